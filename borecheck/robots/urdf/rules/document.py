"""Rules of the document: a robot, whole elements, none of them twice."""

import re
from collections.abc import Iterator

from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.rules.defect import Defect, matters
from borecheck.robots.urdf.schema import (
    REQUIRED,
    REQUIRED_ATTRIBUTES,
    SHAPES,
    SINGLE,
    VERSIONS,
)
from borecheck.robots.urdf.source import children, elements, tag_of

# What other simulators' files are, and how to come by a URDF.
_OTHERS = {
    "sdf": " (this is an SDF file of Gazebo: give the URDF or xacro it was made from, "
    "or convert it, in ROS 2 by the package sdformat_urdf)",
    "mujoco": " (this is an MJCF file of MuJoCo: give the URDF it was made from, or "
    "convert it, in Python by the package mjcf-urdf-simple-converter)",
}
_LEFT_OVER = re.compile(r"\$\{[^}]*\}|\$\([^)]*\)")


def root(draft: UrdfDraft) -> Iterator[Defect]:
    """The root element is <robot>."""
    tag = tag_of(draft.root)
    if tag != "robot":
        message = f"the root element is <{tag}>, not <robot>{_OTHERS.get(tag, '')}"
        yield Defect(draft.root, message)


def robot_name(draft: UrdfDraft) -> Iterator[Defect]:
    """The robot has a name."""
    is_robot = tag_of(draft.root) == "robot"
    if is_robot and not (draft.root.get("name") or "").strip():
        yield Defect(draft.root, "the robot's name is missing or empty", "name")


def robot_version(draft: UrdfDraft) -> Iterator[Defect]:
    """The version, if one is named, is one of URDF's."""
    version = draft.root.get("version")
    if tag_of(draft.root) == "robot" and version not in (None, *VERSIONS):
        message = f"version={version!r} is none of {', '.join(VERSIONS)}"
        yield Defect(draft.root, message, "version")


def quaternions(draft: UrdfDraft) -> Iterator[Defect]:
    """No origin is turned by a quaternion, which would be lost."""
    for element in draft.root.iter("origin"):
        if "quat_xyzw" in element.attrib:
            text = f"quat_xyzw={element.get('quat_xyzw')!r} is not read: write rpy"
            yield Defect(element, text, "quat_xyzw")


def left_over_xacro(draft: UrdfDraft) -> Iterator[Defect]:
    """No macro and no expression is left; a file may have any name."""
    for element in elements(draft.root):
        if tag_of(element).startswith("xacro:"):
            yield Defect(
                element,
                f"<{tag_of(element)}> was not expanded: xacro files end in .xacro",
            )
        for attribute, value in element.attrib.items():
            match = _LEFT_OVER.search(value)
            if match is not None:
                message = f"{attribute}={value!r} holds the expression {match.group()}"
                yield Defect(element, message, attribute, attribute != "filename")


def repeated(draft: UrdfDraft) -> Iterator[Defect]:
    """What may stand once stands once."""
    for element, tag in draft.standard:
        for child in SINGLE.get(tag, ()):
            for extra in children(element, child)[1:]:
                count = len(children(element, child))
                message = f"<{tag}> has {count} <{child}>, not one"
                yield Defect(extra, message, stops=matters(extra))
        if tag == "geometry" and len(children(element)) > 1:
            tags = ", ".join(tag_of(child) for child in children(element))
            message = f"<geometry> holds several shapes: {tags}"
            yield Defect(children(element)[1], message)


def missing(draft: UrdfDraft) -> Iterator[Defect]:
    """Children that an element must have are there."""
    for element, tag in draft.standard:
        for child in REQUIRED.get(tag, ()):
            if not children(element, child):
                yield Defect(element, f"<{tag}> has no <{child}>")
        shapes = [child for child in children(element) if tag_of(child) in SHAPES]
        if tag == "geometry" and not shapes:
            yield Defect(element, "<geometry> holds no shape that URDF knows")


def missing_attributes(draft: UrdfDraft) -> Iterator[Defect]:
    """Attributes that an element must have are there."""
    for element, tag in draft.standard:
        for attribute in REQUIRED_ATTRIBUTES.get(tag, ()):
            if not (element.get(attribute) or "").strip():
                message = f"<{tag}> has no {attribute!r}"
                yield Defect(element, message, attribute, matters(element))
