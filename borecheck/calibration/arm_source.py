"""The arm that a command names: an installed robot or a URDF or xacro file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from borecheck.calibration.serial_arm import SerialArm, serial_arm
from borecheck.calibration.setup import CalibrationSetup, setup_of
from borecheck.errors import UnknownNameError
from borecheck.robots.description import RobotDescription, installed, installed_names
from borecheck.robots.from_description import complete_arguments
from borecheck.robots.robot_file import read_urdf
from borecheck.robots.urdf.parse import build
from borecheck.robots.urdf.reach import ANYWHERE, NO_ROOTS, Roots
from borecheck.robots.urdf.tree import UrdfTree


@dataclass(frozen=True, eq=False)
class Subject:
    """What is calibrated.

    Attributes:
        folder: Where its file lies; relative mesh names start there.
        text: URDF text, xacro expanded.
        tree: The robot.
        arm: The calibrated joints.
        setup: How it is measured.
    """

    folder: Path
    text: str
    tree: UrdfTree
    arm: SerialArm
    setup: CalibrationSetup


def read_subject(
    name: str,
    arguments: Mapping[str, str],
    roots: Roots = NO_ROOTS,
    world: str | None = None,
    tip: str | None = None,
    target: Sequence[float] | None = None,
) -> Subject:
    """An arm by its installed name or from a file; no mesh is read.

    Args:
        name: Installed robot, or a path.
        arguments: Xacro arguments.
        roots: Where files it names may lie beside its own folder tree.
        world: Link in whose frame points are measured; by default the set-up's.
        tip: Link that carries the target; by default the set-up's.
        target: In the tip link's frame, (3,), [m]; by default the set-up's.
    """
    setup = CalibrationSetup()
    if name in installed_names("robots"):
        description: RobotDescription = installed("robots", "robot", name)
        complete = complete_arguments(description, arguments)
        path = description.xacro
        source, _ = read_urdf(path, complete, ANYWHERE)
        setup = setup_of(name)
    else:
        path = Path(name)
        if path.suffix not in (".urdf", ".xacro", ".xml") and not path.exists():
            raise UnknownNameError("robot", name, installed_names("robots"))
        source, _ = read_urdf(path, arguments, roots)
    if target is not None:
        x, y, z = target
        setup = replace(setup, target=(x, y, z))
    tree = build(source)
    arm = serial_arm(tree, world or setup.world_link, tip or setup.tip_link)
    return Subject(path.parent, source.text, tree, arm, setup)
