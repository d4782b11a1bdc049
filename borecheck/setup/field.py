"""How far points are from obstacles at most, thousands at a time: a field on a lattice.

Surfaces are sampled so densely that every point of theirs has a sample within `cover`.
The distance to a sample is an upper bound of that to the surface; that to the nearest
one, less `cover`, is a lower one. Inside a solid the distance counts negative. At a
point beside a node it is at most the node's plus the way there: distances are
1-Lipschitz.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.geometry.triangles.solid import Side, side_of

Array = NDArray[np.float64]

# Largest distance of neighbouring samples of a surface, and of nodes, [m].
SPACING, NODES = 8e-3, 12e-3


@dataclass(frozen=True, eq=False)
class Field:
    """Upper bounds of the signed distance to some solids.

    Attributes:
        low: Where the lattice begins, (3,), [m].
        step: Distance of its nodes, [m].
        values: Bounds at the nodes, (a, b, c), [m]; negative inside.
    """

    low: Array
    step: float
    values: Array

    def at_most(self, points: Array) -> Array:
        """Bounds at points (..., 3), (...,); infinite beyond the lattice."""
        place = (points - self.low) / self.step
        node = np.rint(place).astype(np.int64)
        size = np.array(self.values.shape)
        inside = ((node >= 0) & (node < size)).all(axis=-1)
        node = np.clip(node, 0, size - 1)
        beside = self.step * np.linalg.norm(place - node, axis=-1)
        found = self.values[node[..., 0], node[..., 1], node[..., 2]] + beside
        return np.where(inside, found, np.inf)


def field(meshes: list[TriangleMesh], low: Array, high: Array) -> Field:
    """The field of solids within a box; of an open surface nothing is inside."""
    counts = np.maximum(np.ceil((high - low) / NODES).astype(int), 1) + 1
    axes = [a + NODES * np.arange(n) for a, n in zip(low, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    if not meshes:
        return Field(low, NODES, np.full(tuple(counts), np.inf))
    triangles = np.concatenate([mesh.corners for mesh in meshes])
    beside = (triangles.max(axis=1) < low) | (triangles.min(axis=1) > high)
    samples, cover = _samples(triangles[~beside.any(axis=1)], SPACING)
    cell = np.rint((samples - low) / NODES).astype(int)
    there = ((cell >= 0) & (cell < counts)).all(axis=1)
    if not there.any():
        return Field(low, NODES, np.full(tuple(counts), np.inf))
    far, least = _distances(nodes, samples[there], cell[there], cover)
    within = inside(meshes, nodes, least > 0.5 * NODES)
    return Field(low, NODES, np.where(within, -least, far))


def _distances(
    nodes: Array, samples: Array, cell: NDArray[np.int64], cover: float
) -> tuple[Array, Array]:
    """Upper and lower bounds of the nodes' distances to a sampled surface.

    The upper one is to a sample that is there; the lower one allows for where in its
    cell a sample lies, and for surfaces beyond the lattice.
    """
    counts = nodes.shape[:3]
    free = np.ones(counts, bool)
    free[tuple(cell.T)] = False
    one = np.zeros((*counts, 3))
    one[tuple(cell.T)] = samples
    steps, at = ndimage.distance_transform_edt(free, return_indices=True)
    far = np.linalg.norm(nodes - one[tuple(at)], axis=-1)
    least = NODES * (steps - 0.8661) - cover
    edge = np.minimum(nodes - nodes[0, 0, 0], nodes[-1, -1, -1] - nodes).min(axis=-1)
    return far, np.minimum(least, edge)


def sampled(mesh: TriangleMesh, spacing: float) -> tuple[Array, float]:
    """Points of a surface (n, 3), and how far it is from them at most."""
    return _samples(mesh.corners, spacing)


def _samples(triangles: Array, spacing: float) -> tuple[Array, float]:
    """Corners of triangles that are cut across their longest edges until small.

    In any triangle no point is farther from all corners than its longest edge over the
    root of 3.
    """
    found, longest = [], 0.0
    while len(triangles):
        edges = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        small = edges.max(axis=1) <= spacing
        found.append(triangles[small].reshape(-1, 3))
        longest = max(longest, float(edges[small].max(initial=0.0)))
        large, which = triangles[~small], edges[~small].argmax(axis=1)
        rows = np.arange(len(large))
        p, q, r = (large[rows, (which + k) % 3] for k in range(3))
        middle = 0.5 * (p + q)
        halves = [(p, middle, r), (middle, q, r)]
        triangles = np.concatenate([np.stack(half, axis=1) for half in halves])
    cover = longest / 1.7320508 * (1.0 + 1e-9)
    if not found:
        return np.zeros((0, 3)), 0.0
    return np.unique(np.concatenate(found), axis=0), cover


def inside(
    meshes: list[TriangleMesh], nodes: Array, surely_off: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Which nodes (a, b, c, 3) of a lattice are surely inside a solid.

    Neighbouring nodes, both farther from all surfaces than half their distance, are on
    the same side: one of each such region is asked.
    """
    regions, count = ndimage.label(surely_off)
    found = np.zeros(count + 1, bool)
    flat = regions.ravel()
    firsts = np.unique(flat, return_index=True)
    for region, at in zip(*firsts, strict=True):
        if region:
            found[region] = is_within(nodes.reshape(-1, 3)[at], meshes)
    return np.asarray(found[regions])


def is_within(point: Array, meshes: list[TriangleMesh]) -> bool:
    """Whether a point is surely inside one of some solids."""
    for mesh in meshes:
        known = surface(mesh).topology
        low, high = mesh.bounds
        if not known.is_closed or (point < low).any() or (point > high).any():
            continue
        if side_of(point, mesh, known) is Side.INSIDE:
            return True
    return False
