"""The slow, sure way to examine a motion: true distance against how far it can move.

`motion.halving` looks at boxes and separating planes first, which is quick and gives up
where long thin triangles pass each other at a slant. What it leaves is examined here:
the pair is placed in the middle of a stretch, and if the certified distance there
exceeds the margin and every displacement within the stretch, the stretch is clear. That
is the argument of the certificate, too (`motion.certificate` says why the bound holds).
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from borecheck.motion.bounds import FIXED, TURNS, WORLD, Chain, Route
from borecheck.motion.halving import TOUCHED, UNDECIDED

if TYPE_CHECKING:
    from borecheck.motion.problem import Body, Motion, Pair

Array = NDArray[np.float64]
Rows = list[tuple[float, float, int]]

# By how much the distance must exceed margin and displacement: more than rounding, [m].
RESERVE = 1e-9
# The first contact is narrowed until nothing moves farther than this within it, [m].
FIRST_CONTACT = 1e-5


def by_distance(
    chain: Chain,
    pair: "Pair",
    way: Route,
    motion: "Motion",
    stretch: tuple[float, float],
    lengths: tuple[float, float],
    limit: int,
) -> tuple[Rows, int]:
    """What is not clear of a stretch, in order, and how many pieces were looked at.

    Args:
        chain: The robot's joints.
        pair: Who must not touch whom.
        way: The route between their frames.
        motion: The whole motion.
        stretch: Begin and end, in waypoints.
        lengths: Pieces with less motion are not halved, [m]: without contact, and with
            contact in their middle once a first contact is found.
        limit: Pieces looked at before the rest is left undecided.

    Returns:
        Rows (begin, end, TOUCHED or UNDECIDED); the rest of the stretch is clear.
    """
    resolution, contact_length = lengths
    waiting, rows, looked = [stretch], [], 0
    enough = min(FIRST_CONTACT, contact_length)
    while waiting:
        begin, end = waiting.pop()
        middle = 0.5 * (begin + end)
        looked += 1
        if looked > limit or not begin < middle < end:
            rows.append((begin, end, UNDECIDED))
            continue
        placed = motion.place(chain, middle)
        moved = displacement_about(chain, pair, way, motion, placed, begin, middle, end)
        if _farther_than(pair, placed, pair.margin + moved + RESERVE):
            continue
        if moved <= enough and not _farther_than(pair, placed, pair.margin):
            rows.append((begin, end, TOUCHED))
            enough = contact_length
        elif moved <= resolution:
            rows.append((begin, end, UNDECIDED))
        else:
            waiting += [(middle, end), (begin, middle)]
    return rows, looked


def _farther_than(pair: "Pair", placed: Array, length: float) -> bool:
    """Whether the surfaces are surely farther apart; of length 0: do not meet."""
    T_b = pair.standing.T_frame_mesh
    if pair.standing.frame != WORLD:
        T_b = placed[pair.standing.frame]
    T_a = placed[pair.moving.frame]
    answer = pair.moving.tree.within(pair.standing.tree, T_a, T_b, length)
    return answer.verdict == "clear"


def displacement_about(
    chain: Chain,
    pair: "Pair",
    way: Route,
    motion: "Motion",
    placed: Array,
    begin: float,
    middle: float,
    end: float,
) -> float:
    """Bound on how far any point of a moves against b from the middle, [m]."""
    instants = [begin, *_waypoints_between(begin, end), end]
    at = motion.joints_at(middle)
    change = np.zeros(chain.frame_count)
    for instant in instants:
        change = np.maximum(change, np.abs(motion.joints_at(instant) - at))
    corners = _box_corners(pair.moving) @ placed[pair.moving.frame, :3, :3].T
    corners = corners + placed[pair.moving.frame, :3, 3]
    total = 0.0
    for j in way.joints:
        if chain.kind[j] == FIXED or change[j] == 0.0:
            continue
        arm = 1.0
        if chain.kind[j] == TURNS:
            axis = placed[j, :3, :3] @ chain.axis[j]
            from_axis = np.cross(corners - placed[j, :3, 3], axis)
            arm = float(np.linalg.norm(from_axis, axis=1).max())
        total += float(change[j]) * arm
    return total * (1.0 + 1e-12) + 1e-12


def _waypoints_between(begin: float, end: float) -> Iterator[float]:
    first = int(np.floor(begin)) + 1
    yield from (float(k) for k in range(first, int(np.ceil(end))))


def _box_corners(body: "Body") -> Array:
    low, high = body.mesh.bounds
    pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
    return np.where(pick == 1, high, low)
