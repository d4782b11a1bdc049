"""Rigid transforms from points: laws of Fitzpatrick, chains, refusals, the file."""

import json

import numpy as np
import pytest

from borecheck.robots.robot import load_robot
from borecheck.uncertainty.covariance import from_document
from crane.calibration_motion import (
    FIDUCIALS,
    calibrated,
    noisy,
    read_pose,
    sensor_in_robot,
    stage_trajectory,
)
from crane.kinematics import forward
from crane.registration import (
    Registration,
    adjoint,
    point_covariance,
    register,
    uncertainty,
)
from crane.studies.registration import affine, chain, drawn, tracker_place
from crane.turning import turns

CLOUD = np.array(FIDUCIALS)
T = tracker_place()
THERE = CLOUD @ T[:3, :3].T + T[:3, 3]


def small(twist):
    """1 + error: shift and turn about the origin."""
    E = np.eye(4)
    E[:3, :3], E[:3, 3] = turns(twist[None, 3:])[0], twist[:3]
    return E


def test_exact_points_give_the_transform_exactly():
    found = register(CLOUD, THERE)
    np.testing.assert_allclose(found.T, T, atol=1e-14)
    assert found.fre < 1e-15


def test_coplanar_points_are_enough():
    flat = CLOUD * [1.0, 1.0, 0.0]
    found = register(flat, flat @ T[:3, :3].T + T[:3, 3])
    np.testing.assert_allclose(found.T, T, atol=1e-14)
    read = noisy(flat @ T[:3, :3].T + T[:3, 3], 2e-4, np.random.default_rng(0))
    assert np.linalg.det(register(flat, read).T[:3, :3]) == pytest.approx(1.0)


def test_no_rigid_motion_fits_noisy_points_better():
    """Least squares: every small twist of the answer makes the misfit larger."""
    rng = np.random.default_rng(1)
    b = noisy(THERE, 1e-3, rng)
    found = register(CLOUD, b)
    for _ in range(50):
        M = small(rng.normal(scale=1e-4, size=6)) @ found.T
        misfit = CLOUD @ M[:3, :3].T + M[:3, 3] - b
        assert np.sqrt(np.mean(np.sum(misfit**2, axis=1))) > found.fre


def test_the_answer_is_a_rotation_even_for_very_noisy_points():
    rng = np.random.default_rng(2)
    for _ in range(200):
        try:
            found = register(CLOUD, noisy(THERE, 4e-3, rng))
        except ValueError:
            continue
        assert np.linalg.det(found.T[:3, :3]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("points", "fle"),
    [(sensor_in_robot(stage_trajectory())[:, :3, 3], 1.4e-3), (CLOUD, 0.2e-3)],
)
def test_fre_and_tre_over_200_seeds(points, fle):
    found = drawn(points, T, fle, 200, np.random.default_rng(1))
    assert found["fre_ratio"] == pytest.approx(1.0, abs=0.02)
    assert found["tre_ratio"] == pytest.approx(1.0, abs=0.08)  # 3 dof: 4 % rms


def test_tre_is_fitzpatricks():
    """TRE^2 = FLE^2 / N (1 + 1/3 sum of d_k^2 / f_k^2) over the principal axes."""
    fle, target = 0.3e-3, np.array([0.1, -0.05, 0.2])
    middle = THERE.mean(axis=0)
    axes = np.linalg.svd(THERE - middle)[2]
    total = 1.0
    for axis in axes:
        off = np.sum(np.square(target - middle)) - np.square((target - middle) @ axis)
        away = THERE - middle
        f2 = np.mean(np.sum(away**2, axis=1) - (away @ axis) ** 2)
        total += off / f2 / 3.0
    expected = fle * np.sqrt(total / len(THERE))
    assert register(CLOUD, THERE, fle).tre(target) == pytest.approx(expected, rel=1e-9)


def test_covariance_is_that_of_many_draws():
    rng, fle = np.random.default_rng(3), 0.2e-3
    errors = []
    for _ in range(2000):
        E = register(CLOUD, noisy(THERE, fle, rng)).T @ np.linalg.inv(T)
        turn = 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])
        errors.append(np.concatenate([E[:3, 3], turn]))
    stated = point_covariance(THERE, fle)
    whitened = np.linalg.solve(np.linalg.cholesky(stated), np.array(errors).T)
    np.testing.assert_allclose(np.cov(whitened), np.eye(6), atol=0.12)


def test_without_a_stated_error_the_residuals_tell_it():
    rng = np.random.default_rng(4)
    found = [register(CLOUD, noisy(THERE, 0.5e-3, rng)).fle for _ in range(200)]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(0.5e-3, rel=0.04)


def test_products_and_inverses_carry_errors_along():
    """First order: the error of a product is that of perturbed factors."""
    rng = np.random.default_rng(5)
    A = Registration(T, np.diag([1, 2, 3, 4, 5, 6]) * 1e-10)
    B = Registration(np.linalg.inv(T) @ T @ T, point_covariance(CLOUD, 1e-4))
    e = rng.normal(size=6) * 1e-6
    E = (A.T @ small(e) @ B.T) @ np.linalg.inv(A.T @ B.T)
    np.testing.assert_allclose(E[:3, 3], (adjoint(A.T) @ e)[:3], atol=1e-11)
    np.testing.assert_allclose((A @ B).T, A.T @ B.T)
    back = A.inverse()
    np.testing.assert_allclose(back.T, np.linalg.inv(A.T))
    np.testing.assert_allclose(back.inverse().covariance, A.covariance, atol=1e-24)


def test_whole_calibrations_err_as_stated():
    found = chain(150, np.random.default_rng(6))
    assert found["tre_mm"] == pytest.approx(found["tre_expected_mm"], rel=0.12)
    assert 2.4 < found["mahalanobis"] < 3.6  # 3; 150 draws: 0.2 rms


def test_a_pose_read_often_is_surer():
    rng = np.random.default_rng(7)
    one, many = read_pose(T, 1, rng), read_pose(T, 100, rng)
    np.testing.assert_allclose(one.covariance, 100.0 * many.covariance, rtol=0.1)


def test_eq_15_as_printed_is_affine_and_ours_is_not():
    found = affine(T, np.random.default_rng(8))
    assert found["most"] - found["least"] > 0.01
    assert found["rigid_off_by"] < 1e-13


def test_the_trajectory_moves_the_stages_alone():
    q = stage_trajectory()
    assert (q[:, 3:] == q[0, 3:]).all()
    R = forward(q)["8"][:, :3, :3]
    np.testing.assert_allclose(R, np.broadcast_to(R[0], R.shape), atol=1e-15)


RNG = np.random.default_rng(12)
SHUFFLED = [3, 0, 2, 9, 1, 5, 8, 4, 6, 7]
LINE = np.outer(np.linspace(0.0, 0.3, 10), [1.0, 2.0, -1.0]) + 0.1


@pytest.mark.parametrize(
    ("a", "b", "message"),
    [
        (LINE, LINE, "on one line"),
        (LINE, noisy(LINE, 1e-3, np.random.default_rng(0)), "on one line"),
        (noisy(LINE, 1e-3, np.random.default_rng(0)), LINE, "on one line"),
        (
            noisy(LINE, 1e-3, np.random.default_rng(0)),
            noisy(LINE, 1e-3, np.random.default_rng(1)),
            "on one line",
        ),
        (CLOUD[:1].repeat(4, 0), CLOUD[:1].repeat(4, 0), "coincide"),
        (CLOUD[:2], CLOUD[:2], "2 points"),
        (CLOUD, CLOUD * [1.0, 1.0, -1.0], "mirror image"),
        (CLOUD, CLOUD[:-1], "must both be"),
        (CLOUD, CLOUD * np.nan, "not finite"),
        (CLOUD[::-1], CLOUD, "fit no rigid motion: .*in the same order"),
        (CLOUD * 1e3, CLOUD, "by a factor of 1000: the same units"),
        (noisy(LINE, 1e-3, RNG)[SHUFFLED], noisy(LINE, 1e-3, RNG), "no rigid"),
        (noisy(LINE, 5e-3, RNG), noisy(LINE, 5e-3, RNG), "on one line .*misfit"),
        (0.1 * np.eye(3), 0.1 * np.eye(3) * [1, 2, 1], "no rigid motion"),
        (CLOUD * 1e160, CLOUD, "holds 1.4e.158 m"),
        (CLOUD, CLOUD * 1e308, "metres"),
        (CLOUD * 1e-200, CLOUD, "coincide"),
        (CLOUD * 1e-320, CLOUD * 1e-320, "coincide"),
    ],
)
def test_what_tells_no_transform_is_refused(a, b, message):
    with pytest.raises(ValueError, match=message):
        register(a, b)


def test_check_takes_the_covariance():
    found = calibrated(T, np.eye(4), np.random.default_rng(9))
    document = json.loads(json.dumps(uncertainty(found.scanner_robot)))
    read = from_document(document, load_robot("crane"))
    assert read.registration.names == ("x", "y", "z", "rx", "ry", "rz")
    np.testing.assert_allclose(
        read.registration.covariance, found.scanner_robot.covariance, rtol=1e-9
    )


def told(a, b):
    """Why points are refused, or nothing."""
    try:
        register(a, b)
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("scale", [1e-3, 1e-2, 0.1, 1.0, 10.0])
def test_only_lines_are_called_lines(scale):
    """Whatever the misfit, a cloud as wide as long is none; a needle's row is one."""
    rng = np.random.default_rng(13)
    for _ in range(50):
        b = CLOUD[rng.permutation(8)] + rng.normal(scale=scale * 0.01, size=(8, 3))
        assert "line" not in told(CLOUD, b)
    for _ in range(50):
        row = np.outer(np.sort(rng.uniform(0.0, 0.2, 8)), [0.6, 0.0, 0.8])
        noise = scale * 1e-4
        with pytest.raises(ValueError, match="on one line"):
            register(noisy(row, noise, rng), noisy(row, noise, rng))


@pytest.mark.parametrize("fle", [np.nan, np.inf, -1e-3, 1e160])
def test_an_error_that_is_none_is_refused(fle):
    with pytest.raises(ValueError, match="is none"):
        register(CLOUD, THERE, fle)
    with pytest.raises(ValueError, match="is none"):
        point_covariance(CLOUD, fle)
    with pytest.raises(ValueError, match="on one line"):
        point_covariance(LINE, 1e-3)
