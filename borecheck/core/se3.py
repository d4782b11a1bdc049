"""Rigid transforms as 4x4 arrays: T_world_tip maps points of tip into world."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError

Array = NDArray[np.float64]

# A rotation typed with six digits is off by 1e-6; more than that is no rotation.
ROTATION_TOLERANCE = 1e-6


def rpy_matrix(roll: float, pitch: float, yaw: float) -> Array:
    """Rotation of a URDF `rpy` attribute: R = Rz(yaw) Ry(pitch) Rx(roll).

    Args:
        roll: Angle about x, [rad].
        pitch: Angle about y, [rad].
        yaw: Angle about z, [rad].

    Returns:
        Rotation matrix, (3, 3).
    """
    cr, sr = np.cos(roll), np.sin(roll)
    cp, sp = np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def matrix_rpy(R: ArrayLike) -> tuple[float, float, float]:
    """Roll, pitch and yaw [rad] of a rotation, so that `rpy_matrix` gives it back.

    At pitch = +-90 deg, where the split is not unique, roll is 0.
    """
    R = np.asarray(R, dtype=float)
    cos_pitch = float(np.hypot(R[0, 0], R[1, 0]))
    pitch = float(np.arctan2(-R[2, 0], cos_pitch))
    if cos_pitch < 1e-12:
        return 0.0, pitch, float(np.arctan2(-R[0, 1], R[1, 1]))
    roll = float(np.arctan2(R[2, 1], R[2, 2]))
    return roll, pitch, float(np.arctan2(R[1, 0], R[0, 0]))


def transform(
    xyz: ArrayLike = (0.0, 0.0, 0.0), rpy: ArrayLike = (0.0, 0.0, 0.0)
) -> Array:
    """Transform of a URDF `<origin xyz rpy>`, (4, 4), [m] and [rad]."""
    T = np.eye(4)
    T[:3, :3] = rpy_matrix(*np.asarray(rpy, dtype=float))
    T[:3, 3] = np.asarray(xyz, dtype=float)
    return T


def frozen(array: Array) -> Array:
    """The same array, now read-only: what is found from it once stays true."""
    array.setflags(write=False)
    return array


def inverse(T: ArrayLike) -> Array:
    """Inverse of a rigid transform: that of T_a_b is T_b_a."""
    T = np.asarray(T, dtype=float)
    result = np.eye(4)
    result[:3, :3] = T[:3, :3].T
    result[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return result


def axis_rotation(axis: ArrayLike, angle: float) -> Array:
    """Rotation matrix (3, 3) about a unit axis by an angle [rad] (Rodrigues)."""
    x, y, z = np.asarray(axis, dtype=float)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def rotation_angle(R_first: ArrayLike, R_second: ArrayLike) -> float:
    """Angle [rad] between two rotations.

    By atan2 of sine and cosine: arccos of the trace loses half the digits near 0.
    """
    R = np.asarray(R_first, dtype=float).T @ np.asarray(R_second, dtype=float)
    vee = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return float(np.arctan2(np.linalg.norm(vee), np.trace(R) - 1.0))


def check_transform(T: ArrayLike, name: str = "transform") -> Array:
    """A copy of T as a (4, 4) float64 array, if it is a rigid transform.

    Raises:
        GeometryError: Wrong shape, NaN, or no rotation within ROTATION_TOLERANCE.
    """
    try:
        T = np.array(T, dtype=np.float64)
    except (TypeError, ValueError):
        raise GeometryError(f"{name} is no array of numbers (4, 4)") from None
    if T.shape != (4, 4):
        raise GeometryError(f"{name} has shape {T.shape}, not (4, 4)")
    if not np.isfinite(T).all():
        raise GeometryError(f"{name} holds a number that is not finite")
    R = T[:3, :3]
    skewed = np.abs(R.T @ R - np.eye(3)).max() > ROTATION_TOLERANCE
    if skewed or np.linalg.det(R) < 0.0 or (T[3] != (0.0, 0.0, 0.0, 1.0)).any():
        raise GeometryError(f"{name} is not a rigid transform")
    return T
