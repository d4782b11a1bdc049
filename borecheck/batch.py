"""Many configurations in one call: links that move against what stands in the room.

The answers are those of single `MeshTree` queries, pose by pose and pair by pair: the
same walks in one compiled loop, without a Python call for each.
"""

import numpy as np
from numba import njit

from borecheck.bvh_boxes import (
    INLINE,
    KERNEL,
    PAIR_SHAPE,
    RELATION_SHAPE,
    is_identity,
    is_rigid,
    relate,
    relate_back,
    roots_apart,
)
from borecheck.bvh_build import F32
from borecheck.bvh_lanes import PROBE_COLUMNS
from borecheck.bvh_query import FIRST, stack_room, walk

NO_PAIR = -1
ROOT = 4


@njit(**KERNEL)
def first_pairs(  # type: ignore[no-untyped-def]
    nodes_a, corners_a, frames_a, nodes_b, corners_b, frames_b,
    pairs, placements, placements_b, b_moves, begin, end, depths, code, hits,
):  # fmt: skip
    """hits[i] = the first of `pairs` in contact in pose i, or NO_PAIR.

    Args:
        nodes_a: Packed links, like corners_a and frames_a.
        corners_a: ...
        frames_a: ...
        nodes_b: Packed obstacles, or the links again.
        corners_b: ...
        frames_b: ...
        pairs: Which link against which b, (k, 2).
        placements: (n, links, 4, 4).
        placements_b: (1, obstacles, 4, 4), or `placements` again.
        b_moves: Whether placements_b is per pose too.
        begin: First pose of this call.
        end: Behind the last pose.
        depths: Of the deepest tree of either side, together.
        code: The narrowphase.
        hits: (n,), filled between begin and end.

    Returns:
        The first pose with a placement that is not rigid, or -1.
    """
    pair, relation = np.zeros(PAIR_SHAPE), np.zeros(RELATION_SHAPE, F32)
    stack = np.zeros((stack_room(depths), 2), np.int64)
    probe = np.zeros(PROBE_COLUMNS, F32)
    found = np.zeros((1, 2), np.int64)
    tree_a = (nodes_a, nodes_a.view(np.int32), corners_a)
    tree_b = (nodes_b, nodes_b.view(np.int32), corners_b)
    for i in range(begin, end):
        if not _all_rigid(placements, i):
            return i
        hits[i] = NO_PAIR
        for k in range(len(pairs)):
            a, b = pairs[k, 0], pairs[k, 1]
            T_a, T_b = placements[i, a], placements_b[i if b_moves else 0, b]
            b_is_world = not b_moves and is_identity(T_b)
            relate(T_a, T_b, b_is_world, frames_a, a, frames_b, b, 0.0, pair, relation)
            root_a, root_b = int(frames_a[a, ROOT]), int(frames_b[b, ROOT])
            if roots_apart(nodes_a, root_a, nodes_b, root_b, relation):
                continue
            relate_back(pair, relation)
            count, _, _ = walk(
                tree_a, root_a, T_a, tree_b, root_b, T_b, b_is_world,
                relation, code, FIRST, stack, probe, found,
            )  # fmt: skip
            if count > 0:
                hits[i] = k
                break
    return -1


@njit(**INLINE)
def _all_rigid(placements, i):  # type: ignore[no-untyped-def]
    rigid = True
    for j in range(placements.shape[1]):
        rigid &= is_rigid(placements[i, j])
    return rigid
