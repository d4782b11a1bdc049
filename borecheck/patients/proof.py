"""That a surface contains the skin, by the kernels that check robots.

Of every slab of the skin, at full resolution: the certified distance to the surface is
greater than 0 (so that they do not meet), and a corner of every connected piece is
inside (so that all of it is). How much too large the surface is comes from points on
it, a millimetre apart, and their distances to the skin.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.triangles.solid import Side, side_of
from borecheck.patients.volume import Array

# Points on the surface cover it within so much, [m], or there are more than so many.
_COVER_M, _MOST_POINTS = 0.0004, 250_000
# Only skin so near can be what a point is judged by, [m].
_NEAR_M = 0.03

_WORLD = np.eye(4)


@dataclass(frozen=True)
class Proof:
    """What was shown of a surface.

    Attributes:
        gap: The whole skin lies at least so far inside, [m]; certified.
        excess: No measured place of the surface is farther from the skin, [m]; None
            if the surface has no place that was measured.
        offset: How far outside it was meant to lie, [m].
        pieces: Connected pieces of skin, all inside.
        triangles: Of the skin.
    """

    gap: float
    excess: float | None
    offset: float
    pieces: int
    triangles: int

    def to_json(self) -> dict[str, Any]:
        """For the result."""
        return {
            "gap_m": self.gap,
            "excess_m": self.excess,
            "offset_m": self.offset,
            "skin_pieces": self.pieces,
            "skin_triangles": self.triangles,
        }


def prove(
    outer: TriangleMesh,
    assumed: NDArray[np.bool_],
    slabs: Iterable[tuple[Array, NDArray[np.int64], int]],
    offset: float,
    progress: Callable[[int], None] | None = None,
) -> Proof | None:
    """The proof that `outer` contains the skin; None if it does not.

    Args:
        outer: The surface, [m].
        assumed: Which of its triangles continue the scan, (m,): no skin is near them.
        slabs: Parts of the skin: vertices [m], triangles, slices done.
        offset: How far outside the surface was meant to lie, [m].
        progress: Called with the slices done.
    """
    whole = surface(outer)
    if not whole.topology.is_closed:
        return None
    points, reach = _points_on(outer.corners[~assumed])
    nearest = np.full(len(points), np.inf)
    gap, pieces, count = np.inf, 0, 0
    for vertices, triangles, done in slabs:
        skin = TriangleMesh("skin", vertices, triangles)
        found = MeshTree.of(skin, cached=False).closest(whole.tree, _WORLD, _WORLD)
        if not found.lower > 0.0:
            return None
        corners = surface(skin).representatives
        for corner in corners:
            if side_of(corner, outer, whole.topology) is not Side.INSIDE:
                return None
        gap, pieces = min(gap, found.lower), pieces + len(corners)
        count += len(triangles)
        _nearer(nearest, points, vertices)
        if progress is not None:
            progress(done)
    excess = float((nearest + reach).max()) if len(points) else None
    return Proof(gap, excess, offset, pieces, count) if count else None


def _points_on(corners: Array) -> tuple[Array, Array]:
    """Points of triangles, and how far the rest of each one's part is at most."""
    points, reach = [], []
    sides = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2
    cover = max(_COVER_M, float(np.sqrt(area / _MOST_POINTS)))
    while len(corners):
        centres = corners.mean(axis=1)
        radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
        small = radii <= cover
        points.append(centres[small])
        reach.append(radii[small])
        corners = _halved(corners[~small])
    if not points:
        return np.zeros((0, 3)), np.zeros(0)
    return np.concatenate(points), np.concatenate(reach)


def _halved(corners: Array) -> Array:
    """Each triangle as two, cut at its longest edge."""
    edges = np.roll(corners, -1, axis=1) - corners
    longest = np.argmax((edges**2).sum(axis=2), axis=1)
    rows = np.arange(len(corners))
    a, b, c = (corners[rows, (longest + k) % 3] for k in range(3))
    middle = (a + b) / 2
    first = np.stack([a, middle, c], axis=1)
    second = np.stack([middle, b, c], axis=1)
    return np.concatenate([first, second])


def _nearer(nearest: Array, points: Array, vertices: Array) -> None:
    """Lowers the distances of points by the skin of one slab."""
    low, high = vertices.min(axis=0) - _NEAR_M, vertices.max(axis=0) + _NEAR_M
    close = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
    if len(close) == 0:
        return
    found, _ = cKDTree(vertices).query(points[close])
    nearest[close] = np.minimum(nearest[close], found)
