"""The slow, sure way to examine a motion: true distance against how far it can move.

`motion.halving` looks at boxes and separating planes first, which is quick and gives up
where long thin triangles pass each other at a slant. What it leaves is examined here:
the pair is placed in the middle of a stretch, and if the certified distance there
exceeds the margin and every displacement within the stretch, the stretch is clear. That
is the argument of the certificate, too (`motion.certificate` says why the bound holds).
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.motion.bounds import Route
from borecheck.motion.halving import TOUCHED, UNDECIDED
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, TURNS, WORLD

if TYPE_CHECKING:
    from borecheck.motion.problem import Motion, Pair

Array = NDArray[np.float64]
Rows = list[tuple[float, float, int]]

# By how much the distance must exceed margin and displacement: more than rounding, [m].
RESERVE = 1e-9
# The first contact is narrowed until nothing moves farther than this within it, [m].
FIRST_CONTACT = 1e-5


def by_distance(
    chain: JointChain,
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
    chain: JointChain,
    pair: "Pair",
    way: Route,
    motion: "Motion",
    placed: Array,
    begin: float,
    middle: float,
    end: float,
) -> float:
    """Bound on how far any point of a moves against b from the middle, [m]."""
    at = motion.joints_at(middle)
    first, last = int(np.floor(begin)) + 1, int(np.ceil(end))
    instants = [motion.joints_at(begin), *motion.theta[first:last]]
    instants.append(motion.joints_at(end))
    change = np.abs(np.array(instants) - at).max(axis=0)
    T = placed[pair.moving.frame]
    total = _displacement(
        way.joints, chain.kind, chain.axis, placed, change, T, pair.moving.mesh.bounds
    )
    return float(total) * (1.0 + 1e-12) + 1e-12


@kernel
def _displacement(joints, kind, axis, placed, change, T, bounds):  # type: ignore[no-untyped-def]
    """Sum over the joints of their change times the box's distance from their axis."""
    corners = np.zeros((8, 3))
    for i in range(8):
        x, y, z = bounds[i >> 2 & 1, 0], bounds[i >> 1 & 1, 1], bounds[i & 1, 2]
        for d in range(3):
            corners[i, d] = T[d, 0] * x + T[d, 1] * y + T[d, 2] * z + T[d, 3]
    total = 0.0
    for j in joints:
        if kind[j] == FIXED or change[j] == 0.0:
            continue
        arm = 1.0
        if kind[j] == TURNS:
            arm = _farthest(corners, placed[j], axis[j])
        total += change[j] * arm
    return total


@kernel
def _farthest(points, T, axis):  # type: ignore[no-untyped-def]
    """Largest distance of points from the line through T's origin along an axis."""
    n = np.zeros(3)
    for d in range(3):
        n[d] = T[d, 0] * axis[0] + T[d, 1] * axis[1] + T[d, 2] * axis[2]
    largest = 0.0
    for i in range(len(points)):
        x, y, z = points[i, 0] - T[0, 3], points[i, 1] - T[1, 3], points[i, 2] - T[2, 3]
        u, v, w = y * n[2] - z * n[1], z * n[0] - x * n[2], x * n[1] - y * n[0]
        largest = max(largest, u * u + v * v + w * w)
    return np.sqrt(largest)
