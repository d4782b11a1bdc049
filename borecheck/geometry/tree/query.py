"""Which triangles of placed meshes meet: one walk through two trees for every pair.

The walk is a strict pre-filter: it only drops pairs whose boxes are surely apart, so
the pairs it finds are those of all pairs. At the leaves both triangles are placed in
the world and judged by one of the narrowphases.

One kernel serves one pair of meshes and many links in many poses alike. It is one
function because numba counts references at every inner call that takes arrays: done
for each link, that costs more than the walk. Children are asked in the order of their
slots: the deepest overlap first needs no fewer visits and costs a fifth more.
"""

import math

import numpy as np
from numba.np.numpy_support import carray

from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.geometry.tree.addresses import DEPTH, SIDE, open_pairs, open_side
from borecheck.geometry.tree.boxes import (
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
from borecheck.geometry.tree.build import CHILD_ROW, WIDTH
from borecheck.geometry.tree.simd import PROBE_COLUMNS, local_memory, overlap_mask
from borecheck.geometry.triangles.narrowphase import leaf
from borecheck.geometry.triangles.placing import place_triangle
from borecheck.geometry.triangles.published import triangle_row

# What a walk is for: the first contact of a pose, all contacts, all meeting boxes.
FIRST, ALL, BOXES = 0, 1, 2
# What `hits` holds for a pose without contact.
NO_PAIR = -1
# Columns of what is found: pose, pair of meshes, leaf of a, leaf of b.
FOUND_COLUMNS = 4
# Bytes of what a walk keeps at hand.
_RELATION, _PROBE = 4 * math.prod(RELATION_SHAPE), 4 * PROBE_COLUMNS
_PLACEMENT, _TRIANGLE = 8 * 12, 8 * 9


@kernel(**INLINE)
def stack_room(depths):  # type: ignore[no-untyped-def]
    """Entries a walk can need, from the depths of both trees together.

    Each opening takes one and leaves at most eight; eight more are written ahead.
    """
    return (WIDTH - 1) * depths + 2 * WIDTH


@kernel(**INLINE)
def all_rigid(placements, i):  # type: ignore[no-untyped-def]
    """Whether every placement of pose i is a rigid transform."""
    rigid = True
    for j in range(placements.shape[1]):
        rigid &= is_rigid(placements, i, j)
    return rigid


@kernel(**INLINE)
def sort_pairs(found, begin, end):  # type: ignore[no-untyped-def]
    """Sorts the rows from begin to end by their last two columns (Shell's sort)."""
    gap = 1
    while 9 * gap < 4 * (end - begin):
        gap = 9 * gap // 4 + 1
    while gap > 0:
        for i in range(begin + gap, end):
            a, b = found[i, 2], found[i, 3]
            j = i
            while j >= begin + gap:
                c, d = found[j - gap, 2], found[j - gap, 3]
                if c < a or (c == a and d <= b):
                    break
                found[j, 2], found[j, 3] = c, d
                j -= gap
            found[j, 2], found[j, 3] = a, b
        gap = (4 * gap + 4) // 9


@kernel(**INLINE)
def keep_triangle(triangle, kept):  # type: ignore[no-untyped-def]
    """Writes a triangle into (1, 9): the next leaf of b often asks for it again."""
    for i in range(9):
        kept[0, i] = triangle[i]


@kernel
def search(  # type: ignore[no-untyped-def]
    book, placements_a, placements_b, b_moves, begin, end,
    code, task, inflate, hits, touches, found,
):  # fmt: skip
    """Contacts of pairs of meshes, pose by pose.

    Args:
        book: Trees and pairs, see `addresses.PairBook`.
        placements_a: (n, a, 4, 4).
        placements_b: (n, b, 4, 4), or (1, b, 4, 4) if they stand still.
        b_moves: Whether they do not.
        begin: First pose.
        end: Behind the last pose.
        code: The narrowphase.
        task: FIRST, ALL or BOXES.
        inflate: For BOXES: boxes nearer than this count as meeting, [m].
        hits: (n,), the first pair in contact or NO_PAIR, filled from begin to end; or
            empty if nobody asks.
        touches: (n,), whether there is one, bool; or empty.
        found: (c, 4), filled as far as it goes: see FOUND_COLUMNS. Leaves for FIRST,
            else original triangles, and sorted if all fit.

    Returns:
        Number of triangle pairs found (maybe more than fit), number examined, and the
        first pose with a placement that is not rigid, or -1; the hit of the last pose.
    """
    nodes_a, children_a, corners_a, order_a, frames_a = open_side(book, 0)
    nodes_b, children_b, corners_b, order_b, frames_b = open_side(book, SIDE)
    pairs = open_pairs(book)
    relation = carray(local_memory(_RELATION), RELATION_SHAPE, np.float32)
    probe = carray(local_memory(_PROBE), (PROBE_COLUMNS,), np.float32)
    T_a = carray(local_memory(_PLACEMENT), (3, 4), np.float64)
    T_b = carray(local_memory(_PLACEMENT), (3, 4), np.float64)
    kept = carray(local_memory(_TRIANGLE), (1, 9), np.float64)
    stack = np.empty((stack_room(book[DEPTH] + book[SIDE + DEPTH]), 2), np.int64)
    count, examined = 0, 0
    hit, standing = NO_PAIR, -1
    if not b_moves and not all_rigid(placements_b, 0):
        return count, examined, 0, hit
    for i in range(begin, end):
        if not (
            all_rigid(placements_a, i) and (not b_moves or all_rigid(placements_b, i))
        ):
            return count, examined, i, hit
        hit = NO_PAIR
        for k in range(len(pairs)):
            before = count
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
                    if hit == NO_PAIR:
                        hit = k
                    if count < len(found):
                        found[count, 0], found[count, 1] = i, k
                        found[count, 2], found[count, 3] = ~node_a, ~node_b
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
            if task == FIRST:
                if hit != NO_PAIR:
                    break
            elif before < count <= len(found):
                for row in range(before, count):
                    found[row, 2] = order_a[found[row, 2]]
                    found[row, 3] = order_b[found[row, 3]]
                sort_pairs(found, before, count)
        if len(hits) > 0:
            hits[i] = hit
        if len(touches) > 0:
            touches[i] = hit != NO_PAIR
    return count, examined, -1, hit
