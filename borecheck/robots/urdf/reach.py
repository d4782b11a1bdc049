"""Which files a robot file may read: its own folder tree and the roots it is given.

A URDF or xacro file is often a stranger's, and it names other files: meshes, includes,
YAML. It may name what belongs to it, and nothing else on the computer:

- in a ROS package (a `package.xml` above it): the package, and the packages beside it
  in the same workspace folder;
- without one: its own folder, the folders for meshes and textures beside that, and all
  of the folder above if its own is called `urdf` or `xacro`;
- the roots that the user gives (`--package-path`) or has set up (ROS_PACKAGE_PATH ...);
- what is installed with borecheck: descriptions of robots and scanners, their meshes.

Links are followed before that is asked. The package that a linked `package.xml` stands
in counts too, for a workspace installed by links points back to its sources.
"""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

LEVELS_UP = 8  # how far above the referring file a package is looked for
MANIFEST = "package.xml"

# Each variable and what is appended to its entries before the package's name.
ENVIRONMENT = (
    ("BORECHECK_PACKAGE_PATH", ""),
    ("ROS_PACKAGE_PATH", ""),
    ("AMENT_PREFIX_PATH", "share"),
    ("CMAKE_PREFIX_PATH", "share"),
    ("GZ_SIM_RESOURCE_PATH", ""),
    ("GAZEBO_MODEL_PATH", ""),
)

_SOURCES = ("urdf", "xacro")  # a folder of this name belongs to the one above it
_GEOMETRY = ("meshes", "mesh", "textures", "materials")  # these lie beside it


@dataclass(frozen=True)
class Roots:
    """Where a robot file's files may lie, beside its own folder tree.

    Attributes:
        folders: They hold packages, or are packages (`--package-path`).
        allow_outside: Whether any file may be read (`--allow-outside`).
    """

    folders: tuple[Path, ...] = ()
    allow_outside: bool = False


NO_ROOTS = Roots()
ANYWHERE = Roots(allow_outside=True)  # for our own descriptions


@dataclass(frozen=True)
class Reach:
    """The files that one robot file may read.

    Attributes:
        own: Its own folder tree, as the user named it.
        trees: Folders with all that is below them, links followed.
        workspace: The folder of its package; packages in it are within reach.
        everywhere: Whether the user allowed any file.
    """

    own: Path
    trees: tuple[Path, ...]
    workspace: Path | None
    everywhere: bool

    def holds(self, path: Path) -> bool:
        """Whether a file may be read (whether there is one or not)."""
        if self.everywhere:
            return True
        real = _real(path)
        if real is None:
            return False
        return (
            self._within(real)
            or self._within_linked_package(path, real)
            or any(real.is_relative_to(folder) for folder in _installed_folders())
        )

    def refusal(self, path: Path) -> str:
        """Why a file is not read, in one line."""
        return (
            f"{path} leaves {self.own}, the file's own folder tree, so it is not read: "
            "name its folder by --package-path, or give --allow-outside"
        )

    def _within(self, real: Path) -> bool:
        if any(real.is_relative_to(tree) for tree in self.trees):
            return True
        if self.workspace is None or not real.is_relative_to(self.workspace):
            return False
        first = real.relative_to(self.workspace).parts[:1]
        return bool(first) and manifest_of(self.workspace / first[0]) is not None

    def _within_linked_package(self, path: Path, real: Path) -> bool:
        """Whether a link leads into the package that its own package stands for."""
        package = _package_above(Path(os.path.normpath(path)).parent)
        manifest = manifest_of(package) if package is not None else None
        if package is None or manifest is None:
            return False
        folder = _real(package)
        if folder is None or not self._within(folder):
            return False
        return real.is_relative_to(manifest.parent)


def reach_of(
    base: Path, roots: Roots, environment: Mapping[str, str] | None = None
) -> Reach:
    """What a robot file in this folder may read.

    Args:
        base: The folder of the file.
        roots: What the user gave.
        environment: Where the search variables stand; the process's by default.
    """
    base = base.absolute()
    env = os.environ if environment is None else environment
    package = _package_above(base)
    own = package or _folder_above(base)
    trees = [own, *roots.folders, *(root for root, _ in environment_roots(env))]
    if package is None:
        trees += [base.parent / name for name in _GEOMETRY]
    found = (_real(Path(tree)) for tree in trees)
    return Reach(
        own=own,
        trees=tuple(tree for tree in found if tree is not None),
        workspace=None if package is None else _real(package.parent),
        everywhere=roots.allow_outside,
    )


def environment_roots(environment: Mapping[str, str]) -> Iterator[tuple[Path, Path]]:
    """The folders that hold packages, each with the entry it was made from."""
    for variable, share in ENVIRONMENT:
        for entry in filter(None, environment.get(variable, "").split(os.pathsep)):
            yield Path(entry) / share, Path(entry)


def manifest_of(folder: Path) -> Path | None:
    """The `package.xml` of a folder, links followed; None if there is none."""
    try:
        manifest = (folder / MANIFEST).resolve(strict=True)
        is_one = manifest.name == MANIFEST and manifest.is_file()
    except (OSError, RuntimeError, ValueError):  # nothing there, or links in a circle
        return None
    return manifest if is_one else None


def _installed_folders() -> Iterator[Path]:
    """Folders of the installed descriptions and of the meshes made for them."""
    from borecheck.core.cache import cache_folder
    from borecheck.robots.description import installed_folders

    for folder in (*installed_folders(), cache_folder() / "meshes"):
        yield folder.resolve()


def _package_above(base: Path) -> Path | None:
    """The nearest folder with a manifest; a home or a whole disk is no package."""
    for folder in [base, *base.parents][:LEVELS_UP]:
        if _is_too_wide(folder):
            return None
        if manifest_of(folder) is not None:
            return folder
    return None


def _folder_above(base: Path) -> Path:
    if base.name in _SOURCES and not _is_too_wide(base.parent):
        return base.parent
    return base


def _is_too_wide(folder: Path) -> bool:
    """Whether a folder holds more than robots: the disk, or somebody's home."""
    return Path(os.path.expanduser("~")).is_relative_to(folder)  # noqa: PTH111


def _real(path: Path) -> Path | None:
    """The path with links followed; None for a name that no file can have."""
    try:
        return path.resolve()
    except (OSError, RuntimeError, ValueError):
        return None
