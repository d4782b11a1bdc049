"""How much the errors may move a needle in its patient: the room of a passage.

What the needle sweeps in a piece of the motion is held by slabs about the corridor's
line (`motion.passage`). By how much they may all grow and still be allowed is the
passage's room. Most of it is spent at the corridor's own wall, 2 mm beside the needle;
the part before the corridor has much more. So a draw with too large errors for the
whole is looked at again: its own slabs must keep to the corridor where they are deep,
and before it its errors must be within the larger room.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from borecheck.motion.bounds import route
from borecheck.motion.by_distance import displacement_about
from borecheck.motion.passage import Approach, Slabs
from borecheck.motion.passage_search import PassageSearch
from borecheck.motion.problem import Motion, Pair, Passage, PathProblem, path_motion
from borecheck.robots.kinematics.forward import WORLD
from borecheck.uncertainty.reach import Effect, arms, grows_with_motion

Array = NDArray[np.float64]

# Halvings of a leg, and the steps by which rooms are looked for, [m].
HALVINGS, STEP, COARSE = 6, 1e-4, 1e-3
# More room before the corridor than this is not looked for, [m].
MOST = 0.05
# More than all roundings together, [m].
RESERVE = 1e-8


class Piece(NamedTuple):
    """A piece of the motion, in waypoints, with the arms of all effects.

    Attributes:
        begin: Where it begins.
        end: Where it ends.
        arms: See `reach.arms`, (effects,).
        room: By how much all that is swept may grow, [m]; negative: not at all.
        before: By how much what lies before the corridor may, [m].
    """

    begin: float
    end: float
    arms: Array
    room: float
    before: float


@dataclass(frozen=True, eq=False)
class NeedleRoom:
    """The room of one passage.

    Attributes:
        passage: Which part may be in which obstacle, and where.
        pieces: Of the whole motion, in order.
        approach: The patient before the corridor.
    """

    passage: Passage
    pieces: tuple[Piece, ...]
    approach: Approach

    def keeps(self, problem: PathProblem, points: Array, sizes: Array) -> bool:
        """Whether a disturbed motion is proven to keep to the corridor.

        Args:
            problem: With the errors.
            points: The disturbed waypoints, (k, n).
            sizes: Of all effects of the errors, (effects,).
        """
        look = _search(problem, self.passage, path_motion(problem, points))
        return all(
            float(piece.arms @ sizes) * (1.0 + 1e-9) < piece.before
            and self.approach.holds_deep(look.sweep(piece.begin, piece.end))
            for piece in self.pieces
        )


def needle_room(
    problem: PathProblem, passage: Passage, motion: Motion, effects: list[Effect]
) -> NeedleRoom:
    """The room of a passage along the nominal motion."""
    look = _search(problem, passage, motion)
    needle, patient = look.needle, look.patient
    way = route(problem.chain, WORLD, needle.frame)
    pair, grow = Pair(needle, patient, 0.0), grows_with_motion(effects, problem.chain)
    pieces = []
    for begin, end in _pieces(look, len(motion.theta) - 1):
        middle = 0.5 * (begin + end)
        placed = motion.place(problem.chain, middle)
        moved = displacement_about(
            problem.chain, pair, way, motion, placed, begin, middle, end
        )
        numbers = (passage.part, -1)
        found = arms(effects, problem.chain, way, needle, numbers, True, placed)
        slabs = look.sweep(begin, end)
        pieces.append(
            Piece(
                begin,
                end,
                found + moved * grow,
                _growth(look.approach.allows, slabs, look.corridor.slack, STEP),
                _growth(_is_free(look), slabs, MOST, COARSE),
            )
        )
    return NeedleRoom(passage, tuple(pieces), look.approach)


def _search(problem: PathProblem, passage: Passage, motion: Motion) -> PassageSearch:
    needle = problem.parts[passage.part]
    patient = problem.obstacles[passage.obstacle]
    return PassageSearch(problem.chain, needle, patient, passage.corridor, motion)


def _pieces(look: PassageSearch, legs: int) -> Iterator[tuple[float, float]]:
    """Pieces of the motion that are proven to keep to the corridor, or short."""
    for leg in range(legs):
        cuts = [float(leg), leg + 1.0]
        for _ in range(HALVINGS):
            if all(look.stays(a, b) for a, b in pairwise(cuts)):
                break
            cuts = sorted([*cuts, *(0.5 * (a + b) for a, b in pairwise(cuts))])
        yield from pairwise(cuts)


def _is_free(look: PassageSearch) -> Callable[[Slabs], bool]:
    near = -look.corridor.slack
    return lambda slabs: look.approach.is_free(slabs.before(near))


def _growth(
    allows: Callable[[Slabs], bool], slabs: Slabs, most: float, step: float
) -> float:
    """By how much slabs may grow and still be allowed, [m], at most so much."""
    low, high = -1, round(most / step) + 1
    while high - low > 1:
        middle = (low + high) // 2
        if allows(_grown(slabs, middle * step)):
            low = middle
        else:
            high = middle
    return low * step - RESERVE


def _grown(slabs: Slabs, by: float) -> Slabs:
    return Slabs(slabs.low - by, slabs.high + by, slabs.aside + by, slabs.tail + by)
