"""A closed surface at a distance around cells, simplified.

On the lattice of the cells' corners the distance to the nearest cell is the distance to
the nearest corner of one: there the field is exact. What interpolation and simplifying
do to the surface is not bounded here but measured afterwards, in `proof`.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.patients.libraries import library
from borecheck.patients.raster import Cells, Raster
from borecheck.patients.volume import Array, Volume

# Off every value that the lattice can have: a level on one gives no manifold.
_OFF_LATTICE = -0.2123
_DIAGONALS = 1.3


def offset_level(volume: Volume) -> float:
    """How far outside the cells the surface is meant to lie, [mm].

    The skin lies up to half a voxel's diagonal outside the voxels of tissue, and
    simplifying and interpolating take about as much again.
    """
    step = float(np.median(np.abs(np.diff(volume.places[:, 2]))))
    return _DIAGONALS * float(np.linalg.norm([*volume.spacing, step])) + _OFF_LATTICE


def surface_around(
    raster: Raster, level: float, coarser: int = 1
) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (n, 3) along the raster's axes, [mm], and triangles, outward.

    Hollows that do not reach the outside are filled.

    Args:
        raster: The cells; there may be some at its edges.
        level: Distance of the surface, [mm].
        coarser: Every so many-th lattice point is taken.
    """
    pads = tuple(int(n) for n in np.ceil(level / raster.size[::-1]) + 1)
    wide = raster.padded(pads, pads)
    field = _distances(wide)
    if coarser > 1:
        # exact where it is kept: no part of the body is nearer to a point than it says
        field = np.ascontiguousarray(field[::coarser, ::coarser, ::coarser])
    _fill_hollows(field, level)
    measure = library("skimage.measure", "scikit-image")
    spacing = tuple(float(s) for s in coarser * wide.size[::-1])
    points, triangles, _, _ = measure.marching_cubes(field, level, spacing=spacing)
    vertices = points[:, ::-1].astype(np.float64) + wide.low
    triangles = np.asarray(triangles, dtype=np.int64)
    return vertices, _outward(vertices, triangles)


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
