"""Containment in closed meshes: points, components, cavities, bores, open meshes."""

import numpy as np
import pytest
import trimesh

from borecheck.core.se3 import transform
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.geometry.triangles.solid import Side, contained, is_inside, topology


def mesh_of(shape, name="mesh"):
    return TriangleMesh(name, shape.vertices, shape.faces)


def box(size, centre=(0.0, 0.0, 0.0), name="box"):
    shape = trimesh.creation.box(np.broadcast_to(size, 3))
    return TriangleMesh(name, shape.vertices + np.array(centre), shape.faces)


def joined(*meshes, name="joined"):
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    triangles = [m.triangles + s for m, s in zip(meshes, starts, strict=False)]
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    return TriangleMesh(name, vertices, np.concatenate(triangles))


def flipped(mesh):
    return TriangleMesh(mesh.name, mesh.vertices, mesh.triangles[:, ::-1])


def soup(mesh):
    """The mesh as STL holds it: three corners of its own for every triangle."""
    triangles = np.arange(3 * len(mesh.triangles)).reshape(-1, 3)
    return TriangleMesh(mesh.name, mesh.corners.reshape(-1, 3), triangles)


@pytest.fixture(scope="module")
def gantry():
    """A ring with a bore, the bore along z."""
    return mesh_of(trimesh.creation.annulus(0.36, 0.9, 0.9, sections=64), "gantry")


def test_bore_is_outside_and_wall_is_inside(gantry):
    assert is_inside((0.0, 0.0, 0.0), gantry) is Side.OUTSIDE
    assert is_inside((0.6, 0.0, 0.0), gantry) is Side.INSIDE
    assert is_inside((0.0, -0.6, 0.1), gantry) is Side.INSIDE
    assert is_inside((0.0, 0.0, 0.6), gantry) is Side.OUTSIDE
    assert is_inside((0.0, 0.6, 0.45), gantry) is Side.ON_SURFACE


def test_agrees_with_the_solid_angle_sum(gantry):
    """The winding number as a sum of solid angles (Van Oosterom and Strackee)."""
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.95, 0.95, size=(400, 3))
    shape = topsy_turvy(gantry)
    inside = [is_inside(p, shape) is Side.INSIDE for p in points]
    winding = np.array([solid_angle(p, shape.corners) for p in points]) / (4.0 * np.pi)
    assert np.abs(winding - np.round(winding)).max() < 1e-9
    assert 50 < np.round(winding).sum() < 350
    assert (np.array(inside) == (np.round(winding) != 0)).all()


def topsy_turvy(mesh):
    return place_mesh(transform((0.01, 0.02, 0.03), (0.3, 0.5, 0.7)), mesh)


def solid_angle(point, corners):
    a, b, c = (corners - point).swapaxes(0, 1)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    above = np.einsum("nk,nk->n", a, np.cross(b, c))
    ab, bc, ca = (np.einsum("nk,nk->n", u, v) for u, v in ((a, b), (b, c), (c, a)))
    below = la * lb * lc + ab * lc + bc * la + ca * lb
    return 2.0 * np.arctan2(above, below).sum()


def test_rays_through_edges_and_corners_are_decided():
    """On a lattice through a subdivided box every ray meets edges or corners."""
    shape = mesh_of(trimesh.creation.box((2, 2, 2)).subdivide().subdivide())
    levels = np.linspace(-1.25, 1.25, 11)
    for point in np.array(np.meshgrid(levels, levels, levels)).reshape(3, -1).T:
        reach = np.abs(point).max()
        expected = (
            Side.INSIDE if reach < 1 else Side.OUTSIDE if reach > 1 else Side.ON_SURFACE
        )
        assert is_inside(point, shape) is expected


@pytest.mark.parametrize("sections", [4, 8, 36])
def test_ray_through_the_tips_of_a_turned_solid(sections):
    """Tips and edges in every direction: the octahedron and its finer relatives."""
    shape = mesh_of(trimesh.creation.uv_sphere(count=(sections, sections)))
    assert is_inside((0.0, 0.0, 0.0), shape) is Side.INSIDE
    for k in range(3):
        for sign in (-1.0, 1.0):
            outside, inside = np.zeros(3), np.zeros(3)
            outside[k], inside[k] = sign * 1.5, sign * 0.5
            assert is_inside(outside, shape) is Side.OUTSIDE
            assert is_inside(inside, shape) is Side.INSIDE


def test_one_unit_in_the_last_place_off_a_face():
    cube = box(2.0)
    assert is_inside((1.0, 0.3, 0.2), cube) is Side.ON_SURFACE
    assert is_inside((np.nextafter(1.0, 0.0), 0.3, 0.2), cube) is Side.INSIDE
    assert is_inside((np.nextafter(1.0, 2.0), 0.3, 0.2), cube) is Side.OUTSIDE


def test_cavity_overlap_and_direction_of_normals():
    hollow = joined(box(2.0), flipped(box(1.0)))
    assert is_inside((0.1, 0.2, 0.1), hollow) is Side.OUTSIDE
    assert is_inside((0.7, 0.2, 0.1), hollow) is Side.INSIDE
    overlapping = joined(box(2.0), box(2.0, (0.5, 0.4, 0.3)))
    assert is_inside((0.2, 0.1, 0.3), overlapping) is Side.INSIDE
    assert is_inside((0.2, 0.1, 0.3), flipped(box(2.0))) is Side.INSIDE


def test_closed_parts_that_share_an_edge_are_solid():
    boxes = joined(box(1.0), box(1.0, (1.0, 1.0, 0.0)))
    assert not boxes.is_closed  # four triangles meet in the common edge
    assert topology(boxes).is_closed
    assert is_inside((0.1, 0.2, 0.3), boxes) is Side.INSIDE
    assert is_inside((1.1, 0.9, 0.3), boxes) is Side.INSIDE
    assert is_inside((0.9, 0.2, 0.3), boxes) is Side.OUTSIDE
    assert contained(box(0.1, (1.0, 1.0, 0.0)), boxes).kind == "a_in_b"


def test_one_triangle_wound_the_wrong_way_leaves_no_inside():
    shape = box(1.0)
    triangles = shape.triangles.copy()
    triangles[0] = triangles[0, ::-1]
    spoiled = TriangleMesh("spoiled", shape.vertices, triangles)
    assert not topology(spoiled).is_closed
    assert contained(box(0.1), spoiled).kind == "unknown"


def test_link_in_the_wall_is_contained_and_link_in_the_bore_is_not(gantry):
    in_wall, in_bore = box(0.05, (0.6, 0.0, 0.0)), box(0.05)
    assert contained(in_wall, gantry).kind == "a_in_b"
    assert contained(gantry, in_wall).kind == "b_in_a"
    assert contained(in_bore, gantry).kind == "none"
    assert contained(gantry, in_bore).kind == "none"
    assert contained(in_bore, box(0.05, (3.0, 0.0, 0.0))).kind == "none"


def test_every_component_is_examined(gantry):
    parts = joined(box(0.05), box(0.05, (2.0, 0.0, 0.0)), box(0.05, (0.0, 0.6, 0.1)))
    answer = contained(parts, gantry)
    assert answer.kind == "a_in_b"
    assert answer.point[1] > 0.5
    assert contained(soup(parts), gantry).kind == "a_in_b"
    assert topology(soup(parts)).component.max() == 2
    assert (
        contained(joined(box(0.05), box(0.05, (2.0, 0.0, 0.0))), gantry).kind == "none"
    )


def test_topology_is_kept_by_moving(gantry):
    link = box(0.05)
    known = topology(link), topology(gantry)
    moved = place_mesh(transform((0.0, 0.6, 0.1), (0.1, 0.2, 0.3)), link)
    assert contained(moved, gantry, *known).kind == "a_in_b"
    answer, again = contained(moved, gantry, *known), contained(moved, gantry)
    assert (answer.kind, answer.reason) == (again.kind, again.reason)
    assert np.array_equal(answer.point, again.point)


def test_open_mesh_is_unknown_unless_the_boxes_rule_it_out(gantry):
    opened = TriangleMesh("open gantry", gantry.vertices, gantry.triangles[:-1])
    assert contained(box(0.05), opened).kind == "unknown"
    assert "open gantry is open" in contained(box(0.05), opened).reason
    assert contained(opened, box(0.05)).kind == "unknown"
    assert contained(box(0.05, (0.0, 0.0, 2.0)), opened).kind == "none"
    assert contained(opened, box(4.0)).kind == "a_in_b"  # inside a closed one it is


def test_touching_is_not_answered(gantry):
    touching = box(0.1, (0.6, 0.0, 0.4))
    assert contained(touching, gantry).kind == "unknown"
    assert "ask for contact first" in contained(touching, gantry).reason


def test_refuses_open_meshes_and_points_that_are_none(gantry):
    with pytest.raises(GeometryError, match="it has no inside"):
        is_inside((0.0, 0.0, 0.0), TriangleMesh("x", box(1).vertices, [[0, 1, 2]]))
    with pytest.raises(GeometryError, match="no point"):
        is_inside((0.0, np.nan, 0.0), gantry)
