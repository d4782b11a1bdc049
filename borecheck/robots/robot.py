"""Loads a robot by its installed name, or from a URDF or xacro file."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import check_transform, inverse
from borecheck.core.units import check_near, parse_pose
from borecheck.errors import UsageError
from borecheck.robots.allowed import AllowedPair, Request, allowances_of
from borecheck.robots.checked_robot import NEVER_MODELLED as NEVER_MODELLED
from borecheck.robots.checked_robot import Robot as Robot
from borecheck.robots.described_names import tool_frame_off
from borecheck.robots.description import RobotDescription, installed, installed_names
from borecheck.robots.from_description import build_installed, complete_arguments
from borecheck.robots.model import RobotModel
from borecheck.robots.parts import collision_parts, refuse_nothing, without_size
from borecheck.robots.robot_file import read_urdf, refuse_misspelt, robot_path
from borecheck.robots.urdf.reach import ANYWHERE, NO_ROOTS, Roots
from borecheck.robots.urdf.text import is_xacro

Array = NDArray[np.float64]


def load_robot(
    name: str | Path,
    *,
    level: str = "coarse",
    base: ArrayLike | str | None = None,
    package_paths: Sequence[Path] = (),
    allow_outside: bool = False,
    srdf: str | Path | None = None,
    allow: Sequence[Request] = (),
    trust_never: bool = False,
    needle: str | None = None,
    tip: str | None = None,
    insertion: str | None = None,
    **arguments: str,
) -> Robot:
    """A robot by its installed name or from a URDF or xacro file.

    Args:
        name: For example "zerobot", or a path.
        level: Level of detail of an installed robot's meshes: coarse, middle, fine.
        base: T_scene_base (4, 4): where the robot's base frame stands in the
            scanner's frame, or "x,y,z[,r,p,y]"; the identity by default.
        package_paths: Roots for `package://` and `$(find ...)`.
        allow_outside: Whether the file may read files beyond its own folder tree and
            the roots.
        srdf: A file that says which links may touch each other.
        allow: Further pairs of links that may: `"finger:palm"`, or two names each.
        trust_never: Whether to take the SRDF's pairs that rest on statistics
            ("Never"), or on no reason that is known.
        needle: The link that is the needle: it may enter the patient in a corridor.
        tip: The frame at its tip, and which of its axes points forward: `"tip:z"`.
        insertion: The sliding joint that drives the needle along itself, if one does.
        **arguments: xacro arguments by name, for example mount="+90".

    Raises:
        UnknownNameError: No such robot, argument or level.
        UrdfError: The file describes no robot.
        MeshError: A mesh is missing or damaged.
        UsageError: A base that is metres away, as millimetres taken for metres are; a
            pair that is not of two links.
    """
    for what, given in (("package_paths", package_paths), ("allow", allow)):
        if isinstance(given, str | Path):
            raise UsageError(f"{what} is a string: give a list, [{str(given)!r}]")
    if not is_xacro(Path(str(name))):  # a xacro file may call its arguments anything
        refuse_misspelt(load_robot, arguments, _arguments_of(name))
    roots = Roots(tuple(map(Path, package_paths)), allow_outside)
    allowances = allowances_of(srdf, allow, trust_never)
    robot = robot_with(name, arguments, level, base, roots).allowing(allowances)
    return robot.with_needle(needle, tip, insertion)


def _arguments_of(name: object) -> list[str]:
    """What an installed robot takes; nothing of a file that is no xacro."""
    if str(name) not in installed_names("robots"):
        return []
    description: RobotDescription = installed("robots", "robot", str(name))
    return list(description.arguments)


def robot_with(
    name: str | Path,
    arguments: Mapping[str, str],
    level: str = "coarse",
    base: ArrayLike | str | None = None,
    roots: Roots = NO_ROOTS,
) -> Robot:
    """As `load_robot`, for xacro arguments of any name (`level`, `base`, ...)."""
    if not isinstance(name, str | Path):
        kind = type(name).__name__
        raise UsageError(f"robot is a {kind}: give an installed name, or a file")
    if str(name) in installed_names("robots"):
        return _load_installed(str(name), level, base, arguments)
    path = robot_path(str(name))
    source, warnings = read_urdf(path, arguments, roots)
    model = RobotModel(source)
    parts = collision_parts(model.tree, path, roots)
    refuse_nothing(parts, path)
    return Robot(
        name=str(name),
        description=None,
        arguments=dict(arguments),
        level="as given",
        file=path,
        urdf_text=source.text,
        model=model,
        parts=parts,
        T_scene_root=_checked_base(base),
        allowed_contacts=(),
        warnings=(*warnings, *_oddities(model, base is not None)),
        roots=roots,
    )


def _oddities(model: RobotModel, is_placed: bool) -> tuple[str, ...]:
    """What was read otherwise than it is written, and harms no verdict."""
    joints = () if is_placed else model.standing
    return (
        *(f"joint {name} stands at its origin: --base places it" for name in joints),
        *(
            f"link {name}: a drawn shape without size is left out"
            for name in without_size(model.tree)
        ),
    )


def _load_installed(
    name: str, level: str, base: ArrayLike | str | None, arguments: Mapping[str, str]
) -> Robot:
    description: RobotDescription = installed("robots", "robot", name)
    complete = complete_arguments(description, arguments)
    model, text, warnings = build_installed(description, level, complete)
    parts = collision_parts(model.tree, description.xacro, ANYWHERE)
    refuse_nothing(parts, description.xacro)
    return Robot(
        name=name,
        description=description,
        arguments=complete,
        level=level,
        file=description.xacro,
        urdf_text=text,
        model=model,
        parts=parts,
        T_scene_root=_placed_by_base_frame(model, description.base_frame, base),
        allowed_contacts=tuple(
            AllowedPair(*pair, f"description of {name}")
            for pair in description.allowed_contacts
        ),
        warnings=(*warnings, *tool_frame_off(description, model, parts)),
        roots=ANYWHERE,
    )


def _placed_by_base_frame(
    model: RobotModel, base_frame: str | None, base: ArrayLike | str | None
) -> Array:
    """T_scene_root such that the base frame stands at `base`."""
    T_scene_base = _checked_base(base)
    if base_frame is None:
        return T_scene_base
    T_root_base = model.placements(np.zeros(len(model.free_joints)))[base_frame]
    return T_scene_base @ inverse(T_root_base)


def _checked_base(base: ArrayLike | str | None) -> Array:
    if base is None:
        return np.eye(4)
    if isinstance(base, str):
        return parse_pose(base)
    if np.ndim(base) == 1:
        raise UsageError(
            f"base has shape {np.shape(base)}: give T_scene_base (4, 4), or text such "
            'as "0.8,0,0" or "800mm,0,0,0,0,90deg"'
        )
    return check_near(check_transform(base, "base"), "base")
