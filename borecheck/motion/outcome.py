"""What is known of a motion, instant by instant, put together from all pairs."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.verdict import (
    CLEAR,
    CONTACT,
    UNKNOWN,
    Answer,
    AnyVerdict,
    Closest,
)
from borecheck.geometry.tree.mesh_tree import NearestPoints
from borecheck.motion.halving import CERTIFIED, TOUCHED, UNDECIDED

Array = NDArray[np.float64]
Names = tuple[str, str]


@dataclass(frozen=True)
class Stretch:
    """A part of the path with one verdict; start and end are fractions of the path.

    Attributes:
        start: Where it begins, 0 to 1.
        end: Where it ends.
        verdict: clear: proven for every instant. contact: there is contact in it (in
            the margin, if one was asked for). unknown: neither could be shown.
        pairs: Names of part and obstacle that are in contact or undecided.
    """

    start: float
    end: float
    verdict: str
    pairs: tuple[Names, ...] = ()

    @property
    def place(self) -> str:
        """Where it lies, in words."""
        return f"between {self.start:.4%} and {self.end:.4%} of the motion"

    def to_json(self) -> dict[str, Any]:
        """As the contract names it: from, to, verdict."""
        return {"from": self.start, "to": self.end, "verdict": self.verdict}


@dataclass(frozen=True, eq=False)
class LeastClearance:
    """How near robot and obstacles come to each other during a motion.

    Attributes:
        lower: They are farther apart than this at every instant: proven, [m].
        upper: They are this near at one instant, [m].
        at: That instant, as a fraction of the motion.
        pair: Indices of part and obstacle there, in the problem.
        names: Their names.
        closest: Their nearest points there.
        within_tolerance: Whether the bounds are as near each other as was asked.
    """

    lower: float
    upper: float
    at: float
    pair: tuple[int, int]
    names: Names
    closest: NearestPoints
    within_tolerance: bool

    def closest_to(self, role: str) -> Closest:
        """The nearest points, of an obstacle in that role."""
        link, obstacle = self.names
        found = self.closest
        return Closest(
            link=link,
            obstacle=obstacle,
            role=role,
            distance=found.lower,
            upper=self.upper,
            points=(_point(found.point_self), _point(found.point_other)),
            triangles=(int(found.triangle_self), int(found.triangle_other)),
        )


def _point(values: Array) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])


@dataclass(frozen=True, repr=False)
class PathVerdict(AnyVerdict):
    """The answer for every instant of a motion.

    Attributes:
        verdict: clear, contact or unknown.
        reason: One sentence.
        qualifiers: `contained`, if a solid holds another.
        certified: Whether every instant is proven clear.
        intervals: Stretches that cover the path from 0 to 1 without gaps.
        first_contact: Fractions between which contact begins, with the pair; or None.
        worst: Fraction of the path to look at first, or None if all is clear.
        counts: Pairs examined, pieces of time tried, poses judged exactly.
        least: The certified least clearance to the obstacles; None in contact, where
            none could be shown, and where it was not asked for.
        obstacles: Whether the robot touches what stands around it; None of a motion
            whose way is not known.
        itself: Whether it touches itself; None likewise.
    """

    verdict: str
    reason: str
    qualifiers: tuple[str, ...]
    certified: bool
    intervals: tuple[Stretch, ...]
    first_contact: tuple[float, float, Names] | None
    worst: float | None
    counts: dict[str, int] = field(default_factory=dict)
    least: LeastClearance | None = None
    obstacles: Answer | None = None
    itself: Answer | None = None

    @property
    def clearance_m(self) -> float | None:
        """Robot and obstacles are farther apart at every instant: proven, [m]."""
        return None if self.least is None else self.least.lower

    @property
    def clearance_upper_m(self) -> float | None:
        """At the instant `least.at` they are this near, [m]."""
        return None if self.least is None else self.least.upper


class Timeline:
    """Gathers findings of all pairs; times are fractions of the path."""

    def __init__(self, span: float) -> None:
        self.span = span  # waypoint steps
        self.pieces = 0
        self.poses = 0
        self.notes: dict[Names, str] = {}
        self.open: list[tuple[float, float, int, Names]] = []
        self.first_touch: tuple[float, float, Names] | None = None
        self.contained: list[tuple[Names, str]] = []
        self.undecided: list[tuple[Names, str]] = []

    def count(self, pieces: int, poses: int) -> None:
        """Adds to the work done."""
        self.pieces += int(pieces)
        self.poses += int(poses)

    def note(self, names: Names, text: str) -> None:
        """Adds a reason why something about a pair stays unknown."""
        self.notes.setdefault(names, text)

    def add(self, names: Names, findings: Array) -> None:
        """Findings (from, to, outcome) of one pair in order, in waypoints."""
        times = np.minimum(findings[:, :2] / self.span, 1.0).tolist()
        outcomes = findings[:, 2].astype(int).tolist()
        for (start, end), outcome in zip(times, outcomes, strict=True):
            if outcome == TOUCHED:
                touch = (start, end, names)
                if self.first_touch is None or touch[:2] < self.first_touch[:2]:
                    self.first_touch = touch
            self._join(start, end, outcome, names)

    def not_clear_for(self, names: Names) -> list[tuple[float, float]]:
        """Stretches in which a pair is not proven clear.

        Its own, and those in contact already: there it was not looked at any more.
        """
        return [
            (start, end)
            for start, end, outcome, whose in self.open
            if whose == names or outcome == TOUCHED
        ]

    def settled(self) -> Array:
        """Stretches that hold contact already, in waypoints, (k, 2)."""
        found = [(s, e) for s, e, outcome, _ in self.open if outcome == TOUCHED]
        return np.array(found, dtype=np.float64).reshape(-1, 2) * self.span

    def add_unknown(self, names: Names, reason: str) -> None:
        """A pair of which nothing can be told anywhere."""
        self.undecided.append((names, reason))

    def add_contained(
        self, names: Names, reason: str, start: float = 0.0, end: float = 1.0
    ) -> None:
        """A pair of which one holds the other during a stretch."""
        self.contained.append((names, reason))
        self.open.append((start, end, TOUCHED, names))

    def _join(self, start: float, end: float, outcome: int, names: Names) -> None:
        if self.open:
            begun, until, before, same = self.open[-1]
            if until == start and before == outcome and same == names:
                self.open[-1] = (begun, end, outcome, names)
                return
        self.open.append((start, end, outcome, names))


def path_verdict(timeline: Timeline, pairs: int) -> PathVerdict:
    """One verdict from everything that was found."""
    stretches = _stretches(timeline)
    counts = {"pairs": pairs, "pieces": timeline.pieces, "poses": timeline.poses}
    first = _first_contact(timeline, stretches)
    verdict, reason = _judgement(timeline, stretches, first, pairs)
    certified = verdict == CLEAR
    not_clear = [s.start for s in stretches if s.verdict == verdict]
    return PathVerdict(
        verdict=verdict,
        reason=reason,
        qualifiers=("contained",) if timeline.contained else (),
        certified=certified,
        intervals=stretches,
        first_contact=first,
        worst=None if certified else min(not_clear, default=0.0),
        counts=counts,
    )


def in_doubt(found: PathVerdict, doubt: str) -> PathVerdict:
    """The same without `clear`, because the numbers may mean something else."""
    intervals = tuple(
        Stretch(s.start, s.end, UNKNOWN if s.verdict == CLEAR else s.verdict, s.pairs)
        for s in found.intervals
    )
    if found.verdict != CLEAR:
        return replace(found, intervals=intervals)
    return replace(
        found,
        verdict=UNKNOWN,
        reason=f"{doubt}; {found.reason}",
        certified=False,
        intervals=intervals,
        worst=0.0,
    )


def _judgement(
    timeline: Timeline,
    stretches: tuple[Stretch, ...],
    first: tuple[float, float, Names] | None,
    pairs: int,
) -> tuple[str, str]:
    if first is not None:
        start, end, names = first
        where = Stretch(start, end, CONTACT).place
        return CONTACT, f"{' and '.join(names)} meet {where}"
    if timeline.contained:
        return CONTACT, timeline.contained[0][1]
    if timeline.undecided:
        return UNKNOWN, timeline.undecided[0][1]
    left = [s for s in stretches if s.verdict == UNKNOWN]
    if left:
        s = left[0]
        why = timeline.notes.get(s.pairs[0], "no gap could be shown there")
        who = " and ".join(s.pairs[0])
        return UNKNOWN, f"{who} {s.place}: {why}"
    if pairs == 0:
        return UNKNOWN, "nothing was examined"
    return CLEAR, f"every instant is proven clear for {pairs} pairs"


def _first_contact(
    timeline: Timeline, stretches: tuple[Stretch, ...]
) -> tuple[float, float, Names] | None:
    """Between which fractions contact begins: the first stretch that shows it."""
    if timeline.first_touch is None:
        return None
    start, end, names = timeline.first_touch
    # What is undecided just before may hold the contact already.
    for s in reversed([s for s in stretches if s.start < start]):
        if s.verdict == CLEAR:
            break
        start = s.start
    return start, end, names


def _stretches(timeline: Timeline) -> tuple[Stretch, ...]:
    """Neighbouring instants of equal verdict joined; contact beats unknown."""
    if not timeline.open:
        verdict = UNKNOWN if timeline.undecided else CLEAR
        return (Stretch(0.0, 1.0, verdict, tuple(n for n, _ in timeline.undecided)),)
    cuts = np.unique([0.0, 1.0, *(x for found in timeline.open for x in found[:2])])
    worst = np.zeros(len(cuts) - 1, np.int64)
    rank = {CERTIFIED: 0, UNDECIDED: 1, TOUCHED: 2}
    names: list[dict[Names, None]] = [{} for _ in worst]
    for start, end, outcome, pair in timeline.open:
        i, j = np.searchsorted(cuts, [start, end])
        for k in range(i, j):
            if rank[outcome] > worst[k]:
                worst[k] = rank[outcome]
                names[k] = {}
            if rank[outcome] == worst[k]:
                names[k][pair] = None
    if timeline.undecided:
        worst = np.maximum(worst, 1)
    stretches: list[Stretch] = []
    for k, level in enumerate(worst):
        verdict = (CLEAR, UNKNOWN, CONTACT)[level]
        new = Stretch(float(cuts[k]), float(cuts[k + 1]), verdict, tuple(names[k]))
        last = stretches[-1] if stretches else None
        if last is not None and (last.verdict, last.pairs) == (verdict, new.pairs):
            stretches[-1] = Stretch(last.start, new.end, verdict, new.pairs)
        else:
            stretches.append(new)
    return tuple(stretches)
