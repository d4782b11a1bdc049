"""Where a target goes when an arm turns about given axes, and how that depends on them.

The arm is nothing but its axes at zero, as lines in the world (product of
exponentials): four numbers each, whatever the axes are, parallel ones too. numpy only.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Lines:
    """The joint axes of an arm at zero, in the world frame.

    Attributes:
        points: A point of every axis, (k, 3), [m].
        directions: Unit directions, (k, 3); a positive angle turns by the right hand.
    """

    points: Array
    directions: Array

    def __len__(self) -> int:
        return len(self.points)

    def bases(self) -> tuple[Array, Array]:
        """Two unit vectors across every axis, each (k, 3), always the same ones."""
        helper = np.eye(3)[np.argmin(np.abs(self.directions), axis=1)]
        v = np.cross(helper, self.directions)
        v /= np.linalg.norm(v, axis=1, keepdims=True)
        return v, np.cross(self.directions, v)

    def moved(self, deviation: ArrayLike) -> "Lines":
        """The axes moved by four small numbers each.

        Args:
            deviation: Tilt towards and shift along both vectors of `bases`, (k, 4):
                tilt 1, tilt 2 [rad], shift 1, shift 2 [m].
        """
        t1, t2, s1, s2 = np.asarray(deviation, dtype=np.float64).reshape(-1, 4).T
        v, w = self.bases()
        u = self.directions + t1[:, None] * v + t2[:, None] * w
        u = u / np.linalg.norm(u, axis=1, keepdims=True)
        return Lines(self.points + s1[:, None] * v + s2[:, None] * w, u)

    def near(self, place: ArrayLike) -> "Lines":
        """The same axes, their points moved along them to be nearest to a place."""
        away = np.asarray(place, dtype=np.float64) - self.points
        along = (away * self.directions).sum(axis=1, keepdims=True)
        return Lines(self.points + along * self.directions, self.directions)


def positions(lines: Lines, q: ArrayLike, target: ArrayLike) -> Array:
    """Where the target is at each configuration, (n, 3), [m].

    Args:
        lines: The axes at zero.
        q: Joint angles, (n, k), [rad].
        target: Where the target is at zero, (3,), [m].
    """
    q = np.atleast_2d(np.asarray(q, dtype=np.float64))
    x = np.broadcast_to(np.asarray(target, dtype=np.float64), (len(q), 3))
    for i in reversed(range(len(lines))):
        x = turned(lines, i, q[:, i], x)
    return np.array(x)


def turned(lines: Lines, i: int, angle: Array, x: Array) -> Array:
    """Points (n, 3) turned about axis i by their angles (n,)."""
    u, p = lines.directions[i], lines.points[i]
    y = x - p
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    along = (y @ u)[:, None] * u
    result: Array = p + c * (y - along) + s * np.cross(u, y) + along
    return result


def rotations(lines: Lines, q: Array) -> Array:
    """Rotation of everything above axis i at each configuration, (n, k + 1, 3, 3)."""
    R = np.empty((len(q), len(lines) + 1, 3, 3))
    R[:, 0] = np.eye(3)
    for i, u in enumerate(lines.directions):
        R[:, i + 1] = R[:, i] @ _rotation(u, q[:, i])
    return R


def jacobian(lines: Lines, q: ArrayLike, target: ArrayLike) -> Array:
    """Derivative of `positions` by the axes and the target, (n, 3, 4 k + 3).

    Columns: tilt 1, tilt 2, shift 1, shift 2 of every axis as in `Lines.moved`, then
    the target's place at zero.
    """
    q = np.atleast_2d(np.asarray(q, dtype=np.float64))
    k = len(lines)
    above = rotations(lines, q)
    v, w = lines.bases()
    J = np.empty((len(q), 3, 4 * k + 3))
    x = np.broadcast_to(np.asarray(target, dtype=np.float64), (len(q), 3))
    for i in reversed(range(k)):
        c, s = np.cos(q[:, i])[:, None], np.sin(q[:, i])[:, None]
        u, y = lines.directions[i], x - lines.points[i]
        for column, across in enumerate((v[i], w[i])):
            # of c y + s (u x y) + (1 - c) u (u . y) by u, and of p - R p by p
            along = (y @ across)[:, None] * u + (y @ u)[:, None] * across
            tilt = s * np.cross(across, y) + (1.0 - c) * along
            shift = (1.0 - c) * across - s * np.cross(u, across)
            J[:, :, 4 * i + column] = (above[:, i] @ tilt[..., None])[..., 0]
            J[:, :, 4 * i + 2 + column] = (above[:, i] @ shift[..., None])[..., 0]
        x = turned(lines, i, q[:, i], x)
    J[:, :, 4 * k :] = above[:, k]
    return J


def joint_jacobian(lines: Lines, q: ArrayLike, target: ArrayLike) -> Array:
    """Derivative of `positions` by the joint angles, (n, 3, k), [m/rad]."""
    q = np.atleast_2d(np.asarray(q, dtype=np.float64))
    k = len(lines)
    above = rotations(lines, q)
    x = np.broadcast_to(np.asarray(target, dtype=np.float64), (len(q), 3))
    J = np.empty((len(q), 3, k))
    for i in reversed(range(k)):
        x = turned(lines, i, q[:, i], x)
        rate = np.cross(lines.directions[i], x - lines.points[i])
        J[:, :, i] = (above[:, i] @ rate[..., None])[..., 0]
    return J


def target_from(lines: Lines, q: ArrayLike, points: ArrayLike) -> Array:
    """The target's place at zero that fits measured points best, (3,), [m]."""
    q = np.atleast_2d(np.asarray(q, dtype=np.float64))
    offset = positions(lines, q, np.zeros(3))
    R = rotations(lines, q)[:, -1]
    away = np.asarray(points, dtype=np.float64) - offset
    result: Array = (np.swapaxes(R, 1, 2) @ away[..., None])[..., 0].mean(axis=0)
    return result


def _rotation(u: Array, angle: Array) -> Array:
    x, y, z = u
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = angle[:, None, None]
    result: Array = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
    return result
