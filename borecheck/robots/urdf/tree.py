"""URDF text to records: what a robot is built from, each with its place.

`parse` is strict: a robot that cannot be built, or that parsers would build
differently, is refused with one line. Listing everything that is wrong with a file is
the work of `borecheck.validation`, which reads the same source leniently.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.errors import UrdfError
from borecheck.robots.urdf import mimic as mimic_chains
from borecheck.robots.urdf import source as urdf_source
from borecheck.robots.urdf.source import Place, Source, children, tag_of

Array = NDArray[np.float64]

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
AXIS_TYPES = ("revolute", "continuous", "prismatic", "planar")
LIMITED_TYPES = ("revolute", "prismatic")
LINK_TAGS = ("inertial", "visual", "collision")
JOINT_TAGS = (
    *("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
    *("calibration", "safety_controller"),
)
RESEMBLES = 0.8  # how alike a misspelt word is (difflib): orign, colision, limits


@dataclass(frozen=True)
class Box:
    """A box with edges `size` [m], centred."""

    size: tuple[float, float, float]


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
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


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
    """A joint; `origin` is T_parent_child at position zero, `axis` a unit vector."""

    name: str
    type: str
    parent: str
    child: str
    origin: Array
    axis: Array
    limits: Limits | None
    mimic: Mimic | None
    place: Place


@dataclass(frozen=True, eq=False)
class UrdfTree:
    """A robot: links and joints in file order, forming one tree.

    Attributes:
        name: The robot's name.
        links: All links.
        joints: All joints.
        materials: Names of the materials declared on the robot.
        source: The file the robot was read from.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    materials: tuple[str, ...]
    source: str

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
    reader = _Reader(source)
    root = source.root
    if urdf_source.tag_of(root) != "robot":
        raise reader.error(root, f"the root element is <{root.tag}>, not <robot>")
    tree = UrdfTree(
        name=reader.attribute(root, "name"),
        links=tuple(reader.link(element) for element in children(root, "link")),
        joints=tuple(reader.joint(element) for element in children(root, "joint")),
        materials=tuple(e.get("name", "") for e in children(root, "material")),
        source=source.file,
    )
    _check_names(tree)
    _check_tree(tree)
    mimic_chains.resolve(tree.joints, source.file)
    return tree


class _Reader:
    """Elements to records; every refusal says file, line and element."""

    def __init__(self, source: Source) -> None:
        self.source = source

    def error(self, element: Any, problem: str) -> UrdfError:
        return _refusal(self.source.place(element), problem)

    def attribute(self, element: Any, name: str) -> str:
        value = element.get(name)
        if value is None or not value.strip():
            raise self.error(element, f"attribute {name!r} is missing or empty")
        return str(value)

    def numbers(
        self, element: Any, name: str, count: int, default: Sequence[float] | None
    ) -> tuple[float, ...]:
        text = element.get(name)
        if text is None:
            if default is None:
                raise self.error(element, f"attribute {name!r} is missing")
            return tuple(default)
        try:
            return urdf_source.parse_numbers(text, count)
        except urdf_source.NotNumbersError as error:
            raise self.error(element, f"{name}={error}") from None

    def number(self, element: Any, name: str, default: float | None = None) -> float:
        given = None if default is None else [default]
        return self.numbers(element, name, 1, given)[0]

    def positive(self, element: Any, name: str) -> float:
        value = self.number(element, name)
        if value <= 0.0:
            raise self.error(element, f"{name}={value} is not positive")
        return value

    def only(self, element: Any, tag: str, required: bool = False) -> Any:
        found = children(element, tag)
        if len(found) > 1:
            raise self.error(element, f"has {len(found)} <{tag}>; one is allowed")
        if required and not found:
            raise self.error(element, f"has no <{tag}>")
        return found[0] if found else None

    def spelt(
        self, element: Any, attributes: Sequence[str], tags: Sequence[str] = ()
    ) -> None:
        """Refuses what looks like a misspelt attribute or child: nothing is skipped.

        A rotation or a shape that parsers skip without a word would be missing from
        every verdict. What resembles nothing (an extension) is left alone.
        """
        given = [str(name) for name in element.attrib if not name.startswith("{")]
        below = [tag_of(child) for child in children(element)]
        for words, known in ((given, attributes), (below, tags)):
            for word in words:
                close = get_close_matches(word, known, 1, RESEMBLES)
                if word not in known and close:
                    problem = f"{word!r} is not known; did you mean {close[0]!r}?"
                    raise self.error(element, problem)

    def origin(self, element: Any) -> Array:
        origin = self.only(element, "origin")
        if origin is None:
            return np.eye(4)
        strange = [name for name in origin.attrib if name not in ("xyz", "rpy")]
        if strange:  # quat_xyzw of URDF 1.1 among them: its rotation would be lost
            raise self.error(origin, f"{strange[0]!r} is not read: write xyz and rpy")
        xyz = self.numbers(origin, "xyz", 3, (0.0, 0.0, 0.0))
        return transform(xyz, self.numbers(origin, "rpy", 3, (0.0, 0.0, 0.0)))

    def link(self, element: Any) -> Link:
        self.spelt(element, ("name",), LINK_TAGS)
        for child in () if children(element, "collision") else children(element):
            if tag_of(child) not in LINK_TAGS and child.find(".//geometry") is not None:
                problem = f"<{tag_of(child)}> holds a <geometry> and is no <collision>"
                raise self.error(child, problem)
        return Link(
            name=self.attribute(element, "name"),
            inertial=self.inertial(element),
            visuals=tuple(self.shape(e) for e in children(element, "visual")),
            collisions=tuple(self.shape(e) for e in children(element, "collision")),
            place=self.source.place(element),
        )

    def inertial(self, link: Any) -> Inertial | None:
        element = self.only(link, "inertial")
        if element is None:
            return None
        mass = self.number(self.only(element, "mass", required=True), "value")
        tensor = self.only(element, "inertia", required=True)
        names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        xx, xy, xz, yy, yz, zz = (self.number(tensor, name) for name in names)
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return Inertial(mass, self.origin(element), inertia)

    def shape(self, element: Any) -> Shape:
        self.spelt(element, ("name",), ("origin", "geometry", "material"))
        return Shape(
            name=element.get("name"),
            origin=self.origin(element),
            geometry=self.geometry(self.only(element, "geometry", required=True)),
            place=self.source.place(element),
        )

    def geometry(self, element: Any) -> Geometry:
        found = children(element)
        if len(found) != 1:
            raise self.error(element, f"holds {len(found)} shapes; it must hold one")
        shape, tag = found[0], tag_of(found[0])
        if tag == "box":
            x, y, z = self.numbers(shape, "size", 3, None)
            if min(x, y, z) <= 0.0:
                raise self.error(shape, f"size {x} {y} {z} is not positive")
            return Box((x, y, z))
        if tag == "sphere":
            return Sphere(self.positive(shape, "radius"))
        if tag in ("cylinder", "capsule"):
            kind = Cylinder if tag == "cylinder" else Capsule
            return kind(self.positive(shape, "radius"), self.positive(shape, "length"))
        if tag == "mesh":
            return self.mesh(shape)
        raise self.error(shape, f"<{tag}> is no shape")

    def mesh(self, element: Any) -> Mesh:
        self.spelt(element, ("filename", "scale"))
        filename = self.attribute(element, "filename").strip()
        x, y, z = self.numbers(element, "scale", 3, (1.0, 1.0, 1.0))
        if 0.0 in (x, y, z):
            raise self.error(element, f"scale {x} {y} {z} makes the mesh flat")
        return Mesh(filename, (x, y, z))

    def joint(self, element: Any) -> Joint:
        self.spelt(element, ("name", "type"), JOINT_TAGS)
        kind = self.attribute(element, "type")
        if kind not in JOINT_TYPES:
            known = ", ".join(JOINT_TYPES)
            raise self.error(element, f"joint type {kind!r} is none of {known}")
        parent = self.only(element, "parent", required=True)
        child = self.only(element, "child", required=True)
        return Joint(
            name=self.attribute(element, "name"),
            type=kind,
            parent=self.attribute(parent, "link"),
            child=self.attribute(child, "link"),
            origin=self.origin(element),
            axis=self.axis(element, kind),
            limits=self.limits(element, kind),
            mimic=self.mimic(element),
            place=self.source.place(element),
        )

    def axis(self, joint: Any, kind: str) -> Array:
        default = (1.0, 0.0, 0.0)
        element = self.only(joint, "axis")
        if element is None or kind not in AXIS_TYPES:
            return np.array(default)
        # urdfdom takes an axis without xyz for 0 0 0, others for 1 0 0.
        axis = np.array(self.numbers(element, "xyz", 3, None))
        length = float(np.linalg.norm(axis))
        if length == 0.0:
            raise self.error(element, "the axis is 0 0 0")
        return axis / length

    def limits(self, joint: Any, kind: str) -> Limits | None:
        element = self.only(joint, "limit", required=kind in LIMITED_TYPES)
        if element is None:
            return None
        self.spelt(element, ("lower", "upper", "effort", "velocity"))
        lower = self.number(element, "lower", 0.0)
        upper = self.number(element, "upper", 0.0)
        if kind in LIMITED_TYPES and lower > upper:
            raise self.error(element, f"lower={lower} is above upper={upper}")
        return Limits(
            lower,
            upper,
            self.number(element, "effort") if "effort" in element.attrib else None,
            self.number(element, "velocity") if "velocity" in element.attrib else None,
        )

    def mimic(self, joint: Any) -> Mimic | None:
        element = self.only(joint, "mimic")
        if element is None:
            return None
        self.spelt(element, ("joint", "multiplier", "offset"))
        return Mimic(
            self.attribute(element, "joint"),
            self.number(element, "multiplier", 1.0),
            self.number(element, "offset", 0.0),
        )


def _refusal(place: Place, problem: str) -> UrdfError:
    return UrdfError(f"{place.file}:{place.line}", problem, place.path)


def _check_names(tree: UrdfTree) -> None:
    if not tree.links:
        raise UrdfError(tree.source, "the robot has no link", "robot")
    for kind, things in (("link", tree.links), ("joint", tree.joints)):
        counts = Counter(thing.name for thing in things)
        for thing in things:
            if counts[thing.name] > 1:
                problem = f"{counts[thing.name]} {kind}s are called {thing.name!r}"
                raise _refusal(thing.place, problem)


def _check_tree(tree: UrdfTree) -> None:
    links = {link.name for link in tree.links}
    parent_of: dict[str, Joint] = {}
    for joint in tree.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise _refusal(joint.place, f"{role} link {name!r} does not exist")
        if joint.child in parent_of:
            other = parent_of[joint.child].name
            problem = f"link {joint.child!r} is already the child of joint {other!r}"
            raise _refusal(joint.place, problem)
        parent_of[joint.child] = joint
    roots = [link.name for link in tree.links if link.name not in parent_of]
    if len(roots) > 1:
        problem = f"{len(roots)} links have no parent: {', '.join(roots)}"
        raise UrdfError(tree.source, problem, "robot")
    _check_no_cycle(tree, parent_of)


def _check_no_cycle(tree: UrdfTree, parent_of: dict[str, Joint]) -> None:
    reached: set[str] = set()
    for link in tree.links:
        name, road = link.name, [link.name]
        while name not in reached and name in parent_of:
            name = parent_of[name].parent
            if name in road:
                circle = " -> ".join([*road[road.index(name) :], name])
                place = parent_of[name].place
                raise _refusal(place, f"links form a circle: {circle}")
            road.append(name)
        reached.update(road)
