"""URDF text to records: the strict view of the one lenient reading.

A robot that cannot be built, or that parsers would build differently, is refused with
one line, by the rules (`refusal`) that `borecheck.validation` lists everything by that
is wrong with a file.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import frozen, transform
from borecheck.robots.urdf import source as urdf_source
from borecheck.robots.urdf.attributes import first, number, numbers
from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.draft_elements import DraftJoint, DraftMimic
from borecheck.robots.urdf.refusal import refuse
from borecheck.robots.urdf.rules.shapes import lost_shapes
from borecheck.robots.urdf.source import Source, children, tag_of
from borecheck.robots.urdf.tree import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Inertial,
    Joint,
    Limits,
    Link,
    Mesh,
    Mimic,
    Shape,
    Sphere,
    Triple,
    UrdfTree,
)

Array = NDArray[np.float64]


def parse(
    text: str | bytes,
    file: str = "robot",
    origins: Sequence[tuple[Path, int]] = (),
) -> UrdfTree:
    """The robot that a URDF text describes.

    Args:
        text: URDF text; a xacro is expanded before.
        file: What to call it in errors.
        origins: For an expanded xacro, where each element came from.

    Raises:
        UrdfError: The first thing from which no robot can be built.
    """
    return build(urdf_source.read(text, file, origins))


def build(source: Source) -> UrdfTree:
    """As `parse`, from a source already read."""
    draft = UrdfDraft(source)
    refuse(draft)
    return UrdfTree(
        name=draft.root.get("name"),
        links=tuple(_link(source, link.element) for link in draft.links),
        joints=tuple(_joint(source, joint) for joint in draft.joints),
        materials=tuple(e.get("name", "") for e in children(draft.root, "material")),
        source=source.file,
        lost=tuple(source.place(element) for element in lost_shapes(draft)),
    )


def _link(source: Source, element: Any) -> Link:
    return Link(
        name=element.get("name"),
        inertial=_inertial(first(element, "inertial")),
        visuals=tuple(_shape(source, e) for e in children(element, "visual")),
        collisions=tuple(_shape(source, e) for e in children(element, "collision")),
        place=source.place(element),
    )


def _inertial(element: Any) -> Inertial | None:
    if element is None:
        return None
    tensor = first(element, "inertia")
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    xx, xy, xz, yy, yz, zz = (_number(tensor, name) for name in names)
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    mass = _number(first(element, "mass"), "value")
    return Inertial(mass, transform(*_origin(element)), inertia)


def _shape(source: Source, element: Any) -> Shape:
    return Shape(
        name=element.get("name"),
        origin=frozen(transform(*_origin(element))),
        geometry=_geometry(children(first(element, "geometry"))[0]),
        place=source.place(element),
    )


def _geometry(shape: Any) -> Geometry:
    match tag_of(shape):
        case "box":
            return Box(_vector(shape, "size"))
        case "sphere":
            return Sphere(_number(shape, "radius"))
        case "cylinder":
            return Cylinder(_number(shape, "radius"), _number(shape, "length"))
        case "capsule":
            return Capsule(_number(shape, "radius"), _number(shape, "length"))
        case _:
            return Mesh(shape.get("filename"), _vector(shape, "scale", (1.0, 1.0, 1.0)))


def _joint(source: Source, joint: DraftJoint) -> Joint:
    xyz, rpy = _origin(joint.element)
    return Joint(
        name=joint.name,
        type=joint.type,
        parent=joint.parent or "",
        child=joint.child or "",
        xyz=xyz,
        rpy=rpy,
        axis=frozen(_axis(joint)),
        limits=_limits(joint.limit),
        mimic=_mimic(joint.mimic),
        place=source.place(joint.element),
    )


def _axis(joint: DraftJoint) -> Array:
    if not joint.has_axis:
        return np.array((1.0, 0.0, 0.0))
    axis = np.array(joint.axis)
    return axis / float(np.linalg.norm(axis))


def _limits(element: Any) -> Limits | None:
    if element is None:
        return None
    return Limits(
        _number(element, "lower", 0.0),
        _number(element, "upper", 0.0),
        number(element, "effort"),
        number(element, "velocity"),
    )


def _mimic(mimic: DraftMimic | None) -> Mimic | None:
    if mimic is None:
        return None
    return Mimic(mimic.joint, mimic.multiplier, mimic.offset)


def _origin(element: Any) -> tuple[Triple, Triple]:
    """Xyz and rpy of an element's `<origin>`."""
    origin, zero = first(element, "origin"), (0.0, 0.0, 0.0)
    return _vector(origin, "xyz", zero), _vector(origin, "rpy", zero)


def _vector(element: Any, attribute: str, default: Triple = (0.0, 0.0, 0.0)) -> Triple:
    x, y, z = numbers(element, attribute, 3) or default
    return x, y, z


def _number(element: Any, attribute: str, default: float = 0.0) -> float:
    value = number(element, attribute)
    return default if value is None else value
