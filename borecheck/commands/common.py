"""Options that several commands share, and what they stand for."""

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from borecheck.commands.options.allowed import allowances
from borecheck.commands.options.needle import with_needle
from borecheck.commands.options.outside import add_allow_outside
from borecheck.commands.options.scan import add_patient_ct, with_scans
from borecheck.core.units import parse_joint_value, parse_pair, parse_pose
from borecheck.errors import PlanError, UnknownNameError, UsageError
from borecheck.robots.description import LEVELS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from borecheck.plans.joint_path import JointPath
    from borecheck.robots.model import FreeJoint, RobotModel
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene
    from borecheck.robots.urdf.reach import Roots


# More would fill the memory before the first result.
MAX_RANDOM = 10_000_000


def add_robot(parser: argparse.ArgumentParser) -> None:
    """ROBOT and what places and shapes it."""
    parser.add_argument(
        "robot", help="installed robot, a URDF or xacro file, or a case file (.toml)"
    )
    add_robot_options(parser)


def add_robot_options(parser: argparse.ArgumentParser) -> None:
    """What places and shapes a robot."""
    parser.add_argument(
        "--arg",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="xacro argument of the robot (repeatable)",
    )
    parser.add_argument(
        "--mount", help="shorthand for --arg mount=...: +90 or -90 (degrees)"
    )
    parser.add_argument(
        "--base",
        metavar="X,Y,Z[,R,P,Y]",
        help="where the robot's base frame stands in the scanner's frame",
    )
    parser.add_argument(
        "--level",
        choices=LEVELS,
        default="coarse",
        help="level of detail of installed meshes (default: coarse)",
    )
    parser.add_argument(
        "--package-path",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="root for package:// and $(find ...) (repeatable)",
    )
    add_allow_outside(parser.add_argument)


def roots_of(args: argparse.Namespace) -> "Roots":
    """Where the files of a robot file may lie."""
    from borecheck.robots.urdf.reach import Roots

    return Roots(tuple(args.package_path), args.allow_outside)


def add_scene(parser: argparse.ArgumentParser) -> None:
    """SCENE and what is added to it."""
    parser.add_argument(
        "scene",
        nargs="+",
        help="installed scanner, or files as FILE[:unit][:frame][@x,y,z[,r,p,y]]; "
        "left out with a case file that says it",
    )
    add_scene_options(parser)


def add_scene_options(parser: argparse.ArgumentParser) -> None:
    """What shapes a scene, and what is added to it."""
    parser.add_argument(
        "--scene-arg",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="argument or joint of the scanner: bore=780mm, couch_travel=0.1m",
    )
    parser.add_argument(
        "--obstacle",
        action="append",
        default=[],
        metavar="FILE",
        help="a further obstacle, FILE[:unit][:frame][@pose] (repeatable)",
    )
    parser.add_argument(
        "--patient",
        action="append",
        default=[],
        metavar="FILE",
        help="a patient's surface, FILE[:unit][:frame][@pose], or a body, "
        "body:sex=f,bmi=35,height=1.65,arms=up[@pose] (repeatable)",
    )
    add_patient_ct(parser)


def add_output(parser: argparse.ArgumentParser) -> None:
    """Where the result goes, and in which form."""
    add_format(parser)
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="write the full result there (JSON)"
    )
    add_report(parser)
    add_date(parser)


def add_result(parser: argparse.ArgumentParser) -> None:
    """The same for a command whose `--out` is what it makes: a path, plans, a mesh."""
    add_format(parser)
    parser.add_argument(
        "--result", type=Path, metavar="FILE", help="write the full result there (JSON)"
    )
    add_date(parser)


def add_format(parser: argparse.ArgumentParser) -> None:
    """Text or JSON."""
    parser.add_argument(
        "--format", choices=("text", "json"), default="text", help="form of the result"
    )


def add_report(parser: argparse.ArgumentParser) -> None:
    """A page."""
    parser.add_argument(
        "--report", type=Path, metavar="OUT.html", help="write a page for people there"
    )


def add_date(parser: argparse.ArgumentParser) -> None:
    """A date in the result."""
    parser.add_argument(
        "--date", default=None, help="date to print in the result, as text"
    )


def load(args: argparse.Namespace) -> "Robot":
    """The robot that the options name."""
    from borecheck.robots.robot import robot_with

    arguments = pairs(args.arg, "--arg")
    if args.mount is not None:
        if "mount" in arguments:
            raise UsageError("--mount and --arg mount=... say the same: give one")
        arguments["mount"] = args.mount
    base = parse_pose(args.base) if args.base is not None else None
    robot = robot_with(args.robot, arguments, args.level, base, roots_of(args))
    return with_needle(args, robot.allowing(allowances(args)))


def load_surroundings(args: argparse.Namespace) -> "Scene":
    """The scene that the options name."""
    from borecheck.robots.scene import scene_with

    scene = scene_with(
        args.scene,
        pairs(args.scene_arg, "--scene-arg"),
        args.level,
        args.obstacle,
        args.patient,
        roots_of(args),
    )
    return with_scans(args, scene)


def random_count(args: argparse.Namespace) -> int:
    """N of `--random N`, with a seed that numpy takes.

    Raises:
        UsageError: N is not 1 or more, or the seed is negative.
    """
    count, seed = int(args.random), int(args.seed)
    if not 1 <= count <= MAX_RANDOM:
        raise UsageError(f"--random {count} is not from 1 to {MAX_RANDOM}")
    if seed < 0:
        raise UsageError(f"--seed {seed} is not 0 or more")
    return count


def pairs(texts: Sequence[str], option: str) -> dict[str, str]:
    """NAME=VALUE options as a dictionary.

    Raises:
        UsageError: No `=`, or a name given twice.
    """
    found: dict[str, str] = {}
    for text in texts:
        name, value = parse_pair(text, option)
        if name in found:
            raise UsageError(f"{option} {name} is given twice")
        found[name] = value
    return found


def configuration(robot: "Robot", text: str, option: str = "--q") -> list[float]:
    """Q from `home`, from `name=value,...`, or from values in the joints' order.

    Raises:
        UsageError: Neither all values in order nor names.
        UnknownNameError: A name that is no joint.
    """
    model = robot.model
    if text == "home":
        return [float(value) for value in robot.home]
    if re.fullmatch(r"[A-Za-z_]\w*", text):
        raise UnknownNameError("configuration", text, ["home"])
    parts = [part.strip() for part in text.split(",")]
    if all("=" in part for part in parts):
        return _by_name(model, parts)
    if any("=" in part for part in parts) or len(parts) != len(model.free_joints):
        names, count = ", ".join(model.joint_names), len(model.free_joints)
        raise UsageError(
            f"{option} {text!r}: give home, name=value,..., or {count} values in the "
            f"order {names}"
        )
    return [
        _joint_value(part, joint)
        for part, joint in zip(parts, model.free_joints, strict=True)
    ]


def joint_path(robot: "Robot", path: Path) -> "JointPath":
    """A path file's waypoints and times; what of it is not used is said.

    Raises:
        PlanError: The file cannot be used.
    """
    from borecheck.commands.progress import say
    from borecheck.plans.path_file import read_joint_path

    joints = robot.model.free_joints
    sliding = [joint.name for joint in joints if not joint.is_angle]
    found = read_joint_path(path, robot.model.joint_names, sliding)
    for note in found.notes:
        say(f"borecheck: {path}: {note}")
    return found


def waypoints(robot: "Robot", path: Path) -> "NDArray[np.float64]":
    """The waypoints of a path file, (k, joints), [m] and [rad].

    Raises:
        PlanError: The file cannot be used.
    """
    return joint_path(robot, path).waypoints


def path_to_follow(robot: "Robot", path: Path) -> "JointPath":
    """A path that goes somewhere.

    Raises:
        PlanError: The file cannot be used, or has one waypoint.
    """
    found = joint_path(robot, path)
    if len(found.waypoints) == 1:
        raise PlanError(path, "has one waypoint; a path needs two (a pose: --q)")
    return found


def _by_name(model: "RobotModel", parts: Sequence[str]) -> list[float]:
    values: dict[str, float] = {}
    for name, text in pairs(parts, "--q").items():
        if name not in model.joint_names:
            raise UnknownNameError("joint", name, model.joint_names)
        joint = model.free_joints[model.joint_names.index(name)]
        values[name] = _joint_value(text, joint)
    return [float(value) for value in model.configuration(values)]


def _joint_value(text: str, joint: "FreeJoint") -> float:
    """A position in SI; what is wrong with it names the joint."""
    try:
        return parse_joint_value(text, revolute=joint.is_angle)
    except UsageError as error:
        kind = "turns" if joint.is_angle else "slides"
        raise UsageError(f"--q: joint {joint.name} {kind}, but {error}") from None
