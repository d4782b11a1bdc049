"""Candidates for a set-up: how the arm follows the needle, and what was tried."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from borecheck.plans.needle_plan import NeedlePlan
from borecheck.setup.family import Family, rotated
from borecheck.setup.mechanics import needle_task
from borecheck.setup.terms import NAMES, NOTHING, Terms

Array = NDArray[np.float64]

# What a descent leaves where it reaches its needle, [m].
REACHED = 1e-10


@dataclass(frozen=True, eq=False)
class Candidate:
    """A configuration that keeps all constraints but the cone, which is to be shown.

    Attributes:
        q: (joints,).
        cost: f, an upper bound.
        arm: How it goes on from there.
    """

    q: Array
    cost: float
    arm: "Arm"


@dataclass
class Tried:
    """What a search looked at.

    Attributes:
        count: How many configurations.
        against: How many of them each constraint stands against, by its code.
        best: Candidates, the best first.
        complete: Whether there are no others: then what stands against all is a proof.
        said: What the inverse kinematics says of those it gives no configuration for.
    """

    count: int = 0
    against: Counter[int] = field(default_factory=Counter)
    best: list[Candidate] = field(default_factory=list)
    complete: bool = False
    said: tuple[str, ...] = ()

    def add(self, codes: Iterable[int]) -> None:
        """Counts configurations by what stands against them."""
        counted = Counter(int(code) for code in codes)
        self.count += sum(counted.values())
        self.against.update({k: n for k, n in counted.items() if k != NOTHING})

    def named(self) -> dict[str, int]:
        """The counts by the constraints' names."""
        return {NAMES[code]: n for code, n in sorted(self.against.items())}


class Arm(Protocol):
    """How the arm goes on from a configuration at a plan's entry."""

    def follow(self, turns: Array) -> Array:
        """Configurations (m, joints) with the needle turned about its tip, (m, 3)."""

    def along(self, distances: Array) -> Array:
        """Configurations (m, joints) with the tip so far along the plan's line, [m].

        The first is the nearest to the entry; NaN where it does not get there. An
        insertion joint is not moved.
        """


@dataclass(frozen=True, eq=False)
class InFamily:
    """The arm with its coordinates held, in closed form."""

    family: Family
    plan: NeedlePlan
    x: Array

    def follow(self, turns: Array) -> Array:
        """See `Arm`."""
        plan = self.plan
        at = self.family.tilted(plan.entry, plan.direction, self.x[None], turns)
        return np.asarray(at[0])

    def along(self, distances: Array) -> Array:
        """See `Arm`."""
        plan, x = self.plan, self.x[None]
        tips = plan.entry + np.outer(distances, plan.direction)
        found = [self.family.configurations(p, plan.direction, x)[0] for p in tips]
        return np.array(found)


@dataclass(frozen=True, eq=False)
class ByDescent:
    """The arm by descents, as the paper's local planner; NaN where they fail."""

    terms: Terms
    plan: NeedlePlan
    q: Array

    def follow(self, turns: Array) -> Array:
        """See `Arm`."""
        tips = np.tile(self.plan.entry, (len(turns), 1))
        starts = np.tile(self.q, (len(turns), 1))
        return self._descended(starts, tips, rotated(turns, self.plan.direction))

    def along(self, distances: Array) -> Array:
        """See `Arm`."""
        q, found = self.q, []
        for distance in distances:
            tip = self.plan.entry + distance * self.plan.direction
            aim = self.plan.direction[None]
            q = self._descended(q[None], tip[None], aim)[0]
            found.append(q)
            if not np.isfinite(q).all():
                break
        return np.array(found)

    def _descended(self, starts: Array, tips: Array, aims: Array) -> Array:
        task = needle_task(self.terms.robot)
        drive = self.terms.needle.insertion
        if drive is not None:
            index = self.terms.robot.model.joint_names.index(drive)
            task = replace(task, held=(index,))
        qs, rest = task.descend(starts, tips, aims)
        qs[rest > REACHED] = np.nan
        return qs


def noted(
    terms: Terms,
    tried: Tried,
    qs: Array,
    codes: NDArray[np.int8],
    plan: NeedlePlan,
) -> None:
    """Adds the configurations that nothing stands against, the best of all first."""
    good = qs[codes == NOTHING]
    if len(good):
        costs = terms.costs(good).total
        tried.best += [
            Candidate(q, float(cost), ByDescent(terms, plan, q))
            for q, cost in zip(good, costs, strict=True)
        ]
        tried.best.sort(key=lambda one: one.cost)
