"""Are two surfaces nearer than a distance? For `verify.check`: numpy only.

Triangles are put in groups along a space-filling curve. Groups whose boxes are farther
apart than the distance drop out, then triangles whose boxes are, and what is left is
measured: the least of nine edge-edge and six corner-face distances, or 0 if an edge
goes through a face.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

GROUP = 32
# Pairs handled at a time, so that memory stays small.
_CHUNK = 200_000
# Boxes and distances in float64 are right to far less than this, [m].
_ROUNDING = 1e-12


class GroupedMesh:
    """A mesh whose triangles are in groups of neighbours."""

    def __init__(self, vertices: Array, triangles: Indices) -> None:
        self.vertices = vertices
        self.triangles = triangles
        self.corners = vertices[triangles]
        order = np.argsort(_along_a_curve(self.corners.mean(axis=1)), kind="stable")
        self.sorted = self.corners[order]
        self.starts = np.arange(0, len(order), GROUP)
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
    """Whether a point of a, placed by T_b_a, is nearer than that to one of b."""
    corners_a = a.sorted @ T_b_a[:3, :3].T + T_b_a[:3, 3]
    boxes_a, groups_a = a.boxes(corners_a)
    boxes_b, groups_b = b.standing
    reach = distance + _ROUNDING
    for i, j in _near_boxes(groups_a, groups_b, reach):
        members_a, members_b = _members(i, len(boxes_a)), _members(j, len(boxes_b))
        for k in range(0, len(i), _CHUNK // GROUP**2):
            rows = slice(k, k + _CHUNK // GROUP**2)
            p = np.repeat(members_a[rows], GROUP, axis=1).reshape(-1)
            q = np.tile(members_b[rows], (1, GROUP)).reshape(-1)
            near = _gaps(boxes_a[p], boxes_b[q]) <= reach
            if _any_nearer(corners_a[p[near]], b.sorted[q[near]], reach):
                return True
    return False


def _near_boxes(first: Array, second: Array, reach: float):  # type: ignore[no-untyped-def]
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
    return np.linalg.norm(np.maximum(apart, 0.0), axis=1)


def _any_nearer(first: Array, second: Array, reach: float) -> bool:
    for k in range(0, len(first), _CHUNK // 8):
        rows = slice(k, k + _CHUNK // 8)
        if (triangle_distances(first[rows], second[rows]) < reach).any():
            return True
    return False


def triangle_distances(first: Array, second: Array) -> Array:
    """Distances of triangles (k, 3, 3), pair by pair; 0 where an edge goes through."""
    best = np.full(len(first), np.inf)
    for i in range(3):
        p, u = first[:, i], first[:, (i + 1) % 3] - first[:, i]
        for j in range(3):
            q, v = second[:, j], second[:, (j + 1) % 3] - second[:, j]
            best = np.minimum(best, _segments(p, u, q, v))
    for t, others in ((first, second), (second, first)):
        for k in range(3):
            best = np.minimum(best, _corner_to_face(others[:, k], t))
            edge = others[:, k], others[:, (k + 1) % 3]
            best = np.where(_goes_through(*edge, t), 0.0, best)
    return best


def _dot(u: Array, v: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", u, v))


def _segments(p: Array, u: Array, q: Array, v: Array) -> Array:
    """Distances of segments p + s u and q + t v: the best of five candidates each.

    The least distance is taken in the inside of both or at one of four ends; each
    candidate is a true distance of two points, so the least of them is never too small.
    """
    w = p - q
    a, b, c = _dot(u, u), _dot(u, v), _dot(v, v)
    d, e = _dot(u, w), _dot(v, w)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.nan_to_num(np.clip((b * e - c * d) / (a * c - b * b), 0.0, 1.0))
        candidates = [(s, np.clip(np.nan_to_num((b * s + e) / c), 0.0, 1.0))]
        for end in (0.0, 1.0):
            t = np.clip(np.nan_to_num((b * end + e) / c), 0.0, 1.0)
            candidates.append((np.full_like(a, end), t))
            s = np.clip(np.nan_to_num((b * end - d) / a), 0.0, 1.0)
            candidates.append((s, np.full_like(a, end)))
    best = np.full(len(p), np.inf)
    for s, t in candidates:
        gap = w + s[:, None] * u - t[:, None] * v
        best = np.minimum(best, np.linalg.norm(gap, axis=1))
    return best


def _corner_to_face(point: Array, t: Array) -> Array:
    """Distance to the plane of a triangle where the foot lies inside; else infinite."""
    n = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    inside = np.ones(len(point), dtype=bool)
    for k in range(3):
        side = np.cross(t[:, (k + 1) % 3] - t[:, k], point - t[:, k])
        inside &= _dot(side, n) >= 0.0
    length = np.linalg.norm(n, axis=1)
    inside &= length > 0.0
    height = np.abs(_dot(point - t[:, 0], n)) / np.where(length > 0.0, length, 1.0)
    return np.where(inside, height, np.inf)


def _goes_through(p: Array, q: Array, t: Array) -> NDArray[np.bool_]:
    """Whether a segment meets the inside of a triangle; touching counts."""
    n = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    start, end = _dot(p - t[:, 0], n), _dot(q - t[:, 0], n)
    crosses = (start * end <= 0.0) & ((start != 0.0) | (end != 0.0))
    turns = [
        _dot(q - p, np.cross(t[:, k] - p, t[:, (k + 1) % 3] - p)) for k in range(3)
    ]
    same = np.stack(turns)
    return crosses & ((same >= 0.0).all(axis=0) | (same <= 0.0).all(axis=0))
