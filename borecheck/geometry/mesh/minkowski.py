"""Minkowski sums with a cube: a closed surface swept along the three axes in turn.

A cube is the sum of three segments, so P (+) cube is P swept along x, then y, then z.
Sweeping a closed convex surface by +-s moves the triangles that look along s forward,
the others back, and closes the gap along the silhouette with quads. That is closed and
wound outward by construction: no hull program with its tolerances is needed, and every
new triangle knows the triangle it came from.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# A triangle thinner than this share of its size, its distance from the origin or the
# half edge is swept as its longest edge, with a cube grown by the triangle's height:
# its normal would be mostly rounding. The sum is too large by at most that.
SLIVER = 1e-9

_CUBE_CORNERS = np.array(
    [[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
)
_CUBE_TRIANGLES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5],
        [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
        [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class NumberedSurface:
    """Closed surfaces, each edge shared by two triangles of the same vertex numbers.

    Attributes:
        vertices: Points, (n, 3), [m].
        triangles: Vertex numbers, wound outward, (m, 3).
        source: For each triangle a number of the caller's, (m,).
    """

    vertices: Array
    triangles: Ids
    source: Ids


def convex_plus_cube(surface: NumberedSurface, half_edge: float) -> NumberedSurface:
    """The sum of closed convex surfaces, wound outward, and a cube along the axes."""
    for axis in range(3):
        along = np.zeros_like(surface.vertices)
        along[:, axis] = half_edge
        surface = sweep(surface, along, _normals(surface)[:, axis] >= 0.0)
    return surface


def triangles_plus_cube(
    corners: Array, source: Ids, half_edge: float
) -> NumberedSurface:
    """The sum of every triangle for itself and a cube: one closed hull for each.

    Args:
        corners: Triangles, of zero area too, (m, 3, 3), [m].
        source: A number for each, kept by all triangles of its hull, (m,).
        half_edge: Half edge of the cube, [m].
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.linalg.norm(edges, axis=2)
    longest = lengths.max(axis=1)
    heights = np.divide(
        np.linalg.norm(normals, axis=1),
        longest,
        out=np.zeros(len(corners)),
        where=longest > 0.0,
    )
    size = np.maximum(np.abs(corners).max(axis=(1, 2), initial=0.0), half_edge)
    thin = heights <= SLIVER * np.maximum(size, longest)
    main_axis = np.argmax(np.abs(normals), axis=1)
    hulls = [_edges_plus_cube(corners, lengths, heights, source, thin, half_edge)]
    for axis in range(3):
        chosen = ~thin & (main_axis == axis)
        front = normals[chosen, axis] >= 0.0
        hulls.append(
            _flat_plus_cube(corners[chosen], source[chosen], front, axis, half_edge)
        )
    return join(hulls)


def join(surfaces: list[NumberedSurface]) -> NumberedSurface:
    """Several surfaces as one, vertices not shared between them."""
    offsets = np.cumsum([0] + [len(s.vertices) for s in surfaces])
    return NumberedSurface(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate(
            [s.triangles + at for s, at in zip(surfaces, offsets, strict=False)]
        ),
        np.concatenate([s.source for s in surfaces]),
    )


def sweep(
    surface: NumberedSurface, along: Array, forward: NDArray[np.bool_]
) -> NumberedSurface:
    """The surface swept from -along to +along.

    Args:
        surface: Closed surfaces.
        along: Half the way of each vertex, equal within a connected surface, (n, 3).
        forward: Triangles that look along the way, (m,).
    """
    n = len(surface.vertices)
    triangles = surface.triangles + np.where(forward, 0, n)[:, None]
    quads, quad_source = _silhouette(surface, forward)
    return _compact(
        NumberedSurface(
            np.concatenate([surface.vertices + along, surface.vertices - along]),
            np.concatenate([triangles, quads]),
            np.concatenate([surface.source, quad_source]),
        )
    )


def _silhouette(
    surface: NumberedSurface, forward: NDArray[np.bool_]
) -> tuple[Ids, Ids]:
    """Quads, as two triangles, over the edges between forward and backward triangles.

    Vertex u stands at u in front and at u + n behind.
    """
    n = len(surface.vertices)
    t = surface.triangles
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    owner = np.tile(np.arange(len(t)), 3)
    key = edges[:, 0] * n + edges[:, 1]
    back = edges[:, 1] * n + edges[:, 0]
    order = np.argsort(key)
    twin = owner[order[np.searchsorted(key[order], back)]]
    border = forward[owner] & ~forward[twin]
    u, v = edges[border, 0], edges[border, 1]
    quads = np.concatenate(
        [np.stack([v, u, u + n], axis=1), np.stack([v, u + n, v + n], axis=1)]
    )
    return quads, np.tile(surface.source[owner[border]], 2)


def _flat_plus_cube(
    corners: Array, source: Ids, front: NDArray[np.bool_], axis: int, half_edge: float
) -> NumberedSurface:
    """Triangles swept first along the axis that they look along most, then the others.

    Each is two triangles back to back; the first sweep parts them.
    """
    m = len(corners)
    sides = np.arange(3 * m).reshape(-1, 3)
    surface = NumberedSurface(
        corners.reshape(-1, 3),
        np.concatenate([sides, sides[:, ::-1]]),
        np.tile(source, 2),
    )
    forward = np.concatenate([front, ~front])
    for turn in range(3):
        along = np.zeros_like(surface.vertices)
        along[:, (axis + turn) % 3] = half_edge
        if turn > 0:
            forward = _normals(surface)[:, (axis + turn) % 3] >= 0.0
        surface = sweep(surface, along, forward)
    return surface


def _edges_plus_cube(
    corners: Array,
    lengths: Array,
    heights: Array,
    source: Ids,
    chosen: NDArray[np.bool_],
    half_edge: float,
) -> NumberedSurface:
    """Cubes, grown by the heights, swept along the longest edges."""
    rows = np.flatnonzero(chosen)
    first = np.argmax(lengths[rows], axis=1)
    start, end = corners[rows, first], corners[rows, (first + 1) % 3]
    half_edges = half_edge + 2.0 * heights[rows]  # twice: the height is rounded too
    cubes = ((start + end) / 2)[:, None] + half_edges[:, None, None] * _CUBE_CORNERS
    triangles = _CUBE_TRIANGLES + 8 * np.arange(len(rows))[:, None, None]
    surface = NumberedSurface(
        cubes.reshape(-1, 3), triangles.reshape(-1, 3), np.repeat(source[rows], 12)
    )
    half_way = np.repeat((end - start) / 2, 8, axis=0)
    looks = np.einsum("ij,ij->i", _normals(surface), half_way[surface.triangles[:, 0]])
    return sweep(surface, half_way, looks >= 0.0)


def _normals(surface: NumberedSurface) -> Array:
    a, b, c = (surface.vertices[surface.triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _compact(surface: NumberedSurface) -> NumberedSurface:
    """Without vertices that no triangle uses."""
    used, triangles = np.unique(surface.triangles, return_inverse=True)
    return NumberedSurface(
        surface.vertices[used], triangles.reshape(-1, 3), surface.source
    )
