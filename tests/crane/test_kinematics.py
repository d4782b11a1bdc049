"""The closed form against Table IV's rows multiplied out, a precursor, differences."""

import subprocess
import sys

import numpy as np
import pytest

from crane.dimensions import ANGLES, LIMITS, Dimensions, dimensions, sources
from crane.kinematics import (
    BODIES,
    FRAMES,
    forward,
    jacobian,
    manipulability,
    space_jacobian,
)

ROUNDING = 1e-13  # a dozen products of numbers near 1
DIFFERENCES = 1e-8  # central differences with a step of 1e-6

LOWER, UPPER = np.array(list(LIMITS.values())).T
PLACE = {"base_x": -0.3, "base_y": 0.2, "base_z": 0.1, "base_yaw": 2.0}


def random_q(count, seed=0):
    return np.random.default_rng(seed).uniform(LOWER, UPPER, (count, 8))


def turn(axis, degrees):
    """A turn about x (0) or z (2) as a transform."""
    angle, T = np.deg2rad(degrees), np.eye(4)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    T[[i, j], [i, j]] = np.cos(angle)
    T[j, i], T[i, j] = np.sin(angle), -np.sin(angle)
    return T


def shift(*xyz):
    T = np.eye(4)
    T[:3, 3] = xyz
    return T


def table_iv(q):
    """Frames 0 to 8 by [CRANE] eqs. (12) to (14): rows (alpha, a, d, theta)."""
    q1, q2, q3, *turns, q8 = q
    q4, q5, q6, q7 = np.rad2deg(turns)
    rows = [
        (0, 0, q1, 0),
        (-90, 0, q2, 90),
        (90, 0, q3, 0),
        (0, 0, 0, q4 + 90),
        (90, 0, 0, q5 + 90),
        (90, 0.07, 0, q6),
        (-90, 0.07, 0.03, q7 - 90),
        (-90, 0.01, 0.02 + q8, 0),
    ]
    frames = [turn(0, 90)]
    for alpha, a, d, theta in rows:
        step = turn(0, alpha) @ shift(a, 0, 0) @ turn(2, theta) @ shift(0, 0, d)
        frames.append(frames[-1] @ step)
    return frames


def test_closed_form_is_table_iv():
    T_I_W = shift(-0.3, 0.2, 0.1) @ turn(2, np.rad2deg(2.0))
    for q in random_q(200):
        T = forward(q, **PLACE)
        np.testing.assert_allclose(T["W"], T_I_W, atol=ROUNDING)
        for i, expected in enumerate(table_iv(q)):
            np.testing.assert_allclose(T[str(i)], T_I_W @ expected, atol=ROUNDING)
        tip = T["8"] @ shift(0, 0, 0.05)
        np.testing.assert_allclose(T["needle_tip"], tip, atol=ROUNDING)


def test_the_precursors_printed_frame():
    """Lengths of the earlier arm in the same chain give the place its code prints."""
    earlier = {"a6": 0.08, "a7": 0.08, "d7": 0.0, "a8": 0.0, "d8": 0.05, "base_x": 0.0}
    by = {name: value - getattr(Dimensions(), name) for name, value in earlier.items()}
    T = forward([0.5, 0.2, 0.2, 0, 0, 0, 0.3, 0], perturbed=by)["8"]
    np.testing.assert_allclose(T[:3, 3], [0.408, -0.5, 0.185], atol=5e-4)  # 3 digits


def test_what_the_axes_are_for():
    """At zero arm and needle lie along x; q7 = 90 deg points the needle down."""
    T = forward(np.zeros(8))
    np.testing.assert_allclose(T["8"][:3, 2], [1, 0, 0], atol=ROUNDING)
    np.testing.assert_allclose(T["4"][:3, 2], [1, 0, 0], atol=ROUNDING)
    down = forward([0, 0, 0, 0, 0, 0, np.pi / 2, 0])
    np.testing.assert_allclose(down["8"][:3, 2], [0, 0, -1], atol=ROUNDING)
    assert set(T) == {*FRAMES, *BODIES}


def test_many_configurations_at_once_are_the_single_ones():
    q = random_q(5)
    together = forward(q)
    for i in range(len(q)):
        for name, T in forward(q[i]).items():
            np.testing.assert_array_equal(together[name][i], T)
    np.testing.assert_array_equal(jacobian(q)[2], jacobian(q[2]))
    np.testing.assert_array_equal(space_jacobian(q)[2], space_jacobian(q[2]))
    np.testing.assert_array_equal(manipulability(q)[2], manipulability(q[2]))


@pytest.mark.parametrize("frame", ["8", "needle_tip"])
def test_body_and_space_jacobian_against_differences(frame):
    step = 1e-6
    for q in random_q(20):
        J, spatial = jacobian(q, frame, **PLACE), space_jacobian(q, **PLACE)
        T = forward(q, **PLACE)[frame]
        for j in range(8):
            after = forward(q + step * np.eye(8)[j], **PLACE)[frame]
            before = forward(q - step * np.eye(8)[j], **PLACE)[frame]
            rate = (after - before) / (2 * step)
            for twist, column in (
                (np.linalg.inv(T) @ rate, J[:, j]),
                (rate @ np.linalg.inv(T), spatial[:, j]),
            ):
                turned = [twist[2, 1], twist[0, 2], twist[1, 0]]
                np.testing.assert_allclose(column[:3], twist[:3, 3], atol=DIFFERENCES)
                np.testing.assert_allclose(column[3:], turned, atol=DIFFERENCES)


def test_a_jacobian_is_of_the_needle():
    with pytest.raises(ValueError, match="needle_tip"):
        jacobian(np.zeros(8), "7")


def test_manipulability_is_the_determinant():
    for q in random_q(100):
        rows = jacobian(q)[3:5]  # about x (roll of eq. 25) and y (pitch)
        expected = np.sqrt(np.linalg.det(rows @ rows.T))
        assert manipulability(q) == pytest.approx(expected, abs=1e-12)


def test_five_of_six_directions_of_the_task_are_there():
    """The 5-D task (roll of the needle free) has full rank, as crane.md measured."""
    for q in random_q(100):
        assert np.linalg.matrix_rank(jacobian(q)[:5], tol=1e-9) == 5


def test_rows_of_a_configuration_are_asked_for():
    with pytest.raises(ValueError, match=r"q1\.\.q8"):
        forward(np.zeros(7))


def test_every_number_has_its_source():
    assert set(sources()) == set(dimensions())
    for text in sources().values():
        assert text.startswith(("Table IV", "assumed:"))
    assert set(ANGLES) == {"q4", "q5", "q6", "q7"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"base_w": 1.0}, "unknown argument 'base_w'"),
        ({"base_x": "nan"}, "base_x = 'nan' is no finite number"),
        ({"base_y": "5 mm"}, "base_y = '5 mm' is no finite number"),
        ({"base_yaw": 1e999}, "base_yaw = inf is no finite number"),
        ({"needle_ahead": 0.17}, "needle_ahead = 0.17 is not 0 to 0.16 m"),
        ({"needle_ahead": "-1e-3"}, "needle_ahead = -0.001 is not 0 to"),
        ({"needle_ahead": 1e160}, "needle_ahead = 1e.160 is not 0 to"),
    ],
)
def test_wrong_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        forward(np.zeros(8), **arguments)


def test_the_closed_form_needs_numpy_alone():
    code = (
        "import sys, crane.kinematics;"
        "print(sorted({m.split('.')[0] for m in sys.modules} &"
        " {'pinocchio', 'coal', 'borecheck', 'scipy', 'numba', 'xacro'}))"
    )
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "[]"
