"""Kernels of the walk through swept boxes and of halving, as plain functions."""

from types import SimpleNamespace

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.surfaces import surface
from borecheck.geometry.tree.build import F32, WIDTH
from borecheck.motion import halving, swept_boxes
from borecheck.motion.problem import Motion
from borecheck.robots.kinematics.forward import WORLD

MIDDLE, RADIUS, SIZE = swept_boxes.MIDDLE, swept_boxes.RADIUS, swept_boxes.SIZE
PLACE, SLACK, ROW = swept_boxes.PLACE, swept_boxes.SLACK, swept_boxes.ROW
UNIT = 2.0**-17


@pytest.fixture
def plain(monkeypatch):
    for name in ("_box", "_image", "_mark_standing", "_mark_moving", "start_walk"):
        kernel = getattr(swept_boxes, name).py_func
        monkeypatch.setattr(swept_boxes, name, kernel)
    for name in ("relative", "_apply"):
        monkeypatch.setattr(halving, name, getattr(halving, name).py_func)


T = transform([0.25, -0.5, 1.5], [0.3, -0.4, 0.8])
T_A = transform([-0.75, 0.5, 2.0], [1.1, 0.2, -0.6])


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("frame", [WORLD, 1])
def test_the_moving_mesh_is_seen_from_the_standing_one(frame):
    placed, seen = np.stack([T_A, T]), np.full((3, 4), np.nan)
    undo = np.linalg.inv(T) if frame == WORLD else np.full((4, 4), np.nan)
    halving._seen_from.py_func(frame, undo, placed, 0, seen)
    np.testing.assert_allclose(seen, (np.linalg.inv(T) @ T_A)[:3], atol=1e-15)


def test_a_placement_is_copied():
    target = np.full((4, 4), np.nan)
    halving._copy.py_func(T, target)
    np.testing.assert_array_equal(target, T)


def test_joints_go_straight_and_meet_both_ends():
    theta, values = np.array([[9.0, 9.0], [1e17, 2.0], [1.0, 4.0]]), np.zeros(2)
    for fraction, expected in ((0.0, theta[1]), (1.0, theta[2])):
        halving._at.py_func(theta, 1, 2, fraction, values)
        np.testing.assert_array_equal(values, expected)
    halving._at.py_func(theta, 1, 2, 0.25, values)
    np.testing.assert_allclose(values, [0.75e17, 2.5])


def test_two_rows_are_ordered_and_the_slack_has_room_for_rounding():
    """Rounding is a share of both extents and of the farthest place."""
    rng = np.random.default_rng(2)
    first, last = rng.normal(size=(2, ROW)).astype(F32)
    first[PLACE : PLACE + 3] = 1.0, -2.0, 3.0
    last[PLACE : PLACE + 3] = 0.5, 1.5, -8.0
    frame_a, frame_b = np.array([0, 0, 0, 16.0]), np.array([0, 0, 0, 40.0])
    for far in range(3):
        rows = np.stack([first, last])
        rows[:, PLACE : PLACE + 3] = np.roll(rows[:, PLACE : PLACE + 3], far, axis=1)
        given = rows.copy()
        halving._order.py_func(rows, 1e-3, frame_a, frame_b)
        others = np.arange(ROW) != SLACK
        np.testing.assert_array_equal(rows[0], given.min(axis=0))
        np.testing.assert_array_equal(rows[1, others], given.max(axis=0)[others])
        room = 1e-3 + UNIT * (16.0 + 40.0 + 8.0)
        assert room < rows[1, SLACK] < room * (1.0 + 2e-6)
        swapped = given[::-1].copy()
        halving._order.py_func(swapped, 1e-3, frame_a, frame_b)
        np.testing.assert_array_equal(swapped, rows)


def test_what_images_may_be_off_by():
    frames = np.array([9.0, 9, 9, 1.0]), np.array([9.0, 9, 9, 2.0])
    assert swept_boxes.box_rounding.py_func(*frames, 4.0) == UNIT * 7.0 + 1e-30
    nothing = swept_boxes.box_rounding.py_func(np.zeros(4), np.zeros(4), 0.0)
    assert nothing == 1e-30


def test_a_row_is_the_turn_and_the_place_of_the_boxes():
    """The centre of a's boxes, seen from the centre of b's."""
    frame_a, frame_b = np.array([1.0, 2.0, -4.0, 9.0]), np.array([0.5, 3.0, -7.0, 9.0])
    row = np.full(ROW, 77.0, F32)
    swept_boxes.write_row.py_func(T[:3], frame_a, frame_b, row)
    place = (T @ [*frame_a[:3], 1.0])[:3] - frame_b[:3]
    np.testing.assert_allclose(row[:PLACE], T[:3, :3].ravel(), rtol=1e-7)
    np.testing.assert_allclose(row[PLACE:SLACK], place, rtol=1e-6)
    assert (row[SLACK:] == 77.0).all()


def interval_of(first, last, slack):
    """Between two placements (3, 4), as `span` leaves it."""
    rows = np.zeros((2, ROW), F32)
    for row, placement in zip(rows, (first, last), strict=True):
        swept_boxes.write_row.py_func(placement, np.zeros(4), np.zeros(4), row)
    lo, hi = rows.min(axis=0), rows.max(axis=0)
    hi[SLACK], interval = slack, np.zeros((3, ROW), F32)
    swept_boxes.span.py_func(lo, hi, interval)
    return lo, hi, interval


def test_an_interval_has_its_middle_radius_and_size():
    lo, hi, interval = interval_of(T[:3], T_A[:3], 0.25)
    both = np.arange(ROW) != SLACK
    np.testing.assert_allclose(interval[MIDDLE, both], ((lo + hi) / 2)[both], rtol=1e-6)
    np.testing.assert_allclose(interval[RADIUS, both], ((hi - lo) / 2)[both], rtol=1e-6)
    largest = np.maximum(np.abs(lo), np.abs(hi))
    np.testing.assert_array_equal(interval[SIZE, both], largest[both])
    assert interval[RADIUS, SLACK] == 0.25


def test_the_box_of_a_slot():
    nodes = np.arange(3 * 7 * 8, dtype=F32).reshape(3, 7, 8)
    for node, slot in ((0, 0), (1, 5), (2, 7)):
        found = swept_boxes._box.py_func(nodes, 8 * node + slot)
        assert found == tuple(nodes[node, :6, slot])


CENTRE, HALF = np.array([0.5, -1.0, 2.0]), np.array([0.25, 0.5, 0.125])


@pytest.mark.parametrize("axis", range(3))
def test_an_image_of_one_placement_is_the_box_round_the_turned_box(axis):
    _, _, interval = interval_of(T[:3], T[:3], 0.0)
    centre, half = swept_boxes._image.py_func(interval, *CENTRE, *HALF, axis)
    assert centre == pytest.approx((T[:3, :3] @ CENTRE + T[:3, 3])[axis], rel=1e-6)
    assert half == pytest.approx((np.abs(T[:3, :3]) @ HALF)[axis], rel=1e-6)


@pytest.mark.parametrize("axis", range(3))
def test_an_image_has_room_for_both_ends_and_the_slack(axis):
    """What entries can change by, times where the box is, and no more than that."""
    lo, hi, interval = interval_of(T[:3], T_A[:3], 0.25)
    turn = slice(3 * axis, 3 * axis + 3)
    radius, size = (hi - lo) / 2, np.maximum(np.abs(lo), np.abs(hi))
    expected = radius[turn] @ np.abs(CENTRE) + size[turn] @ HALF
    expected += radius[PLACE + axis] + 0.25
    centre, half = swept_boxes._image.py_func(interval, *CENTRE, *HALF, axis)
    middle = (lo + hi) / 2
    at = middle[turn] @ CENTRE + middle[PLACE + axis]
    assert centre == pytest.approx(at, rel=1e-5)
    assert half == pytest.approx(expected, rel=1e-6)


def node_of(centres, half):
    """One node with child boxes at some places; the rest of its slots are unused."""
    nodes = np.zeros((1, 7, WIDTH), F32)
    nodes[0, 3:6] = -1e30
    for i, centre in enumerate(centres):
        nodes[0, :3, i], nodes[0, 3:6, i] = centre, half
    return nodes


# Beside a box at the origin of half sizes 1, 2, 3: touching it, and a hair off it.
HAIR = 1e-3
HALVES, KIN = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.25, 0.125])
REACH = HALVES + KIN
ASIDE = [s * (REACH[k] + d) * np.eye(3)[k] for k in range(3) for s in (-1.0, 1.0)
         for d in (0.0, HAIR)]  # fmt: skip
MEETS = [1, 0] * 6


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("some", [slice(0, 6), slice(6, 12)])
def test_which_children_may_meet(some):
    image = np.array([*np.zeros(3), *HALVES], F32)
    nodes, flags = node_of(ASIDE[some], KIN), np.full(WIDTH, 9, np.uint8)
    swept_boxes._mark_standing(nodes, 0, image, flags)
    assert flags.tolist() == [*MEETS[some], 0, 0]
    # the same from the moving one's side, which stands as it is
    _, _, still = interval_of(np.eye(4)[:3], np.eye(4)[:3], 0.0)
    images, flags = np.zeros((6, WIDTH), F32), np.full(WIDTH, 9, np.uint8)
    given = tuple(image.tolist())
    swept_boxes._mark_moving(nodes, 0, still, given, images, flags)
    assert flags.tolist() == [*MEETS[some], 0, 0]
    np.testing.assert_allclose(images[:3, :6].T, ASIDE[some])
    np.testing.assert_allclose(images[3:, :6].T, np.tile(KIN, (6, 1)))


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(("place", "meets"), list(zip(ASIDE, MEETS, strict=True)))
def test_a_walk_begins_where_the_boxes_of_all_may_meet(place, meets):
    _, _, still = interval_of(np.eye(4)[:3], np.eye(4)[:3], 0.0)
    boxes = np.zeros((2, 6), F32)
    whole = node_of([place], KIN), node_of([np.zeros(3)], HALVES)
    assert swept_boxes.start_walk(*whole, still, boxes) == bool(meets)
    np.testing.assert_allclose(boxes[0], [*place, *KIN])
    assert not boxes[1].any()


def walked(monkeypatch, task, answer, *, budget=10**6):
    """A block beside another, both of twelve triangles: who is asked, and the outcome.

    Only triangles of the two faces that touch, and those beside them, can be near.
    """
    asked = []

    def asks(corners_a, i, corners_b, j, ends, distance):
        assert (ends, distance) == ("given", 0.25)
        asked.append((corners_a[i], corners_b[j]))
        return answer

    monkeypatch.setattr(swept_boxes, "plane_between", asks)
    monkeypatch.setattr(swept_boxes, "_near", asks)
    first = surface(box("a", [1.0, 1.0, 1.0])).tree
    second = surface(box("b", [1.0, 1.0, 1.0]).moved(transform([0.99, 0, 0]))).tree
    interval = np.zeros((3, ROW), F32)
    row = np.zeros(ROW, F32)
    swept_boxes.write_row.py_func(np.eye(4)[:3], first.frames[0], second.frames[0], row)
    swept_boxes.span.py_func(row, row, interval)
    stack = np.zeros((WIDTH * (first.depth + second.depth + 2), 2), np.int64)
    ends, places = ("given", None) if task == swept_boxes.SWEEP else (None, "given")
    outcome = swept_boxes.walk.py_func(
        first.nodes, first.corners, second.nodes, second.corners, interval, task,
        ends, places, 0.25, budget, stack, np.zeros((len(stack), 6), F32),
        np.zeros((6, WIDTH), F32), np.zeros(WIDTH, np.uint8),
    )  # fmt: skip
    return outcome, asked


def bounds_meet(first, second):
    (a, b), (c, d) = [
        (x.reshape(3, 3).min(axis=0), x.reshape(3, 3).max(axis=0))
        for x in (first, second)
    ]
    return bool(((a <= d + 1e-4) & (c <= b + 1e-4)).all())


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("task", [swept_boxes.SWEEP, swept_boxes.POSE])
def test_every_pair_of_triangles_whose_boxes_meet_is_asked_and_no_other(
    monkeypatch, task
):
    outcome, asked = walked(monkeypatch, task, task == swept_boxes.SWEEP)
    assert outcome == swept_boxes.CLEAR
    first = box("a", [1.0, 1.0, 1.0]).corners.reshape(-1, 9)
    second = box("b", [1.0, 1.0, 1.0]).moved(transform([0.99, 0, 0]))
    second = second.corners.reshape(-1, 9)
    expected = [(a, b) for a in first for b in second if bounds_meet(a, b)]
    assert 20 < len(expected) < 100

    def rows(pairs):
        return sorted(tuple(np.round(np.r_[a, b], 9).tolist()) for a, b in pairs)

    assert rows(asked) == rows(expected)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("task", [swept_boxes.SWEEP, swept_boxes.POSE])
def test_the_first_pair_that_is_not_apart_ends_the_walk(monkeypatch, task):
    outcome, asked = walked(monkeypatch, task, task == swept_boxes.POSE)
    assert (outcome, len(asked)) == (swept_boxes.OPEN, 1)
    outcome, asked = walked(monkeypatch, task, task == swept_boxes.SWEEP, budget=0)
    assert (outcome, asked) == (swept_boxes.OPEN, [])


def test_waypoints_are_met_exactly_in_any_case():
    """Also where a step is so long that going along it would round."""
    theta = np.array([[1e17], [1.0], [-1e17], [3.0]])
    motion = SimpleNamespace(theta=theta)
    for k, values in enumerate(theta):
        assert Motion.joints_at(motion, float(k)) == values
    assert Motion.joints_at(motion, 2.5) == pytest.approx(-0.5e17)
