"""Motors and joints: form of C, there and back, and what encoders tell of it."""

import numpy as np
import pytest

from crane.encoders import JOINT_STEP, MOTOR_STEP, rounded, simulated_series
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


def read(m, cable=TRUE):
    """What encoders read of motors [rad] and of the joints they move."""
    steps = JOINT_STEP * np.array([1.0, 1.0, 1.0, 6.35e-3])
    return rounded(m, MOTOR_STEP), rounded(m @ np.asarray(cable).T, steps)


@pytest.mark.parametrize("amplitude", [0.5, 1.0, 5.0])
@pytest.mark.parametrize("motor", range(4))
def test_a_motor_that_flickers_has_moved_nothing(motor, amplitude):
    """Its spread is that of its own rounding, whatever the number of samples."""
    rng = np.random.default_rng(7)
    m = series(5000).motors.copy()
    m[:, motor] = 0.7 + amplitude * MOTOR_STEP * rng.uniform(-1.0, 1.0, 5000)
    with pytest.raises(ValueError, match=f"m{5 + motor} stands still: it moves by"):
        identify(*read(m))


def test_noise_on_a_motor_that_stands_still_is_no_motion():
    """Finer than any step of an encoder: the joint does not follow it."""
    rng = np.random.default_rng(8)
    s = series(2000)
    for noise in (1e-12, 1e-5, 1e-3):
        m = s.motors.copy()
        m[:, 0] = noise * rng.normal(size=2000)
        q = rounded(rng.normal(scale=3e-4, size=(2000, 4)) + m @ TRUE.T, JOINT_STEP)
        with pytest.raises(ValueError, match=r"m5 stands still|q5 does not follow m5"):
            identify(m, q)


def test_a_joint_that_flickers_does_not_follow():
    rng = np.random.default_rng(9)
    motors, joints = (np.array(v) for v in (series(2000).motors, series(2000).joints))
    joints[:, 1] = 0.3 + JOINT_STEP * rng.integers(0, 2, 2000)
    with pytest.raises(ValueError, match="q6 does not follow m6"):
        identify(motors, joints)


def test_small_motions_in_step_are_in_step_all_the_same():
    """What of one the other does not explain is rounding, however little both move."""
    m = series(5000).motors.copy()
    m[:, 0] *= 40.0 * MOTOR_STEP / np.ptp(m[:, 0])
    m[:, 1] = -m[:, 0]
    with pytest.raises(ValueError, match="m5 and m6 are driven in step"):
        identify(*read(m))


def test_poses_held_one_after_another_are_a_series():
    """A motor that stands in few places shows no small steps, and has moved far."""
    rng = np.random.default_rng(10)
    m = rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0], (200, 4))
    found = identify(m, m @ TRUE.T)
    np.testing.assert_allclose(found.cable, TRUE, atol=1e-12)
    assert found.above_diagonal() == ()


@pytest.mark.parametrize(("i", "j"), [(0, 1), (1, 3), (2, 3)])
def test_an_entry_above_the_diagonal_is_told(i, j):
    C = TRUE.copy()
    C[i, j] = 0.01 * TRUE[i, i]
    for bits in (False, True):
        s = series(5000, cable=C, bits=bits)
        ((joint, motor, entry, ratio),) = identify(s.motors, s.joints).above_diagonal()
        assert (joint, motor) == (f"q{5 + i}", f"m{5 + j}")
        assert entry == pytest.approx(C[i, j], rel=0.05)
        assert ratio > 6.0


def test_nothing_is_told_above_the_diagonal_of_true_series():
    for seed in range(20):
        for bits in (False, True):
            s = series(2000, seed, bits=bits)
            assert identify(s.motors, s.joints).above_diagonal() == ()


@pytest.mark.parametrize("size", [1e160, 1e305, 1e-160, 1e-320])
def test_numbers_beyond_all_units_are_refused(size):
    s = series(100, bits=False)
    for scaled in ((s.motors * size, s.joints), (s.motors, s.joints * size)):
        with pytest.raises(ValueError, match=r"readings are in rad|still|not move"):
            identify(*scaled)
