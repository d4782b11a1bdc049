"""How much the errors may move each pair before it could touch: proven for a motion.

The nominal motion of a pair is cut into pieces. In the middle of each the distance is
found; what is left of it after the piece's own motion and the margin is the pair's
room there. Errors that move nothing farther than the room leave the pair clear at every
instant; as it shrinks from the nominal motion to the disturbed one without the
surfaces ever meeting, no solid comes to hold another either. A needle in its patient
has a room of another kind (`needle`).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.verdict import CLEAR
from borecheck.motion.bounds import Route
from borecheck.motion.by_distance import displacement_about
from borecheck.motion.problem import Body, Motion, Pair, PathProblem, path_motion
from borecheck.motion.search import search
from borecheck.robots.kinematics.forward import WORLD
from borecheck.uncertainty.disturbed import Disturbance
from borecheck.uncertainty.needle import NeedleRoom, needle_room
from borecheck.uncertainty.reach import (
    arms,
    effects_of,
    grows_with_motion,
    per_sigma,
)

Array = NDArray[np.float64]

# The distance's own accuracy, and how much of it a piece's motion may take.
ACCURACY, SPENT = 0.02, 0.05
# More than all roundings together, [m].
RESERVE = 1e-8
# Pieces of a pair at most; what is not decided by then has no room.
PIECES = 4096


@dataclass(frozen=True, eq=False)
class Rooms:
    """The room of every pair, for many draws at once.

    Attributes:
        coefficients: Arms of all effects at every piece, (pieces, effects).
        room: Of every piece, [m]; negative: never enough.
        pair: Which pair a piece belongs to, (pieces,).
        count: Number of pairs.
        radius: Errors x = A z with |z| up to this leave all pairs clear.
        needles: Rooms of the passages, by their number among the pairs.
    """

    coefficients: Array
    room: Array
    pair: NDArray[np.int64]
    count: int
    radius: float
    needles: dict[int, NeedleRoom]


class RoomSearch:
    """Finds the rooms of a problem.

    Args:
        disturbance: What errors do.
        problem: Nominal robot and scene, without doubt.
        points: The nominal motion's waypoints, (k, n).
        enough: Radius in standard deviations beyond which no room is looked for.
    """

    def __init__(
        self,
        disturbance: Disturbance,
        problem: PathProblem,
        points: Array,
        enough: float,
    ) -> None:
        self.problem, self.enough = problem, enough
        self.points = points
        self.motion: Motion = path_motion(problem, points)
        self.effects = effects_of(disturbance)
        self._grow = grows_with_motion(self.effects, problem.chain)
        root = disturbance.uncertainty.root
        self._blocks = _column_blocks(disturbance, root)

    def run(self) -> Rooms:
        """Rooms of all pairs, then of all passages."""
        needles = {
            number: needle_room(self.problem, passage, self.motion, self.effects)
            for number, passage in enumerate(
                self.problem.passages, len(self.problem.pairs)
            )
        }
        rows: list[Array] = []
        room: list[float] = []
        pair: list[int] = []
        for number, found in enumerate(self._all(needles)):
            for coefficients, left in found:
                rows.append(coefficients)
                room.append(left)
                pair.append(number)
        table = np.array(rows).reshape(len(room), len(self.effects))
        rooms = np.array(room)
        each = per_sigma(self.effects, table, self._blocks)
        radius = np.where(rooms > 0.0, rooms / np.maximum(each, 1e-300), 0.0)
        least = float(radius.min(initial=np.inf))
        numbers, count = np.array(pair, np.int64), number_of(self.problem)
        return Rooms(table, rooms, numbers, count, least, needles)

    def _all(
        self, needles: dict[int, NeedleRoom]
    ) -> Iterator[list[tuple[Array, float]]]:
        for number, (pair, way) in enumerate(
            zip(self.problem.pairs, self.problem.routes, strict=True)
        ):
            alone = restricted(self.problem, {number})
            if search(alone, self.points).verdict == CLEAR:
                yield self._pair(pair, way)
            else:
                yield [(np.zeros(len(self.effects)), -1.0)]
        for needle in needles.values():
            yield [(piece.arms, piece.room) for piece in needle.pieces]

    def _pair(self, pair: Pair, way: Route) -> list[tuple[Array, float]]:
        found: list[tuple[Array, float]] = []
        waiting = [(0.0, len(self.motion.theta) - 1.0)]
        numbers = tuple(_number(self.problem, b) for b in (pair.moving, pair.standing))
        looked = 0
        while waiting:
            begin, end = waiting.pop()
            middle = 0.5 * (begin + end)
            looked += 1
            placed = self.motion.place(self.problem.chain, middle)
            moved = displacement_about(
                self.problem.chain, pair, way, self.motion, placed, begin, middle, end
            )
            lower = _distance(pair, placed)
            left = lower - moved - pair.margin - RESERVE
            coefficients = self._arms(way, pair.moving, numbers, pair.standing, placed)
            coefficients = coefficients + moved * self._grow
            each = per_sigma(self.effects, coefficients[None], self._blocks)[0]
            if left >= self.enough * each or moved <= SPENT * lower:
                found.append((coefficients, left))
            elif looked > PIECES or not begin < middle < end:
                found.append((coefficients, min(left, 0.0)))
            else:
                waiting += [(middle, end), (begin, middle)]
        return found

    def _arms(
        self,
        way: Route,
        moving: Body,
        numbers: tuple[int, ...],
        standing: Body,
        placed: Array,
    ) -> Array:
        return arms(
            self.effects,
            self.problem.chain,
            way,
            moving,
            (numbers[0], numbers[1]),
            standing.frame == WORLD,
            placed,
        )


def number_of(problem: PathProblem) -> int:
    """Of pairs and passages."""
    return len(problem.pairs) + len(problem.passages)


def open_pairs(rooms: Rooms, effect_sizes: Array) -> NDArray[np.bool_]:
    """Which pairs are not proven clear in which draw, (draws, pairs)."""
    found = np.zeros((len(effect_sizes), rooms.count), dtype=bool)
    for number in range(rooms.count):
        own = rooms.pair == number
        moved = effect_sizes @ rooms.coefficients[own].T
        found[:, number] = (moved * (1.0 + 1e-9) >= rooms.room[own]).any(axis=1)
    return found


def restricted(problem: PathProblem, numbers: set[int]) -> PathProblem:
    """The problem with some of its pairs and passages alone."""
    apart = problem.excluded | {(p.part, p.obstacle) for p in problem.passages}
    against = [
        (i, j)
        for i in range(len(problem.parts))
        for j in range(len(problem.obstacles))
        if (i, j) not in apart
    ]
    n, m = len(against), len(problem.self_pairs)
    left_out = {pair for k, pair in enumerate(against) if k not in numbers}
    among = enumerate(problem.self_pairs, n)
    through = enumerate(problem.passages, n + m)
    left_out |= {(p.part, p.obstacle) for p in problem.passages}
    return replace(
        problem,
        excluded=problem.excluded | left_out,
        self_pairs=tuple(pair for k, pair in among if k in numbers),
        passages=tuple(passage for k, passage in through if k in numbers),
    )


def _distance(pair: Pair, placed: Array) -> float:
    """A lower bound of the distance, [m]; 0 in contact."""
    T_b = pair.standing.T_frame_mesh
    if pair.standing.frame != WORLD:
        T_b = placed[pair.standing.frame]
    T_a = placed[pair.moving.frame]
    return pair.moving.tree.clearance(pair.standing.tree, T_a, T_b, ACCURACY)[0]


def _number(problem: PathProblem, body: Body) -> int:
    """A part's number, or -1 for an obstacle."""
    return next((k for k, part in enumerate(problem.parts) if part is body), -1)


def _column_blocks(disturbance: Disturbance, root: Array) -> list[Array]:
    """The columns of the root that act on joints, dimensions, and registration."""
    found = []
    for rows in (
        disturbance.of_joints,
        disturbance.of_dimensions,
        disturbance.of_registration,
    ):
        found.append(root[:, root[rows].any(axis=0)])
    return found
