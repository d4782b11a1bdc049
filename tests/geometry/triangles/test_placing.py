import numpy as np

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.placing import (
    place_mesh,
    place_triangle,
    place_vertices,
    placed_bounds,
)


def plain_place(T, v):
    """The order of operations the kernels promise, spelled out."""
    return [
        T[i, 0] * v[0] + T[i, 1] * v[1] + T[i, 2] * v[2] + T[i, 3] for i in range(3)
    ]


def test_all_roads_give_the_same_bits(rng):
    for _ in range(50):
        T = transform(rng.normal(size=3), rng.normal(size=3))
        vertices = rng.normal(size=(3, 3))
        placed = place_vertices(T, vertices)
        expected = np.array([plain_place(T, v) for v in vertices])
        assert np.array_equal(placed, expected)
        corners = vertices.reshape(1, 9)
        assert np.array_equal(place_triangle(T, corners, 0), expected.reshape(-1))


def test_identity_changes_nothing(rng):
    mesh = TriangleMesh("m", rng.normal(size=(9, 3)), np.arange(9).reshape(3, 3))
    assert np.array_equal(place_mesh(np.eye(4), mesh).vertices, mesh.vertices)


def test_placed_bounds_hold_the_placed_vertices(rng):
    for _ in range(50):
        mesh = TriangleMesh("m", rng.normal(size=(9, 3)), np.arange(9).reshape(3, 3))
        T = transform(rng.normal(size=3), rng.normal(size=3))
        low, high = placed_bounds(T, mesh.bounds)
        placed = place_mesh(T, mesh).vertices
        assert (placed >= low).all()
        assert (placed <= high).all()
