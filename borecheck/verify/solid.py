"""Closed surfaces and what they hold, for `verify.claims`: numpy only.

A point from which a straight line leads away without meeting a surface is outside,
whatever the surface is. Where there is none, the surface's winding number is asked;
but one that is 0 says "outside" only if each connected part of the surface lets a line
lead away or meets itself nowhere, and those that wind round the point are apart, the
outermost not inside out: a block drawn on both sides, or one of two that is inside out
where they overlap or hold each other, may hide matter that is wound round 0 times. Then
the answer is that it cannot be told.
"""

from enum import StrEnum
from functools import cache, lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from borecheck.verify.distance import (
    GroupedMesh,
    may_be_nearer,
    near_triangles,
    nearer_than,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# Sheets of one surface that come as near as this are taken to meet, [m].
TOUCHING = 1e-6
# What neighbours keep from each other beside common corners: more than rounding, [m].
ROUNDING = 1e-10
# Straight lines that are tried, beside those along the axes.
DIRECTIONS = 100
# A line as near to a triangle's rim as this share of the sizes meets it.
_AT_THE_RIM = 1e-12
# A sum of solid angles is this near to a whole number of turns.
_WHOLE = 1e-3
# Parts of a surface, none of which lets a line lead away, that are looked into.
_MOST_AROUND = 16


class Side(StrEnum):
    """Where a point is."""

    INSIDE = "inside"
    OUTSIDE = "outside"
    UNTOLD = "cannot be told"


def side_of(point: Array, mesh: GroupedMesh) -> Side:
    """Which side of a closed surface a point is on that is not on the surface."""
    corners = mesh.corners
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    if ((point < low) | (point > high)).any() or leads_away(point, corners):
        return Side.OUTSIDE
    turns = _whole_turns(point, corners)
    if turns is None:
        return Side.UNTOLD
    if turns != 0:
        return Side.INSIDE
    return Side.OUTSIDE if _is_free(point, mesh) else Side.UNTOLD


def _is_free(point: Array, mesh: GroupedMesh) -> bool:
    """Whether parts of a surface that cancel hide nothing round a point."""
    low, high = _boxes_of_parts(mesh)
    near = np.flatnonzero(((low <= point) & (point <= high)).all(axis=1))
    if len(near) > _MOST_AROUND:
        return False
    around = []
    for k in near:
        part = _part(mesh, int(k))
        if leads_away(point, part.corners):
            continue
        turns = _whole_turns(point, part.corners)
        if turns is None or not is_embedded(part):
            return False
        if turns != 0:
            around.append((np.ptp(part.corners, axis=(0, 1)).sum(), turns, part))
    around.sort(key=lambda one: -one[0])
    if (np.cumsum([turns for _, turns, _ in around]) < 0).any():
        return False  # the outermost is inside out: a cavity, or matter in matter
    parts = [part for _, _, part in around]
    return not any(
        nearer_than(a, b, np.eye(4), TOUCHING) for a, b in combinations(parts, 2)
    )


@lru_cache(maxsize=64)
def _parts(mesh: GroupedMesh) -> Indices:
    """Number of the connected part of each triangle, (m,)."""
    label = _labels(mesh.vertices, mesh.triangles)
    return np.asarray(np.unique(label, return_inverse=True)[1], dtype=np.int64)


@lru_cache(maxsize=64)
def _boxes_of_parts(mesh: GroupedMesh) -> tuple[Array, Array]:
    """Lowest and highest corner of every connected part, (c, 3) each."""
    parts = _parts(mesh)
    low = np.full((int(parts.max()) + 1, 3), np.inf)
    high = -low
    np.minimum.at(low, parts, mesh.corners.min(axis=1))
    np.maximum.at(high, parts, mesh.corners.max(axis=1))
    return low, high


@lru_cache(maxsize=256)
def _part(mesh: GroupedMesh, number: int) -> GroupedMesh:
    return GroupedMesh(mesh.vertices, mesh.triangles[_parts(mesh) == number])


def _whole_turns(point: Array, corners: Array) -> int | None:
    """The winding number, or None where rounding leaves it open."""
    turns = winding(point, corners)
    return None if abs(turns - round(turns)) > _WHOLE else round(turns)


def leads_away(point: Array, corners: Array) -> bool:
    """Whether a straight line from a point meets no triangle (m, 3, 3)."""
    a, b, c = (corners[:, k] - point for k in range(3))
    sides = [np.cross(b, c), np.cross(c, a), np.cross(a, b)]
    size = float(np.abs(corners - point).max())
    rim = _AT_THE_RIM * size**2
    volume = np.einsum("ij,ij->i", a, sides[0])
    for direction in _directions():
        turns = np.stack([side @ direction for side in sides])
        met = (turns >= -rim).all(axis=0) | (turns <= rim).all(axis=0)
        along, across = volume[met], turns[:, met].sum(axis=0)
        # behind the point: volume and slope have opposite signs, and surely so
        clear = (along * across < 0.0) & (np.abs(along) > rim * size)
        clear &= np.abs(across) > 3.0 * rim
        if clear.all():
            return True
    return False


@cache
def _directions() -> Array:
    """Unit vectors: along the axes first, then evenly over the sphere."""
    k = np.arange(DIRECTIONS) + 0.5
    polar, around = np.arccos(1.0 - 2.0 * k / DIRECTIONS), np.pi * (1 + 5**0.5) * k
    even = [np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar)]
    return np.concatenate(
        [np.eye(3), -np.eye(3), np.stack([*even, np.cos(polar)], axis=1)]
    )


def winding(point: Array, corners: Array) -> float:
    """How often a closed surface (m, 3, 3) winds round a point that is not on it.

    The sum of the signed solid angles of all triangles (Van Oosterom and Strackee).
    """
    a, b, c = (corners[:, k] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    top = np.einsum("ij,ij->i", a, np.cross(b, c))
    dot = np.einsum
    bottom = la * lb * lc + dot("ij,ij->i", a, b) * lc
    bottom += dot("ij,ij->i", b, c) * la + dot("ij,ij->i", c, a) * lb
    return float(np.arctan2(top, bottom).sum()) / (2.0 * np.pi)


@lru_cache(maxsize=256)
def is_embedded(mesh: GroupedMesh) -> bool:
    """Whether a closed surface meets itself nowhere.

    Every edge is run through once each way, no two triangles without a common corner
    are near each other, and neighbours have nothing but their common corners.
    """
    places = _merged(mesh.vertices, mesh.triangles)
    edges = _edges(places)
    if len(np.unique(edges, axis=0)) != len(edges):
        return False
    own = places[mesh.order]
    for i, j in near_triangles(mesh, mesh.sorted, mesh, TOUCHING):
        others = i < j
        i, j = i[others], j[others]
        shared = (own[i][:, :, None] == own[j][:, None, :]).any(axis=2)
        apart = ~shared.any(axis=1)
        first, second = mesh.sorted[i[apart]], mesh.sorted[j[apart]]
        if may_be_nearer(first, second, TOUCHING).any():
            return False
        for p, q in ((i[~apart], j[~apart]), (j[~apart], i[~apart])):
            if _meets_neighbour(own[p], own[q], mesh.sorted[p], mesh.sorted[q]):
                return False
    return True


def _meets_neighbour(
    own: Indices, others: Indices, first: Array, second: Array
) -> bool:
    """Whether a triangle has more in common with a neighbour than common corners.

    Flat and with a corner in common, they have if what lies opposite of it, an edge or
    a corner, meets the neighbour.
    """
    shared = (own[:, :, None] == others[:, None, :]).any(axis=2)
    if (shared.sum(axis=1) == 3).any():
        return True
    # the shared corners drawn to one that is not: what is left is what lies opposite
    free = np.take_along_axis(first, np.argmin(shared, axis=1)[:, None, None], axis=1)
    opposite = np.where(shared[:, :, None], free, first)
    return bool(may_be_nearer(opposite, second, ROUNDING).any())


def is_closed(vertices: Array, triangles: Indices) -> bool:
    """Whether every edge is run through as often one way as the other.

    Solids that share an edge, as boxes face to face do, are closed together: what
    winds round a point is then still a whole number of times.
    """
    edges = _edges(_merged(vertices, triangles))
    forth, there = np.unique(edges, axis=0, return_counts=True)
    back, again = np.unique(edges[:, ::-1], axis=0, return_counts=True)
    return np.array_equal(forth, back) and np.array_equal(there, again)


def connected_corners(vertices: Array, triangles: Indices) -> Array:
    """One corner of every connected part, (c, 3)."""
    first = np.unique(_labels(vertices, triangles), return_index=True)[1]
    return np.asarray(vertices[triangles[first, 0]], dtype=np.float64)


def _labels(vertices: Array, triangles: Indices) -> Indices:
    """A number for each triangle, equal within a connected part, (m,).

    Labels of places sink to the smallest.
    """
    t = _merged(vertices, triangles)
    label = np.arange(int(t.max()) + 1)
    while True:
        least = label[t].min(axis=1)
        before = label.copy()
        np.minimum.at(label, t.reshape(-1), np.repeat(least, 3))
        label = label[label]
        if np.array_equal(label, before):
            break
    return np.asarray(label[t[:, 0]], dtype=np.int64)


def _merged(vertices: Array, triangles: Indices) -> Indices:
    """Triangles by distinct places: vertices at equal coordinates count as one."""
    same = np.unique(vertices, axis=0, return_inverse=True)[1].reshape(-1)
    return np.asarray(same[triangles], dtype=np.int64)


def _edges(t: Indices) -> Indices:
    """Directed edges between different places, (k, 2)."""
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    return edges[edges[:, 0] != edges[:, 1]]
