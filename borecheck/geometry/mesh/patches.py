"""A mesh cut into compact patches, each in a tight box: what a broadphase can prune.

The box of a whole gantry contains its bore, so it prunes nothing; the boxes of small
patches of its surface follow the surface and leave the bore free.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import GeometryError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# The corners are turned into box axes in float64, about ten operations on numbers as
# large as the coordinates: 16 ulps of the largest one cover their rounding.
_ROUNDING = 16 * np.finfo(np.float64).eps


@dataclass(frozen=True, eq=False)
class Patches:
    """Disjoint groups of triangles and a box around each, in the frame of the mesh.

    Attributes:
        triangle_order: All triangle numbers, patch after patch, (m,).
        offsets: Patch p holds triangle_order[offsets[p]:offsets[p + 1]], (p + 1,).
        centers: Box centres, (p, 3), [m].
        axes: Box axes as columns, right-handed and orthonormal, (p, 3, 3).
        half_sides: Half edges of the boxes, (p, 3), [m]; the closed box contains every
            corner of the patch, rounding included.
    """

    triangle_order: Ids
    offsets: Ids
    centers: Array
    axes: Array
    half_sides: Array

    def __len__(self) -> int:
        """Number of patches."""
        return len(self.centers)

    def triangles(self, patch: int) -> Ids:
        """Triangle numbers of one patch."""
        return self.triangle_order[self.offsets[patch] : self.offsets[patch + 1]]


def cut(mesh: TriangleMesh, size: int = 16) -> Patches:
    """Patches of at most `size` triangles by halving at the median centroid.

    Every triangle is in exactly one patch. Each half is cut across its longest side;
    ties go by triangle number, so equal meshes give equal patches.

    Raises:
        GeometryError: A size below 1.
    """
    if size < 1:
        raise GeometryError(f"patches of {size} triangles")
    corners = mesh.corners
    centroids = corners.mean(axis=1)
    groups = _halve(centroids, size)
    boxes = [_tight_box(corners[group].reshape(-1, 3)) for group in groups]
    lengths = np.array([0] + [len(group) for group in groups], dtype=np.int64)
    return Patches(
        triangle_order=np.concatenate(groups),
        offsets=np.cumsum(lengths),
        centers=np.stack([box[0] for box in boxes]),
        axes=np.stack([box[1] for box in boxes]),
        half_sides=np.stack([box[2] for box in boxes]),
    )


def _halve(centroids: Array, size: int) -> list[Ids]:
    """Groups of at most `size`, neighbours next to each other."""
    done: list[Ids] = []
    to_do = [np.arange(len(centroids), dtype=np.int64)]
    while to_do:
        group = to_do.pop()
        if len(group) <= size:
            done.append(group)
            continue
        points = centroids[group]
        axis = int(np.argmax(np.ptp(points, axis=0)))
        order = np.argsort(points[:, axis], kind="stable")
        # whole patches on the left keep their number small: ceil(m / size) of them
        middle = size * ((-(-len(group) // size)) // 2)
        to_do.extend([np.sort(group[order[middle:]]), np.sort(group[order[:middle]])])
    return done


def _tight_box(points: Array) -> tuple[Array, Array, Array]:
    """The smaller of the box along the mesh's axes and the one along the main axes."""
    upright = _box_along(points, np.eye(3))
    _, main = np.linalg.eigh(np.cov(points.T, bias=True))
    if np.linalg.det(main) < 0.0:
        main[:, 0] = -main[:, 0]
    turned = _box_along(points, main)
    return min(upright, turned, key=lambda box: _surface(box[2]))


def _box_along(points: Array, axes: Array) -> tuple[Array, Array, Array]:
    local = points @ axes
    low, high = local.min(axis=0), local.max(axis=0)
    half_sides = (high - low) / 2 + _ROUNDING * np.abs(points).max()
    return axes @ ((low + high) / 2), axes, half_sides


def _surface(half_sides: Array) -> float:
    x, y, z = half_sides
    return float(x * y + y * z + z * x)
