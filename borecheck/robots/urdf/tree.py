"""A robot as records, each with its place: what everything else is built from."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import frozen, transform
from borecheck.robots.urdf.source import Place

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
        return frozen(transform(self.xyz, self.rpy))


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
