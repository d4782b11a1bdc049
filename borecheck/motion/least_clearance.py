"""The least clearance of a whole motion: reached at one instant, kept at every one.

From above. Robot and obstacles are placed at some instants, and around the one with
least room the nearest pair is followed in time. The motion does come as near as that.

From below. Every pair is examined as for a verdict (`search.examine_pair`), with a
margin a little below the bound from above: what is clear stays farther apart than that
margin at every instant. Where a pair is not, it is looked at there. Either it comes
nearer than anything before, so the bound from above falls and the pair is asked again,
or nothing could be shown, and it is asked for less.

Parts within the robot do not count, nor does a needle against the patient that it may
enter: for neither is a clearance asked (`contact.clearance` does the same for a pose).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, nextafter, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.verdict import CONTACT
from borecheck.errors import UsageError
from borecheck.motion.broadphase import gaps_of_pairs, rooms_of_pairs
from borecheck.motion.outcome import LeastClearance, PathVerdict
from borecheck.motion.problem import Motion, PathProblem, path_motion
from borecheck.motion.search import RESOLUTION, examine_pair, joined, search

Array = NDArray[np.float64]

# Instants looked at before anything else is known: spread evenly, and waypoints.
INSTANTS, WAYPOINTS = 9, 24
# Pieces tried for a pair and a level, and how many of them by boxes and planes.
PIECE_LIMIT, QUICK_LIMIT = 4_000, 40
# So few pairs are looked at without comparing their boxes first.
FEW = 3
# Of what is asked, this share is aimed at: the rest is for where it is not reached.
AIM = 0.8
# How often a pair is asked again after the bound from above fell.
ROUNDS = 50
# Steps of a search for the nearest instant; each narrows it to 0.62 of what it was.
GOLDEN_STEPS = 12
GOLDEN = 0.5 * (sqrt(5.0) - 1.0)


@dataclass(frozen=True)
class Tolerance:
    """How far the bounds of the least clearance may be apart.

    Attributes:
        relative: As a share of the upper one.
        absolute: Where that is less, as a length, [m].
    """

    relative: float = 0.05
    absolute: float = 1e-4

    def __post_init__(self) -> None:
        sound = 0.0 <= self.relative < 1.0 and 0.0 <= self.absolute < inf
        if not (sound and self.relative + self.absolute > 0.0):
            raise UsageError(
                f"tolerance {self.relative:g} or {self.absolute:g} m of a clearance: "
                "give a share from 0 to 1 and a length, one of them above 0"
            )

    def allowed(self, upper: float) -> float:
        """How far below an upper bound the lower one may be, [m]."""
        return max(self.relative * upper, self.absolute)


def least_clearance(
    problem: PathProblem,
    waypoints: ArrayLike,
    found: PathVerdict,
    tolerance: Tolerance | None = None,
    instants: Sequence[float] = (),
) -> LeastClearance | None:
    """The certified least clearance of a motion whose verdict is known.

    Args:
        problem: Who must not touch whom.
        waypoints: The motion, (n, nq).
        found: What `search` said of it.
        tolerance: How far the bounds may be apart.
        instants: Fractions of the motion where robot and obstacles are known to be
            near each other; the first look is there.

    Returns:
        None in contact, without obstacles, and where not even contact is ruled out.
    """
    if found.verdict == CONTACT and problem.margin > 0.0:
        # Within the margin there is a clearance; in contact there is none.
        problem = replace(problem, margin=0.0)
        found = search(problem, waypoints)
    if found.verdict == CONTACT:
        return None
    floor = nextafter(problem.margin, inf) if found.certified else None
    motion = path_motion(problem, waypoints)
    return _Search(problem, motion, tolerance or Tolerance(), floor).run(instants)


class _Search:
    """Narrows both bounds; arguments as above, and a length kept already, or None."""

    def __init__(
        self,
        problem: PathProblem,
        motion: Motion,
        tolerance: Tolerance,
        floor: float | None,
    ) -> None:
        self.problem, self.motion = problem, motion
        self.tolerance, self.floor = tolerance, floor
        self.pairs = problem.pairs[: problem.obstacle_pair_count]
        rooms = rooms_of_pairs(problem, motion)
        # A length that each pair is farther apart than at every instant, and how far
        # its distance can change between any two.
        self.least = rooms.least[: len(self.pairs)]
        self.change = 2.0 * rooms.moved[: len(self.pairs)]
        self.span = len(motion.theta) - 1.0
        self.upper, self.time, self.nearest = inf, 0.0, -1

    def run(self, instants: Sequence[float]) -> LeastClearance | None:
        """Both bounds, or None: see `least_clearance`."""
        if not self.pairs:
            return None
        times = self._first_times(instants)
        # Half-way first: from there the others are the least far.
        for time in sorted(times, key=lambda time: abs(time - 0.5 * self.span)):
            self._look(time)
        if self.upper == 0.0:
            return None
        place = times.index(self.time)
        begin, end = times[max(place - 1, 0)], times[min(place + 1, len(times) - 1)]
        self._follow(self.nearest, begin, end)
        lower = inf
        for k in np.argsort(self.least):
            kept = self._kept(int(k))
            if kept is None:
                return None
            lower = min(lower, kept)
        return self._result(lower)

    def _first_times(self, instants: Sequence[float]) -> list[float]:
        """Where to look first, in waypoints, in order."""
        evenly = np.linspace(0.0, self.span, INSTANTS)
        of_waypoints = np.unique(np.linspace(0.0, self.span, WAYPOINTS).round())
        given = np.array(instants) * self.span
        return [float(t) for t in np.unique([*evenly, *of_waypoints, *given])]

    def _look(self, time: float) -> None:
        """Lowers the upper bound by an instant; pairs whose boxes are nearest first."""
        if np.count_nonzero(self.least < self.upper) <= FEW:
            gaps = self.least
        else:
            placed = self.motion.place(self.problem.chain, time)
            gaps = gaps_of_pairs(self.problem, placed)[: len(self.pairs)]
        for k in np.argsort(gaps):
            if gaps[k] >= self.upper:
                break
            if self.least[k] < self.upper:
                self._distance(int(k), time)

    def _distance(self, k: int, time: float, cutoff: float | None = None) -> float:
        """Upper bound of a pair's distance at an instant; remembered if the least."""
        pair = self.pairs[k]
        placed = self.motion.place(self.problem.chain, time)
        T_a, T_b = placed[pair.moving.frame], pair.standing.T_frame_mesh
        limit = self.upper if cutoff is None else cutoff
        tree, other = pair.moving.tree, pair.standing.tree
        lower, upper = tree.clearance(
            other, T_a, T_b, 0.0, limit, known_apart=self.floor is not None
        )
        self.least[k] = max(self.least[k], lower - self.change[k])
        if upper < self.upper:
            self.upper, self.time, self.nearest = upper, time, k
        return upper

    def _follow(self, k: int, begin: float, end: float) -> None:
        """Looks for the instant between two at which a pair is nearest."""
        inner = [end - GOLDEN * (end - begin), begin + GOLDEN * (end - begin)]
        seen = [self._distance(k, time, inf) for time in inner]
        for _ in range(GOLDEN_STEPS):
            if seen[0] < seen[1]:
                end, inner[1], seen[1] = inner[1], inner[0], seen[0]
                inner[0] = end - GOLDEN * (end - begin)
                seen[0] = self._distance(k, inner[0], inf)
            else:
                begin, inner[0], seen[0] = inner[0], inner[1], seen[1]
                inner[1] = begin + GOLDEN * (end - begin)
                seen[1] = self._distance(k, inner[1], inf)

    def _kept(self, k: int) -> float | None:
        """A length that a pair is farther apart than at every instant, or None."""
        for _ in range(ROUNDS):
            before = self.upper
            for level in self._levels():
                rows = self._nearer_than(k, level)
                if len(rows) == 0:
                    return level
                self._look_into(k, rows)
                if self.upper < before - 0.1 * (before - level):
                    break  # ask again, for less
            else:
                break
        return self.floor

    def _levels(self) -> Iterator[float]:
        """What to ask for, first what is aimed at, then less and less."""
        upper, floor = self.upper, self.floor or 0.0
        allowed = self.tolerance.allowed(upper)
        close = AIM * min(self.tolerance.relative * upper or allowed, allowed)
        for below in (close, AIM * allowed, 0.5 * upper):
            # A margin that is nearly reached leaves no room for a share of it.
            level = max(upper - below, 0.5 * (upper + floor))
            if floor < level < upper:
                yield level

    def _nearer_than(self, k: int, level: float) -> Array:
        """Where a pair is not shown to be farther apart: rows of `Examined`."""
        if self.least[k] > level:
            return np.zeros((0, 3))
        resolution = max(RESOLUTION, 0.02 * (self.upper - level))
        return examine_pair(
            self.problem.chain,
            replace(self.pairs[k], margin=level),
            self.problem.routes[k],
            self.motion,
            resolution,
            PIECE_LIMIT,
            np.zeros((0, 2)),
            QUICK_LIMIT,
        ).rows

    def _look_into(self, k: int, rows: Array) -> None:
        """Lowers the upper bound by what a pair does where it may be nearer."""
        stretches = [(begin, end) for begin, end, _ in joined(rows)]
        stretches.sort(key=lambda s: s[0] - s[1])
        for begin, end in stretches[:4]:
            times = np.linspace(begin, end, 7)
            seen = [self._distance(k, float(time), inf) for time in times]
            best = int(np.argmin(seen))
            self._follow(k, times[max(best - 1, 0)], times[min(best + 1, 6)])

    def _result(self, lower: float) -> LeastClearance:
        pair = self.pairs[self.nearest]
        T_a = self.motion.place(self.problem.chain, self.time)[pair.moving.frame]
        T_b = pair.standing.T_frame_mesh
        # Round shapes lie within their polyhedra, which are asked here.
        upper = self.upper + pair.moving.mesh.excess + pair.standing.mesh.excess
        return LeastClearance(
            lower=min(lower, upper),
            upper=upper,
            at=min(self.time / self.span, 1.0),
            pair=(
                self.problem.parts.index(pair.moving),
                self.problem.obstacles.index(pair.standing),
            ),
            names=pair.names,
            closest=pair.moving.tree.closest(pair.standing.tree, T_a, T_b),
            within_tolerance=upper - lower <= self.tolerance.allowed(upper),
        )
