"""From CRANE's motors to its joints and back; how the coupling is found. numpy only.

[CRANE] eqs. (6) to (10): q = C m with C = blkdiag(C_base, C_cable), C_base diagonal,
C_cable lower triangular, as a cable that passes a joint winds about its idler. C_cable
is identified row by row by least squares; eq. (9) as printed has no intercept, so an
encoder that is not zeroed spoils every entry. Motors [rad]; q1 to q3, q8 [m], else
[rad].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.excitation import FINEST, LEAST_EFFECT, excitation

Array = NDArray[np.float64]

MOTORS = tuple(f"m{i}" for i in range(1, 9))
CABLE_JOINTS = ("q5", "q6", "q7", "q8")

# Eq. (8), g1 to g4; lost. Assumed: belts of 40 mm a turn for the stages, whose drive
# must give way to a hand; 1:4 for the trunnion. Signs are a choice.
BASE_RATIOS = (0.040 / (2 * np.pi), 0.040 / (2 * np.pi), 0.040 / (2 * np.pi), 0.25)

# Eq. (10) is lost. In its place the pulleys of a public precursor (12.7 mm on the
# motors, 28, 28, 16 mm on joints, idlers of 22 mm and less): rad/rad, last row m/rad.
CABLE = (
    (0.4536, 0.0, 0.0, 0.0),
    (-0.3564, 0.4536, 0.0, 0.0),
    (0.9436, -0.6237, 0.7938, 0.0),
    (-5.2606e-3, 3.2317e-3, -8.7312e-3, 6.35e-3),
)

# An entry above the diagonal beyond so many standard errors is no matter of chance.
BY_CHANCE = 6.0
# Readings beyond this are in another unit than [rad] and [m].
LARGEST = 1e6


@dataclass(frozen=True)
class Transmission:
    """The coupling of motors and joints.

    Attributes:
        matrix: C of eq. (7), (8, 8), block diagonal, its cable block lower triangular.

    Raises:
        ValueError: It is not of that form, or has a zero on its diagonal.
    """

    matrix: Array

    def __post_init__(self) -> None:
        C = np.array(self.matrix, dtype=np.float64)
        if C.shape != (8, 8) or not np.isfinite(C).all():
            raise ValueError(f"a coupling is 8 by 8 finite numbers, not {C.shape}")
        may = np.zeros((8, 8), dtype=bool)
        may[:4, :4] = np.eye(4, dtype=bool)
        may[4:, 4:] = np.tri(4, dtype=bool)
        for i, j in np.argwhere((C != 0.0) & ~may):
            raise ValueError(
                f"motor {MOTORS[j]} cannot move q{i + 1}: C is diag(g1..g4) and a "
                "lower triangular block, eqs. (7) to (10)"
            )
        if not np.diag(C).all():
            raise ValueError("a joint that its own motor does not move: zero in diag C")
        C.setflags(write=False)
        object.__setattr__(self, "matrix", C)

    def joints(self, motors: ArrayLike) -> Array:
        """Q = C m, (..., 8); eq. (6)."""
        return np.asarray(motors, float) @ self.matrix.T

    def motors(self, joints: ArrayLike) -> Array:
        """The m (..., 8) with C m = q, by substitution row after row."""
        q = np.asarray(joints, float)
        m = np.zeros(q.shape)
        for i in range(8):
            known = m[..., :i] @ self.matrix[i, :i]
            m[..., i] = (q[..., i] - known) / self.matrix[i, i]
        return m


def transmission(
    base_ratios: ArrayLike = BASE_RATIOS, cable: ArrayLike = CABLE
) -> Transmission:
    """C from its blocks, eq. (7).

    Args:
        base_ratios: g1 to g4, (4,).
        cable: C_cable, (4, 4), lower triangular.
    """
    C = np.zeros((8, 8))
    C[:4, :4] = np.diag(np.asarray(base_ratios, float))
    C[4:, 4:] = np.asarray(cable, float)
    return Transmission(C)


@dataclass(frozen=True)
class Identified:
    """What a series tells of C_cable.

    Attributes:
        cable: (4, 4), rows q5 to q8, columns the motors m5 to m8.
        offset: What the joint encoders read with all motors at zero, (4,); zero if
            it was not asked for.
        residual_rms: Of every row, [rad], the last [m], (4,).
        standard_error: Of every entry of `cable`, (4, 4).
        condition: Of the motors' motions, each measured in its own spread; 1 is best.
        above: Largest entry above the diagonal in its standard error: how well the
            series bears out that C_cable is lower triangular; 0 if it was imposed.
    """

    cable: Array
    offset: Array
    residual_rms: Array
    standard_error: Array
    condition: float
    above: float

    def above_diagonal(self) -> tuple[tuple[str, str, float, float], ...]:
        """Joint, motor, entry and its standard errors, of what the paper has as 0.

        Entries of C_cable above the diagonal that errors, if independent from sample
        to sample, do not explain.
        """
        ratio = _in_standard_errors(self.cable, self.standard_error, self.condition)
        told = np.argwhere(np.triu(ratio, 1) > BY_CHANCE)
        return tuple(
            (CABLE_JOINTS[i], MOTORS[4 + j], float(self.cable[i, j]), ratio[i, j])
            for i, j in told
        )


def identify(
    motors: ArrayLike,
    joints: ArrayLike,
    *,
    intercept: bool = True,
    triangular: bool = False,
) -> Identified:
    """C_cable by least squares from motor and joint encoders, eq. (9).

    Args:
        motors: Series of m5 to m8, (n, 4), [rad].
        joints: Series of q5 to q8 at the same instants, (n, 4), [rad], q8 [m].
        intercept: Whether encoders may have an offset. Without it the row is that of
            eq. (9) as printed.
        triangular: Takes for row i the motors up to i only.

    Raises:
        ValueError: Too few samples, numbers that are not finite, a motor that stands
            still or flickers, a joint that does not follow, or motors driven in step.
    """
    M, Q = _checked(motors, joints)
    stuck = [f"q{5 + i}" for i in np.flatnonzero(np.ptp(Q, axis=0) < FINEST)]
    if stuck:
        raise ValueError(f"{', '.join(stuck)} does not move: encoder or cable?")
    own, condition = excitation(M, MOTORS[4:], intercept)
    cable, errors = np.zeros((4, 4)), np.zeros((4, 4))
    offset, rms = np.zeros(4), np.zeros(4)
    for i in range(4):
        used = i + 1 if triangular else 4
        row, error, offset[i], rms[i] = _row(M[:, :used], Q[:, i], intercept)
        cable[i, :used], errors[i, :used] = row, error
    _refuse_unmoved(np.abs(np.diag(cable)) * own, rms)
    ratio = _in_standard_errors(cable, errors, condition)
    above = 0.0 if triangular else float(ratio[np.triu_indices(4, 1)].max())
    return Identified(cable, offset, rms, errors, condition, above)


def _row(M: Array, q: Array, intercept: bool) -> tuple[Array, Array, float, float]:
    """One row: entries, their standard errors, offset, residual."""
    # about the means: the offset then takes no digits from the entries
    mean = M.mean(axis=0) if intercept else np.zeros(M.shape[1])
    level = float(q.mean()) if intercept else 0.0
    scale = np.abs(M - mean).max(axis=0)
    A = (M - mean) / scale
    scaled = np.linalg.lstsq(A, q - level, rcond=None)[0]
    left = q - level - A @ scaled
    freedom = len(q) - M.shape[1] - int(intercept)
    variance = float(left @ left) / freedom
    spread = np.sqrt(variance * np.diag(np.linalg.inv(A.T @ A)))
    row = scaled / scale
    rms = float(np.sqrt(np.mean(left**2)))
    return row, spread / scale, level - float(mean @ row), rms


def _in_standard_errors(cable: Array, errors: Array, condition: float) -> Array:
    """Every entry in its standard error, to which rounding adds, (4, 4)."""
    rounding = condition * np.finfo(float).eps * np.abs(cable).max(axis=1)
    return np.asarray(np.abs(cable) / (rounding[:, None] + errors))


def _checked(motors: ArrayLike, joints: ArrayLike) -> tuple[Array, Array]:
    M, Q = np.asarray(motors, float), np.asarray(joints, float)
    if M.ndim != 2 or M.shape[1] != 4 or M.shape != Q.shape:
        raise ValueError(f"motors {M.shape} and joints {Q.shape} must both be (n, 4)")
    if len(M) < 10:
        raise ValueError(f"{len(M)} samples; 10 are the least for four motors")
    if not (np.isfinite(M).all() and np.isfinite(Q).all()):
        raise ValueError("a series holds a number that is not finite")
    largest = float(max(np.abs(M).max(), np.abs(Q).max()))
    if largest > LARGEST:
        raise ValueError(f"a series holds {largest:.3g}: readings are in rad, q8 in m")
    return M, Q


def _refuse_unmoved(effect: Array, unexplained: Array) -> None:
    """Refuses joints whose own motor moves them by less than what is not explained."""
    for i in np.flatnonzero(effect < LEAST_EFFECT * unexplained):
        raise ValueError(
            f"{CABLE_JOINTS[i]} does not follow {MOTORS[4 + i]}, which moves it by "
            f"{effect[i]:.2g} rms while {unexplained[i]:.2g} of its motion is not "
            "explained: encoder, cable, or too small a motion?"
        )
