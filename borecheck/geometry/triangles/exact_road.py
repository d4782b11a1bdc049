"""Contact of two closed triangles through exact signs alone.

It knows only one fact: two closed triangles meet if and only if an edge of one meets
the other. (The common points are a convex set; it ends on the boundary of one of them.)
"""

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.exact_sign import (
    Flat,
    Point,
    corners_of,
    orientation_2d,
    orientation_3d,
)
from borecheck.geometry.triangles.placing import Triangle


@kernel
def exact_road(a: Triangle, b: Triangle) -> bool:
    """The same question through exact signs alone; for any two finite triangles."""
    if _boxes_apart(a, b):
        return False
    a1, a2, a3 = corners_of(a)
    b1, b2, b3 = corners_of(b)
    axis_a, axis_b = _open_axis(a1, a2, a3), _open_axis(b1, b2, b3)
    if axis_a >= 0 and axis_b >= 0:
        return _triangles_meet(axis_a, a1, a2, a3, axis_b, b1, b2, b3)
    if axis_a >= 0:
        p, q = _ends(b1, b2, b3)
        return _segment_meets(p, q, axis_a, a1, a2, a3)
    p, q = _ends(a1, a2, a3)
    if axis_b >= 0:
        return _segment_meets(p, q, axis_b, b1, b2, b3)
    r, s = _ends(b1, b2, b3)
    return _segments_meet(p, q, r, s)


@kernel
def _triangles_meet(
    axis_a: int,
    a1: Point,
    a2: Point,
    a3: Point,
    axis_b: int,
    b1: Point,
    b2: Point,
    b3: Point,
) -> bool:
    """Two triangles with area meet; along its axis each of them shows that area."""
    f1, f2, f3 = _sides(a1, a2, a3, b1, b2, b3)
    if f1 == f2 and f2 == f3:
        return f1 == 0 and _overlap_in_plane(axis_a, a1, a2, a3, b1, b2, b3)
    g1, g2, g3 = _sides(b1, b2, b3, a1, a2, a3)
    if g1 == g2 and g2 == g3:
        return False
    return (
        _edge_meets(f1, f2, b1, b2, axis_a, a1, a2, a3)
        or _edge_meets(f2, f3, b2, b3, axis_a, a1, a2, a3)
        or _edge_meets(f3, f1, b3, b1, axis_a, a1, a2, a3)
        or _edge_meets(g1, g2, a1, a2, axis_b, b1, b2, b3)
        or _edge_meets(g2, g3, a2, a3, axis_b, b1, b2, b3)
        or _edge_meets(g3, g1, a3, a1, axis_b, b1, b2, b3)
    )


@kernel
def _overlap_in_plane(
    axis: int, a1: Point, a2: Point, a3: Point, b1: Point, b2: Point, b3: Point
) -> bool:
    """Triangles in one plane meet: an edge of b meets a, or a lies within b."""
    return (
        _meets_in_plane(axis, b1, b2, a1, a2, a3)
        or _meets_in_plane(axis, b2, b3, a1, a2, a3)
        or _meets_in_plane(axis, b3, b1, a1, a2, a3)
        or _holds(axis, b1, b2, b3, a1)
    )


@kernel
def _segment_meets(p: Point, q: Point, axis: int, a: Point, b: Point, c: Point) -> bool:
    """Closed segment p-q (or point) meets the triangle a, b, c with area."""
    side_p, side_q = orientation_3d(a, b, c, p), orientation_3d(a, b, c, q)
    return _edge_meets(side_p, side_q, p, q, axis, a, b, c)


@kernel
def _before(p: Point, q: Point) -> bool:
    """The order of points by x, then y, then z; it runs along every line."""
    if p[0] != q[0]:
        return p[0] < q[0]
    if p[1] != q[1]:
        return p[1] < q[1]
    return p[2] < q[2]


@kernel
def _ends(p: Point, q: Point, r: Point) -> tuple[Point, Point]:
    """The ends of the segment (or point) that three points on one line make."""
    if _before(q, p):
        p, q = q, p
    if _before(r, p):
        return r, q
    if _before(q, r):
        return p, r
    return p, q


@kernel
def _boxes_apart(a: Triangle, b: Triangle) -> bool:
    for k in range(3):
        if max(a[k], a[k + 3], a[k + 6]) < min(b[k], b[k + 3], b[k + 6]):
            return True
        if max(b[k], b[k + 3], b[k + 6]) < min(a[k], a[k + 3], a[k + 6]):
            return True
    return False


@kernel
def _seen_along(p: Point, axis: int) -> Flat:
    if axis == 0:
        return p[1], p[2]
    if axis == 1:
        return p[2], p[0]
    return p[0], p[1]


@kernel
def _area_along(axis: int, p: Point, q: Point, r: Point) -> int:
    """Sign of the area of p, q, r seen along a coordinate axis."""
    return orientation_2d(
        _seen_along(p, axis), _seen_along(q, axis), _seen_along(r, axis)
    )


@kernel
def _open_axis(p: Point, q: Point, r: Point) -> int:
    """An axis along which p, q, r show an area; -1 if they lie on one line."""
    for axis in range(3):
        if _area_along(axis, p, q, r) != 0:
            return axis
    return -1


@kernel
def _sides(
    t1: Point, t2: Point, t3: Point, x: Point, y: Point, z: Point
) -> tuple[int, int, int]:
    """On which side of the plane of t each of x, y, z lies."""
    return (
        orientation_3d(t1, t2, t3, x),
        orientation_3d(t1, t2, t3, y),
        orientation_3d(t1, t2, t3, z),
    )


@kernel
def _edge_meets(
    side_p: int,
    side_q: int,
    p: Point,
    q: Point,
    axis: int,
    a: Point,
    b: Point,
    c: Point,
) -> bool:
    """Closed segment p-q meets the closed triangle a, b, c with area.

    Args:
        side_p: Side of the triangle's plane on which p lies, an exact sign.
        side_q: The same of q.
        p: One end.
        q: The other end.
        axis: Axis along which the triangle shows an area.
        a: Corner of the triangle.
        b: Corner of the triangle.
        c: Corner of the triangle.
    """
    if side_p * side_q > 0:
        return False
    if side_p == 0 and side_q == 0:
        return _meets_in_plane(axis, p, q, a, b, c)
    # p-q crosses the plane in one point; that point is in the triangle unless two
    # edges pass the line p-q on opposite sides.
    first, second = orientation_3d(p, q, a, b), orientation_3d(p, q, b, c)
    if first * second < 0:
        return False
    third = orientation_3d(p, q, c, a)
    return first * third >= 0 and second * third >= 0


@kernel
def _holds(axis: int, a: Point, b: Point, c: Point, x: Point) -> bool:
    """Closed triangle with area holds a point of its plane, seen along the axis."""
    first, second = _area_along(axis, a, b, x), _area_along(axis, b, c, x)
    if first * second < 0:
        return False
    third = _area_along(axis, c, a, x)
    return first * third >= 0 and second * third >= 0


@kernel
def _meets_in_plane(
    axis: int, p: Point, q: Point, a: Point, b: Point, c: Point
) -> bool:
    """As `_edge_meets` for p and q in the triangle's plane, seen along the axis."""
    return (
        _holds(axis, a, b, c, p)
        or _segments_meet_along(axis, p, q, a, b)
        or _segments_meet_along(axis, p, q, b, c)
        or _segments_meet_along(axis, p, q, c, a)
    )


@kernel
def _segments_meet(p: Point, q: Point, r: Point, s: Point) -> bool:
    """Closed segments p-q and r-s, either perhaps a point, meet."""
    if _segment_boxes_apart(p, q, r, s) or orientation_3d(p, q, r, s) != 0:
        return False
    for axis in range(3):
        shows = (
            _area_along(axis, p, q, r) != 0
            or _area_along(axis, p, q, s) != 0
            or _area_along(axis, r, s, p) != 0
            or _area_along(axis, r, s, q) != 0
        )
        if shows:  # their plane does not contain the axis: seen along it, nothing folds
            return _segments_meet_along(axis, p, q, r, s)
    return True  # on one line, or two points: there meeting boxes are meeting segments


@kernel
def _segments_meet_along(axis: int, p: Point, q: Point, r: Point, s: Point) -> bool:
    """Closed segments in one plane meet; the axis must not lie in that plane."""
    r_side, s_side = _area_along(axis, p, q, r), _area_along(axis, p, q, s)
    if r_side * s_side > 0:
        return False
    p_side, q_side = _area_along(axis, r, s, p), _area_along(axis, r, s, q)
    if p_side * q_side > 0:
        return False
    if r_side == 0 and s_side == 0 and p_side == 0 and q_side == 0:
        return not _segment_boxes_apart(p, q, r, s)
    return True


@kernel
def _segment_boxes_apart(p: Point, q: Point, r: Point, s: Point) -> bool:
    for k in range(3):
        if max(p[k], q[k]) < min(r[k], s[k]) or max(r[k], s[k]) < min(p[k], q[k]):
            return True
    return False
