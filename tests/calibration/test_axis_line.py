"""Axes from points: exact on exact discs, from near and far; bad points refused."""

import numpy as np
import pytest

from borecheck.calibration.axis_line import (
    Discs,
    _errors,
    _in_disc,
    _inverse,
    _jacobian,
    _small_motion,
    discs_at,
    discs_from_points,
    fit_axes,
)
from borecheck.errors import GeometryError

EXACT = 1e-12


def random_discs(rng, count, n=21, arc=1.2):
    """Points on arcs about random axes: (points, a point of each axis, directions)."""
    z = rng.normal(size=(count, 3))
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z), axis=1)])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(z, x)
    centre = rng.uniform(-1, 1, (count, 3))
    radius = rng.uniform(0.1, 1.0, (count, 1, 1))
    angle = rng.uniform(-arc, arc, (count, n, 1))
    points = centre[:, None] + radius * (
        np.cos(angle) * x[:, None] + np.sin(angle) * y[:, None]
    )
    return points, centre, z


def distance_to_axis(fit, centre, z):
    across = np.cross(fit.directions, z)
    off = np.cross(centre - fit.points, fit.directions)
    return np.linalg.norm(across, axis=1).max(), np.linalg.norm(off, axis=1).max()


def test_exact_points_give_the_axis_from_the_points():
    rng = np.random.default_rng(0)
    points, centre, z = random_discs(rng, 200)
    fit = fit_axes(points, discs_from_points(points, z))
    assert fit.converged.all()
    angle, off = distance_to_axis(fit, centre, z)
    assert angle < EXACT
    assert off < EXACT
    assert (fit.iterations <= 2).all()
    assert (fit.rms < EXACT).all()


def test_exact_points_give_the_axis_from_the_nominal():
    """A start as near as the paper's (3 mm, 0.5 deg) takes at most 8 iterations."""
    rng = np.random.default_rng(1)
    points, centre, z = random_discs(rng, 200)
    rough = centre + rng.uniform(-0.003, 0.003, centre.shape)
    tilted = z + np.radians(0.5) * rng.uniform(-1, 1, z.shape)
    fit = fit_axes(points, discs_at(rough, tilted, points))
    assert fit.converged.all()
    assert fit.iterations.max() <= 8
    assert max(distance_to_axis(fit, centre, z)) < EXACT


def test_jacobian_against_differences_of_the_motion():
    rng = np.random.default_rng(2)
    points, centre, z = random_discs(rng, 1)
    start = discs_at(centre + 0.01, z, points)
    T, r = start.T_world_disc, start.radius
    J = _jacobian(_in_disc(T, points))[0]
    step = 1e-6
    for k in range(6):
        values = []
        for sign in (1, -1):
            move = np.zeros((1, 6))
            move[0, k] = sign * step
            moved = T @ _inverse(_small_motion(move))
            values.append(_errors(_in_disc(moved, points), r + move[:, 5])[0])
        np.testing.assert_allclose(
            J[..., k], (values[0] - values[1]) / (2 * step), atol=1e-8
        )


def test_the_printed_increment_without_its_minus_moves_away():
    rng = np.random.default_rng(3)
    points, centre, z = random_discs(rng, 1)
    start = discs_at(centre + 0.002, z, points)
    before = np.abs(_errors(_in_disc(start.T_world_disc, points), start.radius)).max()
    p = _in_disc(start.T_world_disc, points)
    J = _jacobian(p).reshape(-1, 6)
    e = _errors(p, start.radius).reshape(-1)
    printed = np.linalg.lstsq(J, e, rcond=None)[0][None]
    for step, better in ((-printed, True), (printed, False)):
        T = start.T_world_disc @ _inverse(_small_motion(step))
        after = np.abs(_errors(_in_disc(T, points), start.radius + step[:, 5])).max()
        assert (after < before) == better


def test_covariance_is_the_scatter_of_the_estimates():
    rng = np.random.default_rng(4)
    one, _, z = random_discs(rng, 1, n=30)
    sigma = 1e-5
    many = np.repeat(one, 2000, axis=0)
    noisy = many + sigma * rng.normal(size=many.shape)
    fit = fit_axes(noisy, discs_from_points(noisy, np.repeat(z, 2000, axis=0)))
    exact = fit_axes(one, discs_from_points(one, z))
    expected = sigma * np.sqrt(exact.covariance[0, 5, 5])
    assert fit.discs.radius.std() == pytest.approx(expected, rel=0.1)


def test_direction_only_chooses_the_sign():
    rng = np.random.default_rng(5)
    points, _, z = random_discs(rng, 5)
    up, down = discs_from_points(points, z), discs_from_points(points, -z)
    np.testing.assert_allclose(
        up.T_world_disc[:, :3, 2], -down.T_world_disc[:, :3, 2], atol=EXACT
    )


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (np.zeros((1, 2, 3)), "2 points cannot fix an axis"),
        (np.ones((1, 5, 3)), "all in one place"),
        (np.arange(5.0)[None, :, None] * np.ones(3), "on a straight line"),
        (np.full((1, 5, 3), np.nan), "not finite"),
        (np.zeros((5, 3)), "shape"),
    ],
)
def test_points_that_fix_no_axis_are_refused(points, words):
    discs = Discs(np.eye(4)[None], np.ones(1))
    with pytest.raises(GeometryError, match=words):
        fit_axes(points, discs)
