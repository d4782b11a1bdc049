"""The paper's iteration: its error, other chains, limits, the closed form beside."""

import math
from dataclasses import replace

import numpy as np
import pytest

from crane.inverse import exists
from crane.kinematics import forward, jacobian
from crane.least_squares import (
    PAPER,
    ROWS,
    TIGHT,
    Chain,
    Settings,
    axis_error,
    damped_inverse,
    needle_error,
    solve,
)
from crane.studies.inverse import (
    ENDLESS,
    LIMITED,
    LOWER,
    REDUNDANT,
    UPPER,
    off_branch,
    poses,
)


def turn(axis, angle):
    """Rodrigues' formula, eq. (23)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    W = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * W + (1 - math.cos(angle)) * W @ W


def test_axis_error_turns_what_is_into_what_is_asked():
    rng = np.random.default_rng(0)
    for _ in range(50):
        z1, z2 = rng.normal(size=(2, 3))
        z1, z2 = z1 / np.linalg.norm(z1), z2 / np.linalg.norm(z2)
        e = axis_error(z1, z2)
        np.testing.assert_allclose(turn(e, np.linalg.norm(e)) @ z1, z2, atol=1e-14)


def test_axes_that_coincide_have_no_error_and_small_ones_are_exact():
    assert axis_error([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]).tolist() == [0.0, 0.0, 0.0]
    tiny = axis_error([0.0, 0.0, 1.0], [1e-9, 0.0, 1.0])
    np.testing.assert_allclose(tiny, [0.0, 1e-9, 0.0], rtol=1e-12)


@pytest.mark.parametrize("tilt", [0.0, 1e-14])
def test_opposite_axes_are_refused(tilt):
    with pytest.raises(ValueError, match=r"opposite directions: eq. \(19\)"):
        axis_error([0.0, 0.0, 1.0], [tilt, 0.0, -1.0])
    q = np.array([0.0, 0.2, 0.1, 0.0, 0.0, 0.0, 0.5, 0.0])
    T = forward(q)["8"]
    T[:3, :3] = T[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    with pytest.raises(ValueError, match="begin from another configuration"):
        solve(ENDLESS, T, q)


def test_error_is_what_the_jacobian_undoes():
    """Its slope along any joint is minus the body Jacobian's column, at the target."""
    q = poses(20, np.random.default_rng(1))
    target, h = ENDLESS.forward(q), 1e-6
    for j in range(8):
        ahead, back = q + h * np.eye(8)[j], q - h * np.eye(8)[j]
        slope = needle_error(ENDLESS.forward(ahead), target)
        slope -= needle_error(ENDLESS.forward(back), target)
        column = jacobian(q)[:, list(ROWS), j]
        np.testing.assert_allclose(slope / (2 * h), -column, atol=1e-8)


def test_roll_about_the_needle_is_no_error():
    T = forward(np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.01]))["8"]
    rolled = T.copy()
    rolled[:3, :3] = T[:3, :3] @ turn([0, 0, 1], 1.3)
    assert np.abs(needle_error(T, rolled)).max() < 1e-15


def test_damped_inverse_is_the_pseudo_inverse_without_damping():
    J = np.random.default_rng(2).normal(size=(4, 5, 8))
    np.testing.assert_allclose(
        damped_inverse(J, np.zeros(4)), np.linalg.pinv(J), atol=1e-12
    )
    # least squares with a penalty on the step, solved another way
    stacked = np.vstack([J[0], 0.3 * np.eye(8)])
    e = np.arange(5.0)
    step = np.linalg.lstsq(stacked, np.concatenate([e, np.zeros(8)]), rcond=None)[0]
    np.testing.assert_allclose(damped_inverse(J[0], 0.09) @ e, step, atol=1e-12)


@pytest.mark.parametrize("settings", [PAPER, TIGHT])
def test_random_poses_are_found_from_random_starts(settings):
    rng = np.random.default_rng(3)
    targets, starts = ENDLESS.forward(poses(300, rng)), poses(300, rng)
    found = solve(ENDLESS, targets, starts, settings)
    assert found.converged.all()
    assert np.median(found.iterations) <= 5
    e = needle_error(ENDLESS.forward(found.q), targets)
    assert np.linalg.norm(e[:, :3], axis=1).max() <= settings.position
    assert np.linalg.norm(e[:, 3:], axis=1).max() <= settings.angle


def test_with_q5_q6_q8_held_it_finds_a_branch_of_the_closed_form():
    rng = np.random.default_rng(4)
    q, starts = poses(300, rng), poses(300, rng)
    starts[:, REDUNDANT] = q[:, REDUNDANT]
    targets = ENDLESS.forward(q)
    found = solve(ENDLESS, targets, starts, TIGHT, held=REDUNDANT)
    assert found.converged.all()
    np.testing.assert_array_equal(found.q[:, REDUNDANT], q[:, REDUNDANT])
    assert off_branch(found, targets, starts) < 1e-6  # a root of 1e-10 at folds


def test_where_no_answer_exists_none_is_claimed():
    rng = np.random.default_rng(5)
    targets, starts = ENDLESS.forward(poses(300, rng)), poses(300, rng)
    can = exists(targets[:, :3, 2], starts[:, 4], starts[:, 5])
    found = solve(ENDLESS, targets, starts, TIGHT, held=REDUNDANT)
    assert 20 < (~can).sum() < 280
    np.testing.assert_array_equal(found.converged, can)


def test_limits_are_never_left_and_local_minima_are_told():
    rng = np.random.default_rng(6)
    targets, starts = ENDLESS.forward(poses(300, rng)), poses(300, rng)
    found = solve(LIMITED, targets, starts, PAPER)
    assert (found.q >= LOWER).all()
    assert (found.q <= UPPER).all()
    assert 0.85 < found.converged.mean() < 1.0  # 93 % of 10^4 (docs/evidence.md)
    assert not (found.converged & found.stalled).any()
    stuck = np.flatnonzero(found.stalled)
    # no joint that could still move lessens the error there
    scale = np.array([1 / PAPER.length] * 3 + [1.0] * 2)
    e = needle_error(ENDLESS.forward(found.q[stuck]), targets[stuck]) * scale
    J = jacobian(found.q[stuck])[:, list(ROWS)] * scale[:, None]
    downhill = np.einsum("nij,ni->nj", J, e)
    q = found.q[stuck]
    downhill[(q <= LOWER) & (downhill < 0)] = 0.0
    downhill[(q >= UPPER) & (downhill > 0)] = 0.0
    assert np.median(np.abs(downhill).max(axis=1)) < 1e-3


def test_the_null_space_term_brings_the_arm_nearer_to_the_preferred_one():
    rng = np.random.default_rng(7)
    preferred = 0.5 * (LOWER + UPPER)
    targets, starts = ENDLESS.forward(poses(100, rng)), poses(100, rng)
    without = solve(ENDLESS, targets, starts, PAPER)
    settings = Settings(pull=0.5)
    pulled = solve(ENDLESS, targets, starts, settings, preferred=preferred)
    assert pulled.converged.all()
    far = np.linalg.norm(without.q - preferred, axis=1)
    assert np.mean(np.linalg.norm(pulled.q - preferred, axis=1) < far) > 0.8


def other_chain(axes, points, home):
    """A chain of turning joints by its axes, as no code of CRANE has it."""

    def joint(axis, point, angle):
        T = np.eye(4)
        T[:3, :3] = turn(axis, angle)
        T[:3, 3] = point - T[:3, :3] @ point
        return T

    def placed(q):
        T, at = np.eye(4), []
        for axis, point, angle in zip(axes, points, q, strict=True):
            at.append((T[:3, :3] @ axis, T[:3, :3] @ point + T[:3, 3]))
            T = T @ joint(axis, point, angle)
        return T @ home, at

    def body(q):
        T, at = placed(q)
        back = T[:3, :3].T
        rows = [
            np.concatenate([back @ np.cross(w, T[:3, 3] - p), back @ w]) for w, p in at
        ]
        return np.array(rows).T

    return Chain(
        lambda q: np.array([placed(x)[0] for x in q]),
        lambda q: np.array([body(x) for x in q]),
    )


def test_any_other_chain_will_do():
    rng = np.random.default_rng(8)
    axes = rng.normal(size=(6, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    home = np.eye(4)
    home[:3, 3] = [0.5, 0.1, 0.2]
    chain = other_chain(axes, rng.uniform(-0.3, 0.3, (6, 3)), home)
    q = rng.uniform(-1, 1, (20, 6))
    found = solve(chain, chain.forward(q), q + rng.uniform(-0.3, 0.3, q.shape), TIGHT)
    assert found.converged.mean() > 0.9
    assert found.position[found.converged].max() <= TIGHT.position


@pytest.mark.parametrize(
    ("start", "message"), [(math.nan, "not finite"), (9.0, "beyond the limits")]
)
def test_what_is_no_start_is_refused(start, message):
    q = 0.5 * (LOWER + UPPER)
    T = forward(q)["8"]
    q[0] = start
    with pytest.raises(ValueError, match=message):
        solve(LIMITED, T, q)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"targets": np.eye(3)}, r"targets .* must be \(n, 4, 4\)"),
        ({"targets": np.tile(np.eye(4), (3, 1, 1))}, "3 targets and 2 starts"),
        ({"targets": np.eye(4) * np.nan}, "not finite"),
        ({"starts": 0.0}, "starts"),
        ({"held": (8,)}, "held joint 8: there are 0 to 7"),
        ({"held": (-1,)}, "held joint -1"),
        ({"preferred": np.zeros(7)}, r"preferred \(7,\) is not \(8,\)"),
        ({"preferred": np.full(8, np.nan)}, "finite numbers"),
        ({"chain": replace(LIMITED, lower=np.zeros(7))}, "lower limits"),
    ],
)
def test_what_is_no_problem_is_refused(change, message):
    asked = {"chain": ENDLESS, "targets": np.eye(4), "starts": np.zeros((2, 8))}
    with pytest.raises(ValueError, match=message):
        solve(**asked | change)


@pytest.mark.parametrize(
    "wrong",
    [
        *({"position": value} for value in (0.0, -1e-3, np.nan, np.inf)),
        *({"angle": np.nan}, {"length": 0.0}, {"damping": -1.0}, {"pull": -0.1}),
        *({"steps": 0}, {"steps": 1.5}, {"steps": -3}),
    ],
)
def test_settings_that_find_nothing_are_refused(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=f"{name} = "):
        Settings(**wrong)
