"""Rigid transforms between CRANE's tracker, robot and scanner, and how sure they are.

[CRANE] eq. (15) read literally is affine; here it is held to rigid motions, in closed
form by singular values (Kabsch), never a reflection. Numpy only.

Errors of points are counted as Fitzpatrick does: FLE, FRE and TRE are root mean squares
of the *length* of a point's error, its three axes together; an axis alone has FLE over
root 3. Then FRE^2 = (1 - 2/N) FLE^2 on the average over errors.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")

# Points nearer to one line than this part of their spread leave the turn about it open.
COLLINEAR = 1e-6
# So do points no farther from it than their own misfit explains.
BEYOND_ERRORS = 2.0
# A mirror image that fits this much better is no matter of noise.
MIRRORED = 0.2


@dataclass(frozen=True, eq=False)
class Registration:
    """A rigid transform b = T a and its first-order uncertainty.

    Attributes:
        T: T_b_a, (4, 4).
        covariance: Of its error, (6, 6): shift x y z [m] of the point at the origin of
            b, turn about x y z [rad], both in b's axes; T_true = (1 + error) T.
        fre: Fiducial registration error, rms length over points, [m]; NaN of a product.
        fle: Error of a point that the covariance rests on, rms length, [m]; likewise.
        residuals: T a - b, (n, 3), [m].
    """

    T: Array
    covariance: Array
    fre: float = float("nan")
    fle: float = float("nan")
    residuals: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def __matmul__(self, other: "Registration") -> "Registration":
        """T_c_b T_b_a with independent errors: the second is seen from c."""
        carried = adjoint(self.T)
        covariance = self.covariance + carried @ other.covariance @ carried.T
        return Registration(self.T @ other.T, covariance)

    def inverse(self) -> "Registration":
        """T_a_b, its errors seen from a."""
        back = np.asarray(np.linalg.inv(self.T), dtype=np.float64)
        carried = adjoint(back)
        return Registration(
            back, carried @ self.covariance @ carried.T, self.fre, self.fle
        )

    def target_covariance(self, point: ArrayLike) -> Array:
        """Of a point of b that is not among those registered, (3, 3), [m^2]."""
        x, y, z = np.asarray(point, float)
        J = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
        return np.asarray(J @ self.covariance @ J.T)

    def tre(self, point: ArrayLike) -> float:
        """Target registration error expected at a point of b, rms length, [m]."""
        return float(np.sqrt(np.trace(self.target_covariance(point))))


def register(a: ArrayLike, b: ArrayLike, fle: float | None = None) -> Registration:
    """The rigid transform with the least squares of T a_k - b_k; eq. (15) in SE(3).

    Args:
        a: Points, (n, 3), [m].
        b: The same points in the other frame, (n, 3), [m].
        fle: Error of a point, rms length, both frames together, [m]; without it, what
            the residuals say: FRE / root(1 - 2/N).

    Raises:
        ValueError: Fewer than three points, numbers that are not finite, points that
            coincide or lie on one line, or points that fit a mirror image.
    """
    a, b = _checked(a, b)
    if fle is not None and not (np.isfinite(fle) and fle >= 0.0):
        raise ValueError(f"an error of {fle!r} m is none")
    _refuse_lines(a, b, 0.0)
    T, fre = _rigid(a, b)
    _refuse_lines(a, b, fre)
    n = len(a)
    known = float(fre / np.sqrt(1.0 - 2.0 / n)) if fle is None else float(fle)
    residuals = a @ T[:3, :3].T + T[:3, 3] - b
    return Registration(T, point_covariance(b, known), fre, known, residuals)


def point_covariance(b: ArrayLike, fle: float) -> Array:
    """Of a registration to these points, each axis of each off by FLE / root 3.

    Args:
        b: Points, (n, 3), [m].
        fle: Rms length of a point's error, [m].

    Returns:
        (6, 6), as `Registration.covariance`.
    """
    b = np.asarray(b, float)
    middle = b.mean(axis=0)
    away = b - middle
    # about their middle shift and turn are independent; then seen from the origin
    moment = np.sum(away**2) * np.eye(3) - away.T @ away
    C = np.zeros((6, 6))
    C[:3, :3] = np.eye(3) / len(b)
    C[3:, 3:] = np.linalg.inv(moment)
    T = np.eye(4)
    T[:3, 3] = middle
    carried = adjoint(T)
    C = (fle**2 / 3.0) * carried @ C @ carried.T
    return np.asarray(0.5 * (C + C.T))


def adjoint(T: ArrayLike) -> Array:
    """How a shift and turn (6,) of frame a looks from b: Ad of T_b_a, (6, 6)."""
    T = np.asarray(T, float)
    R, (x, y, z) = T[:3, :3], T[:3, 3]
    A = np.zeros((6, 6))
    A[:3, :3] = A[3:, 3:] = R
    A[:3, 3:] = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ R
    return A


def pose_covariance(T: ArrayLike, shift: float, turn: float) -> Array:
    """Of a measured pose T_b_a whose sensor's place and axes are off, as `covariance`.

    Args:
        T: The pose, (4, 4).
        shift: Rms length of the sensor's shift, [m].
        turn: Rms angle of its turn, [rad].
    """
    T = np.asarray(T, float)
    R_only = np.eye(4)
    R_only[:3, 3] = T[:3, 3]
    C = np.diag([shift**2 / 3.0] * 3 + [turn**2 / 3.0] * 3)
    return np.asarray(adjoint(R_only) @ C @ adjoint(R_only).T)


def uncertainty(registration: Registration) -> dict[str, dict[str, object]]:
    """The file that `borecheck check --uncertainty` takes, of T_scanner_robot.

    Its `registration` block is the error of the robot's place in the scanner's frame:
    shift, and turn about the scanner's origin.
    """
    C = 0.5 * (registration.covariance + registration.covariance.T)
    return {"registration": {"names": list(DIRECTIONS), "covariance": C.tolist()}}


def _rigid(a: Array, b: Array) -> tuple[Array, float]:
    """T of least squares, and its FRE; refuses points that are mirrored."""
    middle_a, middle_b = a.mean(axis=0), b.mean(axis=0)
    U, _, Vt = np.linalg.svd((b - middle_b).T @ (a - middle_a))
    sign = np.sign(np.linalg.det(U @ Vt))
    found = [U @ np.diag([1.0, 1.0, last]) @ Vt for last in (sign, -sign)]
    size = np.sum((a - middle_a) ** 2) + np.sum((b - middle_b) ** 2)
    rigid, other = found  # the first has det +1 whatever the sign
    misfit = (a - middle_a) @ rigid.T - (b - middle_b)
    fre = float(np.sqrt(np.sum(misfit**2) / len(a)))
    if sign < 0:
        mirrored = (a - middle_a) @ other.T - (b - middle_b)
        better = float(np.sqrt(np.sum(mirrored**2) / len(a)))
        # in a plane a mirror image is a turn as well: only rounding tells them apart
        if better < MIRRORED * fre and fre > 1e-9 * np.sqrt(size / len(a)):
            raise ValueError(
                f"the points fit a mirror image to {1e3 * better:.3g} mm and a rigid "
                f"motion to {1e3 * fre:.3g} mm: an axis of one frame is reversed"
            )
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rigid, middle_b - rigid @ middle_a
    return T, fre


def _checked(a: ArrayLike, b: ArrayLike) -> tuple[Array, Array]:
    a, b = np.asarray(a, float), np.asarray(b, float)
    if a.ndim != 2 or a.shape[1:] != (3,) or a.shape != b.shape:
        raise ValueError(f"points {a.shape} and {b.shape} must both be (n, 3)")
    if len(a) < 3:
        raise ValueError(f"{len(a)} points; a rigid transform takes three at least")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError("a point holds a number that is not finite")
    return a, b


def _refuse_lines(a: Array, b: Array, fre: float) -> None:
    """Refuses points from which a turn cannot be told."""
    for points in (a, b):
        away = points - points.mean(axis=0)
        spread = np.linalg.svd(away, compute_uv=False) / np.sqrt(len(points))
        largest = float(np.abs(points).max())
        if spread[0] <= 1e-12 * max(largest, 1e-300):
            raise ValueError("all points coincide: no turn can be told from them")
        across = float(np.hypot(spread[1], spread[2]))
        if across <= max(COLLINEAR * spread[0], BEYOND_ERRORS * fre):
            raise ValueError(
                f"the points lie on one line (within {1e3 * across:.3g} mm of it, "
                f"along it {1e3 * spread[0]:.3g} mm): the turn about it is open; move "
                "a second axis"
            )


def chained(parts: Sequence[Registration]) -> Registration:
    """The product of registrations, from the left, with independent errors."""
    whole = parts[0]
    for part in parts[1:]:
        whole = whole @ part
    return whole
