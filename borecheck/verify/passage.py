"""A needle in its corridor, for `verify.claims`: numpy only.

Everything is told by depth along the corridor's line, 0 at the entry, and by distance
aside of it. If no point of the needle moves farther than a length during an interval,
every triangle stays in a cylinder about the line: its own least and largest depth and
distance aside, each larger by that length. Deeper than the corridor's near end these
cylinders must lie in the corridor; what of them lies before it must be clear of the
patient. Cylinders are joined by the line, so one point of it that is outside the
patient, and a patient that meets neither, shows that all of them are outside.

Where a margin is stated, only a needle in line may come nearer to the patient: its
foremost cylinders, as deep as the deepest less the slack, must be as narrow as the
corridor.

A corridor is a needle's: no wider than the needle itself is where it enters, and its
slack no more than a hole in the skin needs. So a passage cannot stand for an arm.
"""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from borecheck.verify.fields import Rejected

if TYPE_CHECKING:
    from borecheck.verify.statement import Passage

Array = NDArray[np.float64]

# What a corridor may leave beside the needle and beyond the target, [m].
MOST_SLACK = 2e-3
# Nothing thicker is a needle: half its width, [m].
WIDEST_NEEDLE = 5e-3
# How much of a needle, from its tip, tells how wide it is, [m].
FOREMOST = 0.01
# More than the rounding of sizes up to 100 m, [m].
ROUNDING = 1e-10
# Into so many lengths the line is divided at most.
MOST_CUTS = 65


class StatedCorridor:
    """A corridor as a certificate states it, about a patient's triangles (m, 3, 3)."""

    def __init__(self, stated: "Passage", patient: Array) -> None:
        self.entry, self.target = stated.entry, stated.target
        self.radius, self.slack = stated.radius, stated.slack
        self.length = float(np.linalg.norm(self.target - self.entry))
        if not self.length > ROUNDING:
            raise Rejected("a corridor of no length")
        self.axis = (self.target - self.entry) / self.length
        middle = patient.mean(axis=1)
        reach = np.linalg.norm(patient - middle[:, None], axis=2).max(axis=1)
        # no point of a triangle is nearer to the line than this
        self.nearest = self._depth_and_aside(middle)[1] - reach - ROUNDING
        self.patient = patient

    def _depth_and_aside(self, points: Array) -> tuple[Array, Array]:
        """Depth and distance aside of points (..., 3)."""
        depth = (points - self.entry) @ self.axis
        across = points - self.entry - depth[..., None] * self.axis
        return depth, np.linalg.norm(across, axis=-1)

    def before(self, needle: Array, moved: float) -> Array:
        """The point of the line where a needle, moved so far, begins at most."""
        depth = float(((needle - self.entry) @ self.axis).min()) - moved
        return np.asarray(self.entry + depth * self.axis, dtype=np.float64)

    def depth_and_width(self, needle: Array, moved: float) -> tuple[float, float]:
        """How deep triangles (m, 3, 3) of a needle are, and half the width of some.

        Of those that may be in the corridor, and of its foremost length: where only a
        fine tip went in, what would follow it is a part of the needle, too. The width
        is about its own middle, seen along the line.
        """
        depth, _ = self._depth_and_aside(needle)
        deepest = float(depth.max())
        foremost = deepest - min(self.length, FOREMOST)
        counts = depth.max(axis=1) > min(-self.slack - moved, foremost)
        points = needle[counts].reshape(-1, 3)
        seen = points - np.outer(points @ self.axis, self.axis)
        middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
        return deepest, float(np.linalg.norm(seen - middle, axis=1).max())

    def why_not(self, needle: Array, moved: float, margin: float = 0.0) -> str:
        """What is wrong with a needle's triangles (m, 3, 3), moved so far; or ""."""
        depth, aside = self._depth_and_aside(needle)
        grow = moved + ROUNDING
        low, high = depth.min(axis=1) - grow, depth.max(axis=1) + grow
        wide, near = aside.max(axis=1) + grow, -self.slack
        tip = high >= high.max() - self.slack
        if margin > 0.0 and (wide[tip] > self.radius + self.slack).any():
            return "may be nearer than the margin, and not in line"
        if depth.min() + grow >= near:
            return "may be in with all of its length"
        deep = high > near
        if (high[deep] > self.length + self.slack).any():
            return "may be beyond the target"
        if (wide[deep] > self.radius + self.slack).any():
            return "may be aside of its corridor"
        before = low < near
        low, wide, high = low[before], wide[before], np.minimum(high[before], near)
        cuts = np.unique([*low, *high])
        if len(cuts) > MOST_CUTS:
            cuts = np.linspace(cuts[0], cuts[-1], MOST_CUTS)
        for begin, end in pairwise(cuts):
            there = (low < end) & (high > begin)
            if self._met(begin, end, float(wide[there].max(initial=ROUNDING))):
                return "may meet it before the entry"
        return ""

    def _met(self, begin: float, end: float, wide: float) -> bool:
        """Whether a triangle may have a point in a cylinder about the line."""
        for corners in self.patient[self.nearest <= wide]:
            polygon = _between(
                list(corners), self._depth, begin - ROUNDING, end + ROUNDING
            )
            if polygon and self._aside_of(np.array(polygon)) <= wide + ROUNDING:
                return True
        return False

    def _depth(self, point: Array) -> float:
        return float((point - self.entry) @ self.axis)

    def _aside_of(self, polygon: Array) -> float:
        """How near a flat convex polygon comes to the line, seen along it."""
        from_entry = polygon - self.entry
        seen = from_entry - np.outer(from_entry @ self.axis, self.axis)
        best = np.inf
        turns = []
        for p, q in zip(seen, np.roll(seen, -1, axis=0), strict=True):
            side = q - p
            square = float(side @ side)
            share = min(max(-float(p @ side) / square, 0.0), 1.0) if square else 0.0
            best = min(best, float(np.linalg.norm(p + share * side)))
            turns.append(float(np.cross(p, q) @ self.axis))
        # The line goes through, or the polygon is seen edge on: then it is as thin as
        # it is near.
        around = float(np.linalg.norm(seen - np.roll(seen, -1, axis=0), axis=1).sum())
        # A cut through a corner leaves two that differ by rounding, and a turn between
        # them of any sign.
        thin = ROUNDING * around
        through = min(turns) >= -thin or max(turns) <= thin
        if through and best * around <= abs(sum(turns)) + thin:
            return 0.0
        return best

    def __str__(self) -> str:
        ends = [
            ", ".join(f"{1e3 * x:.1f}" for x in p) for p in (self.entry, self.target)
        ]
        beside = 1e3 * (self.radius + self.slack)
        return (
            f"from ({ends[0]}) to ({ends[1]}) mm, {beside:.2f} mm beside it and "
            f"{1e3 * self.slack:g} mm beyond its ends"
        )


def _between(polygon: list[Array], depth: Any, low: float, high: float) -> list[Array]:
    """What of a convex polygon has a depth between two; maybe nothing."""
    for sign, limit in ((1.0, high), (-1.0, -low)):
        kept = []
        for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            over_p, over_q = sign * depth(p) - limit, sign * depth(q) - limit
            if over_p <= 0.0:
                kept.append(p)
            if (over_p <= 0.0) != (over_q <= 0.0):
                kept.append(p + over_p / (over_p - over_q) * (q - p))
        polygon = kept
    return polygon
