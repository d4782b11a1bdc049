"""Which triangles of two placed meshes meet: one walk through both trees.

The walk is a strict pre-filter: it only drops pairs whose boxes are surely apart, so
the pairs it finds are those of all pairs. At the leaves both triangles are placed in
the world and judged by one of the narrowphases.
"""

import numpy as np
from numba import njit

from borecheck.bvh_boxes import (
    INLINE,
    KERNEL,
    PAIR_SHAPE,
    PLACE_A,
    PLACE_B,
    RELATION_SHAPE,
    child_box,
    copy_placement,
    is_identity,
    is_rigid,
    mark_overlaps,
    relate,
    relate_back,
    roots_apart,
)
from borecheck.bvh_build import CHILD_ROW, F32, WIDTH
from borecheck.narrowphase import leaf
from borecheck.placing import place_triangle
from borecheck.triangle_contact import triangle_row

# What a walk is for: is there a contact, all contacts, all pairs of meeting boxes.
FIRST, ALL, BOXES = 0, 1, 2
# Counts that are none: the placement of a or b is not rigid.
BAD_A, BAD_B = -1, -2

_NO_TRIANGLE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_FIRST_CAPACITY = 64


@njit(**INLINE)
def walk(  # type: ignore[no-untyped-def]
    nodes_a,
    corners_a,
    root_a,
    nodes_b,
    corners_b,
    root_b,
    pair,
    b_is_world,
    relation,
    code,
    task,
    stack,
    flags,
    found,
):
    """One mesh against another, their relation given.

    Args:
        nodes_a: Tree nodes of a (a pool may hold several trees).
        corners_a: Triangles of a in the order of its leaves, (m, 9).
        root_a: Node 0 of the tree of a in its pool.
        nodes_b: Tree nodes of b.
        corners_b: Triangles of b.
        root_b: Node 0 of the tree of b.
        pair: Placements of both, see `borecheck.bvh_boxes`.
        b_is_world: Whether the placement of b is the identity.
        relation: Both rows filled.
        code: The narrowphase.
        task: FIRST, ALL or BOXES.
        stack: (k, 2) int64, deep enough for both trees.
        flags: (8,) uint8 scratch.
        found: (k, 2) int64, grown when full.

    Returns:
        Number of pairs found, number of leaf pairs examined, pairs of leaves.
    """
    children_a, children_b = nodes_a.view(np.int32), nodes_b.view(np.int32)
    any_flag = flags.view(np.uint64)
    T_a, T_b = pair[PLACE_A], pair[PLACE_B]
    placed, alpha = -1, _NO_TRIANGLE
    count, examined = 0, 0
    stack[0, 0], stack[0, 1] = 8 * root_a, 8 * root_b
    top = 1
    while top > 0:
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        node_a = int(children_a[a >> 3, CHILD_ROW, a & 7])
        node_b = int(children_b[b >> 3, CHILD_ROW, b & 7])
        if node_a < 0 and node_b < 0:
            examined += 1
            if task != BOXES:
                if placed != ~node_a:
                    placed = ~node_a
                    alpha = place_triangle(T_a, corners_a, placed)
                if b_is_world:
                    beta = triangle_row(corners_b, ~node_b)
                else:
                    beta = place_triangle(T_b, corners_b, ~node_b)
                if not leaf(code, alpha, beta):
                    continue
            if count == len(found):
                found = _grown(found)
            found[count, 0], found[count, 1] = ~node_a, ~node_b
            count += 1
            if task == FIRST:
                break
            continue
        box_a, box_b = child_box(nodes_a, a), child_box(nodes_b, b)
        size_a = max(box_a[3], max(box_a[4], box_a[5]))
        size_b = max(box_b[3], max(box_b[4], box_b[5]))
        # The larger box is opened; a triangle cannot be.
        if node_a < 0 or (node_b >= 0 and size_b >= size_a):
            mark_overlaps(nodes_b, node_b, box_a, relation, 0, flags)
            if any_flag[0] != 0:
                for i in range(WIDTH):
                    stack[top, 0], stack[top, 1] = a, 8 * node_b + i
                    top += flags[i]
        else:
            mark_overlaps(nodes_a, node_a, box_b, relation, 1, flags)
            if any_flag[0] != 0:
                for i in range(WIDTH):
                    stack[top, 0], stack[top, 1] = 8 * node_a + i, b
                    top += flags[i]
    return count, examined, found


@njit(**KERNEL)
def _grown(found):  # type: ignore[no-untyped-def]
    larger = np.zeros((2 * len(found), 2), np.int64)
    larger[: len(found)] = found
    return larger


@njit(**INLINE)
def stack_room(depth_a, depth_b):  # type: ignore[no-untyped-def]
    """Entries a walk can need: each opening takes one and leaves at most eight."""
    return (WIDTH - 1) * (depth_a + depth_b) + 2 * WIDTH


@njit(**KERNEL)
def search(  # type: ignore[no-untyped-def]
    nodes_a,
    corners_a,
    frame_a,
    T_a,
    nodes_b,
    corners_b,
    frame_b,
    T_b,
    depths,
    code,
    task,
    inflate,
):
    """Two single trees; see `walk` for arguments and results."""
    pair = np.zeros(PAIR_SHAPE)
    relation = np.zeros(RELATION_SHAPE, F32)
    found = np.zeros((_FIRST_CAPACITY, 2), np.int64)
    if not is_rigid(T_a):
        return BAD_A, 0, found
    if not is_rigid(T_b):
        return BAD_B, 0, found
    copy_placement(T_a, pair, PLACE_A)
    copy_placement(T_b, pair, PLACE_B)
    b_is_world = is_identity(T_b)
    relate(pair, b_is_world, frame_a, frame_b, inflate, relation)
    if roots_apart(nodes_a, 0, nodes_b, 0, relation):
        return 0, 0, found
    relate_back(pair, relation)
    stack = np.zeros((stack_room(depths, 0), 2), np.int64)
    flags = np.zeros(WIDTH, np.uint8)
    return walk(
        nodes_a, corners_a, 0, nodes_b, corners_b, 0,
        pair, b_is_world, relation, code, task, stack, flags, found,
    )  # fmt: skip
