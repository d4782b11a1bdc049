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
# Narrower than this part of its length a cloud is a line with errors.
THIN = 0.1
# Spreads that differ by more than this factor are a matter of units, not of order.
SCALED = 1.5
# Points as near as this coincide; as far as this no scanner or tracker sees, [m].
NEAREST, FARTHEST = 1e-9, 1e6
# A mirror image that fits this much better is no matter of noise: noisy slabs of five
# points and more, as thick as their noise or thinner, do not come so far.
MIRRORED = 0.5


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
            coincide or lie on one line, that fit a mirror image, or no rigid motion so
            far that no turn can be told.
    """
    a, b = _checked(a, b)
    if fle is not None:
        _refuse_error(fle)
    _refuse_lines(a, b)
    T, fre = _rigid(a, b)
    _refuse_misfits(a, b, fre)
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

    Raises:
        ValueError: As for `register`.
    """
    b, _ = _checked(b, b)
    _refuse_lines(b, b)
    _refuse_error(fle)
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
    largest = float(max(np.abs(a).max(), np.abs(b).max()))
    if largest > FARTHEST:
        raise ValueError(f"a point holds {largest:.3g} m: coordinates are in metres")
    return a, b


def _refuse_error(fle: float) -> None:
    if not 0.0 <= fle <= FARTHEST:
        raise ValueError(f"an error of {fle!r} m is none")


def _refuse_lines(a: Array, b: Array) -> None:
    """Refuses points from which a turn cannot be told, whatever their errors are."""
    for points in (a, b):
        along, across = _extent(points)
        if along <= max(NEAREST, 1e-12 * float(np.abs(points).max())):
            raise ValueError("all points coincide: no turn can be told from them")
        if across <= COLLINEAR * along:
            raise ValueError(_on_a_line(along, across))


def _refuse_misfits(a: Array, b: Array, fre: float) -> None:
    """Refuses points that do not fit so far that a turn cannot be told from them.

    Thin clouds that fit along their line are lines but for noise; other clouds are no
    lines, and what is wrong is that they are not the same points.
    """
    extents = [_extent(points) for points in (a, b)]
    along, across = min(extents, key=lambda extent: extent[1])
    if across > BEYOND_ERRORS * fre:
        return
    thin = any(width <= THIN * length for length, width in extents)
    if thin and fre <= THIN * along:
        raise ValueError(f"{_on_a_line(along, across)} (misfit {1e3 * fre:.3g} mm)")
    (first, _), (second, _) = extents
    ratio = max(first, second) / min(first, second)
    cause = "the same points, in the same order?"
    if ratio > SCALED:
        cause = f"their spreads differ by a factor of {ratio:.4g}: the same units?"
    raise ValueError(
        f"the points fit no rigid motion: misfit {1e3 * fre:.3g} mm, while they spread "
        f"by {1e3 * first:.3g} and {1e3 * second:.3g} mm; {cause}"
    )


def _extent(points: Array) -> tuple[float, float]:
    """Rms distance of points along their main axis and from it, [m]."""
    away = points - points.mean(axis=0)
    spread = np.linalg.svd(away, compute_uv=False) / np.sqrt(len(points))
    return float(spread[0]), float(np.linalg.norm(spread[1:]))


def _on_a_line(along: float, across: float) -> str:
    return (
        f"the points lie on one line (within {1e3 * across:.3g} mm of it, along it "
        f"{1e3 * along:.3g} mm): the turn about it is open; move a second axis"
    )


def chained(parts: Sequence[Registration]) -> Registration:
    """The product of registrations, from the left, with independent errors."""
    whole = parts[0]
    for part in parts[1:]:
        whole = whole @ part
    return whole
