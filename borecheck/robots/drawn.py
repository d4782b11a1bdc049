"""What is drawn of a link and lies outside its collision geometry.

Contacts are decided with `<collision>`; where a link is drawn beyond it, matter may be
that no verdict knows. Compared are the points that stick out farthest in many
directions, and points spread over the drawn surface, against the collision solids. It
is a look, not a proof: the tolerance says what is told, and a thin spike between the
directions may be missed.
"""

from collections.abc import Sequence
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from borecheck.core import cache as disk
from borecheck.errors import MeshError
from borecheck.geometry.mesh.sampling import directions_on_sphere, points_on_triangles
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import read_mesh
from borecheck.geometry.triangles.solid import Side, is_inside
from borecheck.geometry.triangles.topology import topology
from borecheck.robots.parts import Part, mesh_path, primitive
from borecheck.robots.urdf.reach import NO_ROOTS, Roots
from borecheck.robots.urdf.tree import Link, Mesh, Shape, UrdfTree

Array = NDArray[np.float64]

TOLERANCE = 0.01  # [m] simplified collision shapes cut corners by less
DIRECTIONS = 400
BLOCKS = 20  # of directions at a time: a large mesh needs little memory
POINTS = 600  # spread over a drawn surface
DENSE = 4000  # spread over the collision surface they are compared with
_KIND = "outline-1"


class Beyond(NamedTuple):
    """A link that is drawn beyond its collision geometry.

    Attributes:
        link: Its name.
        distance: How far at least, [m]; None if the drawn mesh cannot be read.
    """

    link: str
    distance: float | None


def drawn_beyond(
    tree: UrdfTree,
    parts: Sequence[Part],
    file: Path | None,
    roots: Roots = NO_ROOTS,
    tolerance: float = TOLERANCE,
) -> tuple[Beyond, ...]:
    """Links that are drawn farther out than their collision geometry by a tolerance.

    Args:
        tree: The robot.
        parts: Its collision geometry.
        file: Where relative mesh names start.
        roots: Where its meshes may lie beside its own folder tree.
        tolerance: What is not told, [m].
    """
    found = []
    for link in tree.links:
        if not link.collisions or _drawn_alike(link):
            continue
        solids = [part.mesh for part in parts if part.link == link.name]
        try:
            points = [
                _points(shape, link.name, file, roots)
                for shape in link.visuals
                if shape.has_size
            ]
        except MeshError:
            found.append(Beyond(link.name, None))
            continue
        distance = _excess(np.concatenate(points), solids) if points else 0.0
        if distance > tolerance:
            found.append(Beyond(link.name, distance))
    return tuple(found)


def _drawn_alike(link: Link) -> bool:
    """Whether everything drawn is a collision shape too, at the same place."""

    def same(a: Shape, b: Shape) -> bool:
        return a.geometry == b.geometry and np.array_equal(a.origin, b.origin)

    return all(any(same(v, c) for c in link.collisions) for v in link.visuals)


def _points(shape: Shape, link: str, file: Path | None, roots: Roots) -> Array:
    """Points on a drawn shape in the link's frame, (n, 3)."""
    if isinstance(shape.geometry, Mesh):
        path = mesh_path(shape.geometry.filename, link, file, roots)
        points = _outline(path) * np.array(shape.geometry.scale)
    else:
        points = outline(primitive("drawn", shape.geometry))
    return points @ shape.origin[:3, :3].T + shape.origin[:3, 3]


def _outline(path: Path) -> Array:
    """The outline of the mesh in a file, kept on disk by its content."""
    try:
        content = sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise MeshError(path, f"cannot be read: {error.strerror or error}") from error
    key = f"{content}-{path.suffix.lower().lstrip('.')}"
    points = _stored(key)
    if points is None:
        points = outline(read_mesh(path))
        disk.store(_KIND, key, {"points": points})
    return points


def _stored(key: str) -> Array | None:
    """The points kept under a key, if points they are."""
    points = (disk.load(_KIND, key) or {}).get("points")
    if points is None:
        return None
    fits = points.dtype == np.float64 and points.ndim == 2 and points.shape[1] == 3
    if not fits or not 0 < len(points) <= DIRECTIONS + POINTS:
        return None
    found = np.asarray(points, dtype=np.float64)
    return found if np.isfinite(found).all() else None


def outline(mesh: TriangleMesh) -> Array:
    """Its vertices farthest out in many directions, and points spread over it."""
    used = mesh.corners.reshape(-1, 3)
    blocks = np.split(_directions(), BLOCKS)
    out = np.concatenate([np.argmax(used @ block.T, axis=0) for block in blocks])
    return np.concatenate(
        [used[np.unique(out)], points_on_triangles(mesh.corners, POINTS)]
    )


def _excess(points: Array, solids: Sequence[TriangleMesh]) -> float:
    """How far the farthest of the points is outside all solids, at least."""
    corners = np.concatenate([solid.corners.reshape(-1, 3) for solid in solids])
    beyond_hull = float((_reach(points) - _reach(corners)).max())
    return max(beyond_hull, _inside_hull(points, solids))


def _reach(points: Array) -> Array:
    """How far out the points lie in each direction."""
    blocks = np.split(_directions(), BLOCKS)
    return np.concatenate([np.max(points @ block.T, axis=0) for block in blocks])


def _inside_hull(points: Array, solids: Sequence[TriangleMesh]) -> float:
    """The same by nearest surface points: it sees gaps between the solids."""
    from scipy.spatial import cKDTree

    surface = np.concatenate(
        [points_on_triangles(solid.corners, DENSE) for solid in solids]
    )
    size = max(float(np.linalg.norm(np.ptp(s.bounds, axis=0))) for s in solids)
    spacing = 2.0 * size / DENSE**0.5  # a point on the surface may seem so far from it
    distance = cKDTree(surface).query(points)[0] - spacing
    for k in np.argsort(-distance):
        if distance[k] <= TOLERANCE:
            break
        if not any(_holds(solid, points[k]) for solid in solids):
            return float(distance[k])
    return 0.0


def _holds(solid: TriangleMesh, point: Array) -> bool:
    low, high = solid.bounds
    if not ((point >= low) & (point <= high)).all():
        return False
    closed = solid.is_closed or topology(solid).is_closed
    return closed and is_inside(point, solid) is not Side.OUTSIDE


@cache
def _directions() -> Array:
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    return np.concatenate([axes, directions_on_sphere(DIRECTIONS - len(axes))])
