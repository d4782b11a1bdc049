"""Cutting one polygon that is not convex into triangles, by its ears."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_MOST_CORNERS = 256  # the work grows with the cube; real faces have a few dozen
_FEW_CORNERS = 64  # what the thorough way does in half a second
_NO_AREA = 1e-6  # share of its parts below which a polygon's area cancels out


def cut_ears(points: Array) -> list[tuple[int, int, int]] | None:
    """Triangles that cover a polygon exactly, wound as it is, or None.

    The polygon is seen along its normal. Of a planar polygon the triangles are its
    very surface, whichever diagonals are chosen; a file leaves open how a bent one is
    folded.

    Args:
        points: Corners in order, (n, 3).

    Returns:
        n - 2 triangles of corner numbers; None if the outline crosses itself, has no
        area, or has more than 256 corners.
    """
    if len(points) > _MOST_CORNERS or not np.isfinite(points).all():
        return None
    flat = _seen_along_normal(points)
    if flat is None:
        return None
    cut = _cut(flat, keeps_findings=True)
    if cut is None and len(flat) <= _FEW_CORNERS:
        return _cut(flat, keeps_findings=False)
    return cut


def _cut(flat: Array, keeps_findings: bool) -> list[tuple[int, int, int]] | None:
    """The ears one after the other; None if at some point there is none.

    Args:
        flat: Corners in the plane, anticlockwise, (n, 2).
        keeps_findings: Ask a corner again only when a neighbour has gone: 20 times
            faster, and it ends without an ear for a few outlines that touch themselves.
    """
    left = list(range(len(flat)))
    known: dict[int, bool] = {}
    triangles = []
    while len(left) > 3:
        ear = _first_ear(flat[left], left, known)
        if ear is None:
            return None
        before, after = left[ear - 1], left[(ear + 1) % len(left)]
        triangles.append((before, left[ear], after))
        del left[ear]
        for corner in (before, after) if keeps_findings else list(known):
            known.pop(corner, None)
    if _area(*flat[left]) < 0.0:
        return None
    return [*triangles, (left[0], left[1], left[2])]


def _first_ear(polygon: Array, left: list[int], known: dict[int, bool]) -> int | None:
    """Place of the first ear among the corners left; what is found is kept.

    When no ear is left all are asked again: what lay in the way may have gone.
    """
    for _ in range(2):
        for k, corner in enumerate(left):
            if corner not in known:
                known[corner] = _is_ear(polygon, k)
            if known[corner]:
                return k
        known.clear()
    return None


def _seen_along_normal(points: Array) -> Array | None:
    """The two coordinates in which the polygon's area is largest, anticlockwise."""
    local = points - points.mean(axis=0)
    crosses = np.cross(local, np.roll(local, -1, axis=0))
    normal = crosses.sum(axis=0)
    if np.linalg.norm(normal) <= _NO_AREA * np.linalg.norm(crosses, axis=1).sum():
        return None
    axis = int(np.argmax(np.abs(normal)))
    kept = [(axis + 1) % 3, (axis + 2) % 3]
    return local[:, kept if normal[axis] > 0.0 else kept[::-1]]


def _is_ear(flat: Array, k: int) -> bool:
    """Whether corner k can be cut off: it bulges, and no other corner is in it."""
    n = len(flat)
    a, b, c = flat[k - 1], flat[k], flat[(k + 1) % n]
    if _area(a, b, c) < 0.0:
        return False
    others = np.delete(flat, [(k - 1) % n, k, (k + 1) % n], axis=0)
    coincide = (others[:, None] == np.stack([a, b, c])).all(axis=2).any(axis=1)
    inside = (
        (_area(a, b, others) >= 0.0)
        & (_area(b, c, others) >= 0.0)
        & (_area(c, a, others) >= 0.0)
    )
    return not bool((inside & ~coincide).any())


def _area(a: Array, b: Array, c: Array) -> Array:
    """Twice the signed area of triangles in the plane."""
    u, v = b - a, c - a
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
