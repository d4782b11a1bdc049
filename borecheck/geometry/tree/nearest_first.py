"""The least distance of many pairs of placed meshes, the nearest pairs first.

Pairs whose boxes are nearest are asked first, and what they give bounds the others:
most are dropped unopened. Surfaces are known not to meet, as in `tree.clearance`.
"""

import numpy as np

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.tree.clearance import (
    LOWER,
    PAIR,
    SLOT_A,
    SLOT_B,
    UPPER,
    narrow,
    room_for,
    side,
)
from borecheck.geometry.tree.world_boxes import gap_between, world_boxes

# First roughly: a small UPPER lets nearly all boxes of the exact round be dropped.
_ROUGH = 2.0
# Whether anything comes as near as a margin.
FAR, NEAR, UNDECIDED = range(3)


@kernel
def nearest_first(  # type: ignore[no-untyped-def]
    nodes_a, corners_a, frames_a, nodes_b, corners_b, frames_b,
    pairs, placements_a, placements_b, b_moves, begin, end,
    depths, scale, answers,
):  # fmt: skip
    """As `clearance.nearest` of all pairs together, (n, 1, 6), in fewer steps.

    Arguments as there. Of pairs at equal distance another one may be named.
    """
    room = room_for(depths)
    side_a, side_b = (
        side(nodes_a, corners_a, frames_a),
        side(nodes_b, corners_b, frames_b),
    )
    count = len(pairs)
    gaps, left = np.empty(count), np.empty(count)
    reach_a = np.empty((len(frames_a), 2, 3))
    reach_b = np.empty((len(frames_b), 2, 3))
    if not b_moves:
        world_boxes(nodes_b, frames_b, placements_b, 0, reach_b)
    for i in range(begin, end):
        answer = answers[i, 0]
        if answer[UPPER] == 0.0:
            continue
        world_boxes(nodes_a, frames_a, placements_a, i, reach_a)
        if b_moves:
            world_boxes(nodes_b, frames_b, placements_b, i, reach_b)
        for k in range(count):
            gaps[k] = gap_between(reach_a, pairs[k, 0], reach_b, pairs[k, 1])
        for turn in range(0 if scale < _ROUGH else 1, 2):
            share = _ROUGH if turn == 0 else scale
            answer[LOWER] = np.inf
            for k in range(count):
                left[k] = gaps[k]
            for _ in range(count):
                k = int(np.argmin(left))
                if left[k] * share >= answer[UPPER]:
                    answer[LOWER] = min(answer[LOWER], left[k])
                    break
                left[k] = np.inf
                before, slot_a, slot_b = answer[UPPER], answer[SLOT_A], answer[SLOT_B]
                narrow(
                    side_a, pairs[k, 0], placements_a, i,
                    side_b, pairs[k, 1], placements_b, i if b_moves else 0,
                    room, share, np.inf, -1.0, answer,
                )  # fmt: skip
                if answer[UPPER] < before:
                    answer[PAIR] = k
                else:
                    answer[SLOT_A], answer[SLOT_B] = slot_a, slot_b


@kernel
def comes_near(  # type: ignore[no-untyped-def]
    nodes_a, corners_a, frames_a, nodes_b, corners_b, frames_b,
    pairs, placements_a, placements_b, b_moves, depths, margin, settled, near, which,
):  # fmt: skip
    """Fills near and which, (n,): does any pair come as near as the margin, [m].

    FAR and NEAR are certain; UNDECIDED where a distance differs from the margin by
    less than its error. Poses that are settled are left as they are.
    """
    reach_a = np.empty((len(frames_a), 2, 3))
    reach_b = np.empty((len(frames_b), 2, 3))
    answer = np.empty(6)
    room = room_for(depths)
    side_a, side_b = (
        side(nodes_a, corners_a, frames_a),
        side(nodes_b, corners_b, frames_b),
    )
    if not b_moves:
        world_boxes(nodes_b, frames_b, placements_b, 0, reach_b)
    for i in range(len(placements_a)):
        if settled[i]:
            continue
        world_boxes(nodes_a, frames_a, placements_a, i, reach_a)
        if b_moves:
            world_boxes(nodes_b, frames_b, placements_b, i, reach_b)
        for k in range(len(pairs)):
            if gap_between(reach_a, pairs[k, 0], reach_b, pairs[k, 1]) > margin:
                continue
            answer[LOWER], answer[UPPER] = np.inf, np.inf
            answer[SLOT_A], answer[SLOT_B] = -1.0, -1.0
            # Distances that cannot be told from the margin are looked at as well.
            narrow(
                side_a, pairs[k, 0], placements_a, i,
                side_b, pairs[k, 1], placements_b, i if b_moves else 0,
                room, 1.0, margin * (1.0 + 1e-9), margin, answer,
            )  # fmt: skip
            if answer[UPPER] <= margin:
                near[i], which[i] = NEAR, k
                break
            if not min(answer[LOWER], answer[UPPER]) > margin:
                near[i], which[i] = UNDECIDED, k
