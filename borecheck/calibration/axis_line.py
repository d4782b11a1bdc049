"""Where an axis is in space, from points that turned about it: [Heikkila2010] App. I.

A target on the arm draws a disc while one joint turns. The pose of the disc is found by
Gauss-Newton with two errors per point: its height above the disc's plane and its
distance from the cylinder around the disc. All functions take many discs at once.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError

Array = NDArray[np.float64]

# Six numbers are estimated and each point gives two errors.
FEWEST_POINTS = 3

# Increments below this end the iteration: [m] and [rad], a tenth of a nanometre.
SMALL_INCREMENT = 1e-10

# A start that has not settled by then goes round in circles; the paper needs 7 to 8.
MOST_ITERATIONS = 50

# Spread across a line, relative to the spread along it, below which points are taken as
# lying on one line (rounding of coordinates near 1 m is 1e-16).
COLLINEAR = 1e-9


@dataclass(frozen=True)
class Discs:
    """Poses of m discs in the world and their radii.

    Attributes:
        T_world_disc: (m, 4, 4); the disc's z axis is the axis of the joint.
        radius: (m,), [m].
    """

    T_world_disc: Array
    radius: Array


@dataclass(frozen=True)
class AxisFit:
    """Axes found for m discs.

    Attributes:
        discs: The estimated discs.
        iterations: Gauss-Newton steps until the increments were small, (m,).
        converged: Whether they became small, (m,).
        residuals: Plane and cylinder errors of every point, (m, n, 2), [m].
        covariance: Of (alpha, beta, x, y, z, r) in the disc's frame for errors of unit
            variance, (m, 6, 6); NaN where it cannot be formed.
    """

    discs: Discs
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]
    residuals: Array
    covariance: Array

    @property
    def points(self) -> Array:
        """A point of every axis, (m, 3), [m]."""
        return self.discs.T_world_disc[:, :3, 3]

    @property
    def directions(self) -> Array:
        """Unit direction of every axis, (m, 3)."""
        return self.discs.T_world_disc[:, :3, 2]

    @property
    def rms(self) -> Array:
        """Root mean square of both errors over the points, (m,), [m]."""
        return np.sqrt((self.residuals**2).mean(axis=(1, 2)))


def fit_axes(points: ArrayLike, start: Discs) -> AxisFit:
    """Axes of m sets of n points by Gauss-Newton from a given start.

    Args:
        points: Measured points in the world frame, (m, n, 3), [m].
        start: Where to begin, as the paper does from the nominal arm (`discs_at`), or
            from the points themselves (`discs_from_points`).

    Raises:
        GeometryError: Too few points, or points that are not finite.
    """
    points = checked_points(points)
    T, r = start.T_world_disc.copy(), start.radius.copy()
    iterations = np.zeros(len(points), dtype=np.int64)
    converged = np.zeros(len(points), dtype=bool)
    for _ in range(MOST_ITERATIONS):
        going = np.flatnonzero(~converged)
        if not len(going):
            break
        step = _increments(_in_disc(T[going], points[going]), r[going])
        # the increment moves the points: p <- dH p, so the disc goes the other way
        T[going] = T[going] @ _inverse(_small_motion(step))
        r[going] += step[:, 5]
        iterations[going] += 1
        converged[going] = np.abs(step).max(axis=1) < SMALL_INCREMENT
    p = _in_disc(T, points)
    return AxisFit(Discs(T, r), iterations, converged, _errors(p, r), _covariance(p))


def discs_at(
    lines_points: ArrayLike, directions: ArrayLike, points: ArrayLike
) -> Discs:
    """Discs about assumed axes, with height and radius as the points have them.

    The start of the paper: the nominal axis, with the disc's centre at the points'
    mean height along it.

    Args:
        lines_points: A point of each axis, (m, 3), [m].
        directions: Their directions, (m, 3).
        points: Measured points, (m, n, 3).
    """
    points = np.asarray(points, dtype=np.float64)
    base = np.asarray(lines_points, dtype=np.float64)
    u = unit(np.asarray(directions, dtype=np.float64))
    away = points - base[:, None]
    height = np.einsum("mnk,mk->mn", away, u)
    radius = np.linalg.norm(away - height[..., None] * u[:, None], axis=2).mean(axis=1)
    centre = base + height.mean(axis=1)[:, None] * u
    return Discs(_poses(centre, u), radius)


def discs_from_points(points: ArrayLike, directions: ArrayLike | None = None) -> Discs:
    """Discs from the points alone: best plane, then best circle in it.

    Needs no nominal arm and therefore cannot start too far away.

    Args:
        points: Measured points, (m, n, 3), [m].
        directions: Rough directions, (m, 3), only to choose the sign of each axis.
    """
    points = checked_points(points)
    mean = points.mean(axis=1)
    _, _, axes = np.linalg.svd(points - mean[:, None], full_matrices=False)
    u = axes[:, 2]
    if directions is not None:
        along = np.einsum("mk,mk->m", u, np.asarray(directions, dtype=np.float64))
        u = u * np.where(along < 0.0, -1.0, 1.0)[:, None]
    T = _poses(mean, u)
    x, y = np.moveaxis(_in_disc(T, points)[..., :2], -1, 0)
    # x^2 + y^2 = 2 a x + 2 b y + c is linear in the centre (a, b)
    A = np.stack([2 * x, 2 * y, np.ones_like(x)], axis=-1)
    a, b, c = np.moveaxis(np.linalg.pinv(A) @ (x**2 + y**2)[..., None], 1, 0)[..., 0]
    T[:, :3, 3] += a[:, None] * T[:, :3, 0] + b[:, None] * T[:, :3, 1]
    return Discs(T, np.sqrt(np.maximum(c + a**2 + b**2, 0.0)))


def checked_points(points: ArrayLike) -> Array:
    """The points as (m, n, 3), if each set can fix an axis at all.

    Raises:
        GeometryError: Too few, not finite, all in one place, or on a straight line.
    """
    points = np.array(points, dtype=np.float64)
    if points.ndim != 3 or points.shape[2] != 3:
        raise GeometryError(f"points have shape {points.shape}, not (m, n, 3)")
    if points.shape[1] < FEWEST_POINTS:
        raise GeometryError(
            f"{points.shape[1]} points cannot fix an axis: it takes {FEWEST_POINTS}"
        )
    if not np.isfinite(points).all():
        raise GeometryError("a measured point holds a number that is not finite")
    spread = np.linalg.svd(
        points - points.mean(axis=1, keepdims=True), compute_uv=False
    )
    if (spread[:, 0] < COLLINEAR).any():
        raise GeometryError("the points are all in one place: the joint did not turn")
    if (spread[:, 1] < COLLINEAR * spread[:, 0]).any():
        raise GeometryError("the points lie on a straight line: they fix no axis")
    return points


def unit(vectors: Array) -> Array:
    """The vectors scaled to length 1, (..., 3)."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _errors(p: Array, r: Array) -> Array:
    """Plane and cylinder error of points in the disc frame, (m, n, 2). Appendix I."""
    return np.stack([p[..., 2], np.hypot(p[..., 0], p[..., 1]) - r[:, None]], axis=-1)


def _jacobian(p: Array) -> Array:
    """Derivatives of both errors by (alpha, beta, x, y, z, r), (m, n, 2, 6).

    Appendix I: de/dp dp/dtheta, the signs lost in print restored: an increment turns
    and shifts the points. The turn about the axis itself is left out.
    """
    x, y, z = np.moveaxis(p, -1, 0)
    rho = np.hypot(x, y)
    cosine, sine = x / rho, y / rho
    zero, one = np.zeros_like(x), np.ones_like(x)
    plane = [y, -x, zero, zero, one, zero]
    cylinder = [-sine * z, cosine * z, cosine, sine, zero, -one]
    return np.stack([np.stack(plane, -1), np.stack(cylinder, -1)], axis=-2)


def _increments(p: Array, r: Array) -> Array:
    """-(J^T J)^-1 J^T e, (m, 6)."""
    J = _jacobian(p).reshape(len(p), -1, 6)
    e = _errors(p, r).reshape(len(p), -1)
    return -np.einsum("mij,mj->mi", np.linalg.pinv(J), e)


def _covariance(p: Array) -> Array:
    J = _jacobian(p).reshape(len(p), -1, 6)
    normal = J.transpose(0, 2, 1) @ J
    result = np.full(normal.shape, np.nan)
    good = np.linalg.cond(normal) < 1.0 / np.finfo(float).eps
    result[good] = np.linalg.inv(normal[good])
    return result


def _small_motion(step: Array) -> Array:
    """The exact motion of an increment (alpha, beta, x, y, z, ...), (m, 4, 4)."""
    ca, sa, cb, sb = (f(step[:, i]) for i in (0, 1) for f in (np.cos, np.sin))
    T = np.zeros((len(step), 4, 4))
    T[:, 0, 0], T[:, 0, 1], T[:, 0, 2] = cb, sb * sa, sb * ca
    T[:, 1, 1], T[:, 1, 2] = ca, -sa
    T[:, 2, 0], T[:, 2, 1], T[:, 2, 2] = -sb, cb * sa, cb * ca
    T[:, :3, 3], T[:, 3, 3] = step[:, 2:5], 1.0
    return T


def _inverse(T: Array) -> Array:
    result = np.zeros_like(T)
    R = T[:, :3, :3].transpose(0, 2, 1)
    result[:, :3, :3] = R
    result[:, :3, 3] = -np.einsum("mij,mj->mi", R, T[:, :3, 3])
    result[:, 3, 3] = 1.0
    return result


def _in_disc(T: Array, points: Array) -> Array:
    """Points in the frames of their discs, (m, n, 3)."""
    return (points - T[:, None, :3, 3]) @ T[:, :3, :3]


def _poses(origins: Array, z: Array) -> Array:
    """Poses with a given z axis and any x axis, (m, 4, 4)."""
    helper = np.eye(3)[np.argmin(np.abs(z), axis=1)]
    x = unit(np.cross(helper, z))
    T = np.zeros((len(z), 4, 4))
    T[:, :3, 0], T[:, :3, 1], T[:, :3, 2] = x, np.cross(z, x), z
    T[:, :3, 3], T[:, 3, 3] = origins, 1.0
    return T
