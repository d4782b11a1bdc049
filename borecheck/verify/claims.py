"""The statements of a certificate asked again, one after the other: numpy only.

First what is missing or contradicts itself; then placements, displacements, distances
and insides are derived once more.
"""

from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from borecheck.verify.chain import inverse
from borecheck.verify.distance import nearer_than
from borecheck.verify.fields import Rejected
from borecheck.verify.passage import MOST_SLACK, WIDEST_NEEDLE, StatedCorridor
from borecheck.verify.solid import Side, side_of
from borecheck.verify.statement import (
    CORRIDOR,
    RESERVE,
    ROUNDING,
    Pair,
    Passage,
    Statement,
    Surface,
)
from borecheck.verify.verification import Verification

Array = NDArray[np.float64]
Claim = Pair | Passage
# After so many problems no more are looked for.
MOST_PROBLEMS = 20


class Claims:
    """Every statement of a certificate asked again.

    Args:
        statement: What it states.
        allowed: Pairs that may touch, with the reason: by files that were read, not by
            the certificate's word.
    """

    def __init__(
        self,
        statement: Statement,
        allowed: Mapping[tuple[int, int], str] = MappingProxyType({}),
    ) -> None:
        self.stated = statement
        self.chain = statement.chain
        self.bodies = statement.bodies
        self.reasons = allowed
        self.allowed = set(allowed)
        self.required = self._required()
        self.checked = 0

    def run(self) -> Verification:
        """First what is missing or contradicts itself; then, if nothing, geometry."""
        problems = [*self._incomplete(), *self._passages_are_the_plans()]
        everything: list[Claim] = [*self.stated.pairs, *self.stated.passages]
        for ask in (self._consistent, self._true):
            if not problems:
                found = (text for one in everything for text in self._asked(ask, one))
                problems = list(islice(found, MOST_PROBLEMS))
        corridors = [] if problems else self.stated.passages
        return Verification(
            not problems,
            tuple(problems),
            self.checked,
            len(everything),
            self._names(self.allowed & self.required),
            tuple(self._limits_of(passage) for passage in corridors),
            self._names(self._all_within() - self.required),
            tuple(self._may_touch()),
        )

    def _may_touch(self) -> Iterator[str]:
        """Every pair that was not asked because it may touch, and why it may."""
        for i, j in sorted(self.allowed & self.required):
            a, b = self.bodies[i].name, self.bodies[j].name
            yield f"{a} and {b}: {self.reasons[i, j]}"

    def _asked(self, ask: Callable[[Claim], None], one: Claim) -> Iterator[str]:
        try:
            ask(one)
        except Rejected as problem:
            yield f"{self._both(one)}: {problem}"

    def _both(self, one: Claim) -> str:
        a, b = self.bodies[one.moving], self.bodies[one.standing]
        return f"{a.name} and {b.name}"

    def _names(self, pairs: set[tuple[int, int]]) -> tuple[tuple[str, str], ...]:
        return tuple(
            (self.bodies[i].name, self.bodies[j].name) for i, j in sorted(pairs)
        )

    def _limits_of(self, passage: Passage) -> str:
        a, b = self.bodies[passage.moving], self.bodies[passage.standing]
        where = f"{a.name} in {b.name} {StatedCorridor(passage, b.mesh.corners)}"
        if len(passage.beside) == 0:
            return where
        times = _spans(passage.intervals)
        return f"{where}; asked for waypoints {times}, plainly clear of it elsewhere"

    def _required(self) -> set[tuple[int, int]]:
        """Every part against every obstacle, and pairs of parts; no exception."""
        parts = self.stated.parts
        obstacles = range(parts, len(self.bodies))
        frames = [body.frame for body in self.bodies[:parts]]
        within = self.chain.required_pairs(frames)
        return within | {(i, j) for i in range(parts) for j in obstacles}

    def _all_within(self) -> set[tuple[int, int]]:
        return {(i, j) for j in range(self.stated.parts) for i in range(j)}

    def _incomplete(self) -> Iterator[str]:
        """Pairs that are not stated, or twice."""
        found: set[tuple[int, int]] = set()
        everything: list[Claim] = [*self.stated.pairs, *self.stated.passages]
        for one in everything:
            i, j = sorted((one.moving, one.standing))
            if i == j or (i, j) in found:
                yield f"{self._both(one)}: stated twice, or of one body"
            found.add((i, j))
        for i, j in sorted(self.required - found - self.allowed):
            reason = ""
            if (i, j) in self.stated.allowed:
                why = self.stated.allowed[i, j]
                reason = (
                    f"; that they may touch is its writer's word ({why}): give --robot "
                    "and what allows it, --srdf or --allow"
                )
            a, b = self.bodies[i].name, self.bodies[j].name
            yield f"{a} and {b}: not examined{reason}"

    def _passages_are_the_plans(self) -> Iterator[str]:
        """Contact is for one needle in a patient, in the plan's or path's corridor."""
        about = self.stated.document.get("about", {})
        plan = about.get("plan", about.get("corridor"))
        records = self.stated.document["passages"]
        for passage, record in zip(self.stated.passages, records, strict=True):
            both = self._both(passage)
            if plan is None:
                yield f"{both}: it allows contact, but names no needle plan or corridor"
            elif any(record[name] != plan[name] for name in CORRIDOR):
                whose = f"the plan {plan['name']!r}" if "plan" in about else "the path"
                yield f"the corridor is not that of {whose}"
            if self.bodies[passage.standing].role != "patient":
                yield f"{both}: contact may be allowed with a patient alone"
            if passage.slack > MOST_SLACK or passage.radius > WIDEST_NEEDLE:
                yield f"{both}: the corridor is wider than a needle's"
        if len({self.bodies[p.moving].frame for p in self.stated.passages}) > 1:
            yield "it allows contact to more than one link"

    def _consistent(self, one: Claim) -> None:
        """What needs no geometry: closed, the whole motion, more than the margin."""
        for index in (one.moving, one.standing):
            if not self.bodies[index].closed:
                raise Rejected(f"{self.bodies[index].name} is open, it has no inside")
        if isinstance(one, Passage):
            self._covers(_in_order(one.intervals[:, :3], one.beside[:, :3]))
            self._has_room(one.as_pair(self.stated.margin))
            return
        self._covers(one.intervals)
        against_obstacle = one.standing >= self.stated.parts
        if one.margin < (self.stated.margin if against_obstacle else 0.0):
            raise Rejected("examined with a smaller margin")
        self._has_room(one)

    def _has_room(self, one: Pair) -> None:
        clearance, moved = one.intervals[:, 3], one.intervals[:, 4]
        wrong = np.flatnonzero(~(clearance > moved + one.margin + RESERVE))
        if len(wrong):
            raise Rejected(
                f"{_stretch(one.intervals[wrong[0]])}: clearance does not exceed "
                "displacement and margin"
            )

    def _covers(self, intervals: Array) -> None:
        begin, end, at = intervals[:, 0], intervals[:, 1], intervals[:, 2]
        if len(begin) == 0:
            raise Rejected("no intervals are stated")
        if begin[0] != 0.0 or end[-1] != self.stated.end:
            raise Rejected("the intervals leave out an end of the path")
        wrong = np.flatnonzero(begin[1:] != end[:-1])
        if len(wrong):
            raise Rejected(f"the intervals do not join at {end[wrong[0]]:.6g}")
        if not ((begin <= at) & (at <= end) & (begin < end)).all():
            raise Rejected("an interval does not hold its own instant")

    def _true(self, one: Claim) -> None:
        """What geometry and kinematics must confirm."""
        if isinstance(one, Passage):
            self._passage(one)
            one = one.as_pair(self.stated.margin)
        end = None
        for row in one.intervals:
            self._interval(one, row)
            self.checked += 1
            if row[0] != end:  # from here on the surfaces never meet
                self._holds_nothing(one, float(row[0]))
            end = row[1]

    def _interval(self, pair: Pair, row: Array) -> None:
        a, b = self.bodies[pair.moving], self.bodies[pair.standing]
        moved = self._moved(a, b, row, float(row[4]))
        clearance = float(row[3])
        if not clearance > moved + pair.margin + RESERVE:
            raise Rejected(
                f"{_stretch(row)}: clearance does not exceed displacement and margin"
            )
        T_b_a = self._T_b_a(a, b, float(row[2]))
        if nearer_than(a.mesh, b.mesh, T_b_a, clearance - ROUNDING):
            raise Rejected(
                f"{_stretch(row)}: the surfaces are nearer than {clearance:.3e} m"
            )

    def _T_b_a(self, a: Surface, b: Surface, time: float) -> Array:
        placed = self.chain.placements(time)
        return np.asarray(inverse(b.placed(placed)) @ a.placed(placed))

    def _moved(self, a: Surface, b: Surface, row: Array, stated: float) -> float:
        """How far a moves against b about an instant, [m]; at least what is stated."""
        begin, end, at = (float(x) for x in row[:3])
        T = a.placed(self.chain.placements(at))
        corners = a.box @ T[:3, :3].T + T[:3, 3]
        moved = self.chain.displacement(corners, (a.frame, b.frame), (begin, end, at))
        if not stated >= moved - ROUNDING:
            raise Rejected(
                f"{_stretch(row)}: moves up to {moved:.3e} m, not {stated:.3e} m"
            )
        return max(moved, stated)

    def _holds_nothing(self, pair: Pair, time: float) -> None:
        """At that time neither closed surface holds a part of the other."""
        a, b = self.bodies[pair.moving], self.bodies[pair.standing]
        T_b_a = self._T_b_a(a, b, time)
        for inner, outer, T in ((a, b, T_b_a), (b, a, inverse(T_b_a))):
            for corner in inner.one_corner_each:
                side = side_of(T[:3, :3] @ corner + T[:3, 3], outer.mesh)
                if side is Side.INSIDE:
                    raise Rejected(f"{inner.name} is inside {outer.name}")
                if side is Side.UNTOLD:
                    raise Rejected(
                        f"{outer.name} meets itself: whether {inner.name} is inside "
                        "cannot be told"
                    )

    def _passage(self, passage: Passage) -> None:
        """Where a needle is said to keep to its corridor: in it, or before the entry.

        There it is outside the patient and does not touch it.
        """
        a, b = self.bodies[passage.moving], self.bodies[passage.standing]
        R, shift = b.T_frame_mesh[:3, :3], b.T_frame_mesh[:3, 3]
        corridor = StatedCorridor(passage, b.mesh.corners @ R.T + shift)
        back = inverse(b.T_frame_mesh)
        deepest, widest = -np.inf, 0.0
        for row in passage.intervals:
            moved = self._moved(a, b, row, float(row[3])) + RESERVE
            T = a.placed(self.chain.placements(float(row[2])))
            needle = a.mesh.corners @ T[:3, :3].T + T[:3, 3]
            wrong = corridor.why_not(needle, moved, self.stated.margin)
            if wrong:
                raise Rejected(f"{_stretch(row)}: {a.name} {wrong}")
            tail = back[:3, :3] @ corridor.before(needle, moved) + back[:3, 3]
            if side_of(tail, b.mesh) is not Side.OUTSIDE:
                raise Rejected(f"{_stretch(row)}: {a.name} may begin inside {b.name}")
            depth, width = corridor.depth_and_width(needle, moved)
            if depth > deepest:
                deepest, widest = depth, width
            self.checked += 1
        if len(passage.intervals) and passage.radius > widest + ROUNDING:
            raise Rejected(
                f"the corridor is {1e3 * passage.radius:g} mm wide about its line, "
                f"{a.name} only {1e3 * widest:.3g} mm"
            )


def _in_order(*lists: Array) -> Array:
    """Intervals of several lists by when they begin."""
    rows = np.concatenate(lists)
    return rows[np.argsort(rows[:, 0], kind="stable")]


def _spans(rows: Array) -> str:
    """From when to when intervals go, joined where one begins as another ends."""
    spans: list[list[float]] = []
    for begin, end in _in_order(rows)[:, :2]:
        if spans and spans[-1][1] == begin:
            spans[-1][1] = end
        else:
            spans.append([begin, end])
    return ", ".join(f"{begin:.6g} to {end:.6g}" for begin, end in spans) or "none"


def _stretch(row: Array) -> str:
    return f"{row[0]:.6g} to {row[1]:.6g}"
