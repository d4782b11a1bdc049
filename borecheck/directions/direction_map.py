"""A map of needle directions, and what can be asked of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.directions.grid import Grid
from borecheck.directions.leaves import (
    CLEAR,
    CONTACT,
    IS_CLEAR,
    IS_CONTACT,
    IS_OUT,
    OUT,
    STATES,
    UNDECIDED,
    Cause,
    Leaves,
)
from borecheck.directions.setup import MapSetup
from borecheck.errors import UsageError
from borecheck.plans.needle_plan import NeedlePlan

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


@dataclass(frozen=True)
class DirectionCell:
    """A cell of directions and what is proven of all of them.

    Attributes:
        state: "clear", "contact", "out" or "undecided".
        reason: Why it is not clear; empty if it is.
        low: Lower ends of the chart's coordinates, (2,), [rad].
        high: Upper ends.
        depth: Bounds of the needle's depth, [m], or None.
        obliquity: Bounds of the angle between needle and inward normal, [rad], or None.
        number: Of the cell in the map; -1 outside the chart.
    """

    state: str
    reason: str
    low: tuple[float, float]
    high: tuple[float, float]
    depth: tuple[float, float] | None
    obliquity: tuple[float, float] | None
    number: int

    @property
    def clear(self) -> bool:
        """Whether every direction in it is clear."""
        return self.state == CLEAR


@dataclass(frozen=True, eq=False)
class NearestClear:
    """The clear direction nearest to one that was asked.

    Attributes:
        plan: It, as a plan; None where nothing is clear.
        angle: Between the two, [rad]; infinite where nothing is clear.
        none_nearer_than: No direction of the chart nearer than this is clear, proven,
            [rad].
    """

    plan: NeedlePlan | None
    angle: float
    none_nearer_than: float


@dataclass(frozen=True, eq=False, repr=False)
class DirectionMap:
    """Which needle directions about a target are clear; cells tile the robot's chart.

    Attributes:
        setup: What was asked: robot, scene, target, requirements.
        leaves: The cells, as columns.
        causes: Why cells are not clear.
    """

    setup: MapSetup
    leaves: Leaves
    causes: tuple[Cause, ...]

    def __repr__(self) -> str:
        told = ", ".join(f"{k} {100.0 * v:.1f} %" for k, v in self.shares.items())
        return f"<DirectionMap {len(self.leaves)} cells: {told}>"

    @property
    def target(self) -> Array:
        """Where needles end, (3,), scanner's frame, [m]."""
        return self.setup.chart.target

    @property
    def verdict(self) -> str:
        """Clear if any direction is; unknown if any may be; else contact or out."""
        present = {STATES[k] for k in self.leaves.state.tolist()}
        for state in (CLEAR, UNDECIDED, CONTACT):
            if state in present:
                return state
        return OUT

    @cached_property
    def solid_angle(self) -> Array:
        """Of every cell, (k,), [sr], as of the quadrangle of its corners."""
        low, high = self.leaves.low, self.leaves.high
        corners = [low, np.stack([high[:, 0], low[:, 1]], axis=1), high]
        corners.append(np.stack([low[:, 0], high[:, 1]], axis=1))
        a, b, c, d = (self.setup.chart.directions(corner) for corner in corners)
        return _solid_angle(a, b, c) + _solid_angle(a, c, d)

    @cached_property
    def shares(self) -> dict[str, float]:
        """Share of the chart's solid angle in every state."""
        whole = float(self.solid_angle.sum())
        return {
            name: float(self.solid_angle[self.leaves.state == k].sum()) / whole
            for k, name in enumerate(STATES)
        }

    @cached_property
    def reasons(self) -> dict[tuple[str, str], float]:
        """Share of the chart by state and reason, largest first; not of clear cells."""
        whole = float(self.solid_angle.sum())
        found: dict[tuple[str, str], float] = {}
        for k in np.unique(self.leaves.cause[self.leaves.cause >= 0]):
            of_cause = self.leaves.cause == k
            for state in np.unique(self.leaves.state[of_cause]):
                rows = of_cause & (self.leaves.state == state)
                share = float(self.solid_angle[rows].sum()) / whole
                found[STATES[state], self.causes[k].text] = share
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    def at(self, direction: ArrayLike) -> DirectionCell:
        """The cell that a direction is in.

        Args:
            direction: The way the needle points, (3,), scanner's frame, any length
                but 0.

        Raises:
            UsageError: It is no direction.
        """
        unit = unit_vector(direction)
        angles = self.setup.chart.angles(unit[None])
        k = int(self._grid.cell_at(angles)[0])
        return self.cell(k) if k >= 0 else self._outside(angles[0])

    def cell(self, number: int) -> DirectionCell:
        """A cell by its number."""
        leaves = self.leaves
        cause = int(leaves.cause[number])
        known = bool(np.isfinite(leaves.depth[number]).all())
        return DirectionCell(
            STATES[leaves.state[number]],
            self.causes[cause].text if cause >= 0 else "",
            _pair(leaves.low[number]),
            _pair(leaves.high[number]),
            _pair(leaves.depth[number]) if known else None,
            _pair(leaves.obliquity[number]) if known else None,
            number,
        )

    def _outside(self, angles: Array) -> DirectionCell:
        """A direction that the chart's own joints do not reach."""
        chart = self.setup.chart
        broken = "the needle is along the bore axis"
        for k, name in enumerate(chart.about.axes):
            for limit, word in ((0, "below"), (1, "above")):
                if (angles[k] - chart.limits[limit, k]) * (2 * limit - 1) > 0.0:
                    broken = f"{name} {word} its limit"
        there = _pair(angles)
        return DirectionCell(OUT, broken, there, there, None, None, -1)

    def plan(self, number: int, name: str | None = None) -> NeedlePlan:
        """The plan along the direction in the middle of a cell.

        Raises:
            UsageError: Where the needle goes in is not known there.
        """
        return self.plan_along(self.leaves.centre[number], number, name)

    def plan_along(
        self, angles: Array, number: int, name: str | None = None
    ) -> NeedlePlan:
        """The plan along a direction of a cell, given by the chart's coordinates."""
        depth = self.setup.skin.depth_along(self.setup.chart.directions(angles[None]))
        if not np.isfinite(depth[0]):
            raise UsageError(f"cell {number}: where the needle goes in is not known")
        direction = self.setup.chart.directions(angles[None])[0]
        entry = self.target - depth[0] * direction
        mount = self.setup.robot.arguments.get("mount")
        return NeedlePlan(
            name or f"cell_{number}",
            entry,
            self.target,
            mount=mount if mount in ("+90", "-90") else None,
        )

    def plans(self) -> tuple[NeedlePlan, ...]:
        """A plan along the middle of every clear cell."""
        rows = np.flatnonzero(self.leaves.state == IS_CLEAR)
        return tuple(self.plan(int(k)) for k in rows)

    def nearest_clear(self, direction: ArrayLike) -> NearestClear:
        """The clear direction nearest to one, and how near none is, proven.

        Raises:
            UsageError: It is no direction.
        """
        unit = unit_vector(direction)
        chart, leaves = self.setup.chart, self.leaves
        half = 0.5 * (leaves.high - leaves.low)
        spread = chart.about.spread(leaves.centre, half)
        to_centre = _angles_to(chart.directions(leaves.centre), unit)
        may_be = (leaves.state != IS_OUT) & (leaves.state != IS_CONTACT)
        bound = np.maximum(to_centre - spread, 0.0)[may_be].min(initial=np.inf)
        rows = np.flatnonzero(leaves.state == IS_CLEAR)
        if not len(rows):
            return NearestClear(None, np.inf, float(bound))
        there = chart.angles(unit[None])[0]
        there = np.where(np.isfinite(there), there, 0.0)
        inside = np.clip(there, leaves.low[rows], leaves.high[rows])
        angle = _angles_to(chart.directions(inside), unit)
        best = int(angle.argmin())
        plan = self.plan_along(inside[best], int(rows[best]), "nearest_clear")
        return NearestClear(plan, float(angle[best]), float(min(bound, angle[best])))

    @cached_property
    def _grid(self) -> Grid:
        return Grid(self.leaves, self.setup.chart.limits)


def unit_vector(direction: ArrayLike) -> Array:
    """A direction at length 1.

    Raises:
        UsageError: Not three finite numbers, or no length.
    """
    try:
        given = np.array(direction, dtype=np.float64)
    except (TypeError, ValueError):
        given = np.zeros(0)
    size = float(np.linalg.norm(given)) if given.shape == (3,) else 0.0
    if not (np.isfinite(size) and size > 0.0):
        raise UsageError(f"direction {direction!r} is not three numbers with a length")
    return given / size


def _angles_to(directions: Array, unit: Array) -> Array:
    across = np.linalg.norm(np.cross(directions, unit), axis=1)
    return np.asarray(np.arctan2(across, directions @ unit))


def _solid_angle(a: Array, b: Array, c: Array) -> Array:
    """Of spherical triangles of unit vectors (k, 3), (k,)."""
    triple = np.abs(np.einsum("kd,kd->k", a, np.cross(b, c)))
    dots = 1.0 + sum(np.einsum("kd,kd->k", x, y) for x, y in ((a, b), (b, c), (c, a)))
    return np.asarray(2.0 * np.arctan2(triple, dots))


def _pair(values: Array) -> tuple[float, float]:
    return float(values[0]), float(values[1])
