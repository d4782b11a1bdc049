"""The robot as it stands in the file, defects and all: None is what cannot be read."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from borecheck.core.se3 import Array
from borecheck.robots.urdf.attributes import (
    first,
    numbers,
    placement,
)
from borecheck.robots.urdf.draft_elements import DraftJoint, DraftLink
from borecheck.robots.urdf.schema import (
    NUMERIC,
    REQUIRED_ATTRIBUTES,
    SCHEMA,
)
from borecheck.robots.urdf.source import Source, children, tag_of


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


def _name(element: Any) -> str:
    """The name as it stands, white space and all, as parsers compare it."""
    name: str = element.get("name") or ""
    return name if name.strip() else ""
