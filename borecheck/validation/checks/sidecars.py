"""Names that other descriptions use: transmissions, ros2_control, Gazebo, SRDF."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from borecheck.errors import UrdfError
from borecheck.robots.urdf.rules.names import nearest
from borecheck.robots.urdf.source import Source, children, elements, read, tag_of
from borecheck.robots.urdf.text import read_bytes
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register

_SRDF_LINKS = {"disable_collisions": ("link1", "link2"), "link": ("name",)}
_SRDF_LINKS |= {"chain": ("base_link", "tip_link"), "virtual_joint": ("child_link",)}
_SRDF_LINKS |= {
    "end_effector": ("parent_link",),
    "link_sphere_approximation": ("link",),
}
_SRDF_LINKS |= {
    "disable_default_collisions": ("link",),
    "enable_collisions": ("link1", "link2"),
}


def _missing(word: str, known: Iterable[str], kind: str) -> str:
    close = nearest(word, known)
    guess = f"; did you mean {close!r}?" if close else ""
    return f"there is no {kind} {word!r}{guess}"


@register("J327", "control-name-unknown", "joints", "WWW")
def control_name_unknown(robot: CheckedUrdf) -> Iterator[Problem]:
    """A transmission or ros2_control names a joint that does not exist.

    Why: The controller fails to start, or drives nothing.

    Fix: Correct the name.

    Libraries: ros2_control stops when it is loaded; urdfdom and Pinocchio never look.
    """
    for tag in ("transmission", "ros2_control"):
        for block in children(robot.root, tag):
            for joint in block.iter("joint"):
                name = joint.get("name") or ""
                if name and name not in robot.joint_named:
                    yield Problem(
                        joint, _missing(name, robot.joint_named, "joint"), "name"
                    )


@register("J328", "gazebo-reference-unknown", "joints", "WWW")
def gazebo_reference_unknown(robot: CheckedUrdf) -> Iterator[Problem]:
    """A <gazebo reference> names neither a link nor a joint.

    Why: What it sets (friction, colour, a sensor) is applied to nothing.

    Fix: Correct the name.

    Libraries: Gazebo skips it in silence or with a warning.
    """
    known = {**robot.link_named, **robot.joint_named}
    for block in children(robot.root, "gazebo"):
        name = block.get("reference") or ""
        if name and name not in known:
            yield Problem(block, _missing(name, known, "link or joint"), "reference")


@register("J331", "srdf-name-unknown", "joints", "EEE")
def srdf_name_unknown(robot: CheckedUrdf) -> Iterator[Problem]:
    """The SRDF names a link or joint that the robot does not have.

    Why: A pair that should be allowed, or a group, silently means nothing.

    Fix: Correct the name in the SRDF.

    Libraries: MoveIt reports it at start-up and goes on.
    """
    if robot.options.srdf is None:
        return
    source = _read_srdf(robot.options.srdf)
    if isinstance(source, UrdfError):
        yield Problem(robot.root, str(source))
        return
    for element in elements(source.root):
        yield from _unknown_in(robot, element)


def _read_srdf(path: Path) -> Source | UrdfError:
    try:
        return read(read_bytes(path), str(path))
    except UrdfError as error:
        return error


def _unknown_in(robot: CheckedUrdf, element: Any) -> Iterator[Problem]:
    tag = tag_of(element)
    for attribute in _SRDF_LINKS.get(tag, ()):
        name = element.get(attribute)
        if name and name not in robot.link_named:
            message = _missing(name, robot.link_named, "link")
            line = element.sourceline
            yield Problem(
                robot.root, f"{robot.options.srdf}:{line}: <{tag}>: {message}"
            )
    name = element.get("name")
    if tag in ("joint", "passive_joint") and name and name not in robot.joint_named:
        message = _missing(name, robot.joint_named, "joint")
        yield Problem(
            robot.root, f"{robot.options.srdf}:{element.sourceline}: <{tag}>: {message}"
        )
