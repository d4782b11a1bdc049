"""How far one shape sticks out of others: a look at points, no proof.

Looked at are the points that stick out farthest in many directions, and points spread
over the surface. A thin spike between the directions may be missed.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh.sampling import directions_on_sphere, points_on_triangles
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.geometry.triangles.solid import Side, side_of

Array = NDArray[np.float64]
Float32 = NDArray[np.float32]

DIRECTIONS = 200  # 9 deg apart: what sticks out is seen to 1 % of the shape's size
POINTS = 300  # spread over the surface that is looked at
SPREAD = 4000  # spread over the surfaces that it is compared with


def outline(mesh: TriangleMesh) -> Array:
    """Its vertices farthest out in many directions, and points spread over it."""
    vertices = mesh.vertices[np.unique(mesh.triangles)]
    out = np.unique(np.argmax(_along(vertices), axis=0))
    between = points_on_triangles(mesh.corners, POINTS)
    return np.concatenate([vertices[out], between])


def overhang(points: Array, solids: Sequence[TriangleMesh]) -> float:
    """How far the farthest of the points is outside all solids, at least, [m].

    Args:
        points: Of an outline, (n, 3), in the solids' frame.
        solids: At least one; an open one has a surface and no inside.
    """
    corners = np.concatenate([s.vertices[np.unique(s.triangles)] for s in solids])
    beyond = float((_along(points).max(axis=0) - _along(corners).max(axis=0)).max())
    # within their hull: between the solids, or where one of them is hollowed out
    return max(0.0, beyond, _between(points, solids))


def _between(points: Array, solids: Sequence[TriangleMesh]) -> float:
    """How far the farthest point is from the surface of all solids and in none."""
    count = max(1, SPREAD // len(solids))
    sample = np.concatenate([points_on_triangles(s.corners, count) for s in solids])
    size = max(float(np.linalg.norm(np.ptp(s.bounds, axis=0))) for s in solids)
    spacing = 2.0 * size / count**0.5  # a point on the surface may seem so far from it
    distance = _nearest(points, sample) - spacing
    for k in np.argsort(-distance):
        if distance[k] <= 0.0:
            break
        if not any(_holds(solid, points[k]) for solid in solids):
            return float(distance[k])
    return 0.0


def _nearest(points: Array, others: Array) -> Array:
    """Distance of each point to the nearest of the others, (n,)."""
    centre = others.mean(axis=0)
    a, b = points - centre, others - centre
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2.0 * a @ b.T
    return np.sqrt(np.maximum(squares.min(axis=1), 0.0))


def _holds(solid: TriangleMesh, point: Array) -> bool:
    low, high = solid.bounds
    if not ((point >= low) & (point <= high)).all():
        return False
    known = surface(solid).topology
    return known.is_closed and side_of(point, solid, known) is not Side.OUTSIDE


def _along(points: Array) -> Float32:
    """How far each point lies along each direction, (n, DIRECTIONS); to 1e-6 of it."""
    return points.astype(np.float32) @ _directions().T


@cache
def _directions() -> Float32:
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    spiral = directions_on_sphere(DIRECTIONS - len(axes))
    return np.concatenate([axes, spiral]).astype(np.float32)
