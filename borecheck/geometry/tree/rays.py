"""How often a placed surface winds round a point, asked through its tree.

What `triangles.winding.crossings` finds of all placed triangles, by the same exact
signs; only boxes that the ray along +x may meet are opened.

Boxes are given a slack of 2**-20 of all lengths that the comparison is made of: more
than what float32 boxes, the turned centre and the placing of corners are off by
together (`tree.boxes`: 32 u of the sizes, with u = 2**-24).
"""

import numpy as np

from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.geometry.tree.boxes import EXTENT, ROOT, motion_of, turn
from borecheck.geometry.tree.build import CHILD_ROW, WIDTH
from borecheck.geometry.triangles.placing import place_triangle
from borecheck.geometry.triangles.published import triangle_row
from borecheck.geometry.triangles.winding import ON_SURFACE, crossing_at

_SLACK = 2.0**-20


@kernel(**INLINE)
def _beside(p, triangle):  # type: ignore[no-untyped-def]
    """Whether the box of a triangle is beside the ray from p along +x, or behind it."""
    x, y, z = p
    y1, y2, y3 = triangle[1], triangle[4], triangle[7]
    z1, z2, z3 = triangle[2], triangle[5], triangle[8]
    beside = (y1 < y) & (y2 < y) & (y3 < y) | (y1 > y) & (y2 > y) & (y3 > y)
    beside |= (z1 < z) & (z2 < z) & (z3 < z) | (z1 > z) & (z2 > z) & (z3 > z)
    return beside | (triangle[0] < x) & (triangle[3] < x) & (triangle[6] < x)


@kernel(**INLINE)
def _box_beside(nodes, node, slot, M, is_world, q, slack):  # type: ignore[no-untyped-def]
    """The same of a box of the tree; q is the point seen from the tree's origin."""
    cx, cy, cz = nodes[node, 0, slot], nodes[node, 1, slot], nodes[node, 2, slot]
    hx, hy, hz = nodes[node, 3, slot], nodes[node, 4, slot], nodes[node, 5, slot]
    if hx < 0.0:
        return True  # an unused slot
    if not is_world:
        cx, cy, cz = turn(M, cx, cy, cz)
        hx, hy, hz = (
            abs(M[0]) * hx + abs(M[1]) * hy + abs(M[2]) * hz,
            abs(M[3]) * hx + abs(M[4]) * hy + abs(M[5]) * hz,
            abs(M[6]) * hx + abs(M[7]) * hy + abs(M[8]) * hz,
        )
    beside = (abs(q[1] - cy) > hy + slack) | (abs(q[2] - cz) > hz + slack)
    return beside | (q[0] - cx > hx + slack)


@kernel
def placed_crossings(  # type: ignore[no-untyped-def]
    p, nodes, children, corners, frames, mesh, T, M, is_world, stack
):
    """Winding number of a placed tree round p, and how many triangles the ray crosses.

    Args:
        p: Where, in the world; three numbers.
        nodes: Of packed trees.
        children: The same memory as int32.
        corners: Triangles of the leaves, (m, 9).
        frames: Of the trees, (k, 5).
        mesh: Which tree.
        T: Its placement, (3, 4).
        M: The same as twelve numbers.
        is_world: Whether that is the identity.
        stack: Room for 8 (depth + 2) numbers.

    Returns:
        ON_SURFACE in place of the first if p is on a triangle.
    """
    ox, oy, oz = frames[mesh, 0], frames[mesh, 1], frames[mesh, 2]
    reach = abs(ox) + abs(oy) + abs(oz) + abs(M[9]) + abs(M[10]) + abs(M[11])
    if not is_world:
        ox, oy, oz = turn(M, ox, oy, oz)
        ox, oy, oz = ox + M[9], oy + M[10], oz + M[11]
    q = (p[0] - ox, p[1] - oy, p[2] - oz)
    size = frames[mesh, EXTENT] + abs(q[0]) + abs(q[1]) + abs(q[2])
    slack = _SLACK * size + 1e-12 * reach
    winding, count = 0, 0
    stack[0] = int(frames[mesh, ROOT])
    top = 1
    while top > 0:
        top -= 1
        node = stack[top]
        for slot in range(WIDTH):
            if _box_beside(nodes, node, slot, M, is_world, q, slack):
                continue
            child = int(children[node, CHILD_ROW, slot])
            if child >= 0:
                stack[top] = child
                top += 1
                continue
            if is_world:
                triangle = triangle_row(corners, ~child)
            else:
                triangle = place_triangle(T, corners, ~child)
            if _beside(p, triangle):
                continue
            crossed = crossing_at(p, triangle)
            if crossed == ON_SURFACE:
                return ON_SURFACE, count
            winding += crossed
            count += abs(crossed)
    return winding, count


@kernel
def windings(points, nodes, frames, depth, corners):  # type: ignore[no-untyped-def]
    """Winding number of one tree, where it is, round each of points (n, 3), (n,).

    ON_SURFACE of points on a triangle.
    """
    found = np.empty(len(points), np.int64)
    children, stack = nodes.view(np.int32), np.empty(WIDTH * (depth + 2), np.int64)
    T = np.zeros((3, 4))
    for d in range(3):
        T[d, d] = 1.0
    for k in range(len(points)):
        p = (points[k, 0], points[k, 1], points[k, 2])
        found[k], _ = placed_crossings(
            p, nodes, children, corners, frames, 0, T, motion_of(T), True, stack
        )
    return found
