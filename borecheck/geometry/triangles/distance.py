"""How far apart two triangles are: true distance, and the distance in given axes.

The true distance is the least over 18 corner-edge pairs, 9 edge-edge pairs and 6
corner-face pairs; the last two count only where both nearest points lie inside. So
triangles without area need no case of their own: their edges say it all.

The distance in given axes is the least over all point pairs of max(|dx|, |dy|, |dz|):
what a cube of half edge h grown onto one triangle reaches when h is that distance.
"""

import math

import numpy as np

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.exact import exact_pair
from borecheck.geometry.triangles.exact_sign import Point, corners_of
from borecheck.geometry.triangles.placing import Triangle
from borecheck.geometry.triangles.vectors import cross, dot, minus

Witness = tuple[float, Point, Point]

# The computed distance is within DISTANCE_ERROR times the longest side of the box round
# both triangles of the true one (the tests measure the largest error and ask less).
DISTANCE_ERROR = 64.0 * 2.0**-53

# Below this squared sine a cross product has lost digits and is formed again with the
# rounding errors of its products added.
_FLAT = 0.01

# Lengths whose fourth power neither overflows nor underflows are used as they are.
_SMALLEST, _LARGEST = 1e-60, 1e60


@kernel
def pair_distance(a: Triangle, b: Triangle) -> Witness:
    """Distance of two closed triangles and two points that are that far apart.

    0 exactly when `exact_pair` says contact; then both points are the pair of corners
    or edge points nearest to each other, and need not be common points.

    Args:
        a: Corners of one triangle [m].
        b: Corners of the other, in the same frame.

    Returns:
        Distance [m], nearest point of a, nearest point of b. The distance is off by at
        most DISTANCE_ERROR times the longest side of the box round both triangles.
    """
    distance, p, q = disjoint_distance(a, b)
    if exact_pair(a, b):
        return 0.0, p, q
    return distance, p, q


@kernel
def disjoint_distance(a: Triangle, b: Triangle) -> Witness:
    """As `pair_distance`, for triangles known to have no point in common."""
    o = (a[0], a[1], a[2])
    a1, a2, a3 = corners_of(a)
    b1, b2, b3 = corners_of(b)
    a1, a2, a3 = minus(a1, o), minus(a2, o), minus(a3, o)
    b1, b2, b3 = minus(b1, o), minus(b2, o), minus(b3, o)
    size = max(_size(a2), _size(a3), _size(b1), _size(b2), _size(b3))
    scale = 1.0
    if size != 0.0 and not (_SMALLEST < size < _LARGEST):
        scale = math.ldexp(1.0, -math.frexp(size)[1])
        a2, a3 = _times(scale, a2), _times(scale, a3)
        b1, b2, b3 = _times(scale, b1), _times(scale, b2), _times(scale, b3)
    square, p, q = _nearest(a1, a2, a3, b1, b2, b3)
    p, q = _times(1.0 / scale, p), _times(1.0 / scale, q)
    return math.sqrt(square) / scale, _plus(p, o), _plus(q, o)


@kernel
def chebyshev_distance(a: Triangle, b: Triangle) -> float:
    """Least max(|dx|, |dy|, |dz|) between points of two closed triangles [m].

    A triangle grown on every side by h along each axis (Minkowski sum with a cube of
    half edge h) reaches the other one if and only if h is at least this distance.

    The largest gap over all directions w of unit 1-norm; the candidates are the
    normals of the faces of the sum of both triangles and a cube: each triangle's own
    normal, the axes, and the cross products of edges with edges and axes. Each gap is a
    lower bound, so rounding cannot make triangles seem further apart than by about
    1e-15 of their size.
    """
    a1, a2, a3 = corners_of(a)
    b1, b2, b3 = corners_of(b)
    u1, u2, u3 = minus(a2, a1), minus(a3, a2), minus(a1, a3)
    v1, v2, v3 = minus(b2, b1), minus(b3, b2), minus(b1, b3)
    best = 0.0
    for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        best = max(best, _gap(axis, a1, a2, a3, b1, b2, b3))
        for edge in (u1, u2, u3, v1, v2, v3):
            best = max(best, _gap(_sharp_cross(axis, edge), a1, a2, a3, b1, b2, b3))
    for u in (u1, u2, u3):
        for v in (v1, v2, v3):
            best = max(best, _gap(_sharp_cross(u, v), a1, a2, a3, b1, b2, b3))
    best = max(best, _gap(_sharp_cross(u1, u2), a1, a2, a3, b1, b2, b3))
    return max(best, _gap(_sharp_cross(v1, v2), a1, a2, a3, b1, b2, b3))


@kernel
def _gap(
    w: Point, a1: Point, a2: Point, a3: Point, b1: Point, b2: Point, b3: Point
) -> float:
    """Gap between both triangles along w or -w, per unit of the 1-norm of w."""
    norm = abs(w[0]) + abs(w[1]) + abs(w[2])
    if norm == 0.0:
        return 0.0
    # relative to a1: far from the origin nothing is lost but the differences' rounding
    s2, s3 = dot(w, minus(a2, a1)), dot(w, minus(a3, a1))
    t1, t2, t3 = (
        dot(w, minus(b1, a1)),
        dot(w, minus(b2, a1)),
        dot(w, minus(b3, a1)),
    )
    above = min(t1, t2, t3) - max(0.0, s2, s3)
    below = min(0.0, s2, s3) - max(t1, t2, t3)
    return max(above, below) / norm


# --- vectors ------------------------------------------------------------------------


@kernel
def _plus(p: Point, q: Point) -> Point:
    return p[0] + q[0], p[1] + q[1], p[2] + q[2]


@kernel
def _times(s: float, p: Point) -> Point:
    return s * p[0], s * p[1], s * p[2]


@kernel
def _size(p: Point) -> float:
    return max(abs(p[0]), abs(p[1]), abs(p[2]))


@kernel
def _product_error(x: float, y: float, xy: float) -> float:
    """What the rounded product xy lacks: x * y == xy + error exactly (Veltkamp)."""
    c = 134217729.0 * x  # 2^27 + 1
    x_high = c - (c - x)
    x_low = x - x_high
    c = 134217729.0 * y
    y_high = c - (c - y)
    y_low = y - y_high
    return x_low * y_low - (((xy - x_high * y_high) - x_low * y_high) - x_high * y_low)


@kernel
def _difference_of_products(a: float, b: float, c: float, d: float) -> float:
    """The value a * b - c * d, with the rounding errors of both products added."""
    ab, cd = a * b, c * d
    return (ab - cd) + (_product_error(a, b, ab) - _product_error(c, d, cd))


@kernel
def _sharp_cross(u: Point, v: Point) -> Point:
    """Cross product, accurate in relation to itself even for nearly parallel u, v."""
    n = cross(u, v)
    if dot(n, n) > _FLAT * dot(u, u) * dot(v, v):
        return n
    return (
        _difference_of_products(u[1], v[2], u[2], v[1]),
        _difference_of_products(u[2], v[0], u[0], v[2]),
        _difference_of_products(u[0], v[1], u[1], v[0]),
    )


# --- nearest points -----------------------------------------------------------------


@kernel
def _nearer(best: Witness, p: Point, q: Point) -> Witness:
    d = minus(p, q)
    square = dot(d, d)
    if square < best[0]:
        return square, p, q
    return best


@kernel
def _on_segment(p: Point, q: Point, x: Point) -> Point:
    """The point of the closed segment p-q nearest to x."""
    d = minus(q, p)
    length = dot(d, d)
    if length == 0.0:
        return p
    # from the nearer end, so that the end itself is met without rounding
    t = dot(minus(x, p), d) / length
    if t <= 0.0:
        return p
    if t >= 1.0:
        return q
    if t < 0.5:
        return _plus(p, _times(t, d))
    return minus(q, _times(dot(minus(q, x), d) / length, d))


@kernel
def _inner_points(best: Witness, p: Point, q: Point, r: Point, s: Point) -> Witness:
    """Nearest points of two skew lines where they lie within p-q and r-s."""
    u, v, w = minus(q, p), minus(s, r), minus(r, p)
    n = _sharp_cross(u, v)
    nn = dot(n, n)
    if nn == 0.0 or dot(n, w) ** 2 >= best[0] * nn:
        return best
    i = dot(_sharp_cross(w, v), n)
    j = dot(_sharp_cross(w, u), n)
    if not (0.0 < i < nn and 0.0 < j < nn):
        return best
    return _nearer(best, _plus(p, _times(i / nn, u)), _plus(r, _times(j / nn, v)))


@kernel
def _foot(a: Point, b: Point, c: Point, n: Point, x: Point) -> tuple[bool, Point]:
    """Foot of x on the plane of a, b, c, and whether it lies inside the triangle."""
    nn = dot(n, n)
    w = minus(x, a)
    j = dot(_sharp_cross(w, minus(c, a)), n)
    k = dot(_sharp_cross(minus(b, a), w), n)
    inside = j > 0.0 and k > 0.0 and j + k < nn
    return inside, minus(x, _times(dot(n, w) / nn, n))


@kernel
def _corners_to_edge(
    best: Witness, x1: Point, x2: Point, x3: Point, p: Point, q: Point
) -> Witness:
    """Nearest of three corners to the closed edge p-q."""
    best = _nearer(best, x1, _on_segment(p, q, x1))
    best = _nearer(best, x2, _on_segment(p, q, x2))
    return _nearer(best, x3, _on_segment(p, q, x3))


@kernel
def _corners_to_face(
    best: Witness, x: tuple[Point, Point, Point], a: Point, b: Point, c: Point
) -> Witness:
    """Nearest of three corners to the inside of the triangle a, b, c."""
    n = _sharp_cross(minus(b, a), minus(c, a))
    nn = dot(n, n)
    if nn == 0.0:
        return best
    for corner in x:
        if dot(n, minus(corner, a)) ** 2 < best[0] * nn:
            inside, foot = _foot(a, b, c, n, corner)
            if inside:
                best = _nearer(best, corner, foot)
    return best


@kernel
def _nearest(
    a1: Point, a2: Point, a3: Point, b1: Point, b2: Point, b3: Point
) -> Witness:
    """Squared distance and nearest points of two triangles without common points."""
    best = (np.inf, a1, b1)
    best = _corners_to_edge(best, a1, a2, a3, b1, b2)
    best = _corners_to_edge(best, a1, a2, a3, b2, b3)
    best = _corners_to_edge(best, a1, a2, a3, b3, b1)
    back = (best[0], best[2], best[1])
    back = _corners_to_edge(back, b1, b2, b3, a1, a2)
    back = _corners_to_edge(back, b1, b2, b3, a2, a3)
    back = _corners_to_edge(back, b1, b2, b3, a3, a1)
    back = _corners_to_face(back, (b1, b2, b3), a1, a2, a3)
    best = _corners_to_face((back[0], back[2], back[1]), (a1, a2, a3), b1, b2, b3)
    for p, q in ((a1, a2), (a2, a3), (a3, a1)):
        best = _inner_points(best, p, q, b1, b2)
        best = _inner_points(best, p, q, b2, b3)
        best = _inner_points(best, p, q, b3, b1)
    return best
