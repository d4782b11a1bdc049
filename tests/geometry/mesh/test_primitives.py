import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.primitives import (
    TOLERANCE,
    box,
    capsule,
    cylinder,
    sphere,
)
from borecheck.geometry.triangles.placing import place_mesh

# float64 rounding of a few products of numbers below 1
ROUNDING = 1e-12


def signed_volume(mesh):
    a, b, c = (mesh.corners[:, k] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def face_distances(mesh):
    """Distance of every face's plane from the origin, along its outward normal."""
    a, b, c = (mesh.corners[:, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.einsum("ij,ij->i", normal, a)


@pytest.mark.parametrize(
    ("mesh", "least"),
    [
        (box("b", (0.1, 0.2, 0.3)), 0.006),
        (cylinder("c", 0.1, 0.4), np.pi * 0.01 * 0.4),
        (sphere("s", 0.1), 4.0 / 3.0 * np.pi * 1e-3),
        (capsule("k", 0.1, 0.4), np.pi * 0.01 * 0.4 + 4.0 / 3.0 * np.pi * 1e-3),
    ],
    ids=["box", "cylinder", "sphere", "capsule"],
)
def test_closed_outward_and_never_smaller_than_the_shape(mesh, least):
    assert mesh.is_closed
    assert signed_volume(mesh) >= least * (1.0 - ROUNDING)
    assert signed_volume(mesh) <= least * 1.03


def test_sphere_touches_the_true_one_from_outside():
    distances = face_distances(sphere("s", 0.25))
    assert distances.min() >= 0.25
    assert distances.min() < 0.25 * 1.001


def test_cylinder_faces_are_tangent():
    mesh = cylinder("c", 0.1, 0.4)
    sides = np.abs(np.cross(*np.moveaxis(np.diff(mesh.corners, axis=1), 1, 0))[:, 2])
    tangent = face_distances(mesh)[sides < ROUNDING]
    assert len(tangent) == 2 * 104
    np.testing.assert_allclose(tangent, 0.1, atol=ROUNDING)


SHAPES = {
    "cylinder": lambda r: cylinder("c", r, 0.4),
    "sphere": lambda r: sphere("s", r),
    "capsule": lambda r: capsule("k", r, 0.4),
}


def depth_in(kind, points, r):
    """How deep points lie in the shape, from its definition; negative outside."""
    beside = np.hypot(points[:, 0], points[:, 1])
    beyond = np.abs(points[:, 2]) - 0.2
    if kind == "sphere":
        return r - np.linalg.norm(points, axis=1)
    if kind == "capsule":
        return r - np.hypot(beside, np.maximum(beyond, 0.0))
    return np.minimum(r - beside, -beyond)


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("r", [0.0006, 0.02, 0.05, 0.3])
def test_the_true_shape_lies_between_the_two_polyhedra(kind, r, rng):
    """On random points of all faces, and by the distance of corners that correspond."""
    mesh = SHAPES[kind](r)
    assert mesh.excess <= max(TOLERANCE, 4e-4 * r)
    shares = rng.dirichlet((0.5, 0.5, 0.5), size=(len(mesh.triangles), 5))
    for surface, sign in ((mesh, -1.0), (mesh.inner, 1.0)):
        assert surface.is_closed
        points = np.einsum("mkc,mcd->mkd", shares, surface.corners).reshape(-1, 3)
        depth = sign * depth_in(kind, points, r)
        assert depth.min() >= -ROUNDING
        assert depth.max() <= mesh.excess + ROUNDING
    turned = mesh.moved(transform((1.0, 2.0, 3.0), (0.1, 0.2, 0.3)))
    assert turned.excess == pytest.approx(mesh.excess, abs=ROUNDING)
    placed = place_mesh(transform((1.0, 2.0, 3.0), (0.1, 0.2, 0.3)), mesh)
    np.testing.assert_allclose(placed.inner.vertices, turned.inner.vertices)
    assert box("b", (r, r, r)).inner.excess == 0.0


@pytest.mark.parametrize("size", [(0.1, 0.0, 0.1), (0.1, -1.0, 0.1), (0.1, np.nan, 1)])
def test_sizes_that_are_none_are_refused(size):
    with pytest.raises(GeometryError, match="box of b"):
        box("b", size)
