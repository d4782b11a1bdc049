"""How far apart pairs surely stay during a whole motion: boxes first, all at once.

Half-way through the motion the boxes of two surfaces leave a gap. No point of the one
moves farther against the other than the bound on displacements says (`motion.bounds`),
taken from there to every waypoint, between which all joints change linearly. So

    room = gap - displacement

is less than the distance of the two surfaces at every instant. A pair with more room
than its margin is clear; with any room at all its boxes never meet, and neither surface
holds a part of the other, be it closed or open. Most pairs of a short motion are
answered like that, and the others are as before.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.core.once import once_per_record
from borecheck.geometry.kernels.compile import kernel
from borecheck.motion.bound_kernels import gains
from borecheck.motion.problem import Motion, PathProblem

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# More than rounding of placements, boxes and bounds, and than a skewed placement that
# is let pass: a share of the displacement, and a length, [m].
_SHARE, _RESERVE = 1e-5, 1e-9


@dataclass(frozen=True, eq=False)
class _Packed:
    """The pairs of a problem as arrays, in their order; p pairs.

    Attributes:
        moving: Number of the moving part, (p,).
        standing: Number of the other body, parts first, then obstacles, (p,).
        frames: Frame of every part, (parts,).
        middles: Middles of the boxes of all parts in their frames, (parts, 3), [m].
        halves: Half their sides, (parts, 3), [m].
        obstacles: Bounds of all obstacles, (obstacles, 2, 3), [m].
        radii: Of the moving part of each pair, (p,), [m].
        joints: Joints of all routes, one after the other.
        forward: How each is crossed.
        starts: Where each route begins, (p + 1,).
    """

    moving: Ids
    standing: Ids
    frames: Ids
    middles: Array
    halves: Array
    obstacles: Array
    radii: Array
    joints: Ids
    forward: NDArray[np.bool_]
    starts: Ids


@dataclass(frozen=True, eq=False)
class Rooms:
    """What boxes tell of all pairs of a problem along a motion.

    Attributes:
        least: Each pair is farther apart at every instant, (pairs,), [m]; negative
            where boxes do not tell.
        moved: No point of its moving part is farther from its place half-way, seen from
            the other body, (pairs,), [m].
    """

    least: Array
    moved: Array


def rooms_of_pairs(problem: PathProblem, motion: Motion) -> Rooms:
    """How far apart all pairs surely stay, in their order."""
    if not problem.pairs:
        return Rooms(np.zeros(0), np.zeros(0))
    packed = _packed(problem)
    middle = motion.joints_at(0.5 * (len(motion.theta) - 1))
    gaps = gaps_of_pairs(problem, problem.chain.placed(middle))
    moved = _displacements(
        packed.joints,
        packed.forward,
        packed.starts,
        problem.chain.kind,
        problem.chain.length,
        packed.radii,
        motion.largest,
        np.abs(motion.theta - middle).max(axis=0),
    )
    moved = (1.0 + _SHARE) * moved + _RESERVE
    return Rooms(gaps - moved, moved)


def gaps_of_pairs(problem: PathProblem, placed: Array) -> Array:
    """Distance of the boxes of each pair at one instant, 0 if they meet, (pairs,).

    Args:
        problem: Who must not touch whom.
        placed: T_world_frame of all frames, (n, 4, 4).
    """
    packed = _packed(problem)
    T = placed[packed.frames]
    middles = np.einsum("kij,kj->ki", T[:, :3, :3], packed.middles) + T[:, :3, 3]
    halves = np.einsum("kij,kj->ki", np.abs(T[:, :3, :3]), packed.halves)
    low = np.concatenate([middles - halves, packed.obstacles[:, 0]])
    high = np.concatenate([middles + halves, packed.obstacles[:, 1]])
    a, b = packed.moving, packed.standing
    apart = np.maximum(low[b] - high[a], low[a] - high[b])
    return np.linalg.norm(np.maximum(apart, 0.0), axis=1)


@kernel
def _displacements(  # type: ignore[no-untyped-def]
    joints, forward, starts, kind, length, radii, largest, change
):
    """Bound on how far points of each moving part go for joint changes (n,), (p,)."""
    moved = np.zeros(len(radii))
    for p in range(len(radii)):
        begin, end = starts[p], starts[p + 1]
        way, crossed = joints[begin:end], forward[begin:end]
        gain = gains(way, crossed, kind, length, radii[p], largest)
        for k in range(len(way)):
            moved[p] += gain[k] * change[way[k]]
    return moved


@once_per_record
def _packed(problem: PathProblem) -> _Packed:
    parts = problem.parts
    number = {body: k for k, body in enumerate((*parts, *problem.obstacles))}
    bounds = np.array([part.bounds for part in parts]).reshape(-1, 2, 3)
    lengths = [len(way.joints) for way in problem.routes]
    return _Packed(
        moving=np.array([number[pair.moving] for pair in problem.pairs]),
        standing=np.array([number[pair.standing] for pair in problem.pairs]),
        frames=np.array([part.frame for part in parts], dtype=np.int64),
        middles=bounds.mean(axis=1),
        halves=0.5 * (bounds[:, 1] - bounds[:, 0]),
        obstacles=np.array([o.bounds for o in problem.obstacles]).reshape(-1, 2, 3),
        radii=np.array([pair.moving.radius for pair in problem.pairs]),
        joints=np.concatenate([way.joints for way in problem.routes]),
        forward=np.concatenate([way.forward for way in problem.routes]),
        starts=np.concatenate([[0], np.cumsum(lengths)]),
    )
