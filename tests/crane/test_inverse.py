"""The inverse: its own forward, the law of existence, double roots, the free case."""

import math

import numpy as np
import pytest

from crane.branches import many_q5_q6
from crane.dimensions import LIMITS
from crane.inverse import (
    broken_limits,
    exists,
    inverse,
    inverse_q5_q6,
    inverse_roll,
    roll_axes,
    within_limits,
)
from crane.kinematics import forward

ROUNDING = 1e-14  # m and rad: some dozens of operations on numbers below 1

LOWER, UPPER = np.array(list(LIMITS.values())).T
NAMES = tuple(LIMITS)


def random_q(count, seed=0):
    return np.random.default_rng(seed).uniform(LOWER, UPPER, (count, 8))


def needle(q, **arguments):
    T = forward(q, **arguments)["needle_tip"]
    return T[:3, 3], T[:3, 2]


def misses(q, tip, direction, **arguments):
    """How far tip [m] and direction [rad] are from what was asked."""
    at, along = needle(q, **arguments)
    return np.linalg.norm(at - tip), np.linalg.norm(np.cross(along, direction))


def test_every_pose_within_limits_is_found_again():
    branches = {1: 0, 2: 0}
    for q in random_q(300):
        tip, n = needle(q)
        found = inverse_q5_q6(tip, n, q[4], q[5], q[7])
        assert not found.q4_is_free
        assert min(np.abs(x - q).max() for x in found.configurations) < 1e-9
        for x in found.configurations:
            assert max(misses(x, tip, n)) < ROUNDING
            np.testing.assert_array_equal(x[[4, 5, 7]], q[[4, 5, 7]])
        branches[sum(within_limits(x) for x in found.configurations)] += 1
    # 81 % and 19 % of 10^5 poses (docs/evidence.md); 300 poses give +-5 %
    assert 0.72 < branches[1] / 300 < 0.90


def test_the_law_of_existence():
    """n_x^2 + (sin q6 cos q5)^2 <= 1, and exactly there the inverse has answers."""
    rng = np.random.default_rng(1)
    n = rng.normal(size=(500, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    q5, q6 = rng.uniform(-math.pi, math.pi, (2, 500))
    law = n[:, 0] ** 2 + (np.sin(q6) * np.cos(q5)) ** 2
    answers = exists(n, q5, q6)
    np.testing.assert_array_equal(answers, law <= 1.0)
    assert 100 < answers.sum() < 450  # both kinds are asked
    for i in range(500):
        found = inverse_q5_q6([0.0, 0.0, 0.1], n[i], q5[i], q6[i], 0.01)
        assert (len(found.configurations) == 2) == answers[i]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_the_edge_of_existence_there_is_one(sign):
    """Equality is a double root: the two branches meet, none is lost to rounding."""
    q5, q6 = 0.3, 0.9
    edge = math.sqrt(1.0 - (math.sin(q6) * math.cos(q5)) ** 2)
    n = np.array([sign * edge, 0.0, math.sqrt(1.0 - edge**2)])
    found = inverse_q5_q6([0.1, 0.0, 0.0], n, q5, q6, 0.0).configurations
    assert 1 <= len(found) <= 2
    assert np.abs(found[0] - found[-1]).max() < 1e-7  # the square root of rounding
    for x in found:
        assert max(misses(x, [0.1, 0.0, 0.0], n)) < 1e-8
    beyond = np.array([sign * (edge + 1e-9), 0.0, 0.0])
    beyond[2] = math.sqrt(1.0 - beyond[0] ** 2)
    assert not inverse_q5_q6([0.1, 0.0, 0.0], beyond, q5, q6, 0.0).configurations


@pytest.mark.parametrize(
    ("direction", "q5", "q6"),
    [
        ([1.0, 0.0, 0.0], 0.4, 0.0),
        ([-1.0, 0.0, 0.0], -0.2, 0.0),
        ([0.0, 0.6, -0.8], 0.0, math.pi / 2),
    ],
)
def test_where_the_roll_of_the_arm_is_free(direction, q5, q6):
    found = inverse_q5_q6([0.2, 0.1, 0.0], direction, q5, q6, 0.0)
    assert found.q4_is_free
    (x,) = found.configurations
    assert np.isfinite(x).all()
    assert max(misses(x, [0.2, 0.1, 0.0], direction)) < ROUNDING


def test_roll_coordinates_are_the_same_arm():
    for q in random_q(200, seed=2):
        tip, n = needle(q)
        x8 = forward(q)["8"][:3, 0]
        e1, e2 = roll_axes(n)
        psi = math.atan2(x8 @ e2, x8 @ e1)
        x = inverse_roll(tip, n, psi, q[6], q[7])
        np.testing.assert_allclose(x, q, atol=1e-12)


def test_roll_coordinates_are_always_solvable():
    """Any psi and q7 put the needle there; only |q5| = 90 deg has no answer."""
    rng = np.random.default_rng(3)
    for n in ([0.3, 0.4, -0.866], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]):
        n = np.array(n) / np.linalg.norm(n)
        psi, q7 = rng.uniform(-math.pi, math.pi, (2, 100))
        qs = inverse_roll([0.0, 0.1, -0.05], n, psi, q7, 0.02)
        assert qs.shape == (100, 8)
        for x in qs:
            assert max(misses(x, [0.0, 0.1, -0.05], n)) < ROUNDING
    upright = inverse_roll([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.0, -math.pi / 2, 0.0)
    assert np.isnan(upright).any()


def test_the_base_may_stand_anywhere():
    place = {"base_x": 0.7, "base_y": -0.1, "base_z": 0.05, "base_yaw": math.pi}
    for q in random_q(20, seed=4):
        tip, n = needle(q, **place)
        found = inverse_q5_q6(tip, n, q[4], q[5], q[7], **place)
        assert min(np.abs(x - q).max() for x in found.configurations) < 1e-9


def test_inverse_gives_what_lies_within_the_limits():
    tip, n = np.array([0.0, 0.02, -0.03]), np.array([0.1, -0.2, -1.0])
    found = inverse(tip, n, 0.01)
    assert len(found.configurations) > 10
    assert found.rejected == ()
    for x in found.configurations:
        assert within_limits(x)
        assert max(misses(x, tip, n / np.linalg.norm(n))) < ROUNDING
        assert x[7] == 0.01
    worst = [
        np.abs((q - (LOWER + UPPER) / 2) / ((UPPER - LOWER) / 2))[3:7].max()
        for q in found.configurations
    ]
    assert worst == pytest.approx(sorted(worst), abs=1e-8)


def test_along_a_line_a_roll_stays_the_same_arm():
    """Only the stages move: what an approach along the needle's line takes."""
    n = np.array([0.1, -0.2, -1.0])
    first = inverse([0.0, 0.02, -0.03], n, 0.0).configurations
    moved = np.array([0.0, 0.02, -0.03]) + 0.02 * n / np.linalg.norm(n)
    then = inverse(moved, n, 0.0).configurations
    same = [min(np.abs(x[3:] - y[3:]).max() for y in then) < 1e-12 for x in first]
    assert np.mean(same) > 0.9  # a stage may come to its limit


def test_out_of_reach_says_by_which_limit():
    found = inverse([0.0, 0.0, 1.5], [0.0, 0.0, -1.0], 0.0)
    assert found.configurations == ()
    (reason,) = found.rejected
    assert "q2" in reason
    assert "above its limit 350.000 mm" in reason


def test_limits_include_their_ends():
    assert within_limits(LOWER)
    assert within_limits(UPPER)
    assert broken_limits(UPPER) == ()
    for i, name in enumerate(NAMES):
        beyond = UPPER + 1e-9 * np.eye(8)[i]
        assert not within_limits(beyond)
        (phrase,) = broken_limits(beyond)
        assert phrase.startswith(f"{name} = ")
        numbers = [float(w) for w in phrase.split() if w[:1].isdigit()]
        assert numbers[-2] > numbers[-1]  # what is beyond is told beyond


@pytest.mark.parametrize(
    ("tip", "direction", "message"),
    [
        ([0.0, math.nan, 0.0], [0.0, 0.0, 1.0], "not finite"),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "no length"),
    ],
)
def test_what_is_no_needle_is_refused(tip, direction, message):
    with pytest.raises(ValueError, match=message):
        inverse(tip, direction, 0.0)
    with pytest.raises(ValueError, match=message):
        inverse_q5_q6(tip, direction, 0.0, 0.0, 0.0)


def test_many_needles_at_once_are_the_same():
    rng = np.random.default_rng(5)
    q = random_q(50, seed=5)
    n = rng.normal(size=(50, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    n[0], q[0, 5] = [1.0, 0.0, 0.0], 0.0  # q4 is free
    tips = rng.uniform(-0.1, 0.1, (50, 3))
    place = {"base_yaw": 0.4, "base_x": -0.2}
    both = many_q5_q6(tips, n, q[:, 4], q[:, 5], q[:, 7], **place)
    counts = set()
    for i in range(50):
        one = inverse_q5_q6(tips[i], n[i], q[i, 4], q[i, 5], q[i, 7], **place)
        given = both[i][np.isfinite(both[i]).all(axis=1)]
        assert len(given) == len(one.configurations)
        counts.add(len(given))
        for mine, theirs in zip(given, one.configurations, strict=True):
            np.testing.assert_allclose(mine, theirs, atol=1e-13)
    assert {0, 2} <= counts


@pytest.mark.parametrize(("q5", "q6"), [(math.nan, 0.0), (0.0, math.inf)])
def test_angles_that_are_no_numbers_are_refused(q5, q6):
    with pytest.raises(ValueError, match="not finite"):
        inverse_q5_q6([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], q5, q6, 0.0)
