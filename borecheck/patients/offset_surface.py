"""A closed surface at a distance around the body, simplified.

On the lattice of the cells' corners the distance to the nearest cell is the distance to
the nearest corner of one: there the field is exact. Near the surface it is taken from
the skin itself, which lies up to half a voxel beside the cells. What interpolation and
simplifying do to the surface is not bounded here but measured afterwards, in `proof`.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.patients.beyond import Extended
from borecheck.patients.libraries import library
from borecheck.patients.raster import Cells, Raster
from borecheck.patients.volume import Array, Volume

# Off the values that the lattice can have: a level on one gives no manifold, [mm].
_OFF_LATTICE = 0.6123
_OF_A_CELL = 0.75


def offset_level(volume: Volume, raster: Raster) -> float:
    """How far outside the skin the surface is meant to lie, [mm]: a voxel's diagonal.

    Simplifying and interpolating take some of it, and partial volume a little. In a
    very long scan cells are much larger than voxels, and the surface follows them.
    """
    step = float(np.median(np.abs(np.diff(volume.places[:, 2]))))
    diagonal = float(np.linalg.norm([*volume.spacing, step]))
    return max(diagonal, _OF_A_CELL * float(raster.size.mean())) + _OFF_LATTICE


def surface_around(
    whole: Extended,
    level: float,
    skin: Iterable[Array] | None,
    coarser: int = 1,
) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (n, 3) along the raster's axes, [mm], and triangles, outward.

    Hollows that do not reach the outside are filled.

    Args:
        whole: The cells; there may be some at the raster's edges.
        level: Distance of the surface, [mm].
        skin: Points of the skin, slab by slab, as dense as voxels: the distance is from
            them where they are; None: from the cells of the body.
        coarser: Every so many-th lattice point is taken.
    """
    pads = tuple(int(n) for n in np.ceil(level / whole.raster.size[::-1]) + coarser + 1)
    wide = whole.raster.padded(pads, pads)
    # exact where it is kept: no cell is nearer to a point than it says
    step = (slice(None, None, coarser),) * 3
    field = np.ascontiguousarray(_distances(wide)[step])
    if skin is not None:
        assumed = np.pad(whole.assumed, [(n, n) for n in pads])
        other = _distances(wide.with_cells(assumed))[step] if assumed.any() else None
        _refine(field, other, wide, level, skin, coarser)
    _fill_hollows(field, level)
    measure = library("skimage.measure", "scikit-image")
    spacing = tuple(float(s) for s in coarser * wide.size[::-1])
    points, triangles, _, _ = measure.marching_cubes(field, level, spacing=spacing)
    vertices = points[:, ::-1].astype(np.float64) + wide.low
    triangles = np.asarray(triangles, dtype=np.int64)
    return vertices, _outward(vertices, triangles)


def _refine(
    field: NDArray[np.float32],
    other: NDArray[np.float32] | None,
    wide: Raster,
    level: float,
    skin: Iterable[Array],
    coarser: int,
) -> None:
    """Distances from the skin itself, where the surface will be, instead of cells.

    Args:
        field: Distances from all cells, changed in place.
        other: Distances from cells that continue the body, where no skin is.
        wide: The raster of the lattice.
        level: Distance of the surface, [mm].
        skin: See `surface_around`.
        coarser: See `surface_around`.
    """
    reach = level + coarser * float(np.linalg.norm(wide.size))
    w, v, u = np.nonzero((field > 0.0) & (field <= reach))
    points = wide.low + wide.size * coarser * np.stack([u, v, w], axis=1)
    nearest = np.full(len(points), np.inf)
    for vertices in skin:
        low, high = vertices[:, 2].min() - reach, vertices[:, 2].max() + reach
        close = np.flatnonzero((points[:, 2] >= low) & (points[:, 2] <= high))
        if len(close):
            found, _ = cKDTree(vertices).query(
                points[close], distance_upper_bound=2.0 * reach
            )
            nearest[close] = np.minimum(nearest[close], found)
    nearest[~np.isfinite(nearest)] = 2.0 * reach
    if other is not None:
        nearest = np.minimum(nearest, other[w, v, u])
    field[w, v, u] = nearest


def simplified(
    vertices: Array, triangles: NDArray[np.int64], tolerance: float
) -> TriangleMesh | None:
    """The surface with fewer triangles, still closed; None if the library cannot.

    Args:
        vertices: (n, 3), [mm].
        triangles: (m, 3).
        tolerance: Of the simplification, [mm]; no bound, see `proof`.
    """
    manifold3d = library("manifold3d")
    whole = manifold3d.Manifold(
        manifold3d.Mesh64(vertices, np.ascontiguousarray(triangles.astype(np.uint64)))
    )
    if whole.status() != manifold3d.Error.NoError or whole.is_empty():
        return None
    mesh = whole.simplify(tolerance).to_mesh64()
    points = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    faces = np.asarray(mesh.tri_verts, dtype=np.int64)
    if len(faces) == 0:
        return None
    return TriangleMesh("patient", points, faces)


def _distances(raster: Raster) -> NDArray[np.float32]:
    """Distance of the cells' corners from the nearest cell, (w + 1, v + 1, u + 1)."""
    corners = np.zeros(tuple(n + 1 for n in raster.cells.shape), dtype=bool)
    for a in (slice(0, -1), slice(1, None)):
        for b in (slice(0, -1), slice(1, None)):
            for c in (slice(0, -1), slice(1, None)):
                corners[a, b, c] |= raster.cells
    sampling = tuple(float(s) for s in raster.size[::-1])
    found = ndimage.distance_transform_edt(~corners, sampling=sampling)
    return np.asarray(found, dtype=np.float32)


def _fill_hollows(field: NDArray[np.float32], level: float) -> None:
    """Sets to 0 what is beyond the level and not connected to the outside."""
    beyond: Cells = field > level
    labels, count = ndimage.label(beyond)
    if count > 1:
        field[beyond & (labels != labels[0, 0, 0])] = 0.0


def _outward(vertices: Array, triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    corners = vertices[triangles] - vertices.mean(axis=0)
    cross = np.cross(corners[:, 1], corners[:, 2])
    volume = float(np.einsum("ij,ij->", corners[:, 0], cross))
    return triangles if volume > 0.0 else np.ascontiguousarray(triangles[:, ::-1])
