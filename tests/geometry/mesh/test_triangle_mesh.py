import numpy as np
import pytest

from borecheck.errors import GeometryError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

TRIANGLE = np.array([[0, 1, 2]])


def test_arrays_are_copied_and_frozen():
    vertices = np.eye(3)
    mesh = TriangleMesh("m", vertices, TRIANGLE)
    vertices[0, 0] = 9.0
    assert mesh.vertices[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 2.0


def test_a_closed_box_and_one_without_a_face():
    closed = box("b", (1, 1, 1))
    assert closed.is_closed
    assert not TriangleMesh("open", closed.vertices, closed.triangles[1:]).is_closed


def test_a_triangle_soup_is_judged_by_its_shape():
    mesh = box("b", (1, 1, 1))
    soup = TriangleMesh("s", mesh.corners.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert soup.is_closed


def test_mixed_winding_is_not_closed():
    mesh = box("b", (1, 1, 1))
    triangles = mesh.triangles.copy()
    triangles[3] = triangles[3, ::-1]
    assert not TriangleMesh("m", mesh.vertices, triangles).is_closed


def test_the_hash_is_of_the_numbers():
    a, b = box("a", (1, 1, 1)), box("b", (1, 1, 1))
    assert a.sha256 == b.sha256
    assert a.sha256 != box("a", (1, 1, 1 + 1e-15)).sha256


@pytest.mark.parametrize(
    ("vertices", "triangles", "words"),
    [
        (np.full((3, 3), np.nan), TRIANGLE, "vertex 0 is not finite"),
        (np.eye(3), np.array([[0, 1, 3]]), "names vertex 3"),
        (np.eye(3), np.zeros((0, 3), int), "triangles have shape"),
        (np.eye(3)[:, :2], TRIANGLE, "vertices have shape"),
    ],
)
def test_bad_arrays_are_refused(vertices, triangles, words):
    with pytest.raises(GeometryError, match=words):
        TriangleMesh("m", vertices, triangles)


def test_the_corners_of_a_soup_are_its_vertices_and_take_no_memory():
    soup = box("b", (1.0, 2.0, 3.0)).corners.reshape(-1, 3)
    ids = np.arange(len(soup)).reshape(-1, 3)
    as_read = TriangleMesh("m", soup, ids)
    assert np.shares_memory(as_read.corners, as_read.vertices)
    turned = TriangleMesh("m", soup, ids[:, ::-1])  # another order
    assert np.array_equal(turned.corners, as_read.corners[:, ::-1])
    with pytest.raises(ValueError, match="read-only"):
        as_read.corners[0, 0, 0] = 2.0


def test_bounds_are_of_vertices_that_triangles_use():
    vertices = [*np.eye(3), [9.0, -9.0, 9.0]]
    mesh = TriangleMesh("m", np.array(vertices), TRIANGLE)
    assert np.array_equal(mesh.bounds, [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
