"""Whether what a description names is in its URDF: links, joints, the needle's way.

A link or joint may be there under other arguments only; a name is wrong if it is there
under none of them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import JointLimitError, UsageError
from borecheck.robots.description import (
    Description,
    RobotDescription,
    ScannerDescription,
)
from borecheck.robots.description.fields import not_among
from borecheck.robots.description.plugins import package_of
from borecheck.robots.model import RobotModel
from borecheck.robots.parts import Part

Array = NDArray[np.float64]

# The needle is asked where it goes over so much insertion, [m], and may go aside by a
# millionth of it: more than rounding, less than a typed angle's last digit.
STEP, ASIDE = 1e-3, 1e-9
# A drawn needle may end so far from its tool frame: a rounded tip, [m].
AT_ITS_END = 1e-3


@dataclass(frozen=True)
class Named:
    """A name in a description.

    Attributes:
        field: Where it stands.
        name: The name.
        kind: "link" or "joint".
        is_needed: Whether nothing can be loaded without it.
    """

    field: str
    name: str
    kind: str
    is_needed: bool = False


def check_names(
    description: Description, model: RobotModel, arguments: Mapping[str, str]
) -> tuple[str, ...]:
    """Warnings about names that may be there under arguments nobody can list.

    Args:
        description: Of a robot or scanner.
        model: Built from it.
        arguments: The xacro arguments of the model, complete.

    Raises:
        UsageError: A name that is in the URDF under no arguments, or a needle that the
            insertion joint does not drive; one line with package, field and what is
            right.
    """
    warnings = []
    for named in _nowhere(description, model, arguments):
        problem = _problem(named, model)
        if named.is_needed or not _is_open(description):
            raise UsageError(f"{_whose(description)}: {problem}")
        warnings.append(f"{description.name}: {problem}")
    if isinstance(description, RobotDescription):
        problems = [*_insertion(description, model)]
        if _are_defaults(description, arguments):  # others may move limits
            problems += _home_beyond(description, model)
        for problem in problems:
            raise UsageError(f"{_whose(description)}: {problem}")
        lacking = _home_lacks(description, model)
        warnings += [f"{_whose(description)}: {problem}" for problem in lacking]
    return tuple(warnings)


def tool_frame_off(
    description: RobotDescription, model: RobotModel, parts: Sequence[Part]
) -> tuple[str, ...]:
    """A warning if the tool frame is not at the end of the needle's own shape.

    Args:
        description: Of a robot.
        model: Built from it.
        parts: Shapes of its links.
    """
    link, frame = description.needle_link, description.tool_frame
    corners = [part.mesh.corners for part in parts if part.link == link]
    if not corners or frame not in model.link_names:
        return ()
    q = np.zeros(len(model.free_joints))
    ways = [_from_link(model, link, frame, at) for at in (q, q + STEP)]
    if np.abs(ways[1] - ways[0]).max() > ASIDE:
        return ()  # a joint lies between them
    points = np.concatenate(corners).reshape(-1, 3) @ ways[0][:3, :3].T + ways[0][:3, 3]
    ahead = float(points[:, 2].max())
    if abs(ahead) <= AT_ITS_END:
        return ()
    where = "behind" if ahead > 0.0 else "beyond"
    return (
        f"{_whose(description)}: tool_frame {frame!r} is {1e3 * abs(ahead):.1f} mm "
        f"{where} the end of needle_link {link!r}: plans bring the frame to the target",
    )


def _from_link(model: RobotModel, link: str | None, frame: str, q: Array) -> Array:
    """T_frame_link (4, 4) at a configuration."""
    placed = model.placements(q)
    return np.asarray(np.linalg.inv(placed[frame]) @ placed[link or ""])


def _are_defaults(description: Description, arguments: Mapping[str, str]) -> bool:
    return all(
        arguments.get(name) == argument.default
        for name, argument in description.arguments.items()
    )


def _home_beyond(description: RobotDescription, model: RobotModel) -> Iterator[str]:
    """A home that the robot cannot take."""
    known = set(model.joint_names)
    home = {name: v for name, v in description.home.items() if name in known}
    try:
        if home:
            model.check_limits(model.configuration(home))
    except JointLimitError as error:
        yield f"home is beyond limits: {str(error).partition(': ')[2]}"


def _home_lacks(description: RobotDescription, model: RobotModel) -> Iterator[str]:
    """Joints that a home leaves out; one without any is all zeros, and says so."""
    lacking = [name for name in model.joint_names if name not in description.home]
    if description.home and lacking:
        yield f"home does not name {', '.join(lacking)}: taken as 0"


def _whose(description: Description) -> str:
    is_robot = isinstance(description, RobotDescription)
    return package_of("robots" if is_robot else "scanners", description.name)


def _is_open(description: Description) -> bool:
    """Whether arguments may be any text, of which names could be made."""
    return any(
        not argument.choices and argument.quantity is None
        for argument in description.arguments.values()
    )


def _named(description: Description) -> Iterator[Named]:
    """Every link and joint that a description names."""
    if isinstance(description, RobotDescription):
        for field in ("needle_link", "tool_frame", "base_frame"):
            link = getattr(description, field)
            if link is not None:
                yield Named(field, link, "link", field == "base_frame")
        for frame, link in description.frames.items():
            yield Named(f"frames[{frame!r}]", link, "link")
        for one, other, _ in description.allowed_contacts:
            yield Named("allowed_contacts", one, "link")
            yield Named("allowed_contacts", other, "link")
        yield from (Named("home", joint, "joint") for joint in description.home)
        yield from (
            Named("joints", joint.name, "joint") for joint in description.joints
        )
        if description.insertion_joint is not None:
            yield Named("insertion_joint", description.insertion_joint, "joint")
    if isinstance(description, ScannerDescription):
        yield from (Named("roles", link, "link") for link in description.roles)
        yield from (Named("points", link, "link") for link in description.points)
        yield from (Named("joints", joint, "joint") for joint in description.joints)


def _nowhere(
    description: Description, model: RobotModel, arguments: Mapping[str, str]
) -> list[Named]:
    """The names that are in the URDF neither here nor under other arguments."""
    here = {("link", name) for name in model.link_names}
    here |= {("joint", name) for name in model.joint_names}
    absent = [n for n in _named(description) if (n.kind, n.name) not in here]
    # A link of a joint's name is a mistake here, not a link of other arguments.
    taken = {*model.link_names, *(joint.name for joint in model.tree.joints)}
    wanted = {(n.kind, n.name) for n in absent if n.name not in taken}
    elsewhere: set[tuple[str, str]] = set()
    if wanted:  # seldom, and it reads and expands files
        from borecheck.robots.names_elsewhere import names_elsewhere

        elsewhere = names_elsewhere(description, arguments, wanted)
    return [
        n
        for n in absent
        if n.is_needed or n.name in taken or (n.kind, n.name) not in elsewhere
    ]


def _problem(named: Named, model: RobotModel) -> str:
    if named.kind == "link":
        known = list(model.link_names)
        return not_among(named.field, named.name, "link of its URDF", known)
    known = list(model.joint_names)
    for joint in model.tree.joints:
        if joint.name == named.name:
            why = "fixed" if joint.type == "fixed" else "a joint that follows another"
            listed = ", ".join(known)
            return f"{named.field} {named.name!r} is {why}, not free (free: {listed})"
    return not_among(named.field, named.name, "free joint of its URDF", known)


def _insertion(description: RobotDescription, model: RobotModel) -> Iterator[str]:
    """The insertion joint drives the needle along itself, forward."""
    name, frame = description.insertion_joint, description.tool_frame
    if name not in model.joint_names or frame not in model.link_names:
        return
    index = model.joint_names.index(name)
    before = np.zeros(len(model.free_joints))
    after = before.copy()
    after[index] = STEP
    T, T_after = (model.placements(q)[frame] for q in (before, after))
    moved, needle = T_after[:3, 3] - T[:3, 3], STEP * T[:3, 2]
    if model.free_joints[index].is_angle:
        yield f"insertion_joint {name!r} turns; it must be prismatic"
    elif float(np.linalg.norm(moved - needle)) > ASIDE:
        way, along = (np.round(v / STEP, 6).tolist() for v in (moved, needle))
        yield (
            f"insertion_joint {name!r} moves the tip along {way}, not along the "
            f"needle, {along}: z of tool_frame {frame!r}"
        )
