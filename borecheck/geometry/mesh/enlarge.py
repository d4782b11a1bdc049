"""The margin `enlarge-axes`: every part of a mesh grown by a cube.

[Matsuno2020] adds the margin (20 mm) on every side along each axis; here that is the
Minkowski sum with a cube whose half edge is the margin, along body or world axes.
The sum is formed for each connected part:

- A closed convex part: the exact sum, one closed surface (see `minkowski`).
- Any other part: the union of (triangle (+) cube) over its triangles, each hull a
  closed surface, and its own surface as well. As a set that is exact: a point of
  S (+) cube lies in S or within the cube of a point of its boundary. What lies in S
  but near no boundary is found by containment in the kept surface (if that is open,
  nobody can say what is inside, here as for the original).

A closed part around a hollow (an inner surface wound the other way) is not convex.
The sum of a union is the union of the sums, so parts may overlap and touch.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import ROTATION_TOLERANCE
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.minkowski import (
    NumberedSurface,
    convex_plus_cube,
    join,
    triangles_plus_cube,
)
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# A surface counts as convex if it leaves its convex hull by no more than this share of
# its largest coordinate: a few roundings to float32, the numbers of STL files.
_CONVEX = 4 * float(np.finfo(np.float32).eps)
_CHUNK = 2_000_000  # distances at a time: 16 MB


@dataclass(frozen=True, eq=False)
class Enlarged:
    """A mesh grown by a cube, and where each of its triangles came from.

    Attributes:
        mesh: All surfaces, in the frame of the original, [m].
        source: For each triangle the original triangle's number, (m,).
        part: For each triangle the number of its closed surface, (m,); -1 for the
            kept surfaces of parts that are not convex, together.
    """

    mesh: TriangleMesh
    source: Ids
    part: Ids

    def solids(self, near: Array | None = None) -> Iterator[TriangleMesh]:
        """Each closed surface by itself: what is inside any of them is in the sum.

        No surface of a small obstacle between a part and the surface of its sum meets
        a triangle: who wants a verdict has to ask for containment in these, too. The
        mesh as a whole may count as open, because neighbouring hulls share edges.

        Args:
            near: Only surfaces whose box meets this one, in the mesh's frame, (2, 3).
        """
        order = np.argsort(self.part, kind="stable")
        starts = np.flatnonzero(np.diff(self.part[order], prepend=-2))
        corners = self.mesh.corners[order]
        low = np.minimum.reduceat(corners.min(axis=1), starts)
        high = np.maximum.reduceat(corners.max(axis=1), starts)
        meets = np.ones(len(starts), dtype=np.bool_)
        if near is not None:
            meets = ((low <= near[1]) & (high >= near[0])).all(axis=1)
        groups = np.split(order, starts[1:])
        for k in np.flatnonzero(meets):
            rows = self.mesh.triangles[groups[k]]
            used, triangles = np.unique(rows, return_inverse=True)
            yield TriangleMesh(
                self.mesh.name, self.mesh.vertices[used], triangles.reshape(-1, 3)
            )


def enlarge(
    mesh: TriangleMesh, margin: float, R_mesh_axes: Array | None = None
) -> Enlarged:
    """The mesh with `margin` added on every side along each axis.

    Args:
        mesh: The original, in its own frame.
        margin: Half edge of the cube, [m].
        R_mesh_axes: Axes of the cube as columns in the mesh's frame, (3, 3): the
            identity for body axes, R_world_mesh transposed for world axes.

    Raises:
        GeometryError: A margin that is not positive, or axes that are no rotation.
    """
    if not (np.isfinite(margin) and margin > 0.0):
        raise GeometryError(f"mesh {mesh.name}: margin {margin} m is not positive")
    axes = _checked_axes(R_mesh_axes)
    vertices = mesh.vertices if axes is None else mesh.vertices @ axes
    points, triangles = _merged(vertices, mesh.triangles)
    surfaces = _surfaces(points, triangles, margin)
    whole = join([surface for surface, _ in surfaces])
    out = whole.vertices if axes is None else whole.vertices @ np.linalg.inv(axes)
    part = np.concatenate([numbers for _, numbers in surfaces])
    return Enlarged(TriangleMesh(mesh.name, out, whole.triangles), whole.source, part)


def _surfaces(
    points: Array, triangles: Ids, margin: float
) -> list[tuple[NumberedSurface, Ids]]:
    """Closed surfaces whose union is the sum, each with the part of its triangles."""
    convex = _convex_parts(points, triangles)
    found: list[tuple[NumberedSurface, Ids]] = []
    is_rest = np.ones(len(triangles), dtype=np.bool_)
    for number, rows in enumerate(convex):
        surface = _convex_sum(points, triangles, rows, margin)
        found.append((surface, np.full(len(surface.triangles), number)))
        is_rest[rows] = False
    rest = np.flatnonzero(is_rest)
    if len(rest):
        hulls = triangles_plus_cube(points[triangles[rest]], rest, margin)
        found.append((hulls, len(convex) + np.searchsorted(rest, hulls.source)))
        found.append(
            (NumberedSurface(points, triangles[rest], rest), np.full(len(rest), -1))
        )
    return found


def _checked_axes(R_mesh_axes: Array | None) -> Array | None:
    if R_mesh_axes is None:
        return None
    axes = np.array(R_mesh_axes, dtype=np.float64)
    if axes.shape != (3, 3) or not np.isfinite(axes).all():
        raise GeometryError(f"axes are not a finite (3, 3) array: {axes.tolist()}")
    if np.abs(axes @ axes.T - np.eye(3)).max() > ROTATION_TOLERANCE:
        raise GeometryError("axes of the margin are not orthonormal")
    return None if np.array_equal(axes, np.eye(3)) else axes


def _merged(vertices: Array, triangles: Ids) -> tuple[Array, Ids]:
    """Vertices at equal coordinates as one: an STL's parts hang together again."""
    points, number = np.unique(vertices, axis=0, return_inverse=True)
    return points, number.reshape(-1)[triangles].astype(np.int64)


def _convex_parts(points: Array, triangles: Ids) -> list[Ids]:
    """Triangle numbers of each part that is closed, convex and not hollow."""
    parts = connected_parts(len(points), triangles)
    closed = [rows for rows in parts if _is_closed(triangles[rows])]
    volumes = [_volume(points[triangles[rows]]) for rows in closed]
    hollow = _hollow([_box(points[triangles[rows]]) for rows in closed], volumes)
    return [
        rows
        for k, rows in enumerate(closed)
        if k not in hollow and _is_convex(points[triangles[rows]], volumes[k])
    ]


def _hollow(boxes: list[Array], volumes: list[float]) -> set[int]:
    """Parts wound inward within the box of another, and those others."""
    hollow: set[int] = set()
    for inner in np.flatnonzero(np.array(volumes) < 0.0):
        around = [k for k, box in enumerate(boxes) if _is_in(boxes[inner], box)]
        if len(around) > 1:  # more than itself
            hollow.update(around)
    return hollow


def connected_parts(n_vertices: int, triangles: Ids) -> list[Ids]:
    """Triangle numbers of each part that hangs together by shared vertices."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    links = coo_array(
        (np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])),
        shape=(n_vertices, n_vertices),
    )
    _, label_of_vertex = connected_components(links, directed=False)
    label = label_of_vertex[triangles[:, 0]]
    order = np.argsort(label, kind="stable")
    starts = np.flatnonzero(np.diff(label[order], prepend=-1))
    return [np.sort(rows) for rows in np.split(order.astype(np.int64), starts[1:])]


def _convex_sum(
    points: Array, triangles: Ids, rows: Ids, margin: float
) -> NumberedSurface:
    """Sum of one convex part; wound outward whatever way it came."""
    rows = rows[_has_three_corners(triangles[rows])]
    part = triangles[rows]
    if _volume(points[part]) < 0.0:
        part = part[:, ::-1]
    used, part = np.unique(part, return_inverse=True)
    surface = NumberedSurface(points[used], part.reshape(-1, 3), rows)
    return convex_plus_cube(surface, margin)


def _is_closed(triangles: Ids) -> bool:
    """Every edge once in each direction; triangles without three corners left out."""
    t = triangles[_has_three_corners(triangles)]
    if len(t) == 0:
        return False
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    base = np.int64(t.max()) + 1
    keys, counts = np.unique(edges[:, 0] * base + edges[:, 1], return_counts=True)
    back = np.unique(edges[:, 1] * base + edges[:, 0])
    return bool((counts == 1).all() and np.array_equal(keys, back))


def _has_three_corners(triangles: Ids) -> NDArray[np.bool_]:
    a, b, c = triangles.T
    return (a != b) & (b != c) & (c != a)


def _volume(corners: Array) -> float:
    local = corners - corners.reshape(-1, 3).mean(axis=0)
    return float(np.linalg.det(local).sum() / 6.0)


def _box(corners: Array) -> Array:
    flat = corners.reshape(-1, 3)
    return np.stack([flat.min(axis=0), flat.max(axis=0)])


def _is_in(inner: Array, outer: Array) -> bool:
    return bool((inner[0] >= outer[0]).all() and (inner[1] <= outer[1]).all())


def _is_convex(corners: Array, volume: float) -> bool:
    """Whether a closed surface is its own convex hull, up to `_CONVEX`."""
    from scipy.spatial import ConvexHull, QhullError

    points = np.unique(corners.reshape(-1, 3), axis=0)
    tolerance = _CONVEX * float(np.abs(points).max())
    try:
        hull = ConvexHull(points)
    except QhullError:  # flat, or too thin to tell: the general way is exact for it
        return False
    if abs(volume) < hull.volume - tolerance * hull.area:
        return False
    inner = np.setdiff1d(np.arange(len(points)), hull.vertices)
    planes = hull.equations
    step = max(1, _CHUNK // len(planes))
    for at in range(0, len(inner), step):
        rows = points[inner[at : at + step]]
        depth = (rows @ planes[:, :3].T + planes[:, 3]).max(axis=1)
        if (depth < -tolerance).any():
            return False
    return True
