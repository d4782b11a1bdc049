"""Triangle contact in floating point, both ways round.

Touching and coplanar triangles get a defined answer. It rounds; `triangles.exact` is
the judge.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.placing import Triangle
from borecheck.geometry.triangles.published import triangle_row, triangle_rows
from borecheck.geometry.triangles.vectors import Point, cross, dot, minus


def two_sided(alpha: ArrayLike, beta: ArrayLike) -> NDArray[np.bool_]:
    """Whether two closed triangles meet, in floating point, pair by pair.

    The published test both ways round with "or equal": touching counts, and triangles
    whose plane values are all exactly 0 are compared in the plane. Signs are rounded
    ones, so within about 1e-15 of the triangles' size either answer may come. A
    zero-area triangle is a segment or a point to the other one; two zero-area
    triangles are never in contact here.

    Args:
        alpha: Triangles, (n, 3, 3): pair, corner, coordinate [m].
        beta: Triangles, (n, 3, 3), in the same frame.

    Returns:
        Contact, (n,) bool.

    Raises:
        GeometryError: Shapes that do not match, or a number that is not finite.
    """
    a, b = triangle_rows(alpha, beta)
    return _two_sided_rows(a, b)


@kernel
def _one_side(x: float, y: float, z: float) -> bool:
    return (x > 0.0 and y > 0.0 and z > 0.0) or (x < 0.0 and y < 0.0 and z < 0.0)


@kernel
def _no_opposites(x: float, y: float, z: float) -> bool:
    return (x >= 0.0 and y >= 0.0 and z >= 0.0) or (x <= 0.0 and y <= 0.0 and z <= 0.0)


@kernel
def _edge_meets(
    f1: float, f2: float, p: Point, q: Point, a1: Point, a2: Point, a3: Point
) -> bool:
    """Edge p-q, with plane values f1 and f2, meets the closed triangle a.

    An edge that lies in the plane is left to the edges beside it and to the test
    the other way round, which see the same contact.
    """
    if not ((f1 <= 0.0 <= f2) or (f2 <= 0.0 <= f1)) or (f1 == 0.0 and f2 == 0.0):
        return False
    d = minus(q, p)
    u, v, w = minus(a1, p), minus(a2, p), minus(a3, p)
    return _no_opposites(dot(d, cross(u, v)), dot(d, cross(v, w)), dot(d, cross(w, u)))


@kernel
def two_sided_pair(a: Triangle, b: Triangle) -> bool:
    """Floating-point test of two closed triangles; `two_sided` says what it answers."""
    a1, a2, a3 = (a[0], a[1], a[2]), (a[3], a[4], a[5]), (a[6], a[7], a[8])
    b1, b2, b3 = (b[0], b[1], b[2]), (b[3], b[4], b[5]), (b[6], b[7], b[8])
    n = cross(minus(a2, a1), minus(a3, a1))
    f1, f2, f3 = (
        dot(n, minus(b1, a1)),
        dot(n, minus(b2, a1)),
        dot(n, minus(b3, a1)),
    )
    if _one_side(f1, f2, f3):
        return False
    m = cross(minus(b2, b1), minus(b3, b1))
    g1, g2, g3 = (
        dot(m, minus(a1, b1)),
        dot(m, minus(a2, b1)),
        dot(m, minus(a3, b1)),
    )
    if _one_side(g1, g2, g3):
        return False
    if f1 == 0.0 and f2 == 0.0 and f3 == 0.0 and _is_direction(n):
        return _overlap_in_plane(a, b, n)
    if g1 == 0.0 and g2 == 0.0 and g3 == 0.0 and _is_direction(m):
        return _overlap_in_plane(a, b, m)
    return (
        _edge_meets(f1, f2, b1, b2, a1, a2, a3)
        or _edge_meets(f2, f3, b2, b3, a1, a2, a3)
        or _edge_meets(f3, f1, b3, b1, a1, a2, a3)
        or _edge_meets(g1, g2, a1, a2, b1, b2, b3)
        or _edge_meets(g2, g3, a2, a3, b1, b2, b3)
        or _edge_meets(g3, g1, a3, a1, b1, b2, b3)
    )


@kernel
def _is_direction(n: Point) -> bool:
    return n[0] != 0.0 or n[1] != 0.0 or n[2] != 0.0


@kernel
def _area(t: NDArray[np.float64], i: int, u: NDArray[np.float64], j: int) -> float:
    """Twice the signed area of edge i of t and corner j of u."""
    k = (i + 1) % 3
    return (t[k, 0] - t[i, 0]) * (u[j, 1] - t[i, 1]) - (t[k, 1] - t[i, 1]) * (
        u[j, 0] - t[i, 0]
    )


@kernel
def _edges_cross(
    t: NDArray[np.float64], i: int, u: NDArray[np.float64], j: int
) -> bool:
    """Closed edges i of t and j of u meet, in the plane."""
    p, q = _area(t, i, u, j), _area(t, i, u, (j + 1) % 3)
    r, s = _area(u, j, t, i), _area(u, j, t, (i + 1) % 3)
    if p == 0.0 and q == 0.0 and r == 0.0 and s == 0.0:
        return _boxes_meet(t[i], t[(i + 1) % 3], u[j], u[(j + 1) % 3])
    apart = (p > 0.0 and q > 0.0) or (p < 0.0 and q < 0.0)
    return not (apart or (r > 0.0 and s > 0.0) or (r < 0.0 and s < 0.0))


@kernel
def _boxes_meet(
    p: NDArray[np.float64],
    q: NDArray[np.float64],
    r: NDArray[np.float64],
    s: NDArray[np.float64],
) -> bool:
    for k in range(2):
        if max(p[k], q[k]) < min(r[k], s[k]) or max(r[k], s[k]) < min(p[k], q[k]):
            return False
    return True


@kernel
def _overlap_in_plane(a: Triangle, b: Triangle, n: Point) -> bool:
    """Coplanar closed triangles overlap; n is the plane's normal.

    Seen along the axis nearest to n: two edges meet, or one holds the other's corner.
    """
    along = 0
    if abs(n[1]) > abs(n[along]):
        along = 1
    if abs(n[2]) > abs(n[along]):
        along = 2
    t, u = np.zeros((3, 2)), np.zeros((3, 2))
    for i in range(3):
        for k in range(2):
            axis = (along + 1 + k) % 3
            t[i, k], u[i, k] = a[3 * i + axis], b[3 * i + axis]
    for i in range(3):
        for j in range(3):
            if _edges_cross(t, i, u, j):
                return True
    return _holds(t, u) or _holds(u, t)


@kernel
def _holds(t: NDArray[np.float64], u: NDArray[np.float64]) -> bool:
    """Corner 0 of u lies strictly inside t, in the plane."""
    return _one_side(_area(t, 0, u, 0), _area(t, 1, u, 0), _area(t, 2, u, 0))


@kernel
def _two_sided_rows(
    a: NDArray[np.float64], b: NDArray[np.float64]
) -> NDArray[np.bool_]:
    contact = np.zeros(len(a), dtype=np.bool_)
    for k in range(len(a)):
        contact[k] = two_sided_pair(triangle_row(a, k), triangle_row(b, k))
    return contact
