import numpy as np
import pytest

from borecheck.core.se3 import (
    axis_rotation,
    check_transform,
    inverse,
    matrix_rpy,
    rotation_angle,
    rpy_matrix,
    transform,
)
from borecheck.errors import GeometryError

# a dozen float64 operations on numbers of size 1
ROUNDING = 1e-14


def test_rpy_is_the_product_of_three_axis_rotations(rng):
    for roll, pitch, yaw in rng.uniform(-np.pi, np.pi, (50, 3)):
        product = (
            axis_rotation((0, 0, 1), yaw)
            @ axis_rotation((0, 1, 0), pitch)
            @ axis_rotation((1, 0, 0), roll)
        )
        np.testing.assert_allclose(rpy_matrix(roll, pitch, yaw), product, atol=ROUNDING)


def test_rpy_round_trip_also_at_the_singularity(rng):
    angles = rng.uniform(-np.pi, np.pi, (50, 3))
    angles[:5, 1] = np.pi / 2
    angles[5:10, 1] = -np.pi / 2
    for rpy in angles:
        R = rpy_matrix(*rpy)
        np.testing.assert_allclose(rpy_matrix(*matrix_rpy(R)), R, atol=1e-7)


def test_inverse_undoes(rng):
    T = transform(rng.normal(size=3), rng.normal(size=3))
    np.testing.assert_allclose(inverse(T) @ T, np.eye(4), atol=ROUNDING)


@pytest.mark.parametrize("angle", [1e-12, 1e-6, 0.3, 3.1])
def test_rotation_angle_keeps_its_digits(angle):
    R = axis_rotation((0.6, 0.0, 0.8), angle)
    assert rotation_angle(np.eye(3), R) == pytest.approx(angle, rel=1e-3)


def test_check_transform_copies():
    T = np.eye(4)
    copy = check_transform(T)
    T[0, 3] = 1.0
    assert copy[0, 3] == 0.0


@pytest.mark.parametrize(
    "T",
    [
        np.eye(3),
        np.full((4, 4), np.nan),
        np.diag([1.0, 1.0, 2.0, 1.0]),
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.eye(4) + np.eye(4)[::-1] * 1e-3,
    ],
)
def test_check_transform_refuses(T):
    with pytest.raises(GeometryError):
        check_transform(T, "T_test")
