"""How often a closed surface winds round a point, along a ray, with exact signs.

A ray is followed along +x and its crossings are counted with their direction; their
sum is the winding number. A ray through an edge or a corner is decided as if it were
shifted by an infinitely small step along y and an infinitely smaller one along z: no
second try, no tolerance. A ray that crosses nothing is worth more than a sum of 0: its
start is joined to infinity, so no surface is around it, however it was drawn.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.exact import exact_pair
from borecheck.geometry.triangles.exact_sign import (
    Point,
    corners_of,
    orientation_2d,
    orientation_3d,
)
from borecheck.geometry.triangles.placing import Triangle
from borecheck.geometry.triangles.published import triangle_row

ON_SURFACE = -(2**62)

# Axes in turn: the ray along x of what these orders show is that along y, then z.
_ORDERS = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


def escapes(point: NDArray[np.float64], corners: NDArray[np.float64]) -> bool:
    """Whether a ray along one of six directions leaves a point and crosses nothing.

    Args:
        point: Where, (3,) [m]; not on a triangle.
        corners: Triangles, (m, 3, 3).
    """
    for order in _ORDERS:
        for sign in (1.0, -1.0):
            x, y, z = (sign * point[list(order)]).tolist()
            seen = np.ascontiguousarray(sign * corners[:, :, order]).reshape(-1, 9)
            if crossings((x, y, z), seen)[1] == 0:
                return True
    return False


@kernel
def crossings(p: Point, corners: NDArray[np.float64]) -> tuple[int, int]:
    """Winding number of triangles (m, 9) round p, and how many the ray crosses.

    The first is ON_SURFACE if p is on a triangle.
    """
    winding, count = 0, 0
    for k in range(len(corners)):
        if _beside(p, corners, k):
            continue
        turn = crossing_at(p, triangle_row(corners, k))
        if turn == ON_SURFACE:
            return ON_SURFACE, count
        winding += turn
        count += abs(turn)
    return winding, count


@kernel
def crossing_at(p: Point, triangle: Triangle) -> int:
    """+1 or -1 if the ray from p crosses a triangle, or 0; ON_SURFACE: p is on it."""
    x, y, z = p
    if exact_pair((x, y, z, x, y, z, x, y, z), triangle):
        return ON_SURFACE
    a, b, c = corners_of(triangle)
    return _crossing(p, a, b, c)


@kernel
def crossings_by_component(
    p: Point,
    corners: NDArray[np.float64],
    component: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """As `crossings` of every component by itself; p is on no triangle."""
    parts = component.max() + 1
    winding, count = np.zeros(parts, np.int64), np.zeros(parts, np.int64)
    for k in range(len(corners)):
        if _beside(p, corners, k):
            continue
        t1, t2, t3 = corners_of(triangle_row(corners, k))
        turn = _crossing(p, t1, t2, t3)
        winding[component[k]] += turn
        count[component[k]] += abs(turn)
    return winding, count


@kernel(inline="always")
def _beside(p: Point, corners: NDArray[np.float64], k: int) -> bool:
    """Whether the box of triangle k is beside the ray or behind it."""
    x, y, z = p
    y1, y2, y3 = corners[k, 1], corners[k, 4], corners[k, 7]
    if (y1 < y and y2 < y and y3 < y) or (y1 > y and y2 > y and y3 > y):
        return True
    z1, z2, z3 = corners[k, 2], corners[k, 5], corners[k, 8]
    if (z1 < z and z2 < z and z3 < z) or (z1 > z and z2 > z and z3 > z):
        return True
    return corners[k, 0] < x and corners[k, 3] < x and corners[k, 6] < x


@kernel
def _turn(p: Point, u: Point, v: Point) -> int:
    """How u, v turn round p seen along -x, with p shifted by (e, e^2) along y and z.

    The area is linear in p. Where it is 0, the sign of its derivative along y decides,
    then along z; both are differences of coordinates. 0 only if u and v coincide.
    """
    sign = orientation_2d((u[1], u[2]), (v[1], v[2]), (p[1], p[2]))
    if sign != 0:
        return sign
    if u[2] != v[2]:
        return 1 if u[2] > v[2] else -1
    if u[1] != v[1]:
        return 1 if v[1] > u[1] else -1
    return 0


@kernel
def _crossing(p: Point, a: Point, b: Point, c: Point) -> int:
    """+1 or -1 if the shifted ray from p along +x crosses a, b, c; p is not on it.

    The sign tells from which side: along +x out of a surface that points outward is +1.
    """
    turn = _turn(p, a, b)
    if turn == 0 or _turn(p, b, c) != turn or _turn(p, c, a) != turn:
        return 0
    # The normal has the sign of `turn` along x. The ray still has the plane before
    # it if p is behind a triangle that faces +x, or in front of one that faces -x.
    return turn if orientation_3d(a, b, c, p) == turn else 0
