"""Containment in closed meshes: points, components, cavities, bores, open meshes."""

import numpy as np
import pytest
import trimesh

from borecheck.core.se3 import transform
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.geometry.triangles.solid import Side, contained, is_inside
from borecheck.geometry.triangles.topology import topology


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


def twice(mesh, other_diagonals=False):
    """The mesh drawn on both sides; a box's faces may be cut along other diagonals."""
    back = flipped(mesh)
    if other_diagonals:
        back = flipped(TriangleMesh("b", -mesh.vertices, mesh.triangles))
        back = TriangleMesh("b", back.vertices, back.triangles[:, ::-1])
    return joined(mesh, back, name="drawn twice")


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


@pytest.mark.parametrize("other_diagonals", [False, True])
def test_matter_drawn_on_both_sides_is_not_outside(other_diagonals):
    block = twice(box(3.0), other_diagonals)
    for shape in (block, soup(block), topsy_turvy(block)):
        assert topology(shape).is_closed
        assert is_inside((0.1, 0.2, 0.3), shape) is Side.UNDECIDED
        answer = contained(box(0.1, (0.1, 0.2, 0.3), "arm"), shape)
        assert answer.kind == contained(shape, box(0.1)).kind == "unknown"
        assert "arm may be inside drawn twice" in answer.reason
    assert contained(block, box(9.0)).kind == "a_in_b"  # of the other it is known


def test_what_is_beside_matter_drawn_twice_is_outside(gantry):
    ring = twice(gantry)
    assert is_inside((0.6, 0.0, 0.0), ring) is Side.UNDECIDED
    assert is_inside((0.0, 0.0, 0.0), ring) is Side.OUTSIDE
    assert is_inside((0.85, 0.85, 0.0), ring) is Side.OUTSIDE


def test_an_arm_that_reaches_out_of_a_nook_is_free():
    """A block with a bent tunnel: from its end no ray along an axis leads out."""
    full = np.ones((5, 5, 5), dtype=bool)
    full[2, 2, 2] = full[3, 2, 2:] = False
    block = of_cubes(full)
    end = (2.5, 2.5, 2.5)
    short = box(0.2, end)
    arm = of_cubes(~full)
    arm = TriangleMesh("arm", 0.5 * arm.vertices + [1.675, 1.25, 1.25], arm.triangles)
    assert is_inside(end, block) is Side.OUTSIDE  # embedded: the winding number tells
    assert contained(short, block).kind == contained(arm, block).kind == "none"
    assert is_inside(end, twice(block)) is Side.UNDECIDED
    assert contained(short, twice(block)).kind == "unknown"
    assert contained(arm, twice(block)).kind == "none"


def of_cubes(full):
    """The surface of unit cubes, (k, k, k) bool, wound outward."""
    cube = trimesh.creation.box((1.0, 1.0, 1.0))
    faces, padded = [], np.pad(full, 1)
    for cell in np.argwhere(full):
        for corners, normal in zip(cube.triangles, cube.face_normals, strict=True):
            if not padded[tuple(cell + 1 + np.round(normal).astype(int))]:
                faces.append(corners + cell + 0.5)
    vertices = np.concatenate(faces)
    return TriangleMesh("cubes", vertices, np.arange(len(vertices)).reshape(-1, 3))


def test_overlapping_blocks_of_which_one_is_inverted():
    blocks = joined(box(2.0), flipped(box(2.0, (0.5, 0.4, 0.3))))
    assert is_inside((0.2, 0.1, 0.3), blocks) is Side.UNDECIDED
    assert is_inside((-0.9, 0.0, 0.0), blocks) is Side.INSIDE
    assert is_inside((1.4, 0.5, 0.5), blocks) is Side.INSIDE
    assert is_inside((-0.9, 1.3, 0.0), blocks) is Side.OUTSIDE


@pytest.mark.parametrize(
    ("edge", "centre", "side"),
    [
        (1.0, (0.0, 0.0, 0.0), Side.OUTSIDE),  # a cavity
        (1.0, (0.4999, 0.0, 0.0), Side.OUTSIDE),  # with a wall of 0.1 mm
        (1.0, (0.5, 0.0, 0.0), Side.UNDECIDED),  # its face lies in the outer one
        (2.0 - 4e-6, (0.0, 0.0, 0.0), Side.UNDECIDED),  # no wall is so thin
        (2.0 - 4e-4, (0.0, 0.0, 0.0), Side.OUTSIDE),
    ],
)
def test_a_cavity_needs_a_wall(edge, centre, side):
    hollow = joined(box(2.0), flipped(box(edge, centre)))
    assert is_inside((0.3, 0.2, 0.1), hollow) is side
    # inside out it may as well be a block in another one, of which that one is
    assert is_inside((0.3, 0.2, 0.1), flipped(hollow)) is Side.UNDECIDED
    assert is_inside((0.3, 0.2, 0.1), topsy_back(hollow)) in (side, Side.INSIDE)


def topsy_back(mesh):
    """Both shells wound outward: one block in another, no cavity."""
    half = len(mesh.triangles) // 2
    triangles = np.concatenate([mesh.triangles[:half], mesh.triangles[half:, ::-1]])
    return TriangleMesh(mesh.name, mesh.vertices, triangles)


def test_room_of_overlapping_walls_is_free_within():
    """No ray leaves it, but no wall is round the point."""
    walls = [box((2.2, 2.2, 0.2), (0.0, 0.0, z)) for z in (-1.0, 1.0)]
    walls += [box((2.2, 0.2, 2.1), (0.0, y, 0.0)) for y in (-1.0, 1.0)]
    walls += [box((0.2, 2.15, 2.12), (x, 0.0, 0.0)) for x in (-1.0, 1.0)]
    assert is_inside((0.1, 0.2, 0.3), joined(*walls)) is Side.OUTSIDE
    inverted = joined(*walls[:5], flipped(walls[5]))
    assert is_inside((0.1, 0.2, 0.3), inverted) is Side.OUTSIDE
    assert is_inside((1.0, 0.2, 0.3), inverted) is Side.INSIDE


def test_a_surface_that_crosses_itself_hides_matter():
    """Two pyramids, base to base, over a line that runs round, back and out again."""
    base = [(2, -2), (2, 2), (-2, 2), (-2, -2), (1.5, -1.5), (-1, -1), (-1, 1)]
    base += [(1, 1), (1, -1.2), (-1.6, -1.8), (1.8, -1.9)]
    flat = np.column_stack([np.array(base), np.zeros(len(base))])
    vertices = np.vstack([flat, [[0.0, 0.0, 3.0], [0.0, 0.0, -3.0]]])
    n = len(base)
    sides = [(i, (i + 1) % n, n) for i in range(n)]
    sides += [((i + 1) % n, i, n + 1) for i in range(n)]
    shape = TriangleMesh("folded", vertices, np.array(sides))
    assert topology(shape).is_closed
    winding = solid_angle(np.array([0.1, 0.2, 0.1]), shape.corners) / (4.0 * np.pi)
    assert abs(winding) < 1e-9
    assert not topology(shape).is_embedded(0)
    assert is_inside((0.1, 0.2, 0.1), shape) is Side.UNDECIDED


def test_the_rim_of_a_sheet_drawn_on_both_sides_is_open():
    bin_ = box(1.0)
    lid = bin_.corners[:, :, 2].min(axis=1) > 0.4
    opened = twice(TriangleMesh("bin", bin_.vertices, bin_.triangles[~lid]))
    assert not topology(opened).is_closed
    assert contained(box(0.1), opened).kind == "unknown"
    # a flat fin of a solid holds nothing, whatever it is joined to
    fin = TriangleMesh("f", [[0.5] * 3, [0.5, 0.5, -0.5], [2.0, 1.0, 0.0]], [[0, 1, 2]])
    finned = joined(box(1.0), twice(fin))
    assert topology(finned).component.max() == 0
    assert topology(finned).is_closed
    assert contained(box(0.1), finned).kind == "a_in_b"
    assert contained(box(0.01, (0.8, 0.3, 0.0)), finned).kind == "none"
    # boxes face to face have a face in common, but no rim
    assert topology(joined(box(1.0), box(1.0, (1.0, 0.0, 0.0)))).is_closed


def test_random_blocks_turned_inside_out_hide_nothing(rng):
    """A point in no block is outside; one in a block is so in a cavity alone."""
    seen = []
    for _ in range(60):
        sizes = rng.uniform(0.3, 1.6, size=(4, 3))
        centres = rng.uniform(-0.6, 0.6, size=(4, 3))
        sizes[0], centres[0] = 2.3, 0.0
        out = rng.random(4) < 0.5
        blocks = [box(*pair) for pair in zip(sizes, centres, strict=True)]
        shape = joined(
            *(b if o else flipped(b) for b, o in zip(blocks, out, strict=True))
        )
        for p in rng.uniform(-1.2, 1.2, size=(12, 3)):
            holds = np.flatnonzero((np.abs(p - centres) < sizes / 2).all(axis=1))
            side = is_inside(p, shape)
            seen.append((len(holds), side))
            if len(holds) == 0 or nested(sizes[holds], centres[holds], out[holds]):
                assert side is Side.OUTSIDE
            else:
                assert side in (Side.INSIDE, Side.UNDECIDED)
    assert {(0, Side.OUTSIDE), (2, Side.UNDECIDED), (2, Side.INSIDE)} <= set(seen)
    assert (2, Side.OUTSIDE) in seen  # a cavity


def nested(sizes, centres, out):
    """Whether blocks lie one in another, and matter ends before it begins again."""
    order = np.argsort(sizes[:, 0])[::-1]
    low, high = (centres - sizes / 2)[order], (centres + sizes / 2)[order]
    inside = (low[:-1] < low[1:]).all() and (high[1:] < high[:-1]).all()
    layers = np.where(out[order], 1, -1).cumsum()
    return bool(inside and layers[-1] == 0 and layers.min() >= 0)
