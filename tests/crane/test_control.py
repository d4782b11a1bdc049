"""The closed loop: laws of lag and stability, what it takes out, filter and motors."""

from dataclasses import replace

import numpy as np
import pytest

from crane.control.controller import Gains, updated
from crane.control.filter import (
    ComplementaryFilter,
    changeover,
    lag_of_estimate,
)
from crane.control.laws import (
    NUDGE,
    errors_of,
    gain_limit,
    growing,
    lag,
    noise_gain,
)
from crane.control.loop import closed_loop, ideal, open_loop
from crane.control.motors import Motors, sampled_loop
from crane.control.plant import PERFECT, Plant, followed
from crane.control.trajectory import AHEAD, ANGLE, cone, held, path_per_step
from crane.kinematics import forward
from crane.statics import Mechanics, tube_compliance
from crane.studies.control import START, lag_law
from crane.transmission import CABLE
from crane.turning import turns

Q0 = np.array(START)
T0 = forward(Q0)["8"]


def test_cone_keeps_the_virtual_tip_and_its_angle():
    targets = cone(T0, 60)
    tips = targets[:, :3, 3] + AHEAD * targets[:, :3, 2]
    np.testing.assert_allclose(tips - tips[0], 0.0, atol=1e-15)
    cosine = targets[:, :3, 2] @ T0[:3, 2]
    np.testing.assert_allclose(cosine, np.cos(ANGLE), atol=1e-14)
    np.testing.assert_allclose(targets[-1], targets[0], atol=1e-14)
    step = np.linalg.norm(np.diff(targets[:, :3, 3], axis=0), axis=1)
    np.testing.assert_allclose(step, path_per_step(steps=60)[0], rtol=1e-2)


def test_lag_is_path_over_gain_within_2_percent():
    for row in lag_law():
        assert row["ratio"] == pytest.approx(1.0, abs=0.02)


def test_loops_swing_above_the_limit_and_not_below():
    """0 to 5 periods of delay, 1 % on either side of 2 cos(n pi / (2 n + 1))."""
    late = np.repeat(np.arange(6), 2)
    gain = gain_limit(late) * np.tile([0.99, 1.01], 6)
    T = T0.copy()
    T[:3, 3] += [NUDGE, 0.0, 0.0]
    error = errors_of(PERFECT, held(T, 500), Q0, gain, late)
    assert growing(error).tolist() == [False, True] * 6


@pytest.mark.parametrize("n", range(6))
def test_the_limit_is_where_a_pole_leaves_the_circle(n):
    for factor, outside in ((0.999, False), (1.001, True)):
        poly = np.zeros(n + 2)
        poly[0], poly[1] = 1.0, -1.0
        poly[-1] += factor * gain_limit(n)
        assert (np.abs(np.roots(poly)).max() > 1.0) == outside


def test_deflection_is_gone_at_rest():
    run = closed_loop(Plant(), held(T0, 60), Q0, Gains())
    assert run.position[0, 0] > 1e-3
    assert run.position[-1, 0] < 1e-7  # 1e-4 mm
    assert run.angle[-1, 0] < 1e-6


def test_cone_open_and_closed():
    targets = cone(T0, 120)
    q0 = ideal(targets[:1], Q0)[0]
    gains = Gains()
    off = open_loop(Plant(), targets, q0).position[:, 0]
    on = closed_loop(Plant(), targets, q0, gains)
    ahead = closed_loop(Plant(), targets, q0, replace(gains, feed_forward=True))
    assert off.mean() > 3e-3
    path, angle = path_per_step(steps=120)
    # a circle, not a line: |1 / (z - 1 + K)| for z = exp(2 pi i / 120)
    swing = 1.0 / abs(np.exp(2j * np.pi / 120) - 1.0 + 0.3)
    assert on.position[60:, 0].mean() == pytest.approx(path * swing, rel=0.02)
    assert on.angle[60:, 0].mean() == pytest.approx(angle * swing, rel=0.02)
    assert on.position[60:, 0].mean() == pytest.approx(lag(path, 0.3), rel=0.05)
    assert ahead.position[60:, 0].mean() < 0.2 * on.position[60:, 0].mean()


def test_a_perfect_arm_is_right_in_the_open_loop():
    run = open_loop(PERFECT, cone(T0, 60), ideal(cone(T0, 60)[:1], Q0)[0])
    assert run.position.max() < 1e-9
    assert run.angle.max() < 1e-9


def test_white_noise_comes_through_as_predicted():
    plant = replace(PERFECT, tracker_shift=1e-3)
    rng = np.random.default_rng(0)
    run = closed_loop(plant, held(T0, 200), np.tile(Q0, (20, 1)), Gains(0.5), rng=rng)
    rms = np.sqrt(np.mean(run.position[40:] ** 2))
    assert rms == pytest.approx(1e-3 * noise_gain(0.5), rel=0.05)


def test_the_null_space_term_moves_the_arm_and_not_the_needle():
    away = Q0 + 1e-4 * np.array([1, 1, 1, 1, -1, 1, -1, 1.0])
    T = forward(away)["8"][None]
    gains = Gains(K_ee=0.0, K_null=0.5)
    q = updated(away[None], away[None], T, T, gains, Q0)
    assert np.linalg.norm(q[0] - away) > 1e-5
    moved = forward(q[0])["8"][:3, 3] - T[0, :3, 3]
    assert np.linalg.norm(moved) < 1e-3 * np.linalg.norm(q[0] - away)


def test_play_holds_a_joint_until_it_is_taken_up():
    before = np.zeros((1, 8))
    for pulled, comes_to in (
        (0.003, 0.0),
        (0.010, 0.006),
        (0.004, 0.006),
        (0.0, 0.004),
    ):
        before = followed(before, np.full((1, 8), pulled), 4e-3)
        assert before[0, 4] == pytest.approx(comes_to)
        assert before[0, 0] == pulled  # stages have none


def test_the_tube_bends_as_the_beam_of_the_statics():
    q, plant = Q0[None], Plant()
    T, bent = forward(Q0), plant.placement(q)[0]
    d = plant.load / plant.link
    nod = turns(np.array([[0.0, 1.5 * d / plant.free_length, 0.0]]))[0]
    np.testing.assert_allclose(bent[:3, :3], nod @ T["8"][:3, :3], atol=1e-15)
    lever = T["8"][:3, 3] - T["4"][:3, 3]
    sag = d + 1.5 * d / plant.free_length * lever[0]
    assert T["8"][2, 3] - bent[2, 3] == pytest.approx(sag, rel=1e-2)
    assert 1.0 / tube_compliance(Mechanics())[2, 2] == pytest.approx(
        plant.link, rel=0.02
    )


def test_cables_stretch_by_the_loads_torque():
    """By virtual work: a joint's turn times its torque is the load's fall."""
    plant, h = Plant(), 1e-6
    stretch = plant.stretched(Q0[None])[0] - Q0
    for j in range(8):
        up, down = (forward(Q0 + s * np.eye(8)[j])["8"][2, 3] for s in (h, -h))
        torque = -plant.load * (up - down) / (2 * h)
        expected = torque / plant.joint if j in (4, 5, 6) else 0.0
        assert stretch[j] == pytest.approx(expected, abs=1e-9)


def test_filter_trusts_encoders_slowly_and_motors_at_once():
    C = np.array(CABLE)
    filter_ = ComplementaryFilter(C, np.zeros(4))
    filter_.step(np.zeros(4), np.ones(4))
    np.testing.assert_allclose(filter_.estimate, 0.02)
    for _ in range(1000):
        filter_.step(np.zeros(4), np.ones(4))
    np.testing.assert_allclose(filter_.estimate, 1.0, atol=1e-8)
    assert changeover() == pytest.approx(3.25, abs=0.01)


def test_filter_lags_by_what_the_coupling_is_off():
    C, speed = np.array(CABLE), np.array([1.0, -0.5, 0.8, 0.3])
    true = 0.98 * C
    filter_ = ComplementaryFilter(C, np.zeros(4))
    for k in range(1, 1001):
        filter_.step(speed, true @ speed * 1e-3 * k)
    behind = filter_.estimate - true @ speed
    np.testing.assert_allclose(behind, lag_of_estimate(C - true, speed), rtol=1e-6)


def test_motors_at_1_khz_do_as_the_settled_loop():
    targets = cone(T0, 1200)[:61]
    q0 = ideal(targets[:1], Q0)[0]
    settled = closed_loop(Plant(), targets, q0, Gains())
    motors = sampled_loop(Plant(), targets, q0, Gains(), rounding=False)
    mine, theirs = motors.position[40:].mean(), settled.position[40:].mean()
    assert mine == pytest.approx(theirs, rel=0.05)


POSE = np.tile(np.eye(4), (5, 1, 1))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"targets": np.eye(4)}, r"targets \(4, 4\) must be \(steps \+ 1, 4, 4\)"),
        ({"targets": POSE[:1]}, "one step or more"),
        ({"targets": POSE * np.nan}, "targets .*not finite"),
        ({"q0": np.zeros(7)}, r"q0 \(7,\)"),
        ({"q0": np.full(8, np.inf)}, "q0 .*not finite"),
        ({"q0": np.zeros((2, 8)), "delay": np.arange(3)}, "2 beginnings, 3 delays"),
        ({"delay": -1}, "whole periods"),
        ({"delay": 0.5}, "whole periods"),
    ],
)
def test_what_is_no_loop_is_refused(change, message):
    asked = {"plant": Plant(), "targets": POSE, "q0": START, "gains": Gains()}
    with pytest.raises(ValueError, match=message):
        closed_loop(**asked | change)
    if "delay" not in change:
        with pytest.raises(ValueError, match=message):
            sampled_loop(**asked | change)
        with pytest.raises(ValueError, match=message):
            open_loop(asked["plant"], **{"targets": POSE, "q0": START} | change)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: Gains(K_ee=np.nan), "K_ee = nan is no gain"),
        (lambda: Gains(K_ee=np.array([0.1, -0.1])), "is no gain"),
        (lambda: Gains(K_ee=np.zeros((2, 2))), "one number"),
        (lambda: Gains(damping=np.inf), "damping"),
        (lambda: Plant(link=0.0), "link = 0.0"),
        (lambda: Plant(load=np.nan), "load = nan"),
        (lambda: Plant(play=-1e-3), "play"),
        (lambda: Motors(ticks=0), "ticks"),
        (lambda: Motors(bandwidth=np.nan), "bandwidth"),
        (lambda: cone(np.eye(4), 0), "steps = 0"),
        (lambda: path_per_step(steps=0), "steps = 0"),
        (lambda: cone(np.eye(4), ahead=np.inf), "ahead"),
        (lambda: held(np.eye(4), -2), "steps = -2"),
    ],
)
def test_what_is_no_arm_and_no_gain_is_refused(made, message):
    with pytest.raises(ValueError, match=message):
        made()


def test_a_rigid_arm_is_an_arm():
    plant = replace(Plant(), link=np.inf, joint=np.inf)
    T = plant.placement(np.array(START)[None])
    np.testing.assert_allclose(T[0], forward(START)["8"], atol=1e-15)
