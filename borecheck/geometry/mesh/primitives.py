"""Boxes, cylinders and spheres of a URDF as triangles, never smaller than the shape.

A contact missed because a round link was drawn with chords is a missed contact, so
round shapes are circumscribed: the surface touches the true shape from outside.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

SECTIONS = 64
SPHERE_SUBDIVISIONS = 3


def box(name: str, size: ArrayLike) -> TriangleMesh:
    """A box centred at the origin with edge lengths size (3,), [m]."""
    half = _positive(name, "box", size, 3) / 2.0
    corners = np.array(
        [[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
    )
    quads = [
        (0, 1, 3, 2),
        (4, 6, 7, 5),
        (0, 4, 5, 1),
        (2, 3, 7, 6),
        (0, 2, 6, 4),
        (1, 5, 7, 3),
    ]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return TriangleMesh(name, corners * half, np.array(triangles))


def cylinder(name: str, radius: float, length: float) -> TriangleMesh:
    """A prism around a cylinder along z, centred; too large by 0.12 % of the radius."""
    radius, length = _positive(name, "cylinder", (radius, length), 2)
    angle = 2.0 * np.pi * np.arange(SECTIONS) / SECTIONS
    around = radius / np.cos(np.pi / SECTIONS)
    ring = around * np.column_stack([np.cos(angle), np.sin(angle)])
    low = np.column_stack([ring, np.full(SECTIONS, -length / 2)])
    high = np.column_stack([ring, np.full(SECTIONS, length / 2)])
    poles = np.array([[0.0, 0.0, -length / 2], [0.0, 0.0, length / 2]])
    i = np.arange(SECTIONS)
    j = (i + 1) % SECTIONS
    bottom, top = 2 * SECTIONS, 2 * SECTIONS + 1
    triangles = np.concatenate(
        [
            np.column_stack([i, j, j + SECTIONS]),
            np.column_stack([i, j + SECTIONS, i + SECTIONS]),
            np.column_stack([np.full(SECTIONS, bottom), j, i]),
            np.column_stack([np.full(SECTIONS, top), i + SECTIONS, j + SECTIONS]),
        ]
    )
    return TriangleMesh(name, np.concatenate([low, high, poles]), triangles)


def sphere(name: str, radius: float) -> TriangleMesh:
    """A subdivided octahedron around a sphere at the origin."""
    (radius,) = _positive(name, "sphere", (radius,), 1)
    axes = np.vstack([np.eye(3), -np.eye(3)])
    faces = np.array(
        [
            [0, 1, 2],
            [1, 3, 2],
            [3, 4, 2],
            [4, 0, 2],
            [1, 0, 5],
            [3, 1, 5],
            [4, 3, 5],
            [0, 4, 5],
        ]
    )
    corners = axes[faces]
    for _ in range(SPHERE_SUBDIVISIONS):
        corners = _subdivided(corners)
    corners /= np.linalg.norm(corners, axis=2, keepdims=True)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    deepest = np.einsum("ij,ij->i", normal, corners[:, 0]).min()
    vertices, index = np.unique(
        corners.reshape(-1, 3).round(12), axis=0, return_inverse=True
    )
    # rounding merged equal corners; 1e-9 pays for the digits it cost
    scaled = vertices * (radius * (1.0 + 1e-9) / deepest)
    return TriangleMesh(name, scaled, index.reshape(-1, 3))


def capsule(name: str, radius: float, length: float) -> TriangleMesh:
    """A cylinder about z with round ends, as the hull of two spheres at its ends."""
    from scipy.spatial import ConvexHull

    radius, length = _positive(name, "capsule", (radius, length), 2)
    ball = sphere(name, radius).vertices
    end = np.array([0.0, 0.0, length / 2])
    points = np.vstack([ball - end, ball + end])
    hull = ConvexHull(points)
    a, b, c = (points[hull.simplices[:, k]] for k in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) > 0
    triangles = np.where(outward[:, None], hull.simplices, hull.simplices[:, ::-1])
    return TriangleMesh(name, points, triangles)


def _subdivided(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([np.stack(part, axis=1) for part in parts])


def _positive(
    name: str, kind: str, values: ArrayLike, count: int
) -> NDArray[np.float64]:
    numbers = np.asarray(values, dtype=float)
    if numbers.shape != (count,) or not (np.isfinite(numbers) & (numbers > 0)).all():
        raise GeometryError(f"{kind} of {name} has size {values!r}, not {count} > 0")
    return numbers
