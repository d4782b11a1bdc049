"""Closed surfaces to build parts from: boxes, solids of revolution, lofts.

Every surface is closed, its triangles wind outward, none has zero area. Cylinders and
other solids of revolution are drawn *around* the true circle, so a coarse polygon
contains the true body. Rounded edges of boxes are cut *within* the true arc.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, cos, inf, pi, radians, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.plugin import TriangleMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Detail:
    """How finely surfaces are cut.

    Attributes:
        edge: Longest step along straight runs, [m].
        segments: Steps around a full circle.
        arc: Steps around a rounded edge (a quarter circle has twice as many).
    """

    edge: float = inf
    segments: int = 8
    arc: int = 1


def box(
    lower: ArrayLike, upper: ArrayLike, detail: Detail, radius: float = 0.0
) -> TriangleMesh:
    """A box between two corners [m], its edges rounded with `radius` [m]."""
    low, high = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    axes = [_axis(a, b, radius, detail) for a, b in zip(low, high, strict=True)]
    lattice, triangles = _lattice_surface([len(axis) for axis in axes])
    points = np.column_stack([axes[k][lattice[:, k]] for k in range(3)])
    if radius > 0.0:
        points = _rounded(points, low + radius, high - radius, radius)
    return TriangleMesh("box", points, triangles)


def cylinder(
    start: ArrayLike, end: ArrayLike, radius: float, detail: Detail
) -> TriangleMesh:
    """A cylinder from one centre to another [m], drawn around the true circle."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(end - start))
    profile = [(0.0, 0.0), (radius, 0.0), (radius, length), (0.0, length)]
    T = np.eye(4)
    T[:3, :3] = _frame_along((end - start) / length)
    T[:3, 3] = start
    return revolved(profile, detail).moved(T)


def revolved(
    profile: Sequence[tuple[float, float]], detail: Detail, *, around: bool = True
) -> TriangleMesh:
    """The solid of revolution of a profile (r, z) [m] about z.

    Args:
        profile: Points from the axis (r = 0) back to the axis.
        detail: Fineness; the profile is cut into steps of at most `edge`.
        around: Whether the polygon goes around the circle instead of within it.
    """
    points = refined(np.array(profile), detail.edge)
    n = detail.segments
    grown = 1.0 / cos(pi / n) if around else 1.0
    angles = np.arange(n) * (2.0 * pi / n)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(n)])
    up = np.array([0.0, 0.0, 1.0])
    rings = [r * grown * circle + z * up for r, z in points[1:-1]]
    ends = (points[0][1] * up, points[-1][1] * up)
    return lofted(np.array(rings), ends)


def lofted(rings: Array, ends: tuple[Array, Array] | None = None) -> TriangleMesh:
    """The surface through rings of points.

    Args:
        rings: (k, n, 3), [m]; each ring is closed, neighbours are joined.
        ends: Points that close the first and the last ring; None joins the last
            ring to the first (a torus).
    """
    k, n, _ = rings.shape
    index = np.arange(k * n).reshape(k, n)
    if ends is None:
        index = np.concatenate([index, index[:1]])
    left = index[:-1].ravel(), np.roll(index, -1, axis=1)[:-1].ravel()
    right = index[1:].ravel(), np.roll(index, -1, axis=1)[1:].ravel()
    triangles = [np.column_stack([left[0], left[1], right[1]])]
    triangles.append(np.column_stack([left[0], right[1], right[0]]))
    points = rings.reshape(-1, 3)
    if ends is not None:
        first, last = np.arange(n), (k - 1) * n + np.arange(n)
        apex = np.full(n, k * n)
        triangles.append(np.column_stack([np.roll(first, -1), first, apex]))
        triangles.append(np.column_stack([last, np.roll(last, -1), apex + 1]))
        points = np.concatenate([points, np.array(ends)])
    return _outward(TriangleMesh("loft", points, np.concatenate(triangles)))


def joined(name: str, meshes: Iterable[TriangleMesh]) -> TriangleMesh:
    """Several closed surfaces as one mesh; they must not cut each other."""
    meshes = list(meshes)
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    return TriangleMesh(
        name,
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate(
            [m.triangles + o for m, o in zip(meshes, offsets, strict=False)]
        ),
    )


def refined(points: Array, edge: float) -> Array:
    """A polyline (n, d) with points added so that no step is longer than `edge`."""
    pieces = []
    for start, end in pairwise(points):
        steps = _steps(float(np.linalg.norm(end - start)), edge)
        share = np.arange(steps)[:, None] / steps
        pieces.append((1.0 - share) * start + share * end)
    return np.concatenate([*pieces, points[-1:]])


def signed_volume(mesh: TriangleMesh) -> float:
    """Volume [m^3] of a closed mesh, negative when its triangles wind inward."""
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _outward(mesh: TriangleMesh) -> TriangleMesh:
    if signed_volume(mesh) > 0.0:
        return mesh
    return TriangleMesh(mesh.name, mesh.vertices, mesh.triangles[:, ::-1])


def _steps(length: float, edge: float) -> int:
    """Steps of at most `edge`; the 1e-9 forgives a length of 3.0000000001 edges."""
    return max(1, ceil(length / edge - 1e-9))


def _axis(low: float, high: float, radius: float, detail: Detail) -> Array:
    """Lattice coordinates along one axis of a box, closer where it is rounded."""
    inner = refined(np.array([[low + radius], [high - radius]]), detail.edge).ravel()
    if radius == 0.0:
        return inner
    angles = np.arange(1, detail.arc + 1) * (radians(45.0) / detail.arc)
    rise = radius * np.array([tan(angle) for angle in angles])
    return np.concatenate([low + radius - rise[::-1], inner, high - radius + rise])


def _rounded(points: Array, low: Array, high: Array, radius: float) -> Array:
    """Points on the box's lattice, moved to `radius` from the inner box."""
    inner = np.clip(points, low, high)
    away = points - inner
    length: Array = np.linalg.norm(away, axis=1, keepdims=True)
    return inner + radius * away / length


def _lattice_surface(counts: Sequence[int]) -> tuple[Indices, Indices]:
    """Lattice indices (n, 3) of a box's surface and the triangles over them."""
    corners, triangles, used = [], [], 0
    for axis in range(3):
        for side in (0, counts[axis] - 1):
            grid = _face(counts, axis, side)
            rows, columns = grid.shape[:2]
            index = used + np.arange(rows * columns).reshape(rows, columns)
            triangles.append(_grid_triangles(index, flipped=side == 0))
            corners.append(grid.reshape(-1, 3))
            used += rows * columns
    lattice, same = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    return lattice, same.reshape(-1)[np.concatenate(triangles)]


def _face(counts: Sequence[int], axis: int, side: int) -> Indices:
    u, v = (axis + 1) % 3, (axis + 2) % 3
    grid = np.zeros((counts[u], counts[v], 3), dtype=np.int64)
    grid[..., axis] = side
    grid[..., u] = np.arange(counts[u])[:, None]
    grid[..., v] = np.arange(counts[v])[None, :]
    return grid


def _grid_triangles(index: Indices, *, flipped: bool) -> Indices:
    a, b = index[:-1, :-1].ravel(), index[1:, :-1].ravel()
    c, d = index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return triangles[:, ::-1] if flipped else triangles


def _frame_along(z: Array) -> Array:
    """A rotation whose third column is the unit vector z."""
    other = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(other, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
