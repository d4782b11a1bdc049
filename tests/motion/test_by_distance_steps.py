"""How a stretch is halved by distances, and how far a pair can move: by hand."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.motion import by_distance as module
from borecheck.motion.by_distance import RESERVE, by_distance, displacement_about
from borecheck.motion.halving import TOUCHED, UNDECIDED
from borecheck.motion.problem import Body, Pair, PathProblem, path_motion
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS, WORLD

MARGIN = 0.5


def halved(monkeypatch, is_farther, *, stretch=(0.0, 1.0), lengths=(1e-6, 0.25), n=99):
    """A stretch in which a piece moves by its length; with what distances say."""
    monkeypatch.setattr(module, "FIRST_CONTACT", 1.0 / 16.0)
    monkeypatch.setattr(module, "displacement_about", lambda *a: a[-1] - a[-3])
    monkeypatch.setattr(module, "_farther_than", lambda pair, at, d: is_farther(at, d))
    motion = SimpleNamespace(place=lambda chain, time: time)
    pair = SimpleNamespace(margin=MARGIN)
    return by_distance(None, pair, None, motion, stretch, lengths, n)


def test_a_stretch_that_is_far_enough_is_clear_at_one_look(monkeypatch):
    asked = []
    found = halved(monkeypatch, lambda at, d: asked.append((at, d)) or True)
    assert found == ([], 1)
    assert asked == [(0.5, MARGIN + 1.0 + RESERVE)]


def test_the_first_contact_is_narrowed_and_the_rest_goes_coarser(monkeypatch):
    rows, looked = halved(monkeypatch, lambda at, d: False)
    edges = [0.0, 0.0625, 0.125, 0.25, 0.5, 0.75, 1.0]
    assert rows == [(a, b, TOUCHED) for a, b in itertools.pairwise(edges)]
    assert looked == 11


def test_a_finer_length_of_contact_is_kept_from_the_start(monkeypatch):
    rows, looked = halved(monkeypatch, lambda at, d: False, lengths=(1e-6, 1.0 / 32.0))
    assert [b - a for a, b, _ in rows] == [1.0 / 32.0] * 32
    assert looked == 63


def test_what_no_distance_decides_is_halved_down_to_the_resolution(monkeypatch):
    """Apart at every instant, but never by as much as a piece moves."""
    rows, looked = halved(monkeypatch, lambda at, d: d <= MARGIN, lengths=(0.25, 0.25))
    assert rows == [(k / 4, (k + 1) / 4, UNDECIDED) for k in range(4)]
    assert looked == 7


def test_only_pieces_near_the_contact_are_left(monkeypatch):
    """A distance that grows with the time after 0.3, margin included."""
    rows, _ = halved(monkeypatch, lambda at, d: at - 0.3 > d - MARGIN)
    assert rows[0][0] == 0.0
    assert {outcome for *_, outcome in rows} == {TOUCHED}
    assert 0.3 < rows[-1][1] <= 0.3 + 0.25


def test_beyond_the_limit_the_rest_is_left_undecided(monkeypatch):
    rows, looked = halved(monkeypatch, lambda at, d: False, n=3)
    edges = [0.0, 0.125, 0.25, 0.5, 1.0]
    assert rows == [(a, b, UNDECIDED) for a, b in itertools.pairwise(edges)]
    assert looked == 7
    exactly, looked = halved(monkeypatch, lambda at, d: True, n=1)
    assert (exactly, looked) == ([], 1)


def test_where_no_number_lies_between_nothing_is_decided(monkeypatch):
    ends = (1.0, float(np.nextafter(1.0, 2.0)))
    found = halved(monkeypatch, lambda at, d: 1 / 0, stretch=ends)
    assert found == ([(*ends, UNDECIDED)], 1)


@pytest.mark.parametrize("frame", [WORLD, 1])
def test_the_standing_surface_is_asked_where_it_is(frame):
    placed, here = np.arange(32.0).reshape(2, 4, 4), np.eye(4)
    asked = []

    def within(other, T_a, T_b, length):
        asked.append((other, T_a, T_b, length))
        return SimpleNamespace(verdict=verdict)

    moving = SimpleNamespace(frame=0, tree=SimpleNamespace(within=within))
    standing = SimpleNamespace(frame=frame, tree="tree", T_frame_mesh=here)
    pair = SimpleNamespace(moving=moving, standing=standing)
    for verdict in ("clear", "contact", "unknown"):
        assert module._farther_than(pair, placed, 0.25) == (verdict == "clear")
    other, T_a, T_b, length = asked[0]
    assert (other, length) == ("tree", 0.25)
    np.testing.assert_array_equal(T_a, placed[0])
    np.testing.assert_array_equal(T_b, here if frame == WORLD else placed[1])


@pytest.fixture
def plain(monkeypatch):
    for name in ("_displacement", "_farthest"):
        monkeypatch.setattr(module, name, getattr(module, name).py_func)


def hinge_and_slide():
    """A hinge about z at (0.3, 0.1, 0), a fixed frame, and a slide along x on it."""
    return JointChain(
        parent=np.array([-1, 0, 1]),
        origin=np.stack([transform([0.3, 0.1, 0.0]), np.eye(4), np.eye(4)]),
        kind=np.array([TURNS, FIXED, SLIDES]),
        axis=np.array([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]),
        source=np.array([0, -1, 1]),
        factor=np.ones(3),
        offset=np.zeros(3),
    )


def moved(waypoints, begin, middle, end):
    part = Body("part", box("part", [0.6, 0.8, 2.0]), 2)
    wall = Body("wall", box("wall", [0.1, 0.1, 0.1]), T_frame_mesh=transform([9, 0, 0]))
    problem = PathProblem(hinge_and_slide(), (part,), (wall,))
    motion = path_motion(problem, waypoints)
    placed = motion.place(problem.chain, middle)
    (pair,), (way,) = problem.pairs, problem.routes
    assert isinstance(pair, Pair)
    return displacement_about(
        problem.chain, pair, way, motion, placed, begin, middle, end
    )


REACH = 0.5  # of the part's corners from the hinge's axis, across it


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("times", "change"),
    [
        ((0.0, 0.25, 0.75), 0.5),
        ((0.0, 0.5, 0.75), 0.5),
        ((0.0, 0.5, 1.0), 0.5),
        ((0.25, 0.25, 1.0), 0.75),
        ((0.75, 0.75, 1.75), 1.25),  # q is 0.75, then 1, then -0.5
        ((0.5, 0.5, 1.25), 0.5),  # the waypoint alone is that far
        ((1.0, 1.0, 1.5), 1.0),
    ],
)
def test_a_hinge_turns_by_what_any_instant_is_off(times, change):
    found = moved([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0]], *times)
    assert found == pytest.approx(change * REACH, rel=1e-9)
    assert found > change * REACH


@pytest.mark.usefixtures("plain")
def test_a_slide_moves_all_points_alike_and_takes_the_part_from_the_hinge():
    slide = moved([[0.4, 0.0], [0.4, 1.0]], 0.0, 0.5, 1.0)
    assert slide == pytest.approx(0.5, rel=1e-9)
    both = moved([[0.0, 0.7], [0.2, 0.7]], 0.0, 0.5, 1.0)
    assert both == pytest.approx(0.1 * np.hypot(1.0, 0.4), rel=1e-9)
    together = moved([[0.0, 0.2], [0.2, 1.2]], 0.0, 0.5, 1.0)
    assert together == pytest.approx(0.5 + 0.1 * np.hypot(1.0, 0.4), rel=1e-9)
    assert 0.0 < moved([[0.4, 0.7], [0.4, 0.7]], 0.0, 0.5, 1.0) <= 2e-12


def test_the_farthest_point_from_a_line_anywhere(rng):
    T = transform([0.3, -0.7, 0.4], [0.3, -0.4, 0.8])
    points, axis = rng.normal(size=(20, 3)), np.array([0.6, 0.0, 0.8])
    for some in (points, points[:1]):
        across = np.cross(some - T[:3, 3], T[:3, :3] @ axis)
        expected = np.linalg.norm(across, axis=1).max()
        assert module._farthest.py_func(some, T, axis) == pytest.approx(expected)
