"""All parameters of the arm at once, from all samples, by least squares.

Beyond [Heikkila2010], which names it as what axis-by-axis calibration prepares. The
unknowns are four numbers for each axis and three for the target: the smallest complete
set, without a singular place for parallel axes. scipy does the minimising.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines, jacobian, positions, target_from
from borecheck.calibration.measurements import Measurements
from borecheck.calibration.noise import Noise, whitening
from borecheck.calibration.serial_arm import SerialArm
from borecheck.errors import GeometryError, UsageError

Array = NDArray[np.float64]

LOSSES = ("linear", "soft_l1", "huber", "cauchy")

# Singular values below this share of the largest are unseen directions: the noise would
# be enlarged ten million times.
UNSEEN = 1e-7


@dataclass(frozen=True, eq=False)
class Refinement:
    """The arm that fits all samples best.

    Attributes:
        lines: Its axes at zero.
        target: The target's place at zero, (3,), [m].
        parameters: By name, [m] and [rad].
        covariance: Of four numbers for each axis (as `Lines.moved`) and the target,
            (4 k + 3, 4 k + 3).
        sigma: Standard deviation of one measured coordinate, [m].
        iterations: Evaluations of the Jacobian.
        residuals: Measured minus fitted places, (n, 3), [m].
        condition: Of the scaled Jacobian: 1 is best.
    """

    lines: Lines
    target: Array
    parameters: dict[str, float]
    covariance: Array
    sigma: float
    iterations: int
    residuals: Array
    condition: float

    @property
    def rms(self) -> float:
        """Root mean square of the coordinates' residuals, [m]."""
        return float(np.sqrt((self.residuals**2).mean()))


def refine(
    arm: SerialArm,
    data: Measurements,
    start: Lines | None = None,
    loss: str = "linear",
    noise: Noise | None = None,
) -> Refinement:
    """All axes and the target from all samples.

    Args:
        arm: The arm as drawn; names and forms of the parameters.
        data: Any samples: joints turned alone, poses of their own, or both.
        start: Where to begin; the result axis by axis, or the nominal arm.
        loss: "linear" for plain least squares; "soft_l1", "huber" or "cauchy" trust
            samples far off the others less.
        noise: How device and encoders scatter (`seen_noise`); None trusts every
            direction alike.

    Raises:
        GeometryError: Fewer equations than unknowns, parameters that the samples do
            not show (named), or no convergence.
        UsageError: No such loss.
    """
    if loss not in LOSSES:
        raise UsageError(f"loss {loss!r} is none of {', '.join(LOSSES)}")
    lines = (arm.lines if start is None else start).near(data.points.mean(axis=0))
    target = target_from(lines, data.q, data.points)
    unknowns = 4 * len(lines) + 3
    if 3 * len(data) <= unknowns:
        raise GeometryError(
            f"{len(data)} samples give {3 * len(data)} equations for {unknowns} "
            "unknowns"
        )
    check_seen(arm, lines, data.q, target)
    return _descended(arm, data, lines, target, loss, noise)


def _descended(
    arm: SerialArm,
    data: Measurements,
    lines: Lines,
    target: Array,
    loss: str,
    noise: Noise | None,
) -> Refinement:
    """Least squares from lines and target near the solution."""
    from scipy.optimize import least_squares

    unknowns = 4 * len(lines) + 3
    W = _weights(arm, lines, data, target, noise)

    def residuals(x: Array) -> Array:
        fitted = positions(lines.moved(x[:-3]), data.q, target + x[-3:])
        return np.asarray((W @ (fitted - data.points)[..., None]).ravel())

    scale = 1.0 if loss == "linear" else _robust_scale(residuals(np.zeros(unknowns)))
    iterations = 0
    for _ in range(3):  # re-centred, so that the increments stay small rotations
        solution = least_squares(
            residuals,
            np.zeros(unknowns),
            jac=_jacobian_about(lines, data.q, target, W),
            method="trf",
            x_scale="jac",
            loss=loss,
            f_scale=scale,
            xtol=1e-12,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=200,
        )
        iterations += int(solution.njev)
        x = solution.x
        lines, target = lines.moved(x[:-3]), target + x[-3:]
        if solution.status <= 0:
            raise GeometryError("the refinement does not settle: check the samples")
        if np.abs(x).max() < 1e-9:
            break
        W = _weights(arm, lines, data, target, noise)
        if loss != "linear":
            scale = _robust_scale(residuals(np.zeros(unknowns)))
    return _result(arm, data, lines, target, iterations, W, scale, loss)


def check_seen(arm: SerialArm, lines: Lines, q: Array, target: Array) -> float:
    """Condition number of the samples, if they show every parameter.

    Raises:
        GeometryError: Names the parameters that can change without any sample moving.
    """
    J = scaled(jacobian(lines, q, target).reshape(3 * len(q), -1))
    _, singular, Vt = np.linalg.svd(J, full_matrices=False)
    unseen = Vt[singular < UNSEEN * singular[0]]
    if len(unseen):
        names = ", ".join(shown_names(arm, lines, unseen))
        raise GeometryError(
            f"ill-conditioned: these samples do not show {names}; turn more joints or "
            "bring the target off their axes"
        )
    return float(singular[0] / singular[-1])


def scaled(J: Array) -> Array:
    """The Jacobian with columns of length 1 (columns of zeros stay)."""
    length = np.linalg.norm(J, axis=0)
    return np.asarray(J / np.where(length > 1e-12, length, 1.0))


def parameter_jacobian(arm: SerialArm, lines: Lines) -> Array:
    """Derivative of the parameters by the numbers of `Lines.moved`, (p, 4 k)."""
    step = 1e-6
    columns = []
    for j in range(4 * len(lines)):
        move = np.zeros(4 * len(lines))
        move[j] = step
        ahead = arm.parameters(lines.moved(move))
        behind = arm.parameters(lines.moved(-move))
        columns.append(
            [_difference(ahead[n], behind[n], n) / (2 * step) for n in arm.forms.names]
        )
    return np.array(columns).T


def parameter_sigmas(
    arm: SerialArm, lines: Lines, covariance: Array
) -> dict[str, float]:
    """Standard deviations of the parameters by name, [m] and [rad]."""
    A = parameter_jacobian(arm, lines)
    C = A @ covariance[: A.shape[1], : A.shape[1]] @ A.T
    sigma = np.sqrt(np.maximum(np.diag(C), 0.0))
    return dict(zip(arm.forms.names, map(float, sigma), strict=True))


def _difference(a: float, b: float, name: str) -> float:
    if name[0] in "abt" and name[:2] in ("al", "be", "th"):
        return float((a - b + np.pi) % (2 * np.pi) - np.pi)
    return a - b


def _jacobian_about(
    lines: Lines, q: Array, target: Array, W: Array
) -> Callable[[Array], Array]:
    """Jacobian of the residuals in the coordinates of the fixed start.

    `Lines.moved` normalises the direction, so that away from the start the tilts of the
    moved line are not those of the start; the chain rule joins them.
    """
    v, w = lines.bases()

    def derivative(x: Array) -> Array:
        tilt = x[:-3].reshape(-1, 4)
        raw = lines.directions + tilt[:, :1] * v + tilt[:, 1:2] * w
        size = np.linalg.norm(raw, axis=1)
        moved = lines.moved(x[:-3])
        J = W @ jacobian(moved, q, target + x[-3:])
        J = J.reshape(3 * len(q), -1)
        v1, w1 = moved.bases()
        for i in range(len(lines)):
            old = np.stack([v[i], w[i]])
            new = np.stack([v1[i], w1[i]])
            columns = slice(4 * i, 4 * i + 2), slice(4 * i + 2, 4 * i + 4)
            J[:, columns[0]] = J[:, columns[0]] @ (new @ old.T) / size[i]
            J[:, columns[1]] = J[:, columns[1]] @ (new @ old.T)
        return J

    return derivative


def _robust_scale(residuals: Array) -> float:
    return max(1.4826 * float(np.median(np.abs(residuals))), 1e-12)


def _weights(
    arm: SerialArm,
    lines: Lines,
    data: Measurements,
    target: Array,
    noise: Noise | None,
) -> Array:
    noise = Noise(0.0, np.zeros(len(lines))) if noise is None else noise
    return whitening(lines, data, target, noise, arm.joint_names)


def _result(
    arm: SerialArm,
    data: Measurements,
    lines: Lines,
    target: Array,
    iterations: int,
    W: Array,
    scale: float,
    loss: str,
) -> Refinement:
    off = data.points - positions(lines, data.q, target)
    J = (W @ jacobian(lines, data.q, target)).reshape(off.size, -1)
    white = (W @ off[..., None])[..., 0]
    free = off.size - J.shape[1]
    linear = loss == "linear"
    sigma = float(np.sqrt((white**2).sum() / free)) if linear else scale
    return Refinement(
        lines=lines,
        target=target,
        parameters=arm.parameters(lines),
        covariance=np.asarray(sigma**2 * np.linalg.inv(J.T @ J), dtype=np.float64),
        sigma=sigma,
        iterations=iterations,
        residuals=off,
        condition=check_seen(arm, lines, data.q, target),
    )


def shown_names(arm: SerialArm, lines: Lines, unseen: Array) -> list[str]:
    """Parameters that change along unseen directions, the strongest first."""
    A = parameter_jacobian(arm, lines)
    change = np.abs(A @ unseen[:, : A.shape[1]].T).max(axis=1)
    names = np.array([*arm.forms.names])
    strong = change > 0.1 * max(float(change.max()), 1e-12)
    order = np.argsort(-change)
    return [str(names[i]) for i in order if strong[i]] or ["the target"]
