"""Solver `proven`: branch and bound over a family, to a proven gap or a proven "no".

Boxes of coordinates are cut in halves, those of least bound first. A box is done where
no configuration in it keeps the constraints, or none costs less than the best known by
more than the gap. What is left when all are done is a proof: of the cost, or, where no
configuration was found, that there is none.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from borecheck.plans.needle_plan import NeedlePlan
from borecheck.setup.boxes import Boxes
from borecheck.setup.candidates import Candidate, InFamily
from borecheck.setup.cone import rim
from borecheck.setup.family import Family
from borecheck.setup.terms import NAMES, NOTHING, Terms

Array = NDArray[np.float64]
# Whether a candidate is shown to keep all, cone and exact verdict with it.
Shown = Callable[[Candidate], bool]

# Cells to begin with: along a periodic coordinate, an angle, a slide.
BEGIN = {"turn": 12, "angle": 6, "slide": 1}
# Boxes cut at once, and looked at before it is given up.
BATCH, MOST_BOXES = 256, 40_000
# A metre of a slide counts like so many radians when a box is cut.
PER_METRE = 8.0
# Middles tried as better configurations in every round.
TRIED = 24
# A better configuration must gain this share of the gap.
WORTH = 0.25


@dataclass
class Proof:
    """What branch and bound came to.

    Attributes:
        least: No configuration that keeps the constraints costs less; infinite where
            there is none; -infinite where nothing is known.
        done: Whether all boxes are done.
        boxes: How many were looked at.
        closed: By which constraint boxes were closed, their share of all coordinates.
        best: The best configuration, if any.
    """

    least: float = np.inf
    done: bool = False
    boxes: int = 0
    closed: Counter[int] = field(default_factory=Counter)
    best: Candidate | None = None

    def shares(self) -> dict[str, float]:
        """Shares of the coordinates closed by each constraint, by its name."""
        return {NAMES[k]: float(v) for k, v in sorted(self.closed.items())}


def prove(
    terms: Terms,
    family: Family,
    plan: NeedlePlan,
    best: Candidate | None,
    shown: Shown,
    gap: float,
    most: int = MOST_BOXES,
) -> Proof:
    """The proof for one needle.

    Args:
        terms: What is asked.
        family: The arm's configurations.
        plan: The needle; its tip is at the entry.
        best: A configuration that keeps all, as `grid` finds them; or None.
        shown: Asks of a better one whether it keeps all.
        gap: How much cheaper another may be, of the cost.
        most: Boxes looked at before it is given up.
    """
    return _Search(terms, family, plan, shown, gap, Proof(best=best)).run(most)


class _Search:
    def __init__(
        self,
        terms: Terms,
        family: Family,
        plan: NeedlePlan,
        shown: Shown,
        gap: float,
        proof: Proof,
    ) -> None:
        self._terms, self._family, self._plan = terms, family, plan
        self._shown, self._gap, self._proof = shown, gap, proof
        self._boxes = Boxes(terms, family, plan)
        self._tilts = rim(plan.direction, terms.asked.cone, 8)
        size = family.upper - family.lower
        self._whole = float(np.prod(np.where(size > 0.0, size, 1.0)))
        angles = [p or s > 0.5 for p, s in zip(family.periodic, size, strict=True)]
        self._weight = np.where(angles, 1.0, PER_METRE)

    def run(self, most: int) -> Proof:
        x, half = self._cells()
        x, half, least = self._judged(x, half, np.full(len(x), -np.inf))
        while len(x):
            open_ = least <= self._enough()
            self._close(least[~open_])
            x, half, least = x[open_], half[open_], least[open_]
            if not len(x):
                break
            if self._proof.boxes > most:
                self._close(least)
                return self._proof
            order = np.argsort(least, kind="stable")
            now, later = order[:BATCH], order[BATCH:]
            cut = self._judged(*self._halves(x[now], half[now], least[now]))
            x, half, least = (
                np.concatenate([a[later], b])
                for a, b in zip((x, half, least), cut, strict=True)
            )
        self._proof.done = True
        return self._proof

    def _enough(self) -> float:
        """Boxes that cost more are done."""
        best = self._proof.best
        return np.inf if best is None else best.cost - self._gap

    def _close(self, least: Array) -> None:
        self._proof.least = min(self._proof.least, float(least.min(initial=np.inf)))

    def _cells(self) -> tuple[Array, Array]:
        family, size = self._family, self._family.upper - self._family.lower
        counts = [
            BEGIN["turn" if p else "angle" if s > 0.5 else "slide"]
            for p, s in zip(family.periodic, size, strict=True)
        ]
        axes = [
            low + (np.arange(n) + 0.5) / n * s
            for low, n, s in zip(family.lower, counts, size, strict=True)
        ]
        mesh = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        x = mesh.reshape(-1, len(axes))
        return x, np.tile(0.5 * size / counts, (len(x), 1))

    def _halves(
        self, x: Array, half: Array, least: Array
    ) -> tuple[Array, Array, Array]:
        """Every box cut in two along its longest side."""
        longest = (half * self._weight).argmax(axis=1)
        rows = np.arange(len(x))
        smaller = half.copy()
        smaller[rows, longest] *= 0.5
        low, high = x.copy(), x.copy()
        low[rows, longest] -= smaller[rows, longest]
        high[rows, longest] += smaller[rows, longest]
        return (
            np.concatenate([low, high]),
            np.concatenate([smaller, smaller]),
            np.concatenate([least, least]),
        )

    def _judged(
        self, x: Array, half: Array, before: Array
    ) -> tuple[Array, Array, Array]:
        """Boxes that are still open, with their bounds; a better middle is taken."""
        said = self._boxes.judge(x, half, self._enough())
        self._proof.boxes += len(x)
        shares = np.prod(2.0 * np.where(half > 0.0, half, 0.5), axis=1) / self._whole
        for code in np.unique(said.against[said.against != NOTHING]):
            self._proof.closed[int(code)] += shares[said.against == code].sum()
        open_ = said.against == NOTHING
        x, half = x[open_], half[open_]
        least = np.maximum(said.least[open_], before[open_])
        self._improve(x, least, said.q[open_])
        return x, half, least

    def _improve(self, x: Array, least: Array, qs: Array) -> None:
        """Takes the best of some middles, if it is worth it and holds."""
        best = self._proof.best
        worth = np.inf if best is None else best.cost - WORTH * self._gap
        promising = np.argsort(least, kind="stable")[:TRIED]
        promising = promising[least[promising] < worth]
        if not len(promising):
            return
        good = promising[self._terms.broken(qs[promising]) == NOTHING]
        if not len(good):
            return
        costs = self._terms.costs(qs[good], 0.05).total
        k = int(costs.argmin())
        if not costs[k] < worth:
            return
        arm = InFamily(self._family, self._plan, x[good[k]])
        tilted = arm.follow(self._tilts)
        if (self._terms.broken(tilted) == NOTHING).all():
            one = Candidate(qs[good[k]], float(costs[k]), arm)
            if self._shown(one):
                self._proof.best = one
