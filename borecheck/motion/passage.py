"""What the needle sweeps, told in the coordinates of its corridor: is that allowed?

Needle and patient are meant to touch, in the corridor alone. Everything is told by
depth along the corridor's line, 0 at the entry, and by the distance aside of it. What a
triangle of the needle sweeps is held by a slab: a solid cylinder about the line. The
needle's inside is between its surfaces and lies in the slabs as well.

In the corridor. What reaches deeper than the corridor's near end must be no farther
aside and no deeper than the corridor allows. Then it may touch or be in the patient.

Before it. What lies before the near end must be clear of the patient. The slabs there,
cut off at that end, are joined by the line they are about; if no triangle of the
patient, cut off at a slab's ends, comes as near to the line as the slab is wide, none
meets it, and one point known to be outside the patient shows that all of them are.

In line. With a margin only a needle whose tip is about the line may come nearer to the
patient: what of it is foremost must be no farther aside than the corridor allows.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.triangles.placing import place_vertices
from borecheck.geometry.triangles.solid import Side, side_of
from borecheck.plans.corridor import Corridor

if TYPE_CHECKING:
    from borecheck.motion.problem import Body

Array = NDArray[np.float64]

# Slabs are so much larger than they come out: far more than rounding up to 100 m, [m].
RESERVE = 1e-9
# More than places across the line are off by, up to 100 m, [m].
ROUNDING = 1e-12
# Into so many lengths the needle is divided at most where one width is too wide.
MOST_SLABS = 64


@dataclass(frozen=True, eq=False)
class Slabs:
    """Solid cylinders about the corridor's line.

    Attributes:
        low: Least depth, (m,), [m].
        high: Largest depth, (m,).
        aside: Radius, (m,).
        tail: Depth beyond which not all of the needle ever is.
    """

    low: Array
    high: Array
    aside: Array
    tail: float

    @classmethod
    def of(cls, depth: Array, aside: Array, grow: float) -> "Slabs":
        """Slabs that hold every triangle at some instants and all its places near by.

        Args:
            depth: Of every triangle's corners at some instants, (k, m, 3).
            aside: Their distances aside.
            grow: How far any point strays from what its places there span, [m].
        """
        return cls(
            depth.min(axis=(0, 2)) - grow,
            depth.max(axis=(0, 2)) + grow,
            aside.max(axis=(0, 2)) + grow,
            float(depth.max(axis=0).min()) + grow,
        )

    def before(self, near: float) -> "Slabs":
        """What of them has no larger depth than that."""
        kept = self.low < near
        high = np.minimum(self.high[kept], near)
        return Slabs(self.low[kept], high, self.aside[kept], self.tail)


@dataclass(frozen=True, eq=False)
class Approach:
    """What of the patient lies before the corridor's near end.

    Attributes:
        patient: The patient, in the world.
        corridor: The corridor.
        margin: Required of a needle that is not in line, [m].
    """

    patient: "Body"
    corridor: Corridor
    margin: float = 0.0

    @cached_property
    def _surface(self) -> tuple[Array, Array]:
        """Triangles that begin before the near end, (m, 3, 3), and how near each gets.

        Coordinates are depth along the line and place across it, seen along the line.
        """
        corners = self.corridor.along_and_across(self.patient.mesh.corners)
        before = corners[:, :, 0].min(axis=1) < -self.corridor.slack
        kept = corners[before]
        return kept, distances_across(kept)

    def allows(self, slabs: Slabs) -> bool:
        """Whether the needle may be anywhere in its slabs."""
        near = -self.corridor.slack
        if self.margin > 0.0 and not self.is_in_line(slabs):
            return False
        return self.holds_deep(slabs) and self.is_free(slabs.before(near))

    def is_in_line(self, slabs: Slabs) -> bool:
        """Whether the foremost part of the needle surely is about the line."""
        slack = self.corridor.slack
        tip = slabs.high >= slabs.high.max() - slack - RESERVE
        return not (slabs.aside[tip] > self.corridor.radius + slack).any()

    def holds_deep(self, slabs: Slabs) -> bool:
        """Whether the corridor holds what reaches deeper than its near end.

        A needle that goes in with its tail is not allowed: nothing of it is then known
        to be outside.
        """
        near = -self.corridor.slack
        deep = slabs.high > near
        deepest = self.corridor.length + self.corridor.slack
        if slabs.tail >= near or (slabs.high[deep] > deepest).any():
            return False
        wide = self.corridor.radius + self.corridor.slack
        return not (slabs.aside[deep] > wide).any()

    def is_free(self, slabs: Slabs) -> bool:
        """Whether the patient neither meets nor holds the slabs, none of it deeper."""
        if not self._is_outside(float(slabs.low.min())):
            return False
        cuts = np.unique(np.concatenate([slabs.low, slabs.high]))
        if len(cuts) > MOST_SLABS + 1:
            cuts = np.linspace(cuts[0], cuts[-1], MOST_SLABS + 1)
        for low, high in pairwise(cuts):
            over = (slabs.low < high) & (slabs.high > low)
            # between slabs the line alone joins them
            wide = float(slabs.aside[over].max(initial=RESERVE))
            if not self._is_apart(float(low), float(high), wide):
                return False
        return True

    def _is_apart(self, low: float, high: float, aside: float) -> bool:
        """Whether no triangle meets the solid cylinder about a stretch of the line."""
        corners, nearest = self._surface
        near = corners[nearest <= aside]
        if _has_corner_in(near, low, high, aside):  # quick, where the cylinder is wide
            return False
        part = cut_off(near, near[:, :, 0], high + RESERVE)
        part = cut_off(part, -part[:, :, 0], RESERVE - low)
        return bool((distances_across(part) > aside).all())

    def _is_outside(self, depth: float) -> bool:
        point = self.corridor.entry + depth * self.corridor.direction
        low, high = self.patient.mesh.bounds
        if (point < low).any() or (point > high).any():
            return True
        if not self.patient.topology.is_closed:
            return False
        side = side_of(point, self.patient.mesh, self.patient.topology)
        return side is Side.OUTSIDE


def _has_corner_in(corners: Array, low: float, high: float, aside: float) -> bool:
    depth, across = corners[:, :, 0], np.linalg.norm(corners[:, :, 1:], axis=2)
    return bool(((low <= depth) & (depth <= high) & (across <= aside)).any())


def cut_off(corners: Array, depth: Array, limit: float) -> Array:
    """What of triangles (m, 3, 3) has a depth (m, 3) up to a limit, as triangles."""
    kept = [corners[(depth <= limit).all(axis=1)]]
    partly = (depth <= limit).any(axis=1) & (depth > limit).any(axis=1)
    for triangle, d in zip(corners[partly], depth[partly], strict=True):
        polygon = []
        for i in range(3):
            j = (i + 1) % 3
            if d[i] <= limit:
                polygon.append(triangle[i])
            if (d[i] <= limit) != (d[j] <= limit):
                share = (limit - d[i]) / (d[j] - d[i])
                polygon.append(triangle[i] + share * (triangle[j] - triangle[i]))
        fan = [
            [polygon[0], polygon[k], polygon[k + 1]] for k in range(1, len(polygon) - 1)
        ]
        kept.append(np.array(fan))
    return np.concatenate(kept)


def distances_across(corners: Array) -> Array:
    """How near triangles (m, 3, 3) come to the line, seen along it: (m,), [m]."""
    p = corners[:, :, 1:]
    side = np.roll(p, -1, axis=1) - p
    turn = side[:, :, 0] * -p[:, :, 1] + side[:, :, 1] * p[:, :, 0]
    length = np.maximum((side**2).sum(axis=2), np.finfo(float).tiny)
    share = np.clip(-(side * p).sum(axis=2) / length, 0.0, 1.0)
    to_side = np.linalg.norm(p + share[:, :, None] * side, axis=2).min(axis=1)
    # Inside, no side is farther than twice the area over the perimeter. That tells it
    # from a triangle seen edge on, whose signs are rounding.
    around = np.maximum(np.sqrt(length).sum(axis=1), np.finfo(float).tiny)
    depth = np.abs(turn.sum(axis=1)) / around + ROUNDING
    same = (turn >= 0.0).all(axis=1) | (turn <= 0.0).all(axis=1)
    return np.where(same & (to_side <= depth), 0.0, to_side)


def depth_and_aside(
    needle: "Body", corridor: Corridor, T: Array
) -> tuple[Array, Array]:
    """Depth and distance aside of the needle's corners, placed by T, (m, 3) each."""
    points = place_vertices(np.ascontiguousarray(T), needle.mesh.vertices)
    depth, aside = corridor.coordinates(points)
    return depth[needle.mesh.triangles], aside[needle.mesh.triangles]
