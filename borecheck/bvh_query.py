"""Which triangles of placed meshes meet: one walk through two trees for every pair.

The walk is a strict pre-filter: it only drops pairs whose boxes are surely apart, so
the pairs it finds are those of all pairs. At the leaves both triangles are placed in
the world and judged by one of the narrowphases.

One kernel serves one pair of meshes and many links in many poses alike. It is one
function because numba counts references at every inner call that takes arrays: done
for each link, that costs more than the walk.
"""

import numpy as np
from numba import njit

from borecheck.bvh_boxes import (
    INLINE,
    KERNEL,
    RELATION_SHAPE,
    ROOT,
    child_box,
    copy_placement,
    is_identity,
    is_rigid,
    keep_relation,
    motion_of,
    relate,
    roots_apart,
    set_probe,
    slack_of,
    undo,
)
from borecheck.bvh_build import CHILD_ROW, F32, WIDTH
from borecheck.bvh_lanes import PROBE_COLUMNS, overlap_mask
from borecheck.narrowphase import leaf
from borecheck.placing import place_triangle
from borecheck.triangle_contact import triangle_row

# What a walk is for: the first contact of a pose, all contacts, all meeting boxes.
FIRST, ALL, BOXES = 0, 1, 2
# What `hits` holds for a pose without contact.
NO_PAIR = -1
# Columns of what is found: pose, pair of meshes, leaf of a, leaf of b.
FOUND_COLUMNS = 4


@njit(**INLINE)
def stack_room(depths):  # type: ignore[no-untyped-def]
    """Entries a walk can need, from the depths of both trees together.

    Each opening takes one and leaves at most eight; eight more are written ahead.
    """
    return (WIDTH - 1) * depths + 2 * WIDTH


@njit(**INLINE)
def all_rigid(placements, i):  # type: ignore[no-untyped-def]
    """Whether every placement of pose i is a rigid transform."""
    rigid = True
    for j in range(placements.shape[1]):
        rigid &= is_rigid(placements, i, j)
    return rigid


@njit(**INLINE)
def keep_triangle(triangle, kept):  # type: ignore[no-untyped-def]
    """Writes a triangle into (1, 9): the next leaf of b often asks for it again."""
    for i in range(9):
        kept[0, i] = triangle[i]


@njit(**KERNEL)
def search(  # type: ignore[no-untyped-def]
    nodes_a, corners_a, frames_a, nodes_b, corners_b, frames_b,
    pairs, placements_a, placements_b, b_moves, begin, end,
    depths, code, task, inflate, hits, found,
):  # fmt: skip
    """Contacts of pairs of meshes, pose by pose.

    Args:
        nodes_a: Nodes of all trees a, see `packed_trees`.
        corners_a: Their triangles in the order of the leaves, (m, 9).
        frames_a: Their origins, sizes and first nodes, (k, 5).
        nodes_b: As nodes_a; may be the same arrays.
        corners_b: As corners_a.
        frames_b: As frames_a.
        pairs: Which a against which b, (p, 2).
        placements_a: (n, a, 4, 4).
        placements_b: (n, b, 4, 4), or (1, b, 4, 4) if they stand still.
        b_moves: Whether they do not.
        begin: First pose.
        end: Behind the last pose.
        depths: Of the deepest tree of either side, together.
        code: The narrowphase.
        task: FIRST, ALL or BOXES.
        inflate: For BOXES: boxes nearer than this count as meeting, [m].
        hits: (n,), the first pair in contact or NO_PAIR, filled from begin to end.
        found: (c, 4), filled as far as it goes: see FOUND_COLUMNS.

    Returns:
        Number of triangle pairs found (maybe more than fit), number examined, and the
        first pose with a placement that is not rigid, or -1.
    """
    children_a, children_b = nodes_a.view(np.int32), nodes_b.view(np.int32)
    relation = np.zeros(RELATION_SHAPE, F32)
    T_a, T_b = np.zeros((3, 4)), np.zeros((3, 4))
    stack = np.zeros((stack_room(depths), 2), np.int64)
    probe, kept = np.zeros(PROBE_COLUMNS, F32), np.zeros((1, 9))
    count, examined = 0, 0
    standing = -1
    if not b_moves and not all_rigid(placements_b, 0):
        return count, examined, 0
    for i in range(begin, end):
        if not (
            all_rigid(placements_a, i) and (not b_moves or all_rigid(placements_b, i))
        ):
            return count, examined, i
        hits[i] = NO_PAIR
        for k in range(len(pairs)):
            mesh_a, mesh_b = pairs[k, 0], pairs[k, 1]
            copy_placement(placements_a, i, mesh_a, T_a)
            motion_a = motion_of(T_a)
            if b_moves or mesh_b != standing:
                standing = mesh_b
                copy_placement(placements_b, i if b_moves else 0, mesh_b, T_b)
            motion_b = motion_of(T_b)
            b_is_world = is_identity(motion_b)
            M = relate(
                motion_a, motion_b, b_is_world, frames_a, mesh_a, frames_b, mesh_b
            )
            slack = slack_of(
                M, motion_a, motion_b, frames_a, mesh_a, frames_b, mesh_b, inflate
            )
            keep_relation(M, slack, 0, relation)
            root_a, root_b = int(frames_a[mesh_a, ROOT]), int(frames_b[mesh_b, ROOT])
            if roots_apart(nodes_a, root_a, nodes_b, root_b, relation):
                continue
            keep_relation(undo(M), slack, 1, relation)
            placed = -1
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
                            keep_triangle(place_triangle(T_a, corners_a, placed), kept)
                        alpha = triangle_row(kept, 0)
                        if b_is_world:
                            beta = triangle_row(corners_b, ~node_b)
                        else:
                            beta = place_triangle(T_b, corners_b, ~node_b)
                        if not leaf(code, alpha, beta):
                            continue
                    if count < len(found):
                        found[count, 0], found[count, 1] = i, k
                        found[count, 2], found[count, 3] = ~node_a, ~node_b
                    count += 1
                    if hits[i] == NO_PAIR:
                        hits[i] = k
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
                        for slot in range(WIDTH):
                            stack[top, 0], stack[top, 1] = a, 8 * node_b + slot
                            top += (mask >> slot) & 1
                else:
                    set_probe(box_b, relation, 1, probe)
                    mask = overlap_mask(nodes_a, node_a, probe)
                    if mask != 0:
                        for slot in range(WIDTH):
                            stack[top, 0], stack[top, 1] = 8 * node_a + slot, b
                            top += (mask >> slot) & 1
            if task == FIRST and hits[i] != NO_PAIR:
                break
    return count, examined, -1
