"""Solver `grid`: a redundant arm's family on a grid, and a descent from several cells.

Finds good configurations fast; that it finds none proves nothing.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.plans.needle_plan import NeedlePlan
from borecheck.setup.candidates import Candidate, InFamily, Tried
from borecheck.setup.cone import rim
from borecheck.setup.family import Family
from borecheck.setup.terms import CONE, NOTHING, Terms

Array = NDArray[np.float64]

# Cells along a periodic coordinate, an angle, a slide.
CELLS = {"turn": 24, "angle": 13, "slide": 4}
# Of cells that keep the constraints so many, best first, are asked their distance to
# the scanner and their cone, and from so many a descent begins.
MOST_ASKED, SEEDS = 48, 3
# Tilts at which the cone is tried before it is proven.
TRIED_TILTS = 8
# Steps of a descent begin and end at these shares of a cell.
FIRST_STEP, LEAST_STEP = 0.5, 1.0 / 32.0


def grid(terms: Terms, family: Family, plan: NeedlePlan) -> Tried:
    """Candidates for a plan's needle, the best first.

    Args:
        terms: What is asked.
        family: The arm's configurations.
        plan: The needle; its tip is at the entry.
    """
    return _Search(terms, family, plan).run()


def cells(family: Family) -> tuple[Array, Array]:
    """Middles of the cells (n, k) and their size, (k,)."""
    size = family.upper - family.lower
    counts = [_count(p, s) for p, s in zip(family.periodic, size, strict=True)]
    axes = [
        low + (np.arange(n) + 0.5) / n * s
        for low, n, s in zip(family.lower, counts, size, strict=True)
    ]
    mesh = np.meshgrid(*axes, indexing="ij")
    return np.stack(mesh, axis=-1).reshape(-1, len(axes)), size / counts


def _count(periodic: bool, size: float) -> int:
    kind = "turn" if periodic else "angle" if size > 0.5 else "slide"
    return CELLS[kind] if size > 0.0 else 1


class _Search:
    def __init__(self, terms: Terms, family: Family, plan: NeedlePlan) -> None:
        self._terms, self._family, self._plan = terms, family, plan
        self._tilts = rim(plan.direction, terms.asked.cone, TRIED_TILTS)
        self._tried = Tried()

    def run(self) -> Tried:
        x, size = cells(self._family)
        kept, qs = self._kept(x)
        if len(kept):
            seeds, costs = self._seeds(kept, qs)
            seeds, costs = self._descended(seeds, costs, size)
            order = np.argsort(costs, kind="stable")
            self._tried.best = [self._candidate(seeds[k], costs[k]) for k in order]
        return self._tried

    def _kept(self, x: Array) -> tuple[Array, Array]:
        """Coordinates and configurations against which nothing stands but the cone."""
        codes, qs = self._broken(x)
        self._tried.add(codes)
        return x[codes == NOTHING], qs[codes == NOTHING]

    def _broken(self, x: Array) -> tuple[NDArray[np.int8], Array]:
        plan = self._plan
        qs = self._family.configurations(plan.entry, plan.direction, x)
        return self._terms.broken(qs), qs

    def _seeds(self, x: Array, qs: Array) -> tuple[Array, Array]:
        """The best cells whose tilts are all right, and their costs."""
        promising = np.argsort(self._terms.without_scanner(qs))[:MOST_ASKED]
        costs = self._terms.costs(qs[promising]).total
        order = np.argsort(costs, kind="stable")
        x, costs = x[promising][order], costs[order]
        seeds: list[int] = []
        for begin in range(0, len(x), 2 * SEEDS):
            some = np.arange(begin, min(begin + 2 * SEEDS, len(x)))
            holds = self._tilts_hold(x[some])
            self._tried.add([CONE] * int((~holds).sum()))
            seeds += some[holds].tolist()
            if len(seeds) >= SEEDS:
                break
        return x[seeds[:SEEDS]], costs[seeds[:SEEDS]]

    def _tilts_hold(self, x: Array) -> NDArray[np.bool_]:
        """Whether some tilts of each keep the constraints, (n,)."""
        if self._terms.asked.cone == 0.0 or not len(x):
            return np.ones(len(x), bool)
        plan = self._plan
        qs = self._family.tilted(plan.entry, plan.direction, x, self._tilts)
        codes = self._terms.broken(qs.reshape(-1, qs.shape[-1]))
        return np.asarray((codes.reshape(len(x), -1) == NOTHING).all(axis=1))

    def _descended(self, x: Array, costs: Array, size: Array) -> tuple[Array, Array]:
        """Pattern searches, all at once: to the best neighbour, or half the step."""
        x, costs, steps = x.copy(), costs.copy(), np.full(len(x), FIRST_STEP)
        while (going := np.flatnonzero(steps > LEAST_STEP)).size:
            near = self._neighbours(x[going], steps[going], size)
            cost = self._costs(near.reshape(-1, x.shape[1])).reshape(len(going), -1)
            best = cost.argmin(axis=1)
            rows = np.arange(len(going))
            ahead, least = near[rows, best], cost[rows, best]
            better = least < costs[going]
            better[better] = self._tilts_hold(ahead[better])
            x[going[better]], costs[going[better]] = ahead[better], least[better]
            steps[going[~better]] *= 0.5
        return x, costs

    def _neighbours(self, x: Array, steps: Array, size: Array) -> Array:
        """Points (n, 2 k, k) a step from each, within the bounds."""
        ways = np.concatenate([np.eye(x.shape[1]), -np.eye(x.shape[1])]) * size
        near = x[:, None] + steps[:, None, None] * ways
        low, high = self._family.lower, self._family.upper
        return np.where(self._family.periodic, near, np.clip(near, low, high))

    def _costs(self, x: Array) -> Array:
        """Costs, infinite where a constraint is broken, (n,)."""
        codes, qs = self._broken(x)
        self._tried.add(codes)
        costs, good = np.full(len(x), np.inf), codes == NOTHING
        if good.any():
            costs[good] = self._terms.costs(qs[good]).total
        return costs

    def _candidate(self, x: Array, cost: float) -> Candidate:
        plan = self._plan
        q = self._family.configurations(plan.entry, plan.direction, x[None])[0]
        return Candidate(q, float(cost), InFamily(self._family, plan, x))
