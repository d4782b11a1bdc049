"""Embedded or not: what neighbours share, and surfaces a gap apart."""

import numpy as np
import pytest
import trimesh

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.embedding import are_apart, is_embedded
from borecheck.geometry.triangles.topology import Topology, topology
from tests.geometry.triangles.test_solid import flipped, joined, mesh_of, soup


def embedded(mesh):
    return topology(mesh).is_embedded(0)


SHAPES = [
    trimesh.creation.box((1.0, 2.0, 3.0)),
    trimesh.creation.icosphere(3),
    trimesh.creation.annulus(0.3, 0.9, 0.5, sections=32),
    trimesh.creation.torus(1.0, 0.3, 24, 12),
    trimesh.creation.box((1, 1, 1)).subdivide().subdivide(),
]


@pytest.mark.parametrize("shape", SHAPES, ids=range(len(SHAPES)))
def test_plain_solids_are_embedded_however_they_lie(shape, rng):
    mesh = mesh_of(shape)
    assert embedded(mesh)
    assert embedded(soup(mesh))
    assert embedded(flipped(mesh))
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))
    assert embedded(mesh.moved(turn))


@pytest.mark.parametrize("shape", SHAPES, ids=range(len(SHAPES)))
def test_a_corner_pulled_through_the_surface_is_found(shape, rng):
    """Triangles that cross then share a corner or nothing."""
    vertices = shape.vertices.copy()
    centre = vertices.mean(axis=0)
    k = rng.integers(len(vertices))
    vertices[k] = centre - 3.0 * (vertices[k] - centre) + 0.01 * rng.random(3)
    assert not embedded(mesh_of(trimesh.Trimesh(vertices, shape.faces, process=False)))


def test_a_dent_is_no_crossing(rng):
    shape = trimesh.creation.icosphere(2)
    vertices = shape.vertices * rng.uniform(0.97, 1.03, size=(len(shape.vertices), 1))
    assert embedded(mesh_of(trimesh.Trimesh(vertices, shape.faces, process=False)))


def test_a_fold_is_found():
    """A flap of two triangles that lie on each other, along an edge they share."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.8, 0], [0.3, 0.3, 1]]
    fold = np.array([[0, 1, 2], [1, 0, 3]])
    points = np.array(corners, dtype=float)
    # closed by a fan from above over the rim of the two: 1-2, 2-0, 0-3, 3-1
    fan = np.array([[2, 1, 4], [0, 2, 4], [3, 0, 4], [1, 3, 4]])
    triangles = np.concatenate([fold, fan])
    assert not is_embedded(points[triangles], triangles)
    opened = points.copy()
    opened[3] = [0.2, 0.8, -0.5]
    opened[3, 1] = -0.8
    assert is_embedded(opened[triangles], triangles)


def test_two_cones_that_share_a_tip_may_or_may_not_cross():
    """All triangles that cross here have the tip in common."""
    cone = mesh_of(trimesh.creation.cone(1.0, 1.0, sections=12))
    cone = TriangleMesh("cone", cone.vertices - [0.0, 0.0, 1.0], cone.triangles)
    for angle, expected in ((np.pi, True), (1.9, True), (0.7, False), (1.5, False)):
        turn = trimesh.transformations.rotation_matrix(angle, [1.0, 0.0, 0.0])
        both = joined(cone, cone.moved(turn))
        assert topology(both).component.max() == 0
        assert embedded(both) is expected


def test_not_two_triangles_at_each_edge_is_not_embedded():
    block = mesh_of(SHAPES[0])
    assert not embedded(joined(block, flipped(block)))
    assert not embedded(joined(block, block))


@pytest.mark.parametrize("gap", [1e-5, 1e-3])
def test_apart_by_more_than_a_gap(gap):
    block = trimesh.creation.box((1.0, 1.0, 1.0)).triangles
    for factor, expected in ((0.999, False), (1.001, True)):
        beside = block + [1.0 + factor * gap, 0.3, 0.2]
        assert are_apart(block, beside, gap) is expected
        assert are_apart(beside, block, gap) is expected
    assert are_apart(block, 0.9 * block, gap)  # one in the other
    assert not are_apart(block, block + 0.2, gap)


def test_where_winding_numbers_tell(monkeypatch):
    """Embedded parts of one way round cannot cancel; kept on disk if large."""
    block = mesh_of(SHAPES[0])
    shifted = TriangleMesh("b", block.vertices + 0.3, block.triangles)
    assert topology(joined(block, shifted)).winding_tells
    assert topology(flipped(joined(block, shifted))).winding_tells
    assert not topology(joined(block, flipped(shifted))).winding_tells
    assert not topology(joined(block, flipped(block))).winding_tells
    large = mesh_of(trimesh.creation.icosphere(4))
    assert topology(large).winding_tells
    monkeypatch.setattr(Topology, "_find_winding_tells", lambda _: 1 / 0)
    assert topology(large).winding_tells  # read from disk
