"""The compiled core of the path search: one pair of surfaces over the whole motion.

A *piece* is a run of waypoint steps, or a fraction of one step. A run is treated as if
the joints moved straight from its first waypoint to its last; how far the waypoints
between are off that line is its *bend* and widens the chord bound, so densely sampled
motions cost as little as coarse ones.

Rows of an array of *findings* are (from, to, outcome), times in units of waypoints.
"""

import numpy as np

from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.geometry.tree.build import F32, WIDTH
from borecheck.motion.bound_kernels import bend_of_run, gains, slack_and_motion
from borecheck.motion.swept_boxes import (
    CLEAR,
    OPEN,
    PLACE,
    POSE,
    ROUNDING,
    ROW,
    SLACK,
    SWEEP,
    box_rounding,
    span,
    walk,
    write_row,
)
from borecheck.robots.kinematics.forward import WORLD, place_all

# What is known of a stretch: proven clear, holds contact, neither could be shown.
CERTIFIED, TOUCHED, UNDECIDED = 0, 1, 2

# Nodes opened for a piece before it is halved: few for long pieces, whose halves need
# fewer still, twice as many for every halving.
FIRST_BUDGET, LAST_BUDGET = 64, 8192
_NO_LIMIT = 1 << 62
_ASK_BELOW = 8.0
_DEPTH = 128  # of halving: 20 for a million waypoints, 50 until fractions end
# Bounds are formed with some hundred roundings and lengths in the frame of a body
# differ from those in the world by what `check_transform` lets pass.
_GENEROUS = 1.0 + 1e-5


@kernel(**INLINE)
def _copy(source, target):  # type: ignore[no-untyped-def]
    for i in range(4):
        for j in range(4):
            target[i, j] = source[i, j]


@kernel(**INLINE)
def relative(T_a, T_b, T_b_a):  # type: ignore[no-untyped-def]
    """T_b_a = inverse(T_b) T_a for rigid transforms."""
    for i in range(3):
        x, y, z = T_b[0, i], T_b[1, i], T_b[2, i]
        for j in range(3):
            T_b_a[i, j] = x * T_a[0, j] + y * T_a[1, j] + z * T_a[2, j]
        T_b_a[i, 3] = (
            x * (T_a[0, 3] - T_b[0, 3])
            + y * (T_a[1, 3] - T_b[1, 3])
            + z * (T_a[2, 3] - T_b[2, 3])
        )


@kernel(**INLINE)
def _apply(undo, T_a, T_b_a):  # type: ignore[no-untyped-def]
    """T_b_a = undo * T_a, where undo inverts a fixed placement."""
    for i in range(3):
        x, y, z = undo[i, 0], undo[i, 1], undo[i, 2]
        for j in range(4):
            T_b_a[i, j] = x * T_a[0, j] + y * T_a[1, j] + z * T_a[2, j]
        T_b_a[i, 3] += undo[i, 3]


@kernel(**INLINE)
def _at(theta, first, last, fraction, values):  # type: ignore[no-untyped-def]
    """Joint values between two waypoints; both ends are met exactly."""
    for j in range(len(values)):
        p, q = theta[first, j], theta[last, j]
        values[j] = q if fraction == 1.0 else p + fraction * (q - p)


# Thirty arguments: with them in five NamedTuples a call takes 7.4 us instead of 3.5, as
# long as most pairs of a short edge take in all.
@kernel
def examine(  # type: ignore[no-untyped-def]
    theta, parent, kind, parts, length, joints, forward, radius, largest,
    a, b, undo, T_world_b, margin, resolution, contact_length, limit,
    nodes_a, corners_a, frame_a, nodes_b, corners_b, frame_b, depths,
    placed, is_placed, bends, has_bend, settled, findings,
):  # fmt: skip
    """One pair over the whole motion, halved in time as far as needed.

    Args:
        theta: Joint values at the waypoints, (k, n).
        parent: The chain (`JointChain`), with kind, parts and length.
        kind: (n,).
        parts: (n, 3, 3, 4).
        length: Length of every joint's fixed offset, (n,), [m].
        joints: The route from b to a, with forward.
        forward: See `motion.bounds.Route`.
        radius: Largest distance of a's vertices from its frame's origin, [m].
        largest: Largest |theta| of every joint on the path, (n,).
        a: Frame of the moving mesh.
        b: Frame of the standing mesh, or WORLD.
        undo: Inverse of T_world_b, (4, 4).
        T_world_b: Placement of the standing mesh if b is WORLD, (4, 4).
        margin: As near as this counts as contact, [m].
        resolution: Pieces with less motion are not halved, [m].
        contact_length: Nor pieces with contact at both ends and less motion, [m].
        limit: Pieces looked at before the rest is left undecided.
        nodes_a: Tree of the moving mesh, with corners and frame, see `MeshTree`.
        corners_a: (m, 9).
        frame_a: Origin of its boxes and its largest coordinate, (4,).
        nodes_b: Tree of the standing mesh.
        corners_b: (m, 9).
        frame_b: (4,).
        depths: Sum of both depths.
        placed: Memory of placements at waypoints, (k, n, 4, 4), shared by all pairs.
        is_placed: Which are there, (k,).
        bends: Memory of bends of runs, (2^x, n), shared by all pairs.
        has_bend: Which are there.
        settled: Stretches known to hold contact, (s, 2): not looked at.
        findings: (f, 3), grown. Stretches that are clear are not listed.

    Returns:
        Findings, how many, pieces looked at, poses judged exactly.
    """
    gain = gains(joints, forward, kind, length, radius, largest)
    stack = np.zeros((WIDTH * (depths + 2), 2), np.int64)
    boxes = np.zeros((len(stack), 6), F32)
    images, flags = np.zeros((6, WIDTH), F32), np.zeros(WIDTH, np.uint8)
    interval, ends = np.zeros((3, ROW), F32), np.zeros((2, 3, 4))
    rows = np.zeros((2, ROW), F32)
    own, places = np.zeros((2, len(parent), 4, 4)), np.zeros((2, 4, 4))
    _copy(T_world_b, places[1])
    values = np.zeros((2, len(parent)))
    straight = np.zeros(len(parent))
    # Of every waiting piece: first and last waypoint, place in the tree of runs and
    # budget; fractions of its step; is there contact at its ends (-1: not asked).
    pieces = np.zeros((_DEPTH, 4), np.int64)
    fractions, at = np.zeros((_DEPTH, 2)), np.zeros((_DEPTH, 2), np.int8)
    pieces[0, 1], pieces[0, 2], pieces[0, 3] = len(theta) - 1, 1, FIRST_BUDGET
    fractions[0, 1] = 1.0
    at[0, 0], at[0, 1] = -1, -1
    waiting, found, looked, judged = 1, 0, 0, 0
    memory_time, memory_touch = -1.0, -1
    while waiting > 0:
        waiting -= 1
        first, last, node = pieces[waiting, 0], pieces[waiting, 1], pieces[waiting, 2]
        budget = pieces[waiting, 3]
        begin, end = fractions[waiting, 0], fractions[waiting, 1]
        touch_0, touch_1 = at[waiting, 0], at[waiting, 1]
        is_run = last - first > 1
        time_0 = float(first) if is_run else first + begin
        time_1 = float(last) if is_run or end == 1.0 else first + end
        if _is_settled(settled, time_0, time_1):
            continue
        looked += 1
        bend = straight
        if is_run:
            if not has_bend[node]:
                bend_of_run(theta, first, last, bends[node])
                has_bend[node] = True
            bend = bends[node]
        _at(theta, first, last, begin, values[0])
        _at(theta, first, last, end, values[1])
        slack, motion = slack_and_motion(values[0], values[1], bend, joints, kind, gain)
        for side in range(2):
            waypoint = first if side == 0 else last
            if (begin if side == 0 else 1.0 - end) == 0.0:
                if not is_placed[waypoint]:
                    place_all(theta[waypoint], parent, kind, parts, placed[waypoint])
                    is_placed[waypoint] = True
                _copy(placed[waypoint, a], own[side, a])
                if b != WORLD:
                    _copy(placed[waypoint, b], own[side, b])
            else:
                place_all(values[side], parent, kind, parts, own[side])
            _seen_from(b, undo, own[side], a, ends[side])
            write_row(ends[side], frame_a, frame_b, rows[side])
        if touch_0 < 1 and touch_1 < 1 and looked <= limit:
            reserve = (margin + slack) * _GENEROUS + ROUNDING
            _order(rows, reserve, frame_a, frame_b)
            span(rows[0], rows[1], interval)
            outcome = walk(
                nodes_a, corners_a, nodes_b, corners_b, interval, SWEEP, ends, places,
                reserve, budget, stack, boxes, images, flags,
            )  # fmt: skip
            if outcome == CLEAR:
                continue
        outcome = UNDECIDED
        if looked <= limit:
            # Of long pieces the ends are not asked: it would not spare their halves.
            asked = 2 if motion <= _ASK_BELOW * contact_length else 0
            for side in range(asked):
                time = time_0 if side == 0 else time_1
                touch = touch_0 if side == 0 else touch_1
                if touch < 0 and time == memory_time:
                    touch = memory_touch
                elif touch < 0:
                    _copy(own[side, a], places[0])
                    if b != WORLD:
                        _copy(own[side, b], places[1])
                    write_row(ends[side], frame_a, frame_b, rows[0])
                    rows[1] = rows[0]
                    _order(rows, margin * _GENEROUS + ROUNDING, frame_a, frame_b)
                    span(rows[0], rows[1], interval)
                    met = walk(
                        nodes_a, corners_a, nodes_b, corners_b, interval, POSE, ends,
                        places, margin, _NO_LIMIT, stack, boxes, images, flags,
                    )  # fmt: skip
                    touch = 1 if met == OPEN else 0
                    judged += 1
                    memory_time, memory_touch = time, touch
                if side == 0:
                    touch_0 = touch
                else:
                    touch_1 = touch
            both, one = touch_0 == 1 and touch_1 == 1, touch_0 == 1 or touch_1 == 1
            small = motion <= resolution or waiting + 2 > _DEPTH
            middle = 0.5 * (begin + end)
            # Fractions end where no number lies between them.
            small |= not is_run and (middle in (begin, end))
            if (both and motion <= contact_length) or (small and one):
                outcome = TOUCHED
            elif not small:
                at[waiting, 0], at[waiting, 1] = touch_0, touch_1
                _halve(pieces, fractions, at, waiting)
                waiting += 2
                continue
        if found == len(findings):
            findings = np.concatenate((findings, np.zeros_like(findings)))
        findings[found, 0], findings[found, 1] = time_0, time_1
        findings[found, 2] = outcome
        found += 1
    return findings, found, looked, judged


@kernel(**INLINE)
def _seen_from(b, undo, placed, a, T_b_a):  # type: ignore[no-untyped-def]
    """The placement of the moving mesh in the frame of the standing one."""
    if b == WORLD:
        _apply(undo, placed[a], T_b_a)
    else:
        relative(placed[a], placed[b], T_b_a)


@kernel(**INLINE)
def _halve(pieces, fractions, at, k):  # type: ignore[no-untyped-def]
    """Replaces a waiting piece, the last, by its halves: the later one first."""
    first, last, node = pieces[k, 0], pieces[k, 1], pieces[k, 2]
    budget = min(2 * pieces[k, 3], LAST_BUDGET)
    begin, end = fractions[k, 0], fractions[k, 1]
    touch_0, touch_1 = at[k, 0], at[k, 1]
    for half in (1, 0):
        row = k + 1 - half
        pieces[row, 0], pieces[row, 1], pieces[row, 2] = first, last, 2 * node + half
        pieces[row, 3] = budget
        fractions[row, 0], fractions[row, 1] = begin, end
        if last - first > 1:
            pieces[row, 1 - half] = (first + last) // 2
        else:
            fractions[row, 1 - half] = 0.5 * (begin + end)
        at[row, 0] = -1 if half == 1 else touch_0
        at[row, 1] = touch_1 if half == 1 else -1


@kernel(**INLINE)
def _is_settled(settled, start, end):  # type: ignore[no-untyped-def]
    for k in range(len(settled)):
        if settled[k, 0] <= start and end <= settled[k, 1]:
            return True
    return False


@kernel(**INLINE)
def _order(rows, reserve, frame_a, frame_b):  # type: ignore[no-untyped-def]
    """Orders two rows into least and largest, and sets the slack."""
    places = F32(0.0)
    for i in range(PLACE, SLACK):
        places = max(places, max(abs(rows[0, i]), abs(rows[1, i])))
    for i in range(ROW):
        first, last = rows[0, i], rows[1, i]
        rows[0, i], rows[1, i] = min(first, last), max(first, last)
    rounding = box_rounding(frame_a, frame_b, float(places))
    # The factor is more than the rounding to float32.
    rows[1, SLACK] = F32((reserve + rounding) * 1.000001)
