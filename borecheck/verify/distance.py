"""Are two surfaces surely farther apart than a distance? Numpy only.

Triangles are put in groups along a space-filling curve. Groups whose boxes are farther
apart than the distance drop out, then triangles whose boxes are, and what is left is
measured.

A distance of two triangles that is computed from their closest points is too large
where these are found badly, as between edges that are nearly parallel. Here it is never
trusted: points only suggest a direction, and along a direction n the gap between the
two triangles, min n.b - max n.a, is a lower bound of their distance whatever n is
(every point of one lies on its side of two planes). Along the line of closest points
the gap is the distance, so nothing is lost. Rounding of the gap itself is a few units
in the last place of the numbers in it, and is taken off.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

GROUP = 32
# Corners of each surface that are looked at first.
SOME_POINTS = 100
# Pairs handled at a time, so that memory stays small.
_CHUNK = 100_000
# Relative to sizes: more than the roundings in a box's or a gap's dozen operations.
_RELATIVE = 16 * 2.0**-53


class GroupedMesh:
    """A mesh whose triangles are in groups of neighbours."""

    def __init__(self, vertices: Array, triangles: Indices) -> None:
        self.vertices = vertices
        self.triangles = triangles
        self.corners = vertices[triangles]
        self.order = np.argsort(
            _along_a_curve(self.corners.mean(axis=1)), kind="stable"
        )
        self.sorted = self.corners[self.order]
        self.starts = np.arange(0, len(self.order), GROUP)
        self.standing = self.boxes(self.sorted)

    def boxes(self, corners: Array) -> tuple[Array, Array]:
        """Boxes of triangles and of groups, each (k, 2, 3), for placed corners."""
        low, high = corners.min(axis=1), corners.max(axis=1)
        group_low = np.minimum.reduceat(low, self.starts, axis=0)
        group_high = np.maximum.reduceat(high, self.starts, axis=0)
        return np.stack([low, high], 1), np.stack([group_low, group_high], 1)


def _along_a_curve(points: Array) -> Indices:
    low = points.min(axis=0)
    extent = max(float((points.max(axis=0) - low).max()), 1e-300)
    cell = np.minimum((points - low) / extent * 1024, 1023).astype(np.int64)
    key = np.zeros(len(points), np.int64)
    for bit in range(10):
        for axis in range(3):
            key |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return key


def nearer_than(a: GroupedMesh, b: GroupedMesh, T_b_a: Array, distance: float) -> bool:
    """Whether a point of a, placed by T_b_a, may be nearer than that to one of b.

    False is proven for the numbers given; True may be said of what is farther by a
    few units in the last place of the sizes.
    """
    corners_a = a.sorted @ T_b_a[:3, :3].T + T_b_a[:3, 3]
    if _some_points_nearer(corners_a, b.sorted, distance):
        return True
    for i, j in near_triangles(a, corners_a, b, distance):
        first, second = corners_a[i], b.sorted[j]
        if (_lengths(first[:, 0] - second[:, 0]) < distance).any():
            return True
        if may_be_nearer(first, second, distance).any():
            return True
    return False


def _some_points_nearer(first: Array, second: Array, distance: float) -> bool:
    """Whether two of some corners are nearer: a false claim is answered at once."""
    a = first[:: len(first) // SOME_POINTS + 1, 0]
    b = second[:: len(second) // SOME_POINTS + 1, 0]
    return bool((_lengths((a[:, None] - b).reshape(-1, 3)) < distance).any())


def near_triangles(
    a: GroupedMesh, corners_a: Array, b: GroupedMesh, distance: float
) -> Iterator[tuple[Indices, Indices]]:
    """Pairs of triangles, in the sorted orders, whose boxes are within a distance."""
    boxes_a, groups_a = a.boxes(corners_a)
    boxes_b, groups_b = b.standing
    largest = max(float(np.abs(groups_a).max()), float(np.abs(groups_b).max()))
    reach = distance + _RELATIVE * (largest + distance)
    for i, j in _near_boxes(groups_a, groups_b, reach):
        members_a, members_b = _members(i, len(boxes_a)), _members(j, len(boxes_b))
        for k in range(0, len(i), _CHUNK // GROUP**2):
            rows = slice(k, k + _CHUNK // GROUP**2)
            p = np.repeat(members_a[rows], GROUP, axis=1).reshape(-1)
            q = np.tile(members_b[rows], (1, GROUP)).reshape(-1)
            near = _gaps(boxes_a[p], boxes_b[q]) <= reach
            if near.any():
                yield p[near], q[near]


def _near_boxes(
    first: Array, second: Array, reach: float
) -> Iterator[tuple[Indices, Indices]]:
    """Index arrays of pairs of boxes not farther apart than `reach`, in chunks."""
    whole = np.stack([first[:, 0].min(axis=0), first[:, 1].max(axis=0)])
    some = np.flatnonzero(_gaps(np.broadcast_to(whole, second.shape), second) <= reach)
    step = max(1, _CHUNK // max(1, len(some)))
    for k in range(0, len(first), step):
        block = first[k : k + step]
        i = np.repeat(np.arange(len(block)), len(some))
        j = np.tile(some, len(block))
        near = _gaps(block[i], second[j]) <= reach
        yield i[near] + k, j[near]


def _members(groups: Indices, count: int) -> Indices:
    """Triangles of groups (k, GROUP); the last group repeats its last triangle."""
    return np.minimum(groups[:, None] * GROUP + np.arange(GROUP), count - 1)


def _gaps(first: Array, second: Array) -> Array:
    """Distances of boxes (k, 2, 3), 0 where they overlap."""
    apart = np.maximum(first[:, 0] - second[:, 1], second[:, 0] - first[:, 1])
    return _lengths(np.maximum(apart, 0.0))


def _lengths(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))


def may_be_nearer(first: Array, second: Array, distance: float) -> NDArray[np.bool_]:
    """Which triangles (k, 3, 3) are not proven to be as far apart as that, (k,)."""
    left = np.ones(len(first), dtype=bool)
    for directions in (_normals, _suggested, _all_suggested):
        some = np.flatnonzero(left)
        for k in range(0, len(some), _CHUNK // 8):
            rows = some[k : k + _CHUNK // 8]
            left[rows] = _bound(first[rows], second[rows], directions) < distance
    return left


def lower_bounds(first: Array, second: Array) -> Array:
    """Lower bounds of the distances of triangles (k, 3, 3); 0 or less where they meet.

    As good as rounding allows: all directions are asked.
    """
    every = (_normals, _suggested, _all_suggested)
    return np.max([_bound(first, second, kind) for kind in every], axis=0)


def _bound(first: Array, second: Array, directions) -> Array:  # type: ignore[no-untyped-def]
    """The best gap of pairs of triangles along some directions."""
    # Small numbers: from a corner in common, where both are near each other.
    a, b = first - first[:, :1], second - first[:, :1]
    best = np.full(len(a), -np.inf)
    for n in directions(a, b):
        length = np.sqrt(_dot(n, n))
        n = n / np.where(length > 0.0, length, 1.0)[:, None]
        along_a = np.einsum("ijk,ik->ij", a, n)
        along_b = np.einsum("ijk,ik->ij", b, n)
        gap = along_b.min(axis=1) - along_a.max(axis=1)
        back = along_a.min(axis=1) - along_b.max(axis=1)
        best = np.maximum(best, np.maximum(gap, back))
    size = np.abs(a).max(axis=(1, 2)) + np.abs(b).max(axis=(1, 2))
    return best - _RELATIVE * 2.0 * size


def _normals(a: Array, b: Array) -> Iterator[Array]:
    """The normals of both triangles."""
    for t in (a, b):
        yield np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])


def _suggested(a: Array, b: Array) -> Iterator[Array]:
    """Directions from the closest points of the two edges that are nearest."""
    best = np.full(len(a), np.inf)
    chosen = [np.zeros((len(a), 3)) for _ in range(3)]
    for p, u, q, v in _edges(a, b):
        gap = _gap_of_segments(p, u, q, v)
        size = _dot(gap, gap)
        better = size < best
        best = np.where(better, size, best)
        for k, value in enumerate((gap, u, v)):
            chosen[k] = np.where(better[:, None], value, chosen[k])
    yield from _squared(*chosen)


def _all_suggested(a: Array, b: Array) -> Iterator[Array]:
    """Directions from the closest points of all pairs of edges."""
    for p, u, q, v in _edges(a, b):
        yield from _squared(_gap_of_segments(p, u, q, v), u, v)


def _edges(a: Array, b: Array) -> Iterator[tuple[Array, Array, Array, Array]]:
    for i in range(3):
        p, u = a[:, i], a[:, (i + 1) % 3] - a[:, i]
        for j in range(3):
            yield p, u, b[:, j], b[:, (j + 1) % 3] - b[:, j]


def _squared(gap: Array, u: Array, v: Array) -> Iterator[Array]:
    """A direction as it is, and at right angles to one edge, the other, and both.

    What the closest points lack in accuracy this gives back: at the true ones the
    direction is square to each edge it ends within.
    """
    yield gap
    yield _without(gap, u)
    yield _without(gap, v)
    # v's part beside u: where they are nearly parallel it is small, so it is made
    # square to u once more
    beside = _without(_without(v, u), u)
    yield _without(_without(gap, u), beside)


def _without(x: Array, u: Array) -> Array:
    """What of x is at right angles to u."""
    square = _dot(u, u)
    share = _dot(x, u) / np.where(square > 0.0, square, 1.0)
    return x - share[:, None] * u


def _dot(u: Array, v: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", u, v))


def _gap_of_segments(p: Array, u: Array, q: Array, v: Array) -> Array:
    """From a point of q + t v to one of p + s u, as near as can be found, (k, 3).

    The nearest are inside of both or at one of four ends.
    """
    w = p - q
    a, b, c = _dot(u, u), _dot(u, v), _dot(v, v)
    d, e = _dot(u, w), _dot(v, w)
    s = _share(b * e - c * d, a * c - b * b)
    pairs = [(s, _share(b * s + e, c))]
    for end in (0.0, 1.0):
        pairs.append((np.full_like(a, end), _share(b * end + e, c)))
        pairs.append((_share(b * end - d, a), np.full_like(a, end)))
    best, nearest = np.full(len(p), np.inf), np.zeros_like(w)
    for s, t in pairs:
        gap = w + s[:, None] * u - t[:, None] * v
        size = _dot(gap, gap)
        nearest = np.where((size < best)[:, None], gap, nearest)
        best = np.minimum(best, size)
    return nearest


def _share(top: Array, bottom: Array) -> Array:
    """The quotient within 0 to 1; 0 where there is none."""
    usable = bottom > 0.0
    return np.clip(np.where(usable, top, 0.0) / np.where(usable, bottom, 1.0), 0.0, 1.0)
