"""How far apart two placed meshes are: certified bounds from one walk, nearest first.

The surfaces are known not to meet (`tree.query` asked before), so the clearance is the
least distance over all triangle pairs. A pair of boxes is dropped when it cannot hold
anything nearer than what is asked for; the least bound of what was dropped is part of
the answer. Bounds of boxes are float32, rounded down by the slack of `tree.boxes` and
by `simd.SAFE`; distances of triangles are float64 with the error that
`triangles.distance` states.
"""

import numpy as np

from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.geometry.tree.boxes import (
    RELATION_SHAPE,
    ROOT,
    child_box,
    copy_placement,
    is_identity,
    keep_relation,
    motion_of,
    relate,
    set_probe,
    slack_of,
    undo,
)
from borecheck.geometry.tree.build import CHILD_ROW, F32, WIDTH
from borecheck.geometry.tree.query import stack_room
from borecheck.geometry.tree.simd import PROBE_COLUMNS, gap_mask
from borecheck.geometry.triangles.distance import DISTANCE_ERROR, disjoint_distance
from borecheck.geometry.triangles.placing import place_triangle
from borecheck.geometry.triangles.published import triangle_row

_ZERO = F32(0.0)
ALL_LANES = 255
# A limit is rounded up to float32, so that what it drops is beyond the float64 limit.
_ROUND_UP = 1.0 + 2.0**-22

# A walk's answer: least bound of the dropped, least distance found, the slots of its
# two triangles, number of triangle pairs examined, and the pair of meshes.
LOWER, UPPER, SLOT_A, SLOT_B, EXAMINED, PAIR = range(6)
NO_ANSWER = (np.inf, np.inf, -1.0, -1.0, 0.0, -1.0)
# A first guess is good when another round lowers it by less than this share.
_SETTLED = 0.99
_ROUNDS = 4
# While guessing, boxes are dropped that can lower the guess by less than a twentieth.
_GUESS = 1.05


@kernel(**INLINE)
def push_nearest_last(mask, gaps, a, b, step_a, step_b, stack, bounds, top):  # type: ignore[no-untyped-def]
    """Puts the children of a mask on the stack, the nearest on top."""
    first = top
    for i in range(WIDTH):
        if (mask >> i) & 1 == 0:
            continue
        gap, place = gaps[i], top
        while place > first and bounds[place - 1] < gap:
            bounds[place] = bounds[place - 1]
            stack[place, 0] = stack[place - 1, 0]
            stack[place, 1] = stack[place - 1, 1]
            place -= 1
        bounds[place] = gap
        stack[place, 0], stack[place, 1] = a + step_a * i, b + step_b * i
        top += 1
    return top


@kernel
def pair_error(a, b):  # type: ignore[no-untyped-def]
    """By how much the computed distance of two triangles can be off."""
    longest = 0.0
    for d in range(3):
        low = min(a[d], a[d + 3], a[d + 6], b[d], b[d + 3], b[d + 6])
        high = max(a[d], a[d + 3], a[d + 6], b[d], b[d + 3], b[d + 6])
        longest = max(longest, high - low)
    return DISTANCE_ERROR * longest


@kernel
def farther(a, b, limit):  # type: ignore[no-untyped-def]
    """Whether two triangles are surely farther apart than `limit`, at little cost.

    They are if their projections are, along the line between their centres or along
    the normal of either; `limit` has room for the rounding of the projections.
    """
    ux, uy, uz = a[3] - a[0], a[4] - a[1], a[5] - a[2]
    vx, vy, vz = a[6] - a[0], a[7] - a[1], a[8] - a[2]
    b0x, b0y, b0z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    b1x, b1y, b1z = b[3] - a[0], b[4] - a[1], b[5] - a[2]
    b2x, b2y, b2z = b[6] - a[0], b[7] - a[1], b[8] - a[2]
    square = limit * limit * (1.0 + 1e-12)
    nx = b0x + b1x + b2x - (ux + vx)
    ny = b0y + b1y + b2y - (uy + vy)
    nz = b0z + b1z + b2z - (uz + vz)
    s1, s2 = nx * ux + ny * uy + nz * uz, nx * vx + ny * vy + nz * vz
    t0, t1 = nx * b0x + ny * b0y + nz * b0z, nx * b1x + ny * b1y + nz * b1z
    t2 = nx * b2x + ny * b2y + nz * b2z
    gap = min(t0, t1, t2) - max(0.0, s1, s2)
    if gap > 0.0 and gap * gap > square * (nx * nx + ny * ny + nz * nz):
        return True
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    t0, t1 = nx * b0x + ny * b0y + nz * b0z, nx * b1x + ny * b1y + nz * b1z
    t2 = nx * b2x + ny * b2y + nz * b2z
    gap = max(min(t0, t1, t2), -max(t0, t1, t2))
    if gap > 0.0 and gap * gap > square * (nx * nx + ny * ny + nz * nz):
        return True
    b1x, b1y, b1z = b1x - b0x, b1y - b0y, b1z - b0z
    b2x, b2y, b2z = b2x - b0x, b2y - b0y, b2z - b0z
    nx, ny, nz = b1y * b2z - b1z * b2y, b1z * b2x - b1x * b2z, b1x * b2y - b1y * b2x
    t0 = -(nx * b0x + ny * b0y + nz * b0z)
    t1, t2 = t0 + nx * ux + ny * uy + nz * uz, t0 + nx * vx + ny * vy + nz * vz
    gap = max(min(t0, t1, t2), -max(t0, t1, t2))
    return gap > 0.0 and gap * gap > square * (nx * nx + ny * ny + nz * nz)


@kernel
def approach(  # type: ignore[no-untyped-def]
    tree_a, slot_a, T_a, tree_b, slot_b, T_b, b_is_world,
    relation, scale, cutoff, stop, scratch, answer,
):  # fmt: skip
    """Narrows `answer` by one mesh against another, their relation given.

    Trees are (nodes, children, corners), placements (3, 4). The walk begins with the
    boxes of `slot_a` and `slot_b`, 8 node + slot. Boxes are dropped when `scale` (1 +
    relative tolerance) times their gap reaches the least distance found, or their gap
    the `cutoff` [m]. The walk ends when something as near as `stop` [m] is found.
    `scratch`: a stack (k, 2) int64, bounds (k,), a probe (19,), gaps (8,), float32.
    Of `answer`, (6,), LOWER and UPPER are lowered; they are infinite at first, or what
    other meshes gave.
    """
    nodes_a, children_a, corners_a = tree_a
    nodes_b, children_b, corners_b = tree_b
    stack, bounds, probe, gaps = scratch
    stack[0, 0], stack[0, 1], bounds[0] = slot_a, slot_b, _ZERO
    top = 1
    while top > 0:
        top -= 1
        limit = min(answer[UPPER] / scale, cutoff)
        limit32 = F32(limit * _ROUND_UP)
        if bounds[top] >= limit:
            answer[LOWER] = min(answer[LOWER], bounds[top])
            continue
        a, b = stack[top, 0], stack[top, 1]
        node_a, node_b = (
            int(children_a[a >> 3, CHILD_ROW, a & 7]),
            int(children_b[b >> 3, CHILD_ROW, b & 7]),
        )
        if node_a < 0 and node_b < 0:
            answer[EXAMINED] += 1
            alpha = place_triangle(T_a, corners_a, ~node_a)
            if b_is_world:
                beta = triangle_row(corners_b, ~node_b)
            else:
                beta = place_triangle(T_b, corners_b, ~node_b)
            error = pair_error(alpha, beta)
            if farther(alpha, beta, limit + error):
                answer[LOWER] = min(answer[LOWER], limit)
                continue
            distance, _, _ = disjoint_distance(alpha, beta)
            answer[LOWER] = min(answer[LOWER], distance - error)
            if distance + error < answer[UPPER]:
                answer[UPPER] = distance + error
                answer[SLOT_A], answer[SLOT_B] = a, b
                if answer[UPPER] <= stop:
                    break
            continue
        box_a, box_b = child_box(nodes_a, a), child_box(nodes_b, b)
        size_a = max(box_a[3], max(box_a[4], box_a[5]))
        size_b = max(box_b[3], max(box_b[4], box_b[5]))
        if node_a < 0 or (node_b >= 0 and size_b >= size_a):
            set_probe(box_a, relation, 0, probe)
            mask = gap_mask(nodes_b, node_b, probe, limit32, gaps)
            first_a, first_b, step_a, step_b = a, 8 * node_b, 0, 1
        else:
            set_probe(box_b, relation, 1, probe)
            mask = gap_mask(nodes_a, node_a, probe, limit32, gaps)
            first_a, first_b, step_a, step_b = 8 * node_a, b, 1, 0
        if mask != ALL_LANES:
            answer[LOWER] = min(answer[LOWER], limit)
        if mask != 0:
            top = push_nearest_last(
                mask, gaps, first_a, first_b, step_a, step_b, stack, bounds, top
            )


@kernel
def guess(  # type: ignore[no-untyped-def]
    tree_a, root_a, T_a, tree_b, root_b, T_b, b_is_world, relation, scratch, answer
):
    """A small UPPER to begin with: every box farther than it will be dropped unopened.

    From the first pair of triangles met, one of the two is held and the nearest
    triangle of the other mesh sought, in turns.
    """
    slot_a, slot_b = 8 * root_a, 8 * root_b
    stop, before, lower = np.inf, np.inf, answer[LOWER]
    answer[SLOT_A] = answer[SLOT_B] = -1.0
    for turn in range(2 * _ROUNDS):
        approach(
            tree_a, slot_a, T_a, tree_b, slot_b, T_b, b_is_world,
            relation, _GUESS, np.inf, stop, scratch, answer,
        )  # fmt: skip
        settled = answer[UPPER] > _SETTLED * before
        # (What other meshes gave may be nearer than anything here.)
        if answer[SLOT_A] < 0.0 or (settled and turn > 1):
            break
        before, stop = answer[UPPER], -1.0
        slot_a, slot_b = int(answer[SLOT_A]), 8 * root_b
        if turn % 2 == 1:
            slot_a, slot_b = 8 * root_a, int(answer[SLOT_B])
    answer[LOWER] = lower


@kernel(**INLINE)
def side(nodes, corners, frames):  # type: ignore[no-untyped-def]
    """Trees of one side, as `narrow` takes them."""
    return nodes, nodes.view(np.int32), corners, frames


@kernel(**INLINE)
def room_for(depths):  # type: ignore[no-untyped-def]
    """What walks write in: a relation, two placements, scratch of `approach`."""
    room = stack_room(depths)
    stack, bounds = np.empty((room, 2), np.int64), np.empty(room, F32)
    scratch = (stack, bounds, np.empty(PROBE_COLUMNS, F32), np.empty(WIDTH, F32))
    return np.empty(RELATION_SHAPE, F32), np.empty((3, 4)), np.empty((3, 4)), scratch


@kernel
def narrow(  # type: ignore[no-untyped-def]
    side_a, a, placements_a, i, side_b, b, placements_b, j,
    room, scale, cutoff, stop, answer,
):  # fmt: skip
    """Narrows `answer` by one placed mesh against another; see `approach`.

    Mesh a of side a stands where pose i says, mesh b where pose j does.
    """
    nodes_a, children_a, corners_a, frames_a = side_a
    nodes_b, children_b, corners_b, frames_b = side_b
    tree_a, tree_b = (nodes_a, children_a, corners_a), (nodes_b, children_b, corners_b)
    relation, T_a, T_b, scratch = room
    copy_placement(placements_a, i, a, T_a)
    copy_placement(placements_b, j, b, T_b)
    motion_a, motion_b = motion_of(T_a), motion_of(T_b)
    b_is_world = is_identity(motion_b)
    M = relate(motion_a, motion_b, b_is_world, frames_a, a, frames_b, b)
    slack = slack_of(M, motion_a, motion_b, frames_a, a, frames_b, b, 0.0)
    keep_relation(M, slack, 0, relation)
    keep_relation(undo(M), slack, 1, relation)
    root_a, root_b = int(frames_a[a, ROOT]), int(frames_b[b, ROOT])
    # What other meshes gave is a guess as good as any.
    if stop < 0.0 and answer[UPPER] == np.inf:
        guess(
            tree_a, root_a, T_a, tree_b, root_b, T_b, b_is_world,
            relation, scratch, answer,
        )  # fmt: skip
    approach(
        tree_a, 8 * root_a, T_a, tree_b, 8 * root_b, T_b, b_is_world,
        relation, scale, cutoff, stop, scratch, answer,
    )  # fmt: skip


@kernel
def nearest(  # type: ignore[no-untyped-def]
    nodes_a, corners_a, frames_a, nodes_b, corners_b, frames_b,
    pairs, placements_a, placements_b, b_moves, begin, end,
    depths, scale, cutoff, stop, answers,
):  # fmt: skip
    """Bounds for meshes whose surfaces do not meet; see `approach`.

    Arguments as in `query.search` and `approach`; placements are rigid. If `stop` ends
    a walk, LOWER says nothing. `answers` is (n, p, 6), one for every pair of meshes, or
    (n, 1, 6), the least of all pairs; it is filled from begin to end, and poses whose
    UPPER is 0 are left as they are.
    """
    room = room_for(depths)
    side_a, side_b = (
        side(nodes_a, corners_a, frames_a),
        side(nodes_b, corners_b, frames_b),
    )
    for i in range(begin, end):
        for k in range(len(pairs)):
            answer = answers[i, k if answers.shape[1] > 1 else 0]
            if answer[UPPER] == 0.0 or answer[UPPER] <= stop:
                continue
            before = answer[UPPER]
            narrow(
                side_a, pairs[k, 0], placements_a, i,
                side_b, pairs[k, 1], placements_b, i if b_moves else 0,
                room, scale, cutoff, stop, answer,
            )  # fmt: skip
            if answer[UPPER] < before:
                answer[PAIR] = k


@kernel
def nearest_points(corners_a, T_a, leaf_a, corners_b, T_b, leaf_b):  # type: ignore[no-untyped-def]
    """Distance and nearest points, in the world, of two leaves of placed trees."""
    alpha = place_triangle(T_a[0, 0], corners_a, leaf_a)
    beta = place_triangle(T_b[0, 0], corners_b, leaf_b)
    return disjoint_distance(alpha, beta)
