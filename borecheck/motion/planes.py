"""Does a plane separate a moving triangle from a standing one all the time?

If along some direction n every corner of the moving triangle, at both ends of an
interval, lies farther than the slack beyond the standing triangle, so does every point
of it at every instant between.
"""

import numpy as np

from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.geometry.triangles.distance import disjoint_distance
from borecheck.geometry.triangles.placing import place_triangle
from borecheck.geometry.triangles.published import triangle_row
from borecheck.geometry.triangles.vectors import cross


@kernel
def plane_between(corners_a, i, corners_b, j, ends, reserve):  # type: ignore[no-untyped-def]
    """Whether a plane separates a standing triangle from both ends of a moving one.

    The direction is that of the shortest way between the triangles half-way; if faces
    slide along each other or pass side by side, another may do. Only the separation is
    relied upon, not how the direction was found.
    """
    first = place_triangle(ends[0], corners_a, i)
    last = place_triangle(ends[1], corners_a, i)
    standing = triangle_row(corners_b, j)
    half_way = (
        0.5 * (first[0] + last[0]),
        0.5 * (first[1] + last[1]),
        0.5 * (first[2] + last[2]),
        0.5 * (first[3] + last[3]),
        0.5 * (first[4] + last[4]),
        0.5 * (first[5] + last[5]),
        0.5 * (first[6] + last[6]),
        0.5 * (first[7] + last[7]),
        0.5 * (first[8] + last[8]),
    )
    _, p, q = disjoint_distance(half_way, standing)
    way = (p[0] - q[0], p[1] - q[1], p[2] - q[2])
    if _separates(way, first, last, standing, reserve):
        return True
    step = (last[0] - first[0], last[1] - first[1], last[2] - first[2])
    return _beside(standing, step, first, last, standing, reserve) or (
        _beside(half_way, step, first, last, standing, reserve)
    )


@kernel
def _either_way(n, first, last, standing, reserve):  # type: ignore[no-untyped-def]
    return _separates(n, first, last, standing, reserve) or _separates(
        (-n[0], -n[1], -n[2]), first, last, standing, reserve
    )


@kernel
def _beside(t, step, first, last, standing, reserve):  # type: ignore[no-untyped-def]
    """Whether a plane that t suggests separates.

    Its own plane, the one along the motion across it, and those along the motion and
    one of its edges.
    """
    n = _normal(t)
    if _either_way(n, first, last, standing, reserve):
        return True
    if _either_way(cross(n, step), first, last, standing, reserve):
        return True
    for k in range(3):
        p, q = 3 * k, 3 * ((k + 1) % 3)
        edge = (t[q] - t[p], t[q + 1] - t[p + 1], t[q + 2] - t[p + 2])
        if _either_way(cross(edge, step), first, last, standing, reserve):
            return True
    return False


@kernel(**INLINE)
def _normal(t):  # type: ignore[no-untyped-def]
    along = (t[3] - t[0], t[4] - t[1], t[5] - t[2])
    across = (t[6] - t[0], t[7] - t[1], t[8] - t[2])
    return cross(along, across)


@kernel
def _separates(way, first, last, standing, reserve):  # type: ignore[no-untyped-def]
    """Whether the moving triangle is farther along a direction than the standing one.

    The direction is a unit vector up to a few roundings; ROUNDING, which is part of
    the reserve, covers what they change.
    """
    x, y, z = way
    length = np.sqrt(x * x + y * y + z * z)
    if not length > 1e-150:  # its square would leave the range of float64
        return False
    x, y, z = x / length, y / length, z / length
    near = min(_least(first, x, y, z), _least(last, x, y, z))
    return near + _least(standing, -x, -y, -z) > reserve


@kernel(**INLINE)
def _least(t, x, y, z):  # type: ignore[no-untyped-def]
    """Smallest coordinate of a triangle's corners along a direction."""
    return min(
        t[0] * x + t[1] * y + t[2] * z,
        min(t[3] * x + t[4] * y + t[5] * z, t[6] * x + t[7] * y + t[8] * z),
    )
