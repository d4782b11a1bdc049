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
    RELATION_SHAPE,
    child_box,
    is_identity,
    is_rigid,
    relate,
    relate_back,
    roots_apart,
    set_probe,
)
from borecheck.bvh_build import CHILD_ROW, F32, WIDTH
from borecheck.bvh_lanes import PROBE_COLUMNS, overlap_mask
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
    tree_a, root_a, T_a, tree_b, root_b, T_b, b_is_world,
    relation, code, task, stack, probe, found,
):  # fmt: skip
    """One mesh against another, their relation given.

    Args:
        tree_a: Nodes of a, their int32 view, and corners (m, 9) in the order of the
            leaves. The arrays may hold several trees.
        root_a: Node 0 of the tree of a.
        T_a: Placement of a.
        tree_b: As tree_a.
        root_b: Node 0 of the tree of b.
        T_b: Placement of b.
        b_is_world: Whether that is the identity.
        relation: Both rows filled, see `bvh_boxes`.
        code: The narrowphase.
        task: FIRST, ALL or BOXES.
        stack: (k, 2) int64, deep enough for both trees.
        probe: (19,) float32 scratch.
        found: (k, 2) int64, grown when full.

    Returns:
        Number of pairs found, number of leaf pairs examined, pairs of leaves.
    """
    nodes_a, children_a, corners_a = tree_a
    nodes_b, children_b, corners_b = tree_b
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
            set_probe(box_a, relation, 0, probe)
            mask = overlap_mask(nodes_b, node_b, probe)
            if mask != 0:
                for i in range(WIDTH):
                    stack[top, 0], stack[top, 1] = a, 8 * node_b + i
                    top += (mask >> i) & 1
        else:
            set_probe(box_b, relation, 1, probe)
            mask = overlap_mask(nodes_a, node_a, probe)
            if mask != 0:
                for i in range(WIDTH):
                    stack[top, 0], stack[top, 1] = 8 * node_a + i, b
                    top += (mask >> i) & 1
    return count, examined, found


@njit(**KERNEL)
def _grown(found):  # type: ignore[no-untyped-def]
    larger = np.zeros((2 * len(found), 2), np.int64)
    larger[: len(found)] = found
    return larger


@njit(**INLINE)
def stack_room(depths):  # type: ignore[no-untyped-def]
    """Entries a walk can need, from the depths of both trees together.

    Each opening takes one and leaves at most eight; eight more are written ahead.
    """
    return (WIDTH - 1) * depths + 2 * WIDTH


@njit(**KERNEL)
def search(  # type: ignore[no-untyped-def]
    nodes_a, corners_a, frame_a, T_a, nodes_b, corners_b, frame_b, T_b,
    depths, code, task, inflate,
):  # fmt: skip
    """Two single trees; see `walk` for arguments and results."""
    found = np.zeros((_FIRST_CAPACITY, 2), np.int64)
    if not is_rigid(T_a):
        return BAD_A, 0, found
    if not is_rigid(T_b):
        return BAD_B, 0, found
    pair, relation = np.zeros(PAIR_SHAPE), np.zeros(RELATION_SHAPE, F32)
    b_is_world = is_identity(T_b)
    relate(T_a, T_b, b_is_world, frame_a, 0, frame_b, 0, inflate, pair, relation)
    if roots_apart(nodes_a, 0, nodes_b, 0, relation):
        return 0, 0, found
    relate_back(pair, relation)
    stack = np.zeros((stack_room(depths), 2), np.int64)
    probe = np.zeros(PROBE_COLUMNS, F32)
    tree_a = (nodes_a, nodes_a.view(np.int32), corners_a)
    tree_b = (nodes_b, nodes_b.view(np.int32), corners_b)
    return walk(
        tree_a, 0, T_a, tree_b, 0, T_b, b_is_world,
        relation, code, task, stack, probe, found,
    )  # fmt: skip
