"""The corridor's ends, width and slack, in numbers of their own."""

import numpy as np
import pytest

from borecheck.core.se3 import rpy_matrix
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.solid import Side
from borecheck.geometry.triangles.topology import topology
from borecheck.plans.corridor import Corridor, _edge_crossings, common_points
from borecheck.verify.passage import MOST_SLACK

# Needle of 1 mm, 50 mm deep; a hair is far below what is asked and above rounding.
RADIUS, LENGTH, SLACK, HAIR = 0.0005, 0.05, 0.002, 1e-9


def test_the_slack_is_two_millimetres():
    """A number of its own, as typed here, and what the verifier accepts at most."""
    assert Corridor(np.zeros(3), np.array([0, 0, 1.0]), RADIUS).slack == SLACK
    assert MOST_SLACK == SLACK


@pytest.fixture(params=[(0.0, 0.0, 0.0), (0.3, -1.1, 2.0)])
def posed(request):
    """A corridor along a turned z, and a way to name points by depth and place."""
    R = rpy_matrix(*request.param)
    entry = np.array([0.3, -0.2, 0.1])
    corridor = Corridor(entry, entry + LENGTH * R[:, 2], RADIUS)
    return corridor, lambda *rows: entry + np.array(rows) @ R.T


WIDE = RADIUS + SLACK


@pytest.mark.parametrize(
    ("point", "held"),
    [
        ((0.0, 0.0, LENGTH / 2), True),
        # both ends along the line, by the slack and not by more
        ((0.0, 0.0, -SLACK + HAIR), True),
        ((0.0, 0.0, -SLACK - HAIR), False),
        ((0.0, 0.0, LENGTH + SLACK - HAIR), True),
        ((0.0, 0.0, LENGTH + SLACK + HAIR), False),
        # aside, on either side, and at an angle
        ((WIDE - HAIR, 0.0, 0.01), True),
        ((WIDE + HAIR, 0.0, 0.01), False),
        ((0.0, -WIDE - HAIR, 0.01), False),
        ((0.8 * (WIDE - HAIR), 0.6 * (WIDE - HAIR), 0.01), True),
        ((0.8 * (WIDE + HAIR), 0.6 * (WIDE + HAIR), 0.01), False),
        # the rim at both ends belongs to it
        ((WIDE - HAIR, 0.0, LENGTH + SLACK - HAIR), True),
        ((0.0, WIDE - HAIR, -SLACK + HAIR), True),
    ],
)
def test_what_the_corridor_holds(posed, point, held):
    corridor, at = posed
    assert corridor.holds(at(point)).tolist() == [held]


def test_the_border_itself_is_within():
    """In numbers that float64 holds exactly."""
    corridor = Corridor(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.25, 0.25)
    ends = [[0, 0, -0.25], [0, 0, 1.25], [0.5, 0, 0.5], [0.5, 0, -0.25]]
    assert corridor.holds(np.array(ends)).all()


def test_depth_and_distance_aside(posed):
    corridor, at = posed
    depth, aside = corridor.coordinates(at((0.003, 0.004, 0.02), (0.0, 0.0, -0.01)))
    np.testing.assert_allclose(depth, [0.02, -0.01], atol=1e-15)
    np.testing.assert_allclose(aside, [0.005, 0.0], atol=1e-15)
    assert corridor.length == pytest.approx(LENGTH)
    np.testing.assert_allclose(
        corridor.direction, (at((0, 0, 1.0)) - corridor.entry)[0]
    )


def test_places_across_keep_all_distances(posed, rng):
    """A rotation: depth comes first, what is left is the distance aside."""
    corridor, _ = posed
    points = rng.uniform(-0.1, 0.1, (50, 2, 3))
    told = corridor.along_and_across(points)
    depth, aside = corridor.coordinates(points.reshape(-1, 3))
    np.testing.assert_allclose(told[..., 0].reshape(-1), depth, atol=1e-15)
    np.testing.assert_allclose(
        np.linalg.norm(told[..., 1:], axis=-1).reshape(-1), aside, atol=1e-15
    )
    apart = np.linalg.norm(points[:, 0] - points[:, 1], axis=1)
    np.testing.assert_allclose(
        np.linalg.norm(told[:, 0] - told[:, 1], axis=1), apart, atol=1e-14
    )


def test_common_points_of_triangles_that_cross_known_segments():
    """One in z = 0, one in y = 0; where they meet is told along x."""
    flat = np.array([[0.0, -1, 0], [4, -1, 0], [2, 3, 0]])  # meets y = 0 in 0.5 to 3.5
    for low, high in ((1.0, 2.0), (0.0, 2.0), (2.0, 9.0), (-1.0, 5.0)):
        upright = np.array([[low, 0, -1], [high, 0, -1], [low, 0, 1], [high, 0, 1]])
        first = np.array([upright[0], upright[1], upright[2]])
        # in z = 0 the first triangle spans low to the middle
        middle = (low + high) / 2
        ends = sorted([max(low, 0.5), min(middle, 3.5)])
        for a, b in ((first, flat), (flat, first)):
            points = common_points(a, b)
            np.testing.assert_allclose(points[:, 1:], 0.0, atol=1e-12)
            assert points[:, 0].min() == pytest.approx(ends[0], abs=1e-12)
            assert points[:, 0].max() == pytest.approx(ends[1], abs=1e-12)
    beside = np.array([[9.0, 0, -1], [10, 0, -1], [9, 0, 1]])
    above = np.array([[1.0, 0, 1], [2, 0, 1], [1, 0, 2]])
    for other in (beside, above):
        assert common_points(flat, other).shape == (0, 3)
        assert common_points(other, flat).shape == (0, 3)


CUBE = box("cube", (0.4, 0.4, 0.4))
BODY = TriangleMesh("body", CUBE.vertices - [0, 0, 0.2], CUBE.triangles)
DOWN = Corridor(np.zeros(3), np.array([0.0, 0.0, -LENGTH]), RADIUS)


def rod(low, high, x=0.0):
    mesh = box("needle", (2 * RADIUS / 1.5, 2 * RADIUS / 1.5, high - low))
    return TriangleMesh(
        "needle", mesh.vertices + [x, 0, (low + high) / 2], mesh.triangles
    )


@pytest.mark.parametrize(
    ("low", "high", "x", "told"),
    [
        (-LENGTH, 0.1, 0.0, None),
        (-LENGTH - SLACK + HAIR, 0.1, 0.0, None),
        (-LENGTH - SLACK - HAIR, 0.1, 0.0, "2.0 mm beyond the target"),
        (-0.1, 0.1, 0.0, "50.0 mm beyond the target"),
        (-0.02, 0.1, 0.01, "aside of its line"),
        (-0.02, -0.01, 0.01, "aside of its line"),
        (0.01, 0.1, 0.0, None),
        (0.01, 0.1, 0.3, None),
    ],
)
def test_where_a_needle_strays(low, high, x, told):
    stray = DOWN.stray(rod(low, high, x), BODY, topology(BODY))
    if told is None:
        assert stray is None
    else:
        assert stray.certain
        assert stray.reason == f"needle is in body outside the plan's corridor, {told}"


OPEN = TriangleMesh("skin", BODY.vertices, BODY.triangles[:-1])


@pytest.mark.parametrize(
    ("low", "high", "x", "told"),
    [
        (-LENGTH, 0.1, 0.0, False),  # all that is near lies in the corridor
        (-LENGTH - 0.01, 0.1, 0.0, True),
        (0.01, 0.1, 0.3, False),  # beside the box round the skin
        (-0.02, 0.1, 0.01, True),
    ],
)
def test_of_an_open_skin_what_is_aside_and_near_is_told_as_unknown(low, high, x, told):
    stray = DOWN.stray(rod(low, high, x), OPEN, topology(OPEN))
    assert (stray is not None) == told
    if told:
        assert not stray.certain
        assert stray.reason.startswith("skin is open")


def test_where_no_ray_tells_the_side_it_is_not_certain(monkeypatch):
    monkeypatch.setattr("borecheck.plans.corridor.side_of", lambda *_: Side.UNDECIDED)
    stray = DOWN.stray(rod(-0.02, 0.1, 0.01), BODY, topology(BODY))
    assert not stray.certain
    assert "needle" in stray.reason
    assert "body" in stray.reason
    # what lies in the corridor is not asked
    assert DOWN.stray(rod(-LENGTH, 0.0), BODY, topology(BODY)) is None


def test_a_needle_all_of_whose_tail_is_near_an_open_skin_may_be_in():
    """Before the entry, but within the box: nothing of it is known to be outside."""
    hood = TriangleMesh(
        "hood",
        np.vstack([OPEN.vertices, [[0.2, 0.2, 0.5]]]),
        np.vstack([OPEN.triangles, [[0, 1, len(OPEN.vertices)]]]),
    )
    assert DOWN.stray(rod(-0.02, 0.3), hood, topology(hood)) is not None
    assert DOWN.stray(rod(-0.02, 0.6), hood, topology(hood)) is None


@pytest.mark.parametrize("size", [1e-3, 1.0, 50.0])
@pytest.mark.parametrize("first", [0, 1, 2])
def test_a_crossing_just_beside_an_edge_counts_up_to_rounding(size, first):
    """A thousand-millionth of the triangle's size, wherever it stands."""
    shift = size * np.array([4.0, 6.0, 5.0])
    right = size * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    for beyond, counts in ((0.5e-9, 1), (3e-9, 0)):
        y = -beyond * size
        blade = [[0.3 * size, y, -size], [0.3 * size, y, size]]
        blade = np.array([*blade, [0.3 * size, -9.0 * size, size]])
        for turn in (1, -1):
            triangle = np.roll(right, first, axis=0)[::turn] + shift
            assert len(_edge_crossings(blade + shift, triangle)) == counts
