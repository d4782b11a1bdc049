"""What the installed robots and scanners share: their data, shapes, small helpers.

Scanners are made in `scanners`; URDF, xacro and shipped meshes lie in the project's
folder `urdf`, which is installed inside this package so that no common name is taken.
"""

from pathlib import Path


def data_folder(*names: str) -> Path:
    """The folder of URDF, xacro and shipped meshes of a robot or scanner.

    Args:
        names: The way to it below `urdf`, as in `data_folder("scanners", "ct_gantry")`.
    """
    here = Path(__file__).resolve().parent
    installed = here / "urdf"
    root = installed if installed.is_dir() else here.parent / "urdf"
    return root.joinpath(*names)
