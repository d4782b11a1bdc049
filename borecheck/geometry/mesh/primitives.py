"""Boxes, cylinders, spheres and capsules of a URDF as triangles.

A contact missed because a round link was drawn with chords is a missed contact, so
round shapes are circumscribed: their surface is nowhere inside the true one, and no
farther outside than TOLERANCE as long as triangles are no more than some ten thousand.
Each carries the vertices of a polyhedron within the shape (`inner_vertices`): what
touches that one touches the shape for certain.
"""

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

# How far a round shape's surface may lie outside the true one, [m].
TOLERANCE = 5e-5
# At most so many sides are off by 0.0075 % of the radius, beyond 0.66 m.
LEAST_SECTIONS, MOST_SECTIONS = 64, 256

_OCTAHEDRON = np.array(
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
# Parts that an edge of the octahedron is cut into, and how often these are halved:
# 512 triangles up to 18,432, which are off by 0.033 % of the radius.
_CUTS = ((1, 3), (3, 2), (1, 4), (5, 2), (3, 3), (1, 5), (5, 3), (3, 4))
# Rounding of unit vectors, in shares of the radius.
_DIGITS = 1e-9


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
    """A prism around a cylinder along z, centred, and one within it."""
    radius, length = _positive(name, "cylinder", (radius, length), 2)
    n = _sections(radius)
    angle = 2.0 * np.pi * np.arange(n) / n
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n)])
    end = np.array([0.0, 0.0, length / 2])
    i = np.arange(n)
    j = (i + 1) % n
    bottom, top = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    triangles = np.concatenate(
        [
            np.column_stack([i, j, j + n]),
            np.column_stack([i, j + n, i + n]),
            np.column_stack([bottom, j, i]),
            np.column_stack([top, i + n, j + n]),
        ]
    )
    outer, inner = (
        np.concatenate([factor * ring - end, factor * ring + end, [-end, end]])
        for factor in (1.0 / np.cos(np.pi / n), 1.0 - _DIGITS)
    )
    return TriangleMesh(name, outer, triangles, inner)


def sphere(name: str, radius: float) -> TriangleMesh:
    """A subdivided octahedron around a sphere at the origin, and one within it."""
    (radius,) = _positive(name, "sphere", (radius,), 1)
    vertices, triangles, around = _ball(radius)
    outer, inner = (radius * factor * vertices for factor in (around, 1.0 - _DIGITS))
    return TriangleMesh(name, outer, triangles, inner)


def capsule(name: str, radius: float, length: float) -> TriangleMesh:
    """A cylinder about z with round ends: halves of a sphere, joined at the equator."""
    radius, length = _positive(name, "capsule", (radius, length), 2)
    vertices, triangles, around = _ball(radius)
    n = len(vertices)
    upper = vertices[triangles][:, :, 2].mean(axis=1) > 0.0
    edges = triangles[upper][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    a, b = edges[(vertices[edges][:, :, 2] == 0.0).all(axis=1)].T
    sides = [np.column_stack([b, a, a + n]), np.column_stack([b, a + n, b + n])]
    whole = np.concatenate([triangles[upper], triangles[~upper] + n, *sides])
    used, whole = np.unique(whole, return_inverse=True)
    end = np.array([0.0, 0.0, length / 2])
    outer, inner = (
        np.concatenate([factor * vertices + end, factor * vertices - end])[used]
        for factor in (radius * around, radius * (1.0 - _DIGITS))
    )
    return TriangleMesh(name, outer, whole.reshape(-1, 3), inner)


def _sections(radius: float) -> int:
    """Into how many sides a circle is cut so that its polygon is within tolerance."""
    n = LEAST_SECTIONS
    while n < MOST_SECTIONS and radius * (1.0 / np.cos(np.pi / n) - 1.0) > TOLERANCE:
        n += 8
    return n


def _ball(radius: float) -> tuple[NDArray[np.float64], NDArray[np.int64], float]:
    """The coarsest unit sphere within tolerance, and the factor that puts it around."""
    for cut in _CUTS:
        vertices, triangles, around = _unit_sphere(*cut)
        if radius * (around - 1.0) <= TOLERANCE:
            break
    return vertices, triangles, around


@cache
def _unit_sphere(
    parts: int, halvings: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], float]:
    """Vertices on the unit sphere, triangles, and the factor that puts them around it.

    The faces of an octahedron, each edge cut into so many parts and these halved.
    """
    axes = np.vstack([np.eye(3), -np.eye(3)])
    corners = _on_sphere(_cut(axes[_OCTAHEDRON], parts))
    for _ in range(halvings):
        corners = _on_sphere(_cut(corners, 2))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    deepest = np.einsum("ij,ij->i", normal, corners[:, 0]).min()
    vertices, index = np.unique(
        corners.reshape(-1, 3).round(12) + 0.0, axis=0, return_inverse=True
    )
    # rounding merged equal corners; _DIGITS pays for what it cost
    return vertices, index.reshape(-1, 3), (1.0 + _DIGITS) / float(deepest)


def _cut(corners: NDArray[np.float64], parts: int) -> NDArray[np.float64]:
    """Triangles (m, 3, 3) with each edge cut into so many parts: (m parts^2, 3, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v = (b - a) / parts, (c - a) / parts
    found = []
    for i in range(parts):
        for j in range(parts - i):
            p = a + i * u + j * v
            found.append(np.stack([p, p + u, p + v], axis=1))
            if i + j < parts - 1:
                found.append(np.stack([p + u, p + u + v, p + v], axis=1))
    return np.concatenate(found)


def _on_sphere(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(corners / np.linalg.norm(corners, axis=2, keepdims=True))


def _positive(
    name: str, kind: str, values: ArrayLike, count: int
) -> NDArray[np.float64]:
    numbers = np.asarray(values, dtype=float)
    if numbers.shape != (count,) or not (np.isfinite(numbers) & (numbers > 0)).all():
        raise GeometryError(f"{kind} of {name} has size {values!r}, not {count} > 0")
    return numbers
