"""Which links touch each other: always, never or sometimes, by sampling."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from borecheck.errors import BorecheckError
from borecheck.validation.findings import Severity
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.moving_tree import moving_tree_of
from borecheck.validation.registry import Problem, register

ALWAYS, NEVER, SOMETIMES = "always", "never", "sometimes"


@dataclass(frozen=True)
class ContactTable:
    """How often each pair of links touched.

    Attributes:
        samples: Configurations that were tried, zero and the corners among them.
        counts: Touching configurations for each pair that is not adjacent.
        adjacent: Pairs joined by a joint.
        at_zero: Pairs that touch with all joints at zero (or nearest to it).
        missing: Links with collision geometry that could not be read.
    """

    samples: int
    counts: dict[tuple[str, str], int]
    adjacent: tuple[tuple[str, str], ...]
    at_zero: tuple[tuple[str, str], ...]
    missing: tuple[str, ...]

    def kind(self, pair: tuple[str, str]) -> str:
        """always, never or sometimes."""
        count = self.counts[pair]
        return NEVER if count == 0 else ALWAYS if count == self.samples else SOMETIMES

    @property
    def bound(self) -> float:
        """With 95 % confidence "never" means at most this share: the rule of three."""
        return 3.0 / self.samples


def contact_table(robot: CheckedUrdf, samples: int) -> ContactTable | None:
    """The table of a robot; None if it cannot be moved. Remembered."""
    found: ContactTable | None = robot.remembered(
        "self-contact", samples, lambda: _contact_table(robot, samples)
    )
    return found


def _contact_table(robot: CheckedUrdf, samples: int) -> ContactTable | None:
    moving = moving_tree_of(robot)
    if moving is None:
        return None
    trees, missing = _trees(robot)
    adjacent = {
        tuple(sorted((joint.parent or "", link))) for link, joint, _ in moving.steps
    }
    pairs = [p for p in combinations(sorted(trees), 2) if p not in adjacent]
    counts = dict.fromkeys(pairs, 0)
    chosen = moving.sampled(robot.options.seed, max(0, samples - 3))
    at_zero: list[tuple[str, str]] = []
    for index, free in enumerate(chosen):
        placed = moving.placements(moving.positions(free))
        for pair in pairs:
            if _touch(trees, placed, pair):
                counts[pair] += 1
                at_zero += [pair] if index == 0 else []
    joined = tuple(sorted((a, b) for a, b in adjacent))
    return ContactTable(len(chosen), counts, joined, tuple(at_zero), missing)


@register("K607", "self-contact", "kinematics", "IWW")
def self_contact(robot: CheckedUrdf) -> Iterator[Problem]:
    """Links touch each other at home or always (sampled on request).

    Why: A pair that always touches hides every real contact; one that touches at home
    blocks every plan from the start.

    Fix: Correct the collision geometry, or list the pair as allowed (SRDF).
    """
    if robot.options.self_contact <= 0:
        return
    table = contact_table(robot, robot.options.self_contact)
    if table is None:
        return
    for pair, count in table.counts.items():
        kind = table.kind(pair)
        if kind == NEVER:
            continue
        home = ", also at home" if pair in table.at_zero else ""
        message = (
            f"{pair[0]!r} and {pair[1]!r} touch {kind}: {count} of {table.samples} "
            f"configurations (seed {robot.options.seed}){home}"
        )
        level = None if kind == ALWAYS or home else Severity.INFO
        yield Problem(robot.link_named[pair[1]].element, message, None, level)


def _trees(robot: CheckedUrdf) -> tuple[dict[str, Any], tuple[str, ...]]:
    """A tree of boxes for each link with collision geometry that can be read."""
    from borecheck.geometry.tree.mesh_tree import MeshTree

    trees: dict[str, Any] = {}
    missing = []
    for link in robot.links:
        shapes = link.of_kind("collision")
        if not shapes:
            continue
        corners = _corners(robot, shapes)
        if corners is None:
            missing.append(link.name)
            continue
        vertices = corners.reshape(-1, 3)
        triangles = np.arange(len(vertices)).reshape(-1, 3)
        trees[link.name] = MeshTree(vertices, triangles, cached=False)
    return trees, tuple(missing)


def _corners(robot: CheckedUrdf, shapes: Sequence[Any]) -> Any:
    from borecheck.geometry.mesh import primitives
    from borecheck.robots.urdf.attributes import number, numbers, placement
    from borecheck.validation.reading.mesh_reading import mesh_of

    found: list[Any] = []
    for shape in shapes:
        corners: Any
        T = placement(shape.element)
        try:
            if shape.tag == "box":
                size = numbers(shape.shape, "size", 3) or (0.0, 0.0, 0.0)
                corners = primitives.box(shape.link, size).corners
            elif shape.tag == "sphere":
                radius = number(shape.shape, "radius") or 0.0
                corners = primitives.sphere(shape.link, radius).corners
            elif shape.tag in ("cylinder", "capsule"):
                make = getattr(primitives, shape.tag)
                radius = number(shape.shape, "radius") or 0.0
                length = number(shape.shape, "length") or 0.0
                corners = make(shape.link, radius, length).corners
            else:
                mesh = mesh_of(robot, shape)
                corners = None if mesh is None else mesh.corners * np.array(shape.scale)
        except BorecheckError:
            return None
        if T is None or corners is None:
            return None
        found.append(corners @ T[:3, :3].T + T[:3, 3])
    return np.concatenate(found)


def _touch(
    trees: dict[str, Any], placed: dict[str, Any], pair: tuple[str, str]
) -> bool:
    first, second = pair
    if first not in placed or second not in placed:
        return False
    return bool(
        trees[first].first_contact(trees[second], placed[first], placed[second])
    )
