"""Motors and joints: form of C, there and back, and what encoders tell of it."""

import numpy as np
import pytest

from crane.encoders import JOINT_STEP, rounded, simulated_series
from crane.transmission import CABLE, Transmission, identify, transmission

TRUE = np.array(CABLE)
OFFSET = 0.05 * np.array([1.0, 1.0, 1.0, 6.35e-3])


def series(samples=2000, seed=0, **options):
    return simulated_series(samples, np.random.default_rng(seed), **options)


def test_joints_to_motors_and_back():
    C, q = transmission(), np.random.default_rng(1).uniform(-1, 1, (100, 8))
    np.testing.assert_allclose(C.joints(C.motors(q)), q, atol=1e-14)
    np.testing.assert_allclose(C.motors(q), np.linalg.solve(C.matrix, q.T).T, rtol=1e-9)


def test_an_earlier_motor_moves_later_joints_and_no_other():
    C = transmission()
    for j in range(8):
        moved = C.joints(np.eye(8)[j]) != 0.0
        assert moved[j]
        assert not moved[:j].any()
        assert moved[j + 1 :].any() == (4 <= j < 7)


@pytest.mark.parametrize(
    ("i", "j", "value", "message"),
    [
        (4, 5, 1e-9, "motor m6 cannot move q5"),
        (4, 3, 0.1, "motor m4 cannot move q5"),
        (0, 1, 0.1, "motor m2 cannot move q1"),
        (6, 6, 0.0, "zero in diag"),
        (5, 4, np.nan, "finite"),
    ],
)
def test_a_matrix_of_another_form_is_refused(i, j, value, message):
    C = np.array(transmission().matrix)
    C[i, j] = value
    with pytest.raises(ValueError, match=message):
        Transmission(C)


def test_exact_series_give_the_matrix_exactly():
    s = series(bits=False)
    found = identify(s.motors, s.joints)
    np.testing.assert_allclose(found.cable, TRUE, atol=1e-12)
    np.testing.assert_allclose(found.offset, 0.0, atol=1e-12)
    assert found.residual_rms.max() < 1e-12
    assert found.condition < 10.0


@pytest.mark.parametrize("seed", range(5))
def test_14_bits_give_it_to_1e_5_and_say_how_well(seed):
    s = series(50_000, seed)
    found = identify(s.motors, s.joints)
    assert np.abs(found.cable - TRUE).max() < 1e-5
    assert found.above < 6.0  # lower triangular within what the series can tell
    # steps of 2 pi / 2^14 and of the motors: rms of rounding is a step by root 12
    motor = np.linalg.norm(TRUE, axis=1) * 2 * np.pi / 4096
    joint = JOINT_STEP * np.array([1.0, 1.0, 1.0, 6.35e-3])
    expected = np.sqrt((motor**2 + joint**2) / 12.0)
    np.testing.assert_allclose(found.residual_rms, expected, rtol=0.05)


def test_standard_errors_are_those_of_repeated_series():
    rng = np.random.default_rng(5)
    s = series(500, bits=False)
    found = [
        identify(s.motors, s.joints + 1e-3 * rng.normal(size=s.joints.shape))
        for _ in range(300)
    ]
    spread = np.std([f.cable for f in found], axis=0)
    stated = np.mean([f.standard_error for f in found], axis=0)
    np.testing.assert_allclose(stated, spread, rtol=0.2)  # 300 draws: 4 % rms


def test_an_offset_is_found_with_the_intercept_and_spoils_eq_9_without():
    s = series(bits=False, offset=OFFSET)
    found = identify(s.motors, s.joints)
    np.testing.assert_allclose(found.cable, TRUE, atol=1e-12)
    np.testing.assert_allclose(found.offset, OFFSET, atol=1e-12)
    printed = identify(s.motors, s.joints, intercept=False)
    assert np.abs(printed.cable - TRUE).max() > 1e-3
    assert printed.offset.tolist() == [0.0] * 4
    M, Q = s.motors.T, s.joints.T
    literal = Q @ M.T @ np.linalg.inv(M @ M.T)  # eq. (9)
    np.testing.assert_allclose(printed.cable, literal, atol=1e-10)


def test_imposing_the_triangle_changes_nothing_that_is_true():
    s = series(5000)
    found = identify(s.motors, s.joints, triangular=True)
    assert (np.triu(found.cable, 1) == 0.0).all()
    np.testing.assert_allclose(found.cable, TRUE, atol=1e-4)


@pytest.mark.parametrize("bits", [False, True])
def test_motors_in_step_are_refused_with_the_reason(bits):
    s = series(bits=bits, in_step=True)
    with pytest.raises(ValueError, match=r"m5 and m6 are driven in step .*singular"):
        identify(s.motors, s.joints)


def test_a_motor_that_stands_still_is_named():
    s = series(bits=False)
    motors = s.motors.copy()
    motors[:, 2] = 0.7
    with pytest.raises(ValueError, match="m7 stands still"):
        identify(motors, s.joints)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda m, q: (m[:9], q[:9]), "9 samples"),
        (lambda m, q: (m, q[:-1]), "must both be"),
        (lambda m, q: (np.where(m == m[0, 0], np.inf, m), q), "not finite"),
    ],
)
def test_what_is_no_series_is_refused(spoil, message):
    s = series(100)
    with pytest.raises(ValueError, match=message):
        identify(*spoil(s.motors, s.joints))


def test_rounding_is_to_the_nearest_step():
    assert rounded(0.26, 0.5) == 0.5
    assert rounded(-0.24, 0.5) == 0.0
    assert rounded(0.24, 0.0) == 0.24


@pytest.mark.parametrize("reading", [0.0, 0.3])
def test_a_joint_that_never_moves_is_no_coupling(reading):
    rng = np.random.default_rng(6)
    motors, joints = rng.normal(size=(2, 40, 4))
    joints[:, 0] = reading
    with pytest.raises(ValueError, match="q5 does not move"):
        identify(motors, joints)
