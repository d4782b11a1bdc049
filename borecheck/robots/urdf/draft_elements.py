"""Links, joints and shapes as they stand in a file: None is what cannot be read."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from borecheck.robots.urdf.attributes import Vector, first, number, numbers
from borecheck.robots.urdf.schema import (
    AXIS_TYPES,
    JOINT_TYPES,
    LIMITED_TYPES,
    SHAPES,
)
from borecheck.robots.urdf.source import children, tag_of


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


def _shape_of(element: Any) -> Any:
    geometry = first(element, "geometry")
    if geometry is None:
        return None
    return next((c for c in children(geometry) if tag_of(c) in SHAPES), None)


def _link_name(element: Any) -> str | None:
    name = None if element is None else element.get("link") or ""
    return name if name and name.strip() else None


def _bound(limit: Any, attribute: str) -> float | None:
    if limit is None:
        return None
    return number(limit, attribute) if attribute in limit.attrib else 0.0
