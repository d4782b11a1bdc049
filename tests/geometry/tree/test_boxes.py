"""A point in both boxes keeps them together, however the numbers are rounded."""

import numpy as np
import pytest
from numba import njit

from borecheck.core.se3 import check_transform, inverse, transform
from borecheck.errors import GeometryError
from borecheck.geometry.tree.boxes import (
    LARGEST_COORDINATE,
    RELATION_SHAPE,
    copy_placement,
    is_identity,
    is_rigid,
    keep_relation,
    motion_of,
    relate,
    roots_apart,
    set_probe,
    slack_of,
    undo,
)
from borecheck.geometry.tree.build import build
from borecheck.geometry.tree.simd import PROBE_COLUMNS, gap_mask, overlap_mask

F32 = np.float32
EYE = np.eye(4)


@njit
def asked(nodes_a, frames_a, T_a, nodes_b, frames_b, T_b, inflate):
    """Roots apart; masks and gaps of child 0 of b for a's box and the reverse."""
    relation, probe = np.zeros(RELATION_SHAPE, F32), np.zeros(PROBE_COLUMNS, F32)
    gaps = np.zeros((2, 8), F32)
    A, B = motion_of(T_a), motion_of(T_b)
    M = relate(A, B, is_identity(B), frames_a, 0, frames_b, 0)
    slack = slack_of(M, A, B, frames_a, 0, frames_b, 0, inflate)
    keep_relation(M, slack, 0, relation)
    keep_relation(undo(M), slack, 1, relation)
    masks = np.zeros(2, np.int64)
    for row in range(2):
        fixed, opened = (nodes_a, nodes_b) if row == 0 else (nodes_b, nodes_a)
        box = (
            fixed[0, 0, 0],
            fixed[0, 1, 0],
            fixed[0, 2, 0],
            fixed[0, 3, 0],
            fixed[0, 4, 0],
            fixed[0, 5, 0],
        )
        set_probe(box, relation, row, probe)
        masks[row] = overlap_mask(opened, 0, probe)
        gap_mask(opened, 0, probe, F32(np.inf), gaps[row])
    return roots_apart(nodes_a, 0, nodes_b, 0, relation), masks, gaps[:, 0]


def single(corners):
    tree = build(np.ascontiguousarray(corners).reshape(1, 9))
    return tree.nodes, np.append(tree.frame, 0.0)[None]


@pytest.mark.parametrize("size", [1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("away", [0.0, 1e3, 1e8])
@pytest.mark.parametrize("skew", [0.0, 3e-7])
def test_boxes_with_a_common_point_are_never_apart(size, away, skew):
    """Flat boxes that share one corner, in any frames: all the room is the slack."""
    rng = np.random.default_rng(41)
    for trial in range(120):
        T_a = transform(size * away * rng.normal(size=3), rng.uniform(-3, 3, 3))
        T_b = transform(size * away * rng.normal(size=3), rng.uniform(-3, 3, 3))
        T_a[:3, :3] += skew * rng.uniform(-1, 1, (3, 3))
        T_b[:3, :3] += skew * rng.uniform(-1, 1, (3, 3))
        if trial % 3 == 0:
            T_b = EYE
        common = T_a[:3, 3] + size * rng.normal(size=3)
        p = np.linalg.solve(T_a[:3, :3], common - T_a[:3, 3])
        q = np.linalg.solve(T_b[:3, :3], common - T_b[:3, 3])
        # The boxes lie on opposite sides of the common corner, as far as can be.
        a = p + size * np.array([[0, 0, 0], [1, 0.3, 0.2], [0.4, 1, 0]])
        away_from_a = (T_b[:3, :3].T @ T_a[:3, :3] @ [-1.0, -1, -1])[None]
        # A large box and a small one: the small one's own rounding hides nothing.
        small = 10.0 ** -rng.integers(0, 6)
        b = q + small * size * np.array([[0.0], [0.5], [1.0]]) * away_from_a
        apart, masks, gaps = asked(*single(a), T_a, *single(b), T_b, 0.0)
        assert not apart
        assert (masks & 1).all()
        # A gap that is certified cannot exceed the true one, which is 0 but for the
        # roundings of this test's own placements.
        assert (gaps <= 1e-14 * size * (1.0 + away)).all()


def test_inflation_keeps_what_is_nearer():
    rng = np.random.default_rng(42)
    separate = 0
    for _ in range(300):
        a, b = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)) + 2.0
        T_a = transform(rng.normal(size=3), rng.uniform(-3, 3, 3))
        T_b = transform(rng.normal(size=3), rng.uniform(-3, 3, 3))
        in_world = a @ T_a[:3, :3].T + T_a[:3, 3], b @ T_b[:3, :3].T + T_b[:3, 3]
        near = np.linalg.norm(in_world[0][:, None] - in_world[1], axis=-1).min()
        apart, masks, _ = asked(*single(a), T_a, *single(b), T_b, near)
        assert not apart
        assert (masks & 1).all()
        apart, masks, gaps = asked(*single(a), T_a, *single(b), T_b, 0.0)
        separate += bool(apart or not (masks & 1).all())
        assert (gaps <= near).all()
    assert separate > 100


@njit
def undone(T):
    return undo(motion_of(T))


@njit
def rigid(placements):
    return is_rigid(placements, 0, 0)


@njit
def copied(placements):
    T = np.zeros((3, 4))
    copy_placement(placements, 0, 0, T)
    return T


def test_undo_is_the_inverse():
    rng = np.random.default_rng(43)
    T = transform(rng.normal(size=3), rng.uniform(-3, 3, 3))
    numbers = np.array(undone(T))
    expected = inverse(T)
    np.testing.assert_allclose(numbers[:9].reshape(3, 3), expected[:3, :3], atol=1e-15)
    np.testing.assert_allclose(numbers[9:], expected[:3, 3], atol=1e-15)
    np.testing.assert_array_equal(copied(T.reshape(1, 1, 4, 4)), T[:3])


def test_rigid_means_what_check_transform_means():
    rng = np.random.default_rng(44)
    outcomes = set()
    for trial in range(600):
        T = transform(rng.normal(size=3), rng.uniform(-3, 3, 3))
        place = rng.integers(0, 4, 2)
        T[tuple(place)] += (0.0, 3e-7, 1e-5, np.nan, np.inf, -2.0)[trial % 6]
        try:
            check_transform(T)
            expected = True
        except GeometryError:
            expected = False
        assert rigid(T.reshape(1, 1, 4, 4)) == expected
        outcomes.add(expected)
    assert outcomes == {True, False}
    assert not rigid(transform((2 * LARGEST_COORDINATE, 0, 0)).reshape(1, 1, 4, 4))
