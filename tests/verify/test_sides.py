"""The verifier's solids and groups: directions, windings, parts, boxes, by hand."""

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box, sphere
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.verify.distance import (
    GROUP,
    GroupedMesh,
    lower_bounds,
    may_be_nearer,
    near_triangles,
    nearer_than,
)
from borecheck.verify.solid import (
    Side,
    _directions,
    connected_corners,
    is_closed,
    is_embedded,
    leads_away,
    side_of,
    winding,
)

Array = NDArray[np.float64]

CUBE = box("cube", [2.0] * 3)
ROUNDING = 1e-12


def grouped(*meshes: TriangleMesh) -> GroupedMesh:
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    triangles = [m.triangles + s for m, s in zip(meshes, starts[:-1], strict=True)]
    vertices = np.concatenate([m.vertices for m in meshes])
    return GroupedMesh(vertices, np.concatenate(triangles))


def moved(mesh: TriangleMesh, x: float, y: float = 0.0, z: float = 0.0) -> TriangleMesh:
    return TriangleMesh(mesh.name, mesh.vertices + [x, y, z], mesh.triangles)


def test_lines_lead_everywhere() -> None:
    """Of length 1, along the axes first, and no direction is far from all of them."""
    directions = _directions()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    np.testing.assert_array_equal(directions[:6], np.vstack([np.eye(3), -np.eye(3)]))
    points = np.random.default_rng(1).normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    nearest = (points @ directions[6:].T).max(axis=1)
    assert nearest.min() > np.cos(np.radians(16.0))
    assert np.abs(directions[6:].mean(axis=0)).max() < 0.02


@pytest.mark.parametrize("scale", [1e-3, 1.0, 100.0])
def test_a_line_leads_out_of_what_has_a_hole(scale: float) -> None:
    """Out of a cube no line leads; without a triangle one does, unless it is tiny."""
    corners = scale * CUBE.corners
    inside = scale * np.array([0.31, -0.23, 0.11])
    assert not leads_away(inside, corners)
    assert all(leads_away(inside, np.delete(corners, k, axis=0)) for k in range(12))
    for outside in ([3.0, 0.1, 0.2], [0.1, -3.0, 0.2], [1.2, 1.3, 1.4]):
        assert leads_away(scale * np.array(outside), corners)
    # a sheet before it and one behind it block the axes, not every line
    between = np.concatenate([moved(CUBE, 3.0).corners, moved(CUBE, -3.0).corners])
    assert leads_away(inside, scale * between)


def test_winding_counts_turns_with_their_sign() -> None:
    inside, outside = np.array([0.3, -0.2, 0.4]), np.array([1.3, 0.2, 0.4])
    small = box("small", [1.0] * 3).corners
    assert winding(inside, CUBE.corners) == pytest.approx(1.0)
    assert winding(inside, CUBE.corners[:, ::-1]) == pytest.approx(-1.0)
    assert winding(outside, CUBE.corners) == pytest.approx(0.0, abs=ROUNDING)
    both = np.concatenate([CUBE.corners, small])
    assert winding(inside, both) == pytest.approx(2.0)
    # an open one: the solid angle of one face of the cube from its middle is a sixth
    top = CUBE.corners[(CUBE.corners[:, :, 2] == 1.0).all(axis=1)]
    assert winding(np.zeros(3), top) == pytest.approx(1.0 / 6.0)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_just_in_and_just_out(axis: int, side: float) -> None:
    mesh = grouped(CUBE)
    point = np.array([0.13, 0.17, 0.19])
    for gap, expected in ((-1e-6, Side.INSIDE), (1e-6, Side.OUTSIDE)):
        point[axis] = side * (1.0 + gap)
        assert side_of(point, mesh) is expected


def test_parts_have_a_corner_each() -> None:
    """Whatever the order of the triangles, and joined by a vertex is joined."""
    parts = [moved(CUBE, 5.0 * k) for k in range(4)]
    mesh = grouped(*parts)
    order = np.random.default_rng(2).permutation(len(mesh.triangles))
    corners = connected_corners(mesh.vertices, mesh.triangles[order])
    assert len(corners) == 4
    middles = sorted(round(float(x) / 5.0) for x in corners[:, 0])
    assert middles == [0, 1, 2, 3]
    chain = grouped(CUBE, moved(CUBE, 2.0, 2.0, 2.0), moved(CUBE, 4.0, 4.0, 4.0))
    assert len(connected_corners(chain.vertices, chain.triangles)) == 1
    # vertices at equal places count as one
    soup = CUBE.corners.reshape(-1, 3)
    assert len(connected_corners(soup, np.arange(36).reshape(-1, 3))) == 1


def test_closed_is_every_edge_both_ways_as_often() -> None:
    v, t = CUBE.vertices, CUBE.triangles
    assert is_closed(v, t)
    assert is_closed(CUBE.corners.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert not is_closed(v, t[:-1])
    turned = t.copy()
    turned[3] = turned[3, ::-1]
    assert not is_closed(v, turned)
    assert is_closed(v, np.vstack([t, t]))
    assert not is_closed(v, np.vstack([t, t[:3]]))
    # a leaf that shares an edge is none, and a triangle of no area changes nothing
    assert not is_closed(np.vstack([v, [9.0, 9, 9]]), np.vstack([t, [[0, 1, 8]]]))
    assert is_closed(v, np.vstack([t, [[0, 1, 1]]]))


def test_a_surface_that_meets_itself_is_not_embedded() -> None:
    assert is_embedded(grouped(CUBE, moved(CUBE, 3.0)))
    assert is_embedded(grouped(CUBE, box("small", [1.0] * 3)))
    assert not is_embedded(grouped(CUBE, moved(CUBE, 1.5, 0.3, 0.2)))
    assert not is_embedded(grouped(CUBE, moved(CUBE, 2.0 + 1e-7)))
    assert is_embedded(grouped(CUBE, moved(CUBE, 2.0 + 1e-5)))
    assert not is_embedded(grouped(CUBE, CUBE))
    # far along in a mesh of many groups
    row = [moved(CUBE, 3.0 * k) for k in range(20)]
    pin = box("pin", [0.01, 0.01, 0.4])
    assert is_embedded(grouped(*row, moved(pin, 9.0, 0.1)))
    assert not is_embedded(grouped(*row, moved(pin, 9.0, 0.1, 1.0)))


def test_groups_and_their_boxes_hold_their_triangles() -> None:
    ball = sphere("ball", 1.0)
    mesh = GroupedMesh(ball.vertices, ball.triangles)
    assert sorted(mesh.order) == list(range(len(ball.triangles)))
    np.testing.assert_array_equal(mesh.sorted, ball.corners[mesh.order])
    boxes, groups = mesh.boxes(mesh.sorted)
    np.testing.assert_array_equal(boxes[:, 0], mesh.sorted.min(axis=1))
    np.testing.assert_array_equal(boxes[:, 1], mesh.sorted.max(axis=1))
    for k, (low, high) in enumerate(groups):
        own = mesh.sorted[GROUP * k : GROUP * (k + 1)].reshape(-1, 3)
        np.testing.assert_array_equal(low, own.min(axis=0))
        np.testing.assert_array_equal(high, own.max(axis=0))
    # neighbours are near each other: groups are far smaller than the whole
    assert np.ptp(groups, axis=1).max(axis=1).mean() < 1.0


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_boxes_are_as_far_apart_as_by_subtraction(axis: int, side: float) -> None:
    a, b = grouped(CUBE), grouped(box("b", [1.0] * 3))
    shift = np.zeros(3)
    shift[axis] = side * 4.0
    T = transform(shift)  # 4 - 1 - 0.5 apart
    for distance, nearer in ((2.5 - 1e-9, False), (2.5 + 1e-9, True)):
        assert nearer_than(a, b, T, distance) == nearer
        assert nearer_than(b, a, transform(-shift), distance) == nearer
    diagonal = transform([3.0, 4.0, 5.0])  # corners face each other
    gap = float(np.linalg.norm(np.array([3.0, 4.0, 5.0]) - 1.5))
    assert not nearer_than(a, b, diagonal, gap - 1e-9)
    assert nearer_than(a, b, diagonal, gap + 1e-9)


def test_near_triangles_are_all_whose_boxes_are_near(rng: np.random.Generator) -> None:
    ball = sphere("ball", 0.5)
    a, b = GroupedMesh(ball.vertices, ball.triangles), grouped(CUBE)
    for reach in (0.0, 0.1, 0.4):
        placed = a.sorted + rng.uniform(1.0, 1.6, 3)
        found = {
            (int(p), int(q))
            for i, j in near_triangles(a, placed, b, reach)
            for p, q in zip(i, j, strict=True)
        }
        low, high = placed.min(axis=1), placed.max(axis=1)
        other_low, other_high = b.sorted.min(axis=1), b.sorted.max(axis=1)
        apart = np.maximum(
            low[:, None] - other_high[None], other_low[None] - high[:, None]
        )
        gaps = np.linalg.norm(np.maximum(apart, 0.0), axis=2)
        expected = {(int(p), int(q)) for p, q in np.argwhere(gaps <= reach)}
        assert found == expected


def test_a_bound_is_taken_just_below_the_gap() -> None:
    """Exact numbers: the bound lacks a few roundings, and never has one too many."""
    first = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    for gap in (2.0**-20, 0.5, 64.0):
        second = first + [0.0, 0.0, gap]
        bound = lower_bounds(first, second)[0]
        assert gap - 1e-13 * (1.0 + gap) < bound < gap
        assert not may_be_nearer(first, second, gap - 1e-12 * (1.0 + gap)).any()
        assert may_be_nearer(first, second, gap).all()
        mirrored = lower_bounds(second, first)[0]
        assert mirrored == pytest.approx(bound, abs=1e-13 * (1.0 + gap))


def test_a_near_corner_is_found_wherever_it_is_in_a_large_mesh() -> None:
    """A row of 300 small triangles, and one that comes near to each in turn."""
    small = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]])
    row = np.concatenate([small + [float(k), 0.0, 0.0] for k in range(300)])
    many = GroupedMesh(row, np.arange(900).reshape(-1, 3))
    upright = np.array([[0.0, 0, 0], [0, 0, 9.0], [0, 0.1, 9.0]])
    one = GroupedMesh(upright, np.array([[0, 1, 2]]))
    for k in range(0, 300, 7):
        T = transform([float(k), 0.0, 1e-3])
        for distance, nearer in ((2e-3, True), (0.9e-3, False)):
            assert nearer_than(one, many, T, distance) == nearer
            back = transform([-float(k), 0.0, -1e-3])
            assert nearer_than(many, one, back, distance) == nearer
