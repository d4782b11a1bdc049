"""URDF text to records: what a robot is built from, each with its place.

`parse` is strict: a robot that cannot be built, or that parsers would build
differently, is refused with one line, by the rules (`refusal`) that
`borecheck.validation` lists everything by that is wrong with a file.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.robots.urdf import source as urdf_source
from borecheck.robots.urdf.draft import (
    DraftJoint,
    DraftMimic,
    UrdfDraft,
    first,
    number,
    numbers,
)
from borecheck.robots.urdf.refusal import refuse
from borecheck.robots.urdf.rules.shapes import lost_shapes
from borecheck.robots.urdf.source import Place, Source, children, tag_of

Array = NDArray[np.float64]

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """A box with edges `size` [m], centred."""

    size: Triple


@dataclass(frozen=True)
class Cylinder:
    """A cylinder about z, centred, [m]."""

    radius: float
    length: float


@dataclass(frozen=True)
class Capsule:
    """A cylinder about z with round ends; `length` is the cylinder's, [m]."""

    radius: float
    length: float


@dataclass(frozen=True)
class Sphere:
    """A centred sphere, [m]."""

    radius: float


@dataclass(frozen=True)
class Mesh:
    """A mesh file as it is referred to, with its scale."""

    filename: str
    scale: Triple = (1.0, 1.0, 1.0)


Geometry = Box | Cylinder | Capsule | Sphere | Mesh


@dataclass(frozen=True)
class Limits:
    """Joint limits: [rad] or [m], [N m] or [N], [rad/s] or [m/s]; None if not given."""

    lower: float
    upper: float
    effort: float | None
    velocity: float | None


@dataclass(frozen=True)
class Mimic:
    """position = multiplier * position(joint) + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass [kg], frame of the centre of mass (4, 4), inertia (3, 3) [kg m^2] in it."""

    mass: float
    origin: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class Shape:
    """One `<visual>` or `<collision>`: its placement T_link_shape and its geometry."""

    name: str | None
    origin: Array
    geometry: Geometry
    place: Place

    @property
    def has_size(self) -> bool:
        """Whether anything is there: a box of 0 0 0 is a point, and covers nothing."""
        match self.geometry:
            case Box(size=numbers) | Mesh(scale=numbers):
                return sum(number == 0.0 for number in numbers) < 2
            case Sphere():
                return self.geometry.radius > 0.0
            case Cylinder() | Capsule():
                return self.geometry.radius > 0.0


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid body; without shapes it is a plain frame."""

    name: str
    inertial: Inertial | None
    visuals: tuple[Shape, ...]
    collisions: tuple[Shape, ...]
    place: Place


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint; `xyz` [m] and `rpy` [rad] as in the file, `axis` a unit vector."""

    name: str
    type: str
    parent: str
    child: str
    xyz: Triple
    rpy: Triple
    axis: Array
    limits: Limits | None
    mimic: Mimic | None
    place: Place

    @cached_property
    def origin(self) -> Array:
        """T_parent_child at position zero, (4, 4)."""
        return transform(self.xyz, self.rpy)


@dataclass(frozen=True, eq=False)
class UrdfTree:
    """A robot: links and joints in file order, forming one tree.

    Attributes:
        name: The robot's name.
        links: All links.
        joints: All joints.
        materials: Names of the materials declared on the robot.
        source: The file the robot was read from.
        lost: Where a geometry stands that is no link's shape: nobody looks at it.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    materials: tuple[str, ...]
    source: str
    lost: tuple[Place, ...] = ()

    @property
    def root(self) -> Link:
        """The one link that is nobody's child."""
        below = {joint.child for joint in self.joints}
        return next(link for link in self.links if link.name not in below)

    def link(self, name: str) -> Link:
        """The link of that name."""
        return next(link for link in self.links if link.name == name)

    def joint(self, name: str) -> Joint:
        """The joint of that name."""
        return next(joint for joint in self.joints if joint.name == name)


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
        origin=transform(*_origin(element)),
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
        axis=_axis(joint),
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
