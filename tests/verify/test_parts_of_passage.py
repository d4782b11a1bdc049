"""A stated corridor, piece by piece: widths, cuts, polygons seen along its line."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.core.se3 import rpy_matrix
from borecheck.geometry.mesh.primitives import box
from borecheck.verify.passage import StatedCorridor, _between
from borecheck.verify.statement import Passage

Array = NDArray[np.float64]

RADIUS, SLACK, LENGTH = 0.0008, 0.002, 0.05
# what `passage` itself takes for rounding, and a little more than it
ROUNDING, HAIR = 1e-10, 1e-9
ENTRY = np.array([0.02, -0.03, 0.04])
R = rpy_matrix(0.4, -0.9, 1.3)
SKIN = np.array([[[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]]])


def placed(points: object) -> Array:
    """Points given by (x, y, depth) about the corridor's line."""
    return np.asarray(ENTRY + np.array(points) @ R.T, dtype=np.float64)


def corridor(patient: Array = SKIN) -> StatedCorridor:
    target = ENTRY + LENGTH * R[:, 2]
    passage = Passage(0, 1, ENTRY, target, RADIUS, SLACK, np.empty(0))
    return StatedCorridor(passage, placed(patient))


def rod(low: float, high: float, x: float = 0.0, half: float = 5e-4) -> Array:
    """A needle's triangles from one depth to another, (12, 3, 3)."""
    corners = box("rod", [2 * half, 2 * half, high - low]).corners
    return placed(corners + np.array([x, 0.0, (low + high) / 2]))


def test_depth_and_aside_are_told_about_the_line(rng: np.random.Generator) -> None:
    rows = rng.uniform(-0.1, 0.1, (40, 3))
    depth, aside = corridor()._depth_and_aside(placed(rows))
    np.testing.assert_allclose(depth, rows[:, 2], atol=1e-15)
    np.testing.assert_allclose(aside, np.hypot(rows[:, 0], rows[:, 1]), atol=1e-15)


def test_no_triangle_is_nearer_to_the_line_than_said(rng: np.random.Generator) -> None:
    """Dense points of each; the said distance is a bound, and above 0 for far ones."""
    patient = rng.uniform(-1.0, 1.0, (60, 3, 3)) + np.array([2.0, 0.0, 0.0])
    asked = corridor(patient)
    weights = rng.dirichlet(np.ones(3), 500)
    points = np.einsum("kw,mwx->mkx", weights, placed(patient))
    _, aside = asked._depth_and_aside(points)
    assert (asked.nearest <= aside.min(axis=1) + 1e-12).all()
    assert (asked.nearest > 0.0).sum() > 20


def test_where_it_begins_is_the_least_depth_on_the_line() -> None:
    for moved in (0.0, 1e-3):
        point = corridor().before(rod(-0.12, 0.03, x=0.01), moved)
        np.testing.assert_allclose(point, placed([0, 0, -0.12 - moved]), atol=1e-14)


def test_depth_and_width_of_what_is_in() -> None:
    wide = np.hypot(5e-4, 5e-4)
    depth, width = corridor().depth_and_width(rod(-0.1, 0.03, x=0.004), 0.0)
    assert depth == pytest.approx(0.03)
    # about its own middle, not the line
    assert width == pytest.approx(wide)
    # what stays before the corridor has no width, unless it may move in
    handle = rod(-0.1, -SLACK - 1e-4, half=0.02)
    needle = np.concatenate([rod(-0.1, 0.03), handle])
    assert corridor().depth_and_width(needle, 0.0)[1] == pytest.approx(wide)
    assert corridor().depth_and_width(needle, 2e-4)[1] > 0.02


@pytest.mark.parametrize("tip", [-0.05, -SLACK, 0.001, 0.02])
def test_a_needle_is_as_wide_as_its_foremost_centimetre(tip: float) -> None:
    """A fine tip of 8 mm on a rod, and a handle 12 mm behind, however deep it is."""
    steps = np.linspace(0.0, 0.008, 9)
    cone = [rod(tip - b, tip - a, half=5e-4 * b / 0.008) for a, b in pairwise(steps)]
    needle = [*cone, rod(tip - 0.1, tip - 0.008), rod(-0.1, tip - 0.0121, half=0.004)]
    whole = corridor().depth_and_width(np.concatenate(needle[:-1]), 0.0)
    assert whole[0] == pytest.approx(tip)
    assert whole[1] == pytest.approx(np.hypot(5e-4, 5e-4))
    if tip < 0.01:  # else the handle is in
        held = corridor().depth_and_width(np.concatenate(needle), 0.0)
        assert held[1] == pytest.approx(np.hypot(5e-4, 5e-4))


WIDE = float(np.hypot(5e-4, 5e-4))  # of the rod


@pytest.mark.parametrize(
    ("needle", "moved", "why"),
    [
        (rod(-0.1, LENGTH), 0.0, ""),
        (rod(-0.1, LENGTH + SLACK - HAIR), 0.0, ""),
        (rod(-0.1, LENGTH + SLACK + HAIR), 0.0, "may be beyond the target"),
        (rod(-0.1, LENGTH), SLACK - HAIR, ""),
        (rod(-0.1, LENGTH), SLACK + HAIR, "may be beyond the target"),
        (rod(-SLACK - HAIR, 0.01), 0.0, ""),
        (rod(-SLACK + HAIR, 0.01), 0.0, "may be in with all of its length"),
        (rod(-SLACK - HAIR, 0.01), 2 * HAIR, "may be in with all of its length"),
        (rod(0.0, 0.01, x=9.0), 0.0, "may be in with all of its length"),
        # aside: the rod's half edge is 0.5 mm, its corner on the far side counts
        (rod(-0.1, 0.01, x=0.0021), 0.0, ""),
        (rod(-0.1, 0.01, x=0.0024), 0.0, "may be aside of its corridor"),
        (rod(-0.1, 0.01, x=-0.0024), 0.0, "may be aside of its corridor"),
        (rod(-0.1, 0.01), RADIUS + SLACK - WIDE - HAIR, ""),
        (rod(-0.1, 0.01), RADIUS + SLACK - WIDE + HAIR, "may be aside of its corridor"),
        # before the entry it may be anywhere that is clear of the patient
        (rod(-0.1, -0.01, x=0.5), 0.0, ""),
    ],
)
def test_what_is_wrong_with_a_needle(needle: Array, moved: float, why: str) -> None:
    assert corridor().why_not(needle, moved) == why


@pytest.mark.parametrize(
    ("at", "x", "meets"),
    [
        (-0.05, 0.0, True),  # across the line, within the needle's length
        (-0.05, WIDE - 1e-5, True),
        (-0.05, WIDE + 1e-5, False),
        (-0.05, -WIDE - 1e-5 - 0.02, False),  # its far edge is as far aside
        (-0.11, 0.0, False),  # behind the needle
        (-0.1 - HAIR, 0.0, False),
        (-SLACK / 2, 0.0, False),  # in the corridor
        (0.2, 0.0, False),
    ],
)
def test_a_sheet_before_the_entry(at: float, x: float, meets: bool) -> None:
    """A small square across the line, its near edge x aside."""
    square = np.array([[0, -0.01, 0], [0.02, -0.01, 0], [0.02, 0.01, 0], [0, 0.01, 0]])
    square = square + np.array([x, 0.0, at])
    patient = np.concatenate([square[[[0, 1, 2], [0, 2, 3]]], SKIN])
    why = corridor(patient).why_not(rod(-0.1, 0.01), 0.0)
    assert why == ("may meet it before the entry" if meets else "")


def test_each_length_of_a_needle_counts_with_its_own_width() -> None:
    """A handle is wide where it is, and the needle before it is not."""
    needle = np.concatenate([rod(-0.1, 0.01), rod(-0.1, -0.06, half=0.02)])
    for at, meets in ((-0.05, False), (-0.07, True)):
        beside = np.array([[0.01, -0.001, at], [0.03, 0, at], [0.01, 0.001, at]])
        patient = np.concatenate([beside[None], SKIN])
        why = corridor(patient).why_not(needle, 0.0)
        assert (why == "may meet it before the entry") == meets


def test_where_a_wide_length_begins_the_thin_one_before_it_stays_thin() -> None:
    """They have their very end in common; each is as wide as it is, and no wider."""
    thin = [[0.0, 0.0, -0.1], [1e-4, 0.0, -0.1], [0.0, 0.0, -0.05]]
    wide = [[0.0, 0.0, -0.05], [0.02, 0.0, -0.03], [0.0, 0.02, -0.03]]
    in_it = [[0.0, 0.0, -0.03], [1e-4, 0.0, -0.03], [0.0, 0.0, 0.01]]
    moved, needle = 1e-3, placed([thin, wide, in_it])
    for at, meets in ((-0.052, False), (-0.048, True)):
        beside = np.array([[0.01, -0.001, at], [0.03, 0, at], [0.01, 0.001, at]])
        # grown by what it moved, the wide one begins before its own corner
        patient = np.concatenate([beside[None], SKIN])
        why = corridor(patient).why_not(needle, moved)
        assert (why == "may meet it before the entry") == meets


def test_a_needle_of_many_triangles_is_cut_into_some_lengths() -> None:
    """More ends of triangles than lengths: the answers stay those of a plain rod."""
    ends = np.linspace(-0.1, 0.01, 90)
    needle = np.concatenate([rod(a, b) for a, b in pairwise(ends)])
    sheet = np.array([[-0.01, -0.01, -0.05], [0.01, -0.01, -0.05], [0, 0.01, -0.05]])
    assert corridor().why_not(needle, 0.0) == ""
    across = np.concatenate([sheet[None], SKIN])
    assert corridor(across).why_not(needle, 0.0) == "may meet it before the entry"
    # the first and the last of the lengths, too
    for at, meets in ((-0.0999, True), (-SLACK - 1e-5, True), (-0.1001, False)):
        there = np.concatenate([sheet[None] + [0.0, 0.0, at + 0.05], SKIN])
        why = corridor(there).why_not(needle, 0.0)
        assert (why == "may meet it before the entry") == meets


def distance_to_line(polygon: Array, rng: np.random.Generator) -> float:
    """By many points of its triangles, seen along the line."""
    weights = rng.dirichlet(np.full(len(polygon), 0.5), 20_000)
    return float(np.linalg.norm((weights @ polygon)[:, :2], axis=1).min())


def test_how_near_a_polygon_comes_to_the_line(rng: np.random.Generator) -> None:
    """Triangles and cut ones; through the line, beside it and at their corners."""
    zero = 0
    for _ in range(60):
        polygon = rng.uniform(-1.0, 1.0, (3, 3)) + [rng.uniform(-1.5, 1.5), 0.0, 0.0]
        told = corridor()._aside_of(placed(polygon))
        sampled = distance_to_line(polygon, rng)
        assert told <= sampled + 1e-12
        assert told >= sampled - 0.06
        zero += told == 0.0
    assert 3 < zero < 55
    # edge on: as thin as a line that passes it at 0.3
    edge_on = placed([[0.3, -1, 0], [0.3, 1, 0], [0.3, 0, 1]])
    assert corridor()._aside_of(edge_on) == pytest.approx(0.3)
    corner = placed([[0.3, 0.4, 0], [1, 1, 0], [0.5, 2, 0]])
    assert corridor()._aside_of(corner) == pytest.approx(0.5)


def test_what_of_a_polygon_is_between_two_depths() -> None:
    """Areas by hand: a right triangle with its side of length 1 along the depth."""
    triangle = [np.array(p) for p in ([0.0, 0, 0], [0, 0, 1.0], [1.0, 0, 0])]

    def area(low: float, high: float) -> float:
        polygon = _between(triangle, lambda p: float(p[2]), low, high)
        if not polygon:
            return -1.0
        x, z = np.array(polygon)[:, 0], np.array(polygon)[:, 2]
        return abs(float(x @ np.roll(z, -1) - z @ np.roll(x, -1))) / 2

    assert area(-1.0, 2.0) == pytest.approx(0.5)
    assert area(0.0, 1.0) == pytest.approx(0.5)
    assert area(0.5, 2.0) == pytest.approx(0.125)
    assert area(-1.0, 0.5) == pytest.approx(0.375)
    assert area(0.25, 0.75) == pytest.approx((0.75**2 - 0.25**2) / 2)
    assert area(1.5, 2.0) == -1.0
    assert area(-2.0, -0.5) == -1.0
    assert area(1.0, 2.0) == pytest.approx(0.0)  # the tip alone is kept
    assert area(-1.0, 0.0) == pytest.approx(0.0)  # and an edge


def test_a_corridor_tells_itself_in_millimetres() -> None:
    passage = Passage(
        0, 1, np.zeros(3), np.array([0, 0, -LENGTH]), RADIUS, SLACK, np.empty(0)
    )
    assert str(StatedCorridor(passage, SKIN)) == (
        "from (0.0, 0.0, 0.0) to (0.0, 0.0, -50.0) mm, 2.80 mm beside it and "
        "2 mm beyond its ends"
    )


def test_a_cut_through_a_corner_hides_no_triangle() -> None:
    """The line pierces it; a cut 3 ulp from a corner leaves a turn of any sign."""
    entry = [0.01986235963055016, -0.0830123026490275, 0.2557259033088112]
    target = [0.029698959152069587, -0.02411396847821007, 0.26157633421225446]
    triangle = [
        [0.06508707906002699, -0.11572381927946178, 0.25261440330689533],
        [-0.01001032987999199, -0.1065695845617166, 0.20980284929132625],
        [-0.01024456957066368, -0.11509100536213028, 0.295984810973047],
    ]
    passage = Passage(0, 1, np.array(entry), np.array(target), 6e-4, SLACK, np.empty(0))
    found = StatedCorridor(passage, np.array([triangle]))
    for deepest in (-0.025, -0.025000000100000006, -0.02500000012):
        assert found._met(-0.1, deepest, 1e-3)


def test_a_pierced_triangle_is_met_wherever_it_is_cut(rng: np.random.Generator) -> None:
    """Cuts at the depths of corners, and some ulp beside: the worst there are."""
    for _ in range(300):
        turn = rng.uniform(0.0, 2.0 * np.pi) + np.array([0.0, 2.1, 4.2])
        depth = -0.03 + 0.005 * np.cos(turn - turn[0])
        points = np.c_[0.05 * np.cos(turn), 0.05 * np.sin(turn), depth]
        found = corridor(points[None])
        for corner in found.patient[0]:
            end = found._depth(corner) - ROUNDING
            for beside in (-3, -1, 0, 1, 3):
                at = end + beside * np.spacing(abs(end))
                if at > depth.min() + 1e-9 and found._depth(ENTRY) > at:
                    low, high = found._met(-0.1, at, 1e-3), found._met(at, 0.0, 1e-3)
                    assert low or high
