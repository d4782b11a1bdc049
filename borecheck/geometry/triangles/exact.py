"""Exact contact of two closed triangles: the judge, and the default checker.

Right for every pair of triangles with finite float64 corners: touching in a point
counts, so do coplanar overlap and triangles without area (segments and points).

Two roads. Floating point with one error bound per pair decides triangles in general
position. Where a sign stays open, the answer is that of the exact signs (`exact_road`).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.exact_road import exact_road
from borecheck.geometry.triangles.exact_sign import (
    Point,
    corners_of,
    error_bound_3d,
)
from borecheck.geometry.triangles.placing import Triangle
from borecheck.geometry.triangles.published import triangle_row, triangle_rows
from borecheck.geometry.triangles.vectors import cross, dot, minus

CLEAR, CONTACT, OPEN = 0, 1, 2


def exact(alpha: ArrayLike, beta: ArrayLike) -> NDArray[np.bool_]:
    """Whether two closed triangles have a point in common, pair by pair.

    Args:
        alpha: Triangles, (n, 3, 3): pair, corner, coordinate [m].
        beta: Triangles, (n, 3, 3), in the same frame.

    Returns:
        Contact, (n,) bool; right for every finite input.

    Raises:
        GeometryError: Shapes that do not match, or a number that is not finite.
    """
    return exact_counted(alpha, beta)[0]


def exact_counted(alpha: ArrayLike, beta: ArrayLike) -> tuple[NDArray[np.bool_], int]:
    """As `exact`, and how many of the pairs floating point could not decide."""
    a, b = triangle_rows(alpha, beta)
    contact, n_exact_road = _exact_rows(a, b)
    return contact, int(n_exact_road)


def exact_road_only(alpha: ArrayLike, beta: ArrayLike) -> NDArray[np.bool_]:
    """As `exact`, with the floating-point filter switched off."""
    a, b = triangle_rows(alpha, beta)
    return _exact_road_rows(a, b)


@kernel
def exact_pair(a: Triangle, b: Triangle) -> bool:
    """Whether two closed triangles have a point in common. Corners must be finite."""
    answer = filtered_pair(a, b)
    if answer == OPEN:
        return exact_road(a, b)
    return answer == CONTACT


@kernel
def _exact_rows(
    a: NDArray[np.float64], b: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], int]:
    contact = np.zeros(len(a), dtype=np.bool_)
    n_exact_road = 0
    for k in range(len(a)):
        ta, tb = triangle_row(a, k), triangle_row(b, k)
        answer = filtered_pair(ta, tb)
        if answer == OPEN:
            n_exact_road += 1
            contact[k] = exact_road(ta, tb)
        else:
            contact[k] = answer == CONTACT
    return contact, n_exact_road


@kernel
def _exact_road_rows(
    a: NDArray[np.float64], b: NDArray[np.float64]
) -> NDArray[np.bool_]:
    contact = np.zeros(len(a), dtype=np.bool_)
    for k in range(len(a)):
        contact[k] = exact_road(triangle_row(a, k), triangle_row(b, k))
    return contact


@kernel
def _volume(p: Point, q: Point, r: Point, s: Point) -> float:
    """Six times the signed volume: (q - p) . ((r - p) x (s - p))."""
    return dot(minus(q, p), cross(minus(r, p), minus(s, p)))


@kernel
def _all_beyond(x: float, y: float, z: float, bound: float) -> bool:
    return (x > bound and y > bound and z > bound) or (
        x < -bound and y < -bound and z < -bound
    )


@kernel
def _all_sure(x: float, y: float, z: float, bound: float) -> bool:
    return abs(x) > bound and abs(y) > bound and abs(z) > bound


@kernel
def _lone_first(
    s1: float, s2: float, s3: float, p1: Point, p2: Point, p3: Point
) -> tuple[float, Point, Point, Point]:
    """Turn the corners so that the one alone on its side of a plane comes first."""
    up1, up2, up3 = s1 > 0.0, s2 > 0.0, s3 > 0.0
    if up2 == up3:
        return s1, p1, p2, p3
    if up1 == up3:
        return s2, p2, p3, p1
    return s3, p3, p1, p2


@kernel
def filtered_pair(a: Triangle, b: Triangle) -> int:
    """CLEAR or CONTACT where floating point is sure of it, else OPEN.

    Sure means: every sign used is that of a number beyond the error bound. All
    differences below are at most the width of the box round both triangles (rounding
    keeps order), so one bound holds for all determinants of the pair. In general
    position the triangles meet if their sections with the common line of their planes
    overlap; each of the two ends that matter is one more sign [GuigueDevillers2003].
    """
    a1, a2, a3 = corners_of(a)
    b1, b2, b3 = corners_of(b)
    bound = error_bound_3d(
        _width(a1[0], a2[0], a3[0], b1[0], b2[0], b3[0]),
        _width(a1[1], a2[1], a3[1], b1[1], b2[1], b3[1]),
        _width(a1[2], a2[2], a3[2], b1[2], b2[2], b3[2]),
    )
    n = cross(minus(a2, a1), minus(a3, a1))
    f1, f2, f3 = (
        dot(n, minus(b1, a1)),
        dot(n, minus(b2, a1)),
        dot(n, minus(b3, a1)),
    )
    if _all_beyond(f1, f2, f3, bound):
        return CLEAR
    m = cross(minus(b2, b1), minus(b3, b1))
    g1, g2, g3 = (
        dot(m, minus(a1, b1)),
        dot(m, minus(a2, b1)),
        dot(m, minus(a3, b1)),
    )
    if _all_beyond(g1, g2, g3, bound):
        return CLEAR
    if not (_all_sure(f1, f2, f3, bound) and _all_sure(g1, g2, g3, bound)):
        return OPEN
    g1, a1, a2, a3 = _lone_first(g1, g2, g3, a1, a2, a3)
    f1, b1, b2, b3 = _lone_first(f1, f2, f3, b1, b2, b3)
    if g1 < 0.0:
        b2, b3 = b3, b2
    if f1 < 0.0:
        a2, a3 = a3, a2
    first = _volume(a1, a2, b1, b2)
    if first > bound:
        return CLEAR
    second = _volume(a1, a3, b3, b1)
    if second > bound:
        return CLEAR
    if first < -bound and second < -bound:
        return CONTACT
    return OPEN


@kernel
def _width(u: float, v: float, w: float, x: float, y: float, z: float) -> float:
    return max(max(u, v, w), max(x, y, z)) - min(min(u, v, w), min(x, y, z))
