"""A closed surface without self-contact round what a surface winds about.

The body is filled on a grid by signed crossings along z (parts that overlap count
once), creases narrower than twice `CLOSED` are filled, and the surface is drawn anew.
"""

import numpy as np
from manifold3d import Manifold, Mesh
from numpy.typing import NDArray
from scipy import ndimage
from skimage.measure import marching_cubes

Array = NDArray[np.float64]

CELL = 0.006  # [m]
CLOSED = 0.009  # [m]
TOLERANCES = (
    0.0035,
    0.0032,
    0.0029,
    0.0026,
    0.0023,
    0.002,
    0.0015,
)  # of simplifying, [m]


def solid(
    points: Array, triangles: NDArray[np.int64]
) -> tuple[Array, NDArray[np.int64]]:
    """Vertices and triangles of the closed surface, outward."""
    pad = 5
    origin = points.min(axis=0) - pad * CELL
    shape = np.ceil((points.max(axis=0) - origin) / CELL).astype(int) + pad
    inside = _filled(points, triangles, origin, shape)
    inside = ndimage.distance_transform_edt(~inside) * CELL <= CLOSED
    inside = ndimage.distance_transform_edt(inside) * CELL > CLOSED
    inside = ndimage.binary_fill_holes(inside)
    labels, count = ndimage.label(inside)
    if count > 1:
        sizes = ndimage.sum_labels(inside, labels, np.arange(1, count + 1))
        inside = labels == 1 + int(np.argmax(sizes))
    field = ndimage.distance_transform_edt(inside) - ndimage.distance_transform_edt(
        ~inside
    )
    field = ndimage.gaussian_filter(field.astype(np.float32), 1.5)
    drawn, faces, _, _ = marching_cubes(field, level=0.013)  # off the grid's values
    made = Manifold(_mesh(drawn * CELL, faces[:, ::-1]))
    if made.volume() < 0.0:
        made = Manifold(_mesh(drawn * CELL, faces))
    parts = sorted(made.decompose(), key=lambda part: -part.volume())
    vertices, faces = _arrays(parts[0])
    return vertices + origin, faces


def simplified(
    vertices: Array, triangles: NDArray[np.int64], tolerance: float
) -> tuple[Array, NDArray[np.int64]]:
    """Fewer triangles, about within a tolerance [m]."""
    return _arrays(Manifold(_mesh(vertices, triangles)).simplify(tolerance))


def _mesh(vertices: Array, triangles: NDArray[np.int64]) -> Mesh:
    return Mesh(vertices.astype(np.float32), triangles.astype(np.uint32))


def _arrays(made: Manifold) -> tuple[Array, NDArray[np.int64]]:
    mesh = made.to_mesh()
    vertices = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    return vertices, np.asarray(mesh.tri_verts, dtype=np.int64)


def _filled(points, triangles, origin, shape):
    """Cells whose middle a surface winds about."""
    winding = np.zeros(shape, dtype=np.int16)
    a, b, c = np.moveaxis((points[triangles] - origin) / CELL - 0.5 + 1e-4, 1, 0)
    first = np.ceil(np.minimum(np.minimum(a, b), c)[:, :2]).astype(int)
    last = np.floor(np.maximum(np.maximum(a, b), c)[:, :2]).astype(int)
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (
        c[:, 0] - a[:, 0]
    )
    for offset in np.ndindex(*(last - first + 1).max(axis=0)):
        at = first + offset
        k = np.flatnonzero((at <= last).all(axis=1) & (area != 0.0))
        i, j = at[k].T
        p, q, r, size = a[k], b[k], c[k], area[k]
        u = ((i - p[:, 0]) * (r - p)[:, 1] - (j - p[:, 1]) * (r - p)[:, 0]) / size
        v = ((q - p)[:, 0] * (j - p[:, 1]) - (q - p)[:, 1] * (i - p[:, 0])) / size
        z = p[:, 2] + u * (q - p)[:, 2] + v * (r - p)[:, 2]
        hit = (u >= 0.0) & (v >= 0.0) & (u + v < 1.0)
        level = np.clip(np.ceil(z[hit]).astype(int), 0, shape[2] - 1)
        # upward faces end what is below them
        sign = np.where(size[hit] > 0.0, -1, 1)
        np.add.at(winding, (i[hit], j[hit], level), sign)
    return np.cumsum(winding, axis=2) > 0
