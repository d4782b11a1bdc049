"""Counts about a triangle mesh: degenerate, duplicate, open, clashing, inside out."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

# Triangles thinner than this share of their longest edge have no usable normal.
FLAT_SHARE = 1e-7
# A signed volume below this share of the box's is rounding, not a solid.
FLAT_VOLUME = 1e-6

Ids = NDArray[np.int64]


@dataclass(frozen=True)
class MeshFacts:
    """Counts about one mesh; vertices at equal coordinates are one vertex.

    Attributes:
        triangles: How many there are.
        degenerate: Triangles without area.
        duplicate: Triangles whose three corners another triangle has too.
        open_edges: Edges of one triangle only.
        clashing_edges: Edges that two triangles run through in the same direction.
        crowded_edges: Edges of three and more triangles.
        volume: Signed volume in the file's unit; only of closed meshes it means one.
        inverted: Closed, consistently wound, and inside out.
    """

    triangles: int
    degenerate: int
    duplicate: int
    open_edges: int
    clashing_edges: int
    crowded_edges: int
    volume: float
    inverted: bool

    @property
    def is_closed(self) -> bool:
        """Whether every edge joins two triangles (or an even number)."""
        return self.open_edges == 0


def facts_of(mesh: TriangleMesh) -> MeshFacts:
    """All counts of one mesh."""
    ids = weld(mesh.vertices)
    triangles = ids[mesh.triangles]
    degenerate = _degenerate(mesh, triangles)
    duplicate = _duplicate(triangles[~degenerate])
    solid = _without_repeats(triangles[~degenerate])
    open_edges, clashing, crowded = _edges(solid)
    volume = signed_volume(mesh)
    size = float(np.prod(np.maximum(mesh.bounds[1] - mesh.bounds[0], 1e-300)))
    sound = open_edges == 0 and clashing == 0
    return MeshFacts(
        triangles=len(triangles),
        degenerate=int(degenerate.sum()),
        duplicate=duplicate,
        open_edges=open_edges,
        clashing_edges=clashing,
        crowded_edges=crowded,
        volume=volume,
        inverted=bool(sound and len(solid) > 3 and volume < -FLAT_VOLUME * size),
    )


def weld(vertices: NDArray[np.float64]) -> Ids:
    """For each vertex the number of its position; equal coordinates, equal number."""
    bits = np.ascontiguousarray(vertices + 0.0).view(np.uint64).reshape(-1, 3)
    factors = np.array(
        [0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64
    )
    mixed = bits * factors
    mixed ^= mixed >> np.uint64(29)
    key = mixed[:, 0] * factors[1] + mixed[:, 1] * factors[2] + mixed[:, 2]
    ids, first, _ = _grouped(key)
    if np.array_equal(vertices[first[ids]], vertices):
        return ids
    # Two positions met in one key: the slow road is certain.
    return np.unique(vertices, axis=0, return_inverse=True)[1].reshape(-1)


def _grouped(keys: NDArray[Any]) -> tuple[Ids, Ids, Ids]:
    """Of equal keys: their group's number, one member of each group, its size.

    As numpy.unique, with the quicker sort that need not be stable.
    """
    order = np.argsort(keys)
    ranked = keys[order]
    begins = np.ones(len(keys), dtype=bool)
    begins[1:] = ranked[1:] != ranked[:-1]
    ids = np.zeros(len(keys), dtype=np.int64)
    ids[order] = np.cumsum(begins) - 1
    starts = np.flatnonzero(begins)
    return ids, order[starts], np.diff(np.append(starts, len(keys)))


def signed_volume(mesh: TriangleMesh) -> float:
    """Volume enclosed by a closed mesh; negative if it is inside out."""
    corners = mesh.corners - 0.5 * (mesh.bounds[0] + mesh.bounds[1])
    with np.errstate(over="ignore", invalid="ignore"):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _degenerate(mesh: TriangleMesh, triangles: Ids) -> NDArray[np.bool_]:
    a, b, c = (mesh.corners[:, k] for k in range(3))
    with np.errstate(over="ignore", invalid="ignore"):
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        edges = np.stack([b - a, c - b, a - c])
        longest = np.sqrt((edges**2).sum(axis=2).max(axis=0))
    same = (triangles[:, [0, 1, 2]] == triangles[:, [1, 2, 0]]).any(axis=1)
    return np.asarray(same | (area <= FLAT_SHARE * longest**2))


def _keys(rows: Ids) -> Ids:
    """One number per row of small non-negative integers."""
    if len(rows) == 0:
        return np.zeros(0, dtype=np.int64)
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)


def _duplicate(triangles: Ids) -> int:
    keys = np.sort(_row_hash(np.sort(triangles, axis=1)))
    return int((keys[1:] == keys[:-1]).sum())


def _without_repeats(triangles: Ids) -> Ids:
    """Every triangle once; one and its back side are one."""
    _, first, _ = _grouped(_row_hash(np.sort(triangles, axis=1)))
    return triangles[np.sort(first)]


def _row_hash(rows: Ids) -> NDArray[np.uint64]:
    base = np.uint64(int(rows.max(initial=0)) + 1)
    if int(base) < 2**21:  # three numbers fit into 64 bits: no two rows share a key
        r = rows.astype(np.uint64)
        return (r[:, 0] * base + r[:, 1]) * base + r[:, 2]
    return _keys(rows).astype(np.uint64)


def _edges(triangles: Ids) -> tuple[int, int, int]:
    """Open, clashing and crowded edges."""
    if len(triangles) == 0:
        return 0, 0, 0
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    count = np.int64(triangles.max() + 1)
    low, high = edges.min(axis=1), edges.max(axis=1)
    forward = edges[:, 0] == low
    where, _, users = _grouped(low * count + high)
    ahead = np.bincount(where, weights=forward)
    clashing = (users == 2) & (ahead != 1)
    return int((users == 1).sum()), int(clashing.sum()), int((users > 2).sum())


def bodies_of(mesh: TriangleMesh) -> int:
    """Groups of connected pieces whose boxes are apart."""
    triangles = weld(mesh.vertices)[mesh.triangles]
    label = _pieces(triangles)[triangles[:, 0]]
    _, piece = np.unique(label, return_inverse=True)
    count = int(piece.max()) + 1
    if count > 200:
        return count
    corners = mesh.vertices[_representatives(mesh)][triangles]
    low = np.full((count, 3), np.inf)
    high = np.full((count, 3), -np.inf)
    np.minimum.at(low, piece.reshape(-1), corners.min(axis=1))
    np.maximum.at(high, piece.reshape(-1), corners.max(axis=1))
    return _groups(low, high)


def _representatives(mesh: TriangleMesh) -> Ids:
    """For each position number one vertex that stands there."""
    ids = weld(mesh.vertices)
    found = np.zeros(int(ids.max()) + 1, dtype=np.int64)
    found[ids] = np.arange(len(ids))
    return found


def _pieces(triangles: Ids) -> Ids:
    """A label per vertex, equal within a piece: the smallest number spreads."""
    label = np.arange(triangles.max() + 1)
    while True:
        least = label[triangles].min(axis=1)
        after = label.copy()
        for k in range(3):
            np.minimum.at(after, triangles[:, k], least)
        after = after[after]  # the label of the label: long chains shorten quickly
        if np.array_equal(after, label):
            return label
        label = after


def _groups(low: NDArray[np.float64], high: NDArray[np.float64]) -> int:
    """How many groups boxes form that meet each other."""
    meet = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    label = np.arange(len(low))
    while True:
        after = np.where(meet, label[None], len(low)).min(axis=1)
        if np.array_equal(after, label):
            return len(np.unique(label))
        label = after
