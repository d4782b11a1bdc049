"""The edge of existence beside the law in exact arithmetic, down to the last digits.

Where the needle lies along the arm, or square to it with q7's axis along it, both sides
of `n_x^2 + (sin q6 cos q5)^2 <= 1` are 1 but for squares of what counts.
"""

from decimal import Decimal, localcontext

import numpy as np
import pytest

from crane.branches import AT_THE_EDGE, many_q5_q6
from crane.inverse import exists, inverse_q5_q6, inverse_roll
from crane.kinematics import forward

ROUNDING = 1e-14  # m and rad
DIGITS = 60
# So near to the edge [rad] rounding of n, sine and cosine may decide either way.
DOUBT = 2.0 * AT_THE_EDGE

TIP = np.array([0.1, -0.02, 0.03])


def sine(x: Decimal) -> Decimal:
    """Its series: angles here are below 4."""
    term = total = x
    k = 1
    while abs(term) > Decimal(10) ** -DIGITS:
        term *= -x * x / ((k + 1) * (k + 2))
        total, k = total + term, k + 2
    return total


def cosine(x: Decimal) -> Decimal:
    half = sine(x / 2)
    return 1 - 2 * half * half


def beyond(direction, q5, q6):
    """By how much the needle can be pointed to [rad]; below 0 it cannot."""
    with localcontext() as context:
        context.prec = DIGITS
        x, y, z = (Decimal(float(v)) for v in direction)
        across, length = y * y + z * z, x * x + y * y + z * z
        S6, C5 = sine(Decimal(float(q6))), cosine(Decimal(float(q5)))
        room = across / length - (S6 * C5) ** 2  # h^2 - s^2 = c^2 - n_x^2
        h, s = (across / length).sqrt(), abs(S6 * C5)
        x, c = abs(x) / length.sqrt(), (1 - (S6 * C5) ** 2).sqrt()
        parts = h + s if s < c else c + x
        return float(room / parts) if parts else 0.0


def powers(rng, least, most, count):
    return 10.0 ** rng.uniform(least, most, count)


def near_the_edge(rng, count):
    """Sizes down to rounding, and a part more or less than the law allows."""
    size = powers(rng, -16, -1, count)
    part = 1.0 + rng.choice([-1.0, 0.0, 1.0], count) * powers(rng, -16, 0, count)
    turn = rng.uniform(0.0, 2.0 * np.pi, count)
    return size, part, turn


def along_the_arm(rng, count):
    h, part, turn = near_the_edge(rng, count)
    n = np.column_stack([np.sqrt(1.0 - h * h), h * np.cos(turn), h * np.sin(turn)])
    n[:, 0] *= rng.choice([-1.0, 1.0], count)
    q5 = rng.uniform(-1.5, 1.5, count)
    q6 = np.arcsin(np.clip(h * part / np.cos(q5), -1.0, 1.0))
    q6 = np.where(rng.random(count) < 0.5, q6, np.pi - q6)
    return n, q5, q6


def across_the_arm(rng, count):
    c, part, turn = near_the_edge(rng, count)
    q5, q6 = c * np.cos(turn), 0.5 * np.pi - c * np.sin(turn)
    x, turn = c * part, rng.uniform(0.0, 2.0 * np.pi, count)
    n = np.column_stack([x, np.cos(turn), np.sin(turn)])  # of no unit length
    return n, q5, q6


@pytest.mark.parametrize("needles", [along_the_arm, across_the_arm])
def test_law_and_inverse_are_exact_at_the_edge(needles):
    n, q5, q6 = needles(np.random.default_rng(1), 1500)
    room = np.array([beyond(*needle) for needle in zip(n, q5, q6, strict=True)])
    told = exists(n, q5, q6)
    clear = np.abs(room) > DOUBT
    np.testing.assert_array_equal(told[clear], room[clear] > 0.0)
    kinds = (told & clear, ~told, ~clear, (np.abs(room) < 1e-8) & clear)
    assert min(kind.sum() for kind in kinds) > 20  # all kinds were asked
    tips = np.tile(TIP, (len(n), 1))
    q = many_q5_q6(tips, n, q5, q6, np.full(len(n), 0.01))
    np.testing.assert_array_equal(np.isfinite(q[:, 0]).all(axis=1), told)
    along = n / np.linalg.norm(n, axis=1)[:, None]
    T = forward(q[told].reshape(-1, 8))["needle_tip"].reshape(-1, 2, 4, 4)
    off = np.linalg.norm(np.cross(T[..., :3, 2], along[told][:, None]), axis=-1)
    at = np.linalg.norm(T[..., :3, 3] - TIP, axis=-1)
    given = np.isfinite(off)  # where q4 is free there is one row
    assert given[:, 0].all()
    assert off[given].max() < ROUNDING
    assert at[given].max() < ROUNDING
    assert (np.sum(T[..., :3, 2] * along[told][:, None], axis=-1)[given] > 0.0).all()


@pytest.mark.parametrize("needles", [along_the_arm, across_the_arm])
def test_one_needle_is_answered_as_many(needles):
    n, q5, q6 = needles(np.random.default_rng(2), 100)
    told = exists(n, q5, q6)
    for i in range(len(n)):
        found = inverse_q5_q6(TIP, n[i], q5[i], q6[i], 0.0)
        assert bool(found.configurations) == told[i]
        assert not found.q4_is_free or len(found.configurations) == 1


def test_no_pose_of_the_arm_is_lost_near_its_axis():
    """Forward, then back: q5 to q7 nearly or exactly 0, also at a double root."""
    rng = np.random.default_rng(3)
    q = np.zeros((2000, 8))
    q[:, 3] = rng.uniform(-1.5, 1.5, 2000)
    for joint in (4, 5, 6):
        zero = rng.random(2000) < 0.3
        q[:, joint] = np.where(zero, 0.0, powers(rng, -17, -7, 2000))
    T = forward(q)["needle_tip"]
    n, tips = T[:, :3, 2], T[:, :3, 3]
    assert exists(n, q[:, 4], q[:, 5]).all()
    found = many_q5_q6(tips, n, q[:, 4], q[:, 5], q[:, 7])
    back = forward(found[:, 0])["needle_tip"]
    assert np.linalg.norm(np.cross(back[:, :3, 2], n), axis=1).max() < ROUNDING
    assert np.linalg.norm(back[:, :3, 3] - tips, axis=1).max() < ROUNDING


def test_roll_coordinates_hold_up_to_the_upright_arm():
    """The nearer |q5| is to 90 deg, the less is left of what q4 is told from."""
    for away in 10.0 ** np.arange(-14.0, 0.0):
        for q7 in (-0.5 * np.pi + away, 0.5 * np.pi - away):
            q = inverse_roll(TIP, [1.0, 0.0, 0.0], 0.3, q7, 0.01)
            T = forward(q)["needle_tip"]
            assert abs(abs(q[4]) - (0.5 * np.pi - away)) < 1e-7
            assert np.linalg.norm(T[:3, 3] - TIP) < ROUNDING
            assert np.linalg.norm(np.cross(T[:3, 2], [1.0, 0.0, 0.0])) < ROUNDING


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", range(3))
def test_what_is_no_number_has_no_answer(wrong, place):
    """Neither a NaN that looks as if there were no branch, nor a False."""
    numbers = [0.1, 0.2, 0.01]
    numbers[place] = wrong
    n = np.array([0.0, 0.6, -0.8])
    with pytest.raises(ValueError, match="not finite"):
        inverse_roll(TIP, n, *numbers)
    with pytest.raises(ValueError, match="not finite"):
        inverse_roll(TIP, n, [0.1, numbers[0]], numbers[1], numbers[2])
    with pytest.raises(ValueError, match="not finite"):
        many_q5_q6(TIP[None], n[None], *(np.array([v]) for v in numbers))
    with pytest.raises(ValueError, match="not finite"):
        exists(np.where(np.arange(3) == place, wrong, n), 0.1, 0.2)
    if place < 2:
        with pytest.raises(ValueError, match="not finite"):
            exists(n, *numbers[:2])


@pytest.mark.parametrize("length", [5e-324, 1e-320, 1e-160, 1e160, 1.7e308])
def test_a_direction_may_have_any_length(length):
    n = np.array([1.0, 0.0, -1.0]) * length
    q = inverse_roll(TIP, n, 0.1, 0.2, 0.01)
    np.testing.assert_allclose(q, inverse_roll(TIP, [1, 0, -1], 0.1, 0.2, 0.01))
    assert exists(n, 0.1, 0.2)
    with pytest.raises(ValueError, match="no length"):
        exists(0.0 * n, 0.1, 0.2)
