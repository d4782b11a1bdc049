"""Planes between a moving triangle and a standing one: what is tried, and what counts.

The kernels are run as plain functions, so that what they call can be watched.
"""

import numpy as np
import pytest

from borecheck.motion import planes

KERNELS = ("_either_way", "_beside", "_normal", "_separates", "_least", "cross")
FLAT = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0)  # in z = 0
SKEW = (0.5, -1.0, 2.0, 3.0, 0.25, -1.5, -2.0, 4.0, 1.0)


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    for name in KERNELS:
        monkeypatch.setattr(planes, name, getattr(planes, name).py_func)


def shifted(triangle, *by):
    return tuple((np.reshape(triangle, (3, 3)) + by).ravel().tolist())


def test_the_least_coordinate_is_that_of_any_corner():
    for direction in ((1.0, 0.0, 0.0), (-1.0, 2.0, 0.5), (0.0, -3.0, 1.0)):
        least = (np.reshape(SKEW, (3, 3)) @ direction).min()
        for turn in range(3):
            rows = np.roll(np.reshape(SKEW, (3, 3)), turn, axis=0).ravel()
            assert planes._least(tuple(rows), *direction) == least


def test_the_normal_is_across_two_sides():
    p, q, r = np.reshape(SKEW, (3, 3))
    np.testing.assert_array_equal(planes._normal(SKEW), np.cross(q - p, r - p))


@pytest.mark.parametrize("way", [(0.0, 0.0, 5.0), (0.0, 0.0, 1e-140)])
@pytest.mark.parametrize("last_is_nearer", [True, False])
def test_a_gap_must_be_more_than_the_reserve_at_both_ends(way, last_is_nearer):
    ends = [shifted(FLAT, 9.0, 0.0, 2.0), shifted(FLAT, -9.0, 0.0, 1.0)]
    first, last = ends if last_is_nearer else ends[::-1]
    standing = shifted(FLAT, 0.0, 0.0, -0.5)
    for reserve, apart in ((1.25, True), (1.5, False), (1.75, False)):
        assert planes._separates(way, first, last, standing, reserve) == apart
    back = tuple(-x for x in way)
    assert not planes._separates(back, first, last, standing, 0.0)
    assert planes._either_way(back, first, last, standing, 1.25)
    assert planes._either_way(way, first, last, standing, 1.25)
    assert not planes._either_way(way, first, last, standing, 1.5)


def test_a_gap_along_a_slant_is_a_length():
    """Along (2, 3, 6), which is 7 long."""
    first = shifted(FLAT, 4.0, 6.0, 12.0)
    way, standing = (2.0, 3.0, 6.0), FLAT
    # the least of the moving one is 14, the standing one reaches 6 / 7
    gap = 14.0 - 6.0 / 7.0
    assert planes._separates(way, first, first, standing, gap - 1e-9)
    assert not planes._separates(way, first, first, standing, gap + 1e-9)


@pytest.mark.parametrize("axis", range(3))
def test_either_way_is_the_very_opposite(axis):
    """Of a slanted direction, to which a triangle lies on the far side by 14 / 3."""
    way = tuple(np.roll([2.0, 1.0, 2.0], axis).tolist())
    point, gap = FLAT[:3] * 3, 14.0 / 3.0
    moving = shifted(point, *np.roll([-5.0, -2.0, -1.0], axis))
    assert not planes._separates(way, moving, moving, point, 0.0)
    assert planes._either_way(way, moving, moving, point, gap - 1e-9)
    assert not planes._either_way(way, moving, moving, point, gap + 1e-9)


@pytest.mark.parametrize("way", [(0.0, 0.0, 0.0), (0.0, 0.0, 1e-151), (np.nan, 0, 0)])
def test_no_direction_separates_nothing(way):
    assert not planes._separates(way, shifted(FLAT, 0, 0, 9.0), FLAT, FLAT, -99.0)


STEP = (0.25, 1.0, -2.0)


def tried_beside():
    """The directions that are to be tried beside SKEW, in order."""
    corners = np.reshape(SKEW, (3, 3))
    n = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    edges = np.roll(corners, -1, axis=0) - corners
    return [n, np.cross(n, STEP), *(np.cross(edge, STEP) for edge in edges)]


@pytest.mark.parametrize("found", range(6))
def test_its_plane_the_one_across_and_those_along_its_edges_are_tried(
    monkeypatch, found
):
    seen = []

    def look(n, *rest):
        assert rest == ("first", "last", "standing", 0.125)
        seen.append(n)
        return len(seen) == found + 1

    monkeypatch.setattr(planes, "_either_way", look)
    args = (SKEW, STEP, "first", "last", "standing", 0.125)
    assert planes._beside(*args) is (found < 5)
    np.testing.assert_allclose(seen, tried_beside()[: found + 1])


def placed(monkeypatch, separates, beside):
    """`plane_between`, with the ways it tries; moves by STEP."""
    tried = []
    first, last = shifted(SKEW, 0.0, 0.0, 5.0), shifted(SKEW, 0.25, 1.0, 3.0)

    def nearest(half_way, standing):
        assert standing == FLAT
        np.testing.assert_array_equal(half_way, np.add(first, last) / 2.0)
        return 9.0, (4.0, 5.0, 6.0), (1.0, 3.0, -2.0)

    def separates_so(way, *rest):
        assert rest == (first, last, FLAT, 0.125)
        tried.append(way)
        return separates

    def beside_so(t, step, *rest):
        assert step == STEP
        assert rest == (first, last, FLAT, 0.125)
        tried.append("standing" if t == FLAT else tuple(t))
        return beside[len(tried) - 2]

    places = {"at first": first, "at last": last}
    monkeypatch.setattr(planes, "disjoint_distance", nearest)
    monkeypatch.setattr(planes, "place_triangle", lambda end, corners, i: places[end])
    monkeypatch.setattr(planes, "triangle_row", lambda corners, j: FLAT)
    monkeypatch.setattr(planes, "_separates", separates_so)
    monkeypatch.setattr(planes, "_beside", beside_so)
    ends = ("at first", "at last")
    found = planes.plane_between.py_func(None, 0, None, 0, ends, 0.125)
    half_way = tuple((np.add(first, last) / 2.0).tolist())
    return found, tried, half_way


def test_first_the_shortest_way_then_beside_either_triangle(monkeypatch):
    """The way from the standing triangle's point to that of the moving one."""
    way = (3.0, 2.0, 8.0)
    found, tried, _ = placed(monkeypatch, True, ())
    assert (found, tried) == (True, [way])
    found, tried, _ = placed(monkeypatch, False, (True,))
    assert (found, tried) == (True, [way, "standing"])
    for last in (True, False):
        found, tried, half_way = placed(monkeypatch, False, (False, last))
        assert (found, tried) == (last, [way, "standing", half_way])
