"""Steps of continuous joints that do not say which way round they go.

A continuous joint stands at 3.0 and at -3.0 rad nearly alike. borecheck goes from one
to the other as the numbers do, through 0; planners and controllers that know the joint
to be continuous go the short way, through pi. From half a turn on the two differ, and a
motion proven on one way says nothing about the other.
"""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.verdict import CONTACT, UNKNOWN
from borecheck.motion.outcome import PathVerdict, Stretch
from borecheck.robots.model import RobotModel

Array = NDArray[np.float64]

TURN = 2.0 * math.pi
# A step within a microradian of half a turn does not say which way it goes, [rad].
HALF_TURN = math.pi - 1e-6


@dataclass(frozen=True)
class OpenTurns:
    """Steps between waypoints of which the way is not known.

    Attributes:
        steps: Their numbers, from 0, in order.
        count: Steps of the whole motion.
        reason: Why nothing is known there, about the first of them.
        taken: What is taken for granted if they go as they are written.
    """

    steps: tuple[int, ...]
    count: int
    reason: str
    taken: str

    def hold(self, fraction: float) -> bool:
        """Whether an instant is within such a step; at a waypoint none is."""
        time = fraction * self.count
        at_waypoint = abs(time - round(time)) < 1e-9
        return not at_waypoint and int(time) in self.steps


def open_turns(model: RobotModel, points: Array) -> OpenTurns | None:
    """The steps by half a turn or more of a continuous joint, mimics included.

    Args:
        model: The robot's joints.
        points: Waypoints, (k, n), [rad] and [m].
    """
    found: dict[int, tuple[str, float]] = {}
    for joint in model.tree.joints:
        source, factor, _ = model.driver(joint.name, joint.type)
        if joint.type != "continuous" or factor == 0.0:
            continue
        turns = factor * np.diff(points[:, source])
        for step in np.flatnonzero(np.abs(turns) >= HALF_TURN):
            found.setdefault(int(step), (joint.name, float(turns[step])))
    if not found:
        return None
    first = min(found)
    name, turn = found[first]
    written = f"by {turn:.4g} rad from waypoint {first + 1} to {first + 2}"
    other = f"by {_other_way(turn):.4g} rad"
    return OpenTurns(
        tuple(sorted(found)),
        len(points) - 1,
        f"continuous joint {name} turns {written}, but may as well be driven {other}: "
        "add a waypoint between, or say that it goes as written (--long-way)",
        f"that the controller turns continuous joint {name} {written}, as written, "
        f"and not {other}",
    )


def _other_way(turn: float) -> float:
    """The shortest turn that ends at the same place, or as long the other way."""
    shortest = math.remainder(turn, TURN)
    return -shortest if abs(shortest - turn) < 1e-5 else shortest


def held_back(found: PathVerdict, turns: OpenTurns, touched: str | None) -> PathVerdict:
    """The same, with nothing said about steps of which the way is not known.

    Args:
        found: What holds of the motion as it is written.
        turns: Where that is not the only way to go.
        touched: What touches at an end of such a step, where all ways lead; or None.
    """
    intervals = _split(found.intervals, turns)
    contact = next((s for s in intervals if s.verdict == CONTACT), None)
    if touched is None and contact is None:
        return replace(
            found,
            verdict=UNKNOWN,
            reason=turns.reason,
            qualifiers=(),
            certified=False,
            intervals=intervals,
            first_contact=None,
            worst=turns.steps[0] / turns.count,
        )
    first, reason = found.first_contact, found.reason
    if first is None or _overlap(first[0], first[1], turns):
        first, reason = None, touched or reason
        if contact is not None:
            reason = f"{' and '.join(contact.pairs[0])} meet {contact.place}"
    return replace(
        found,
        verdict=CONTACT,
        reason=reason,
        certified=False,
        intervals=intervals,
        first_contact=first,
    )


def _split(stretches: tuple[Stretch, ...], turns: OpenTurns) -> tuple[Stretch, ...]:
    """Stretches that are unknown within open steps."""
    edges = {k / turns.count for step in turns.steps for k in (step, step + 1)}
    found: list[Stretch] = []
    for s in stretches:
        inner = sorted(edge for edge in edges if s.start < edge < s.end)
        cuts = [s.start, *inner, s.end]
        for start, end in pairwise(cuts):
            is_open = _overlap(start, end, turns)
            new = Stretch(start, end, UNKNOWN if is_open else s.verdict, s.pairs)
            last = found[-1] if found else None
            if last is not None and (last.verdict, last.pairs) == (
                new.verdict,
                s.pairs,
            ):
                found[-1] = replace(last, end=end)
            else:
                found.append(new)
    return tuple(found)


def _overlap(start: float, end: float, turns: OpenTurns) -> bool:
    """Whether a stretch, in fractions, has more than a waypoint in an open step."""
    begin, until = start * turns.count, end * turns.count
    return any(begin < k + 1 - 1e-9 and until > k + 1e-9 for k in turns.steps)
