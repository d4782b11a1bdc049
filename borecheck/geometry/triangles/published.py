"""Triangle contact in floating point: the published test, and both ways round.

`paper` is [Matsuno2020] section 3.2, equations (4) to (6) and its flowchart, with its
blind spots: only edges of beta against alpha, and strict inequalities. `two_sided`
asks both ways round and gives touching and coplanar triangles a defined answer. Both
round; `triangles.exact` is the judge.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError
from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.placing import Triangle

Point = tuple[float, float, float]

# alpha is the robot's triangle in paper:robot and the scanner's in paper:scanner.
NARROWPHASES = {"paper:robot": 0, "paper:scanner": 1, "two-sided": 2, "exact": 3}


def paper(alpha: ArrayLike, beta: ArrayLike) -> NDArray[np.bool_]:
    """Whether an edge of beta crosses the inside of alpha, pair by pair.

    One-sided and strict as published: a corner of alpha poking through beta is not
    seen, nor is any contact through an edge or corner of alpha, touching, or coplanar
    overlap. `docs/contact.md` has the smallest examples.

    Args:
        alpha: Triangles, (n, 3, 3): pair, corner, coordinate [m].
        beta: Triangles, (n, 3, 3), in the same frame.

    Returns:
        Contact, (n,) bool.

    Raises:
        GeometryError: Shapes that do not match, or a number that is not finite.

    Source: [Matsuno2020] eqs. (4)-(6), Fig. 9.
    """
    a, b = triangle_rows(alpha, beta)
    return _paper_rows(a, b)


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


def triangle_rows(
    alpha: ArrayLike, beta: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Both sets of triangles as contiguous (n, 9) rows, checked.

    Raises:
        GeometryError: Not (n, 3, 3) both, or a number that is not finite.
    """
    a, b = (np.ascontiguousarray(t, dtype=np.float64) for t in (alpha, beta))
    if a.ndim != 3 or a.shape[1:] != (3, 3) or a.shape != b.shape:
        raise GeometryError(
            f"triangles have shapes {a.shape} and {b.shape}, not (n, 3, 3) both"
        )
    for name, t in (("alpha", a), ("beta", b)):
        bad = np.flatnonzero(~np.isfinite(t).all(axis=(1, 2)))
        if len(bad):
            raise GeometryError(f"triangle {bad[0]} of {name} is not finite")
    return a.reshape(-1, 9), b.reshape(-1, 9)


@kernel(inline="always")
def triangle_row(rows: NDArray[np.float64], k: int) -> Triangle:
    """Row k of (n, 9) as a tuple of nine numbers."""
    return (
        rows[k, 0],
        rows[k, 1],
        rows[k, 2],
        rows[k, 3],
        rows[k, 4],
        rows[k, 5],
        rows[k, 6],
        rows[k, 7],
        rows[k, 8],
    )


# --- the published test -------------------------------------------------------------


@kernel
def _plane(p: Point, q: Point, r: Point) -> tuple[float, float, float, float]:
    """Coefficients a, b, c, d of the plane through p, q, r: eq. (5)."""
    ux, uy, uz = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    vx, vy, vz = p[0] - r[0], p[1] - r[1], p[2] - r[2]
    a = uy * vz - uz * vy
    b = uz * vx - ux * vz
    c = ux * vy - uy * vx
    return a, b, c, -(a * p[0] + b * p[1] + c * p[2])


@kernel
def _f(plane: tuple[float, float, float, float], x: Point) -> float:
    """The plane function f of eq. (5)."""
    return plane[0] * x[0] + plane[1] * x[1] + plane[2] * x[2] + plane[3]


@kernel
def _same_side(p: Point, q: Point, r: Point, x: Point, y: Point) -> bool:
    """One line of eq. (6): x, y strictly on one side of the plane through p, q, r."""
    plane = _plane(p, q, r)
    return _f(plane, x) * _f(plane, y) > 0.0


@kernel
def _edge_goes_through(a1: Point, a2: Point, a3: Point, bi: Point, bj: Point) -> bool:
    """Eq. (6): edge bi-bj, known to have its ends on both sides, goes through alpha."""
    return (
        _same_side(a1, a2, bi, bj, a3)
        and _same_side(a2, a3, bi, bj, a1)
        and _same_side(a3, a1, bi, bj, a2)
    )


@kernel
def paper_pair(a: Triangle, b: Triangle) -> bool:
    """The published test on one pair; a is alpha, b is beta.

    Only edges whose ends lie on opposite sides of alpha's plane are asked: the text
    below eq. (6) says so, and without it eq. (6) reports contacts that are none.

    Source: [Matsuno2020] eqs. (4)-(6), Fig. 9.
    """
    a1, a2, a3 = (a[0], a[1], a[2]), (a[3], a[4], a[5]), (a[6], a[7], a[8])
    b1, b2, b3 = (b[0], b[1], b[2]), (b[3], b[4], b[5]), (b[6], b[7], b[8])
    alpha = _plane(a1, a2, a3)
    f1, f2, f3 = _f(alpha, b1), _f(alpha, b2), _f(alpha, b3)
    if f1 * f2 > 0.0 and f1 * f3 > 0.0:  # eq. (4)
        return False
    if f1 * f2 < 0.0 and _edge_goes_through(a1, a2, a3, b1, b2):
        return True
    if f2 * f3 < 0.0 and _edge_goes_through(a1, a2, a3, b2, b3):
        return True
    return f3 * f1 < 0.0 and _edge_goes_through(a1, a2, a3, b3, b1)


@kernel
def _paper_rows(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
    contact = np.zeros(len(a), dtype=np.bool_)
    for k in range(len(a)):
        contact[k] = paper_pair(triangle_row(a, k), triangle_row(b, k))
    return contact


# --- both ways round, closed --------------------------------------------------------


@kernel
def _minus(p: Point, q: Point) -> Point:
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


@kernel
def _cross(u: Point, v: Point) -> Point:
    return (
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    )


@kernel
def _dot(u: Point, v: Point) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


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
    d = _minus(q, p)
    u, v, w = _minus(a1, p), _minus(a2, p), _minus(a3, p)
    return _no_opposites(
        _dot(d, _cross(u, v)), _dot(d, _cross(v, w)), _dot(d, _cross(w, u))
    )


@kernel
def two_sided_pair(a: Triangle, b: Triangle) -> bool:
    """Floating-point test of two closed triangles; `two_sided` says what it answers."""
    a1, a2, a3 = (a[0], a[1], a[2]), (a[3], a[4], a[5]), (a[6], a[7], a[8])
    b1, b2, b3 = (b[0], b[1], b[2]), (b[3], b[4], b[5]), (b[6], b[7], b[8])
    n = _cross(_minus(a2, a1), _minus(a3, a1))
    f1, f2, f3 = (
        _dot(n, _minus(b1, a1)),
        _dot(n, _minus(b2, a1)),
        _dot(n, _minus(b3, a1)),
    )
    if _one_side(f1, f2, f3):
        return False
    m = _cross(_minus(b2, b1), _minus(b3, b1))
    g1, g2, g3 = (
        _dot(m, _minus(a1, b1)),
        _dot(m, _minus(a2, b1)),
        _dot(m, _minus(a3, b1)),
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
