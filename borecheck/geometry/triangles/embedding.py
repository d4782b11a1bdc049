"""Whether a surface is what it seems: no two of its triangles meet but as neighbours.

Only then does a winding number of 0 tell free space from matter that two surfaces hide
between them. Triangles are sorted along an axis and held against those whose boxes they
share; neighbours are asked exactly whether they have more in common than their common
corners, others whether they meet at all.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.distance import DISTANCE_ERROR, disjoint_distance
from borecheck.geometry.triangles.exact import exact_pair
from borecheck.geometry.triangles.exact_sign import (
    Point,
    orientation_2d,
    orientation_3d,
)
from borecheck.geometry.triangles.published import triangle_row

# Boxes that are held against each other before a mesh is given up: some seconds.
MOST_BOXES = 2**31


def is_embedded(corners: NDArray[np.float64], places: NDArray[np.int64]) -> bool:
    """Whether triangles form an embedded closed surface, wound one way throughout.

    Each edge joins two triangles that run through it in opposite directions, and two
    triangles share a corner, an edge or nothing. So it winds round any point 1 time,
    -1 time or not at all. False also where that would take too long to show.

    Args:
        corners: Triangles, (m, 3, 3).
        places: For each corner a number that is equal for equal coordinates, (m, 3).
    """
    t = places[_proper(places)]
    rows = np.ascontiguousarray(corners[_proper(places)]).reshape(-1, 9)
    edges = t[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    n = np.int64(places.max()) + 1
    there, back = edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0]
    there, back = np.sort(there), np.sort(back)
    if (there[1:] == there[:-1]).any() or not np.array_equal(there, back):
        return False
    order, axis = _swept(rows, 0.0)
    return bool(_stays_apart(rows[order], t[order], axis))


def are_apart(
    first: NDArray[np.float64], second: NDArray[np.float64], gap: float
) -> bool:
    """Whether two surfaces (m, 3, 3) are surely farther apart than a gap, [m]."""
    rows = np.ascontiguousarray(np.concatenate([first, second])).reshape(-1, 9)
    side = np.arange(len(rows)) >= len(first)
    order, axis = _swept(rows, gap)
    return bool(_keep_gap(rows[order], side[order], axis, gap))


def _proper(places: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Triangles with three distinct corners; the others have no inside and two ends."""
    a, b, c = places.T
    return np.asarray((a != b) & (b != c) & (c != a))


def _swept(rows: NDArray[np.float64], gap: float) -> tuple[NDArray[np.int64], int]:
    """The order in which triangles begin along the axis on which fewest overlap."""
    corners = rows.reshape(-1, 3, 3)
    low, high = corners.min(axis=1), corners.max(axis=1)
    whole = np.maximum(high.max(axis=0) - low.min(axis=0), np.finfo(float).tiny)
    axis = int(((high - low + gap).sum(axis=0) / whole).argmin())
    return np.argsort(low[:, axis], kind="stable"), axis


@kernel
def _stays_apart(
    corners: NDArray[np.float64], places: NDArray[np.int64], axis: int
) -> bool:
    """Whether no two of the sorted triangles meet but in what they share."""
    low, high = _boxes(corners)
    looked = 0
    for i in range(len(corners)):
        for j in range(i + 1, len(corners)):
            if low[j, axis] > high[i, axis]:
                break
            looked += 1
            if _boxes_meet(low, high, i, j, 0.0) and _meet_beyond(
                corners, places, i, j
            ):
                return False
        if looked > MOST_BOXES:
            return False
    return True


@kernel
def _keep_gap(
    corners: NDArray[np.float64], side: NDArray[np.bool_], axis: int, gap: float
) -> bool:
    """Whether sorted triangles of the two sides are farther apart than the gap."""
    low, high = _boxes(corners)
    looked = 0
    for i in range(len(corners)):
        for j in range(i + 1, len(corners)):
            if low[j, axis] > high[i, axis] + gap:
                break
            looked += 1
            if side[i] == side[j] or not _boxes_meet(low, high, i, j, gap):
                continue
            a, b = triangle_row(corners, i), triangle_row(corners, j)
            size = (np.maximum(high[i], high[j]) - np.minimum(low[i], low[j])).max()
            distance = disjoint_distance(a, b)[0] - DISTANCE_ERROR * size
            if distance <= gap or exact_pair(a, b):
                return False
        if looked > MOST_BOXES:
            return False
    return True


@kernel
def _boxes(
    corners: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    low, high = np.empty((len(corners), 3)), np.empty((len(corners), 3))
    for i in range(len(corners)):
        for k in range(3):
            a, b, c = corners[i, k], corners[i, 3 + k], corners[i, 6 + k]
            low[i, k], high[i, k] = min(a, b, c), max(a, b, c)
    return low, high


@kernel
def _boxes_meet(
    low: NDArray[np.float64], high: NDArray[np.float64], i: int, j: int, gap: float
) -> bool:
    for k in range(3):
        if low[i, k] > high[j, k] + gap or low[j, k] > high[i, k] + gap:
            return False
    return True


@kernel
def _meet_beyond(
    corners: NDArray[np.float64], places: NDArray[np.int64], i: int, j: int
) -> bool:
    """Whether two triangles have more in common than the corners they share.

    What two triangles share is convex. Beyond a common corner it therefore reaches the
    side opposite that corner, of the one or of the other; beyond a common edge it
    reaches there from both, which takes a fold.
    """
    a, b = triangle_row(corners, i), triangle_row(corners, j)
    shared, at_i, at_j = 0, 0, 0
    left_i, left_j = 3, 3  # the sum of the numbers of corners that are not shared
    for p in range(3):
        for q in range(3):
            if places[i, p] == places[j, q]:
                shared += 1
                at_i, at_j = p, q
                left_i, left_j = left_i - p, left_j - q
    if shared == 0:
        return exact_pair(a, b)
    if shared == 1:
        return exact_pair(_side(corners, i, at_i), b) or exact_pair(
            _side(corners, j, at_j), a
        )
    if shared == 2:
        return _is_fold(
            _corner(corners, i, at_i),
            _corner(corners, i, 3 - at_i - left_i),
            _corner(corners, i, left_i),
            _corner(corners, j, left_j),
        )
    return True


@kernel
def _is_fold(p: Point, q: Point, r: Point, s: Point) -> bool:
    """Whether triangles p, q, r and p, q, s lie in one plane on one side of p, q."""
    if orientation_3d(p, q, r, s) != 0:
        return False
    for k in range(3):
        u, v = (k + 1) % 3, (k + 2) % 3
        line = (p[u], p[v]), (q[u], q[v])
        first = orientation_2d(line[0], line[1], (r[u], r[v]))
        if first != 0 and first == orientation_2d(line[0], line[1], (s[u], s[v])):
            return True
    return False


@kernel
def _corner(corners: NDArray[np.float64], i: int, k: int) -> Point:
    return corners[i, 3 * k], corners[i, 3 * k + 1], corners[i, 3 * k + 2]


@kernel
def _side(corners: NDArray[np.float64], i: int, k: int):  # type: ignore[no-untyped-def]
    """The side opposite corner k, as a triangle without area."""
    p = _corner(corners, i, (k + 1) % 3)
    q = _corner(corners, i, (k + 2) % 3)
    return (p[0], p[1], p[2], q[0], q[1], q[2], q[0], q[1], q[2])
