"""The robot as it stands in the file, defects and all: None is what cannot be read."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from borecheck.core.se3 import Array, transform
from borecheck.robots.urdf.schema import (
    AXIS_TYPES,
    JOINT_TYPES,
    LIMITED_TYPES,
    NUMERIC,
    REQUIRED_ATTRIBUTES,
    SCHEMA,
    SHAPES,
)
from borecheck.robots.urdf.source import (
    NotNumbersError,
    Source,
    children,
    parse_numbers,
    tag_of,
)

Vector = tuple[float, ...]


def numbers(element: Any, attribute: str, count: int) -> Vector | None:
    """The numbers of an attribute, or None if it is missing or malformed."""
    text = None if element is None else element.get(attribute)
    if text is None:
        return None
    try:
        return parse_numbers(text, count)
    except NotNumbersError:
        return None


def number(element: Any, attribute: str) -> float | None:
    """The number of an attribute, or None if it is missing or malformed."""
    found = numbers(element, attribute, 1)
    return None if found is None else found[0]


def first(element: Any, tag: str) -> Any:
    """The first child of that tag, or None."""
    return None if element is None else element.find(tag)


def placement(element: Any) -> Array | None:
    """The transform of an element's `<origin>`; None if it is malformed."""
    origin = first(element, "origin")
    if origin is None:
        return np.eye(4)
    values = []
    for attribute in ("xyz", "rpy"):
        vector = numbers(origin, attribute, 3)
        if vector is None and attribute in origin.attrib:
            return None
        values.append(vector or (0.0, 0.0, 0.0))
    return transform(*values)


@dataclass(frozen=True, eq=False)
class DraftShape:
    """A `<visual>` or `<collision>`; `shape` is the first known child of geometry."""

    element: Any
    link: str
    kind: str
    shape: Any

    @property
    def tag(self) -> str | None:
        """box, cylinder, sphere, capsule, mesh, or None."""
        return None if self.shape is None else tag_of(self.shape)

    @property
    def filename(self) -> str | None:
        """The mesh reference, if this is a mesh that names one."""
        if self.tag != "mesh":
            return None
        text: str = self.shape.get("filename") or ""
        return text if text.strip() else None

    @property
    def scale(self) -> Vector:
        """The mesh's scale, 1 1 1 where it is missing or malformed."""
        return numbers(self.shape, "scale", 3) or (1.0, 1.0, 1.0)


@dataclass(frozen=True, eq=False)
class DraftLink:
    """A `<link>`."""

    element: Any
    name: str

    @property
    def inertial(self) -> Any:
        """The `<inertial>` element, or None."""
        return first(self.element, "inertial")

    @property
    def mass(self) -> float | None:
        """The mass [kg], if it can be read."""
        return number(first(self.inertial, "mass"), "value")

    @cached_property
    def shapes(self) -> tuple[DraftShape, ...]:
        """Visuals and collisions, in file order."""
        return tuple(
            DraftShape(element, self.name, tag_of(element), _shape_of(element))
            for element in children(self.element)
            if tag_of(element) in ("visual", "collision")
        )

    def of_kind(self, kind: str) -> list[DraftShape]:
        """Visuals or collisions."""
        return [shape for shape in self.shapes if shape.kind == kind]


@dataclass(frozen=True)
class DraftMimic:
    """A `<mimic>` whose numbers can be read."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class DraftJoint:
    """A `<joint>` directly under the robot."""

    element: Any
    name: str

    @property
    def type(self) -> str:
        """The type as it is written; empty if it is missing."""
        return self.element.get("type") or ""

    @cached_property
    def parent(self) -> str | None:
        """Name of the parent link, if one is named."""
        return _link_name(first(self.element, "parent"))

    @cached_property
    def child(self) -> str | None:
        """Name of the child link, if one is named."""
        return _link_name(first(self.element, "child"))

    @property
    def has_axis(self) -> bool:
        """Whether the axis means anything for this type."""
        return self.type in AXIS_TYPES

    @property
    def is_limited(self) -> bool:
        """Whether the type needs limits."""
        return self.type in LIMITED_TYPES

    @property
    def moves(self) -> bool:
        """Whether the type is known and not fixed."""
        return self.type in JOINT_TYPES and self.type != "fixed"

    @cached_property
    def axis(self) -> Vector | None:
        """The axis as written; the default if it is left out; None if malformed."""
        element = first(self.element, "axis")
        if element is None or "xyz" not in element.attrib:
            return (1.0, 0.0, 0.0)
        return numbers(element, "xyz", 3)

    @cached_property
    def limit(self) -> Any:
        """The `<limit>` element, or None."""
        return first(self.element, "limit")

    @property
    def lower(self) -> float | None:
        """Lower limit; 0 if it is left out; None without or with a bad `<limit>`."""
        return _bound(self.limit, "lower")

    @property
    def upper(self) -> float | None:
        """Upper limit; 0 if it is left out; None without or with a bad `<limit>`."""
        return _bound(self.limit, "upper")

    @cached_property
    def mimic_element(self) -> Any:
        """The `<mimic>` element, or None."""
        return first(self.element, "mimic")

    @cached_property
    def mimic(self) -> DraftMimic | None:
        """The mimic relation, if it names a joint and its numbers can be read."""
        element = self.mimic_element
        if element is None or not (element.get("joint") or "").strip():
            return None
        values = []
        for attribute, default in (("multiplier", 1.0), ("offset", 0.0)):
            value = number(element, attribute)
            if value is None and attribute in element.attrib:
                return None
            values.append(default if value is None else value)
        return DraftMimic(element.get("joint"), values[0], values[1])


@dataclass(eq=False)
class UrdfDraft:
    """A robot's links and joints as they stand in the file.

    Attributes:
        source: The XML tree.
    """

    source: Source

    @property
    def root(self) -> Any:
        """The root element."""
        return self.source.root

    @cached_property
    def standard(self) -> tuple[tuple[Any, str], ...]:
        """Elements of the URDF proper with their tags, in document order.

        What is in extensions and in unknown elements is left out.
        """
        found = []
        stack = [self.root]
        while stack:
            element = stack.pop()
            found.append((element, tag_of(element)))
            below = children(element)
            stack.extend(c for c in reversed(below) if tag_of(c) in SCHEMA)
        return tuple(found)

    @cached_property
    def numeric(self) -> tuple[tuple[Any, str, str, str, int], ...]:
        """Attributes that hold numbers: element, tag, name, text, how many it holds.

        Left out are those with expressions of xacro in them, and blank ones that must
        not be blank: both are told otherwise.
        """
        return tuple(
            (element, tag, name, text, NUMERIC[tag, name])
            for element, tag in self.standard
            for name, text in element.attrib.items()
            if (tag, name) in NUMERIC
            and "$" not in text
            and (text.strip() or name not in REQUIRED_ATTRIBUTES.get(tag, ()))
        )

    @cached_property
    def links(self) -> tuple[DraftLink, ...]:
        """All links, in file order."""
        found = children(self.root, "link")
        return tuple(DraftLink(e, _name(e)) for e in found)

    @cached_property
    def joints(self) -> tuple[DraftJoint, ...]:
        """All joints, in file order."""
        found = children(self.root, "joint")
        return tuple(DraftJoint(e, _name(e)) for e in found)

    @cached_property
    def link_named(self) -> dict[str, DraftLink]:
        """Links by name; of several, the first."""
        return {link.name: link for link in reversed(self.links)}

    @cached_property
    def joint_named(self) -> dict[str, DraftJoint]:
        """Joints by name; of several, the first."""
        return {joint.name: joint for joint in reversed(self.joints)}

    @cached_property
    def joints_into(self) -> dict[str, list[DraftJoint]]:
        """For each existing link, the joints whose child it is."""
        return self._by_link("child")

    @cached_property
    def joints_from(self) -> dict[str, list[DraftJoint]]:
        """For each existing link, the joints whose parent it is."""
        return self._by_link("parent")

    def _by_link(self, role: str) -> dict[str, list[DraftJoint]]:
        found: dict[str, list[DraftJoint]] = defaultdict(list)
        for joint in self.joints:
            name = getattr(joint, role)
            if name in self.link_named:
                found[name].append(joint)
        return found

    @cached_property
    def roots(self) -> list[DraftLink]:
        """Links that are nobody's child, the one with most links below first."""
        tops = [link for link in self.links if not self.joints_into.get(link.name)]
        return sorted(tops, key=lambda link: -len(list(self.below(link.name))))

    def below(self, name: str) -> Iterator[tuple[str, DraftJoint | None]]:
        """A link and all links under it, each once, with the joint that leads there."""
        seen = {name}
        stack: list[tuple[str, DraftJoint | None]] = [(name, None)]
        while stack:
            current, joint = stack.pop()
            yield current, joint
            for onward in reversed(self.joints_from.get(current, [])):
                child = onward.child
                if child is not None and child in self.link_named and child not in seen:
                    seen.add(child)
                    stack.append((child, onward))

    @cached_property
    def depths(self) -> dict[str, int]:
        """How many joints lie between the root and each link below it."""
        depth: dict[str, int] = {}
        if self.roots:
            for name, joint in self.below(self.roots[0].name):
                above = depth.get(joint.parent or "", 0) if joint is not None else -1
                depth[name] = above + 1
        return depth

    @cached_property
    def placements(self) -> dict[str, Array]:
        """T_root_link of every reachable link with all joints at zero."""
        if not self.roots:
            return {}
        found: dict[str, Array] = {}
        for name, joint in self.below(self.roots[0].name):
            if joint is None:
                found[name] = np.eye(4)
                continue
            origin = placement(joint.element)
            parent = found.get(joint.parent or "")
            if origin is not None and parent is not None:
                found[name] = parent @ origin
        return found

    @cached_property
    def size(self) -> float:
        """The kinematic size [m]: the longest way along joint origins from the root."""
        if not self.roots:
            return 0.0
        length: dict[str, float] = {}
        for name, joint in self.below(self.roots[0].name):
            step = 0.0
            if joint is not None:
                xyz = numbers(first(joint.element, "origin"), "xyz", 3)
                step = float(np.linalg.norm(xyz)) if xyz else 0.0
                length[name] = length.get(joint.parent or "", 0.0) + step
            else:
                length[name] = 0.0
        return max(length.values(), default=0.0)


def _shape_of(element: Any) -> Any:
    geometry = first(element, "geometry")
    if geometry is None:
        return None
    return next((c for c in children(geometry) if tag_of(c) in SHAPES), None)


def _name(element: Any) -> str:
    """The name as it stands, white space and all, as parsers compare it."""
    name: str = element.get("name") or ""
    return name if name.strip() else ""


def _link_name(element: Any) -> str | None:
    name = None if element is None else element.get("link") or ""
    return name if name and name.strip() else None


def _bound(limit: Any, attribute: str) -> float | None:
    if limit is None:
        return None
    return number(limit, attribute) if attribute in limit.attrib else 0.0
