"""How much the device and the encoders scatter, and what that makes of a sample.

A joint that is off by one pulse moves the target along its circle: by 1.8 mm for 0.09
deg at 1.15 m. Plane and cylinder errors do not see that, positions do. A fit of
positions must therefore trust that direction less, or it is worse than the axes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines, joint_jacobian, turned
from borecheck.calibration.measurements import Measurements

Array = NDArray[np.float64]

# Devices better than this are exact: [m], rounding of coordinates.
EXACT = 1e-12


@dataclass(frozen=True, eq=False)
class Noise:
    """Standard deviations of what a sample is made of.

    Attributes:
        point: Of a measured coordinate, [m].
        joints: Of the joint values, by joint, (k,), [rad].
    """

    point: float
    joints: Array


def seen_noise(lines: Lines, data: Measurements, joint_names: tuple[str, ...]) -> Noise:
    """Noise that samples of joints turned alone show about found axes.

    Across the circle only the device scatters; along it the encoder adds.

    Args:
        lines: The axes at zero, as found.
        data: Samples; those without a moving joint are not looked at.
        joint_names: In the order of the axes.
    """
    across, joints = [], np.zeros(len(lines))
    for i, name in enumerate(joint_names):
        members = data.of(name)
        if len(members) < 4:
            continue
        radius, flat, height, angle = _cylindrical(lines, i, data, members)
        off = np.concatenate([flat - flat.mean(), height - height.mean()])
        across.append((off**2).sum() / max(off.size - 6, 1))
        slip = np.angle(np.exp(1j * (angle - data.q[members, i])))
        slip = np.angle(np.exp(1j * (slip - slip[0])))
        joints[i] = max(float(slip.var(ddof=1)) - across[-1] / radius**2, 0.0)
    point = float(np.sqrt(np.mean(across))) if across else 0.0
    return Noise(point, np.sqrt(joints))


def whitening(
    lines: Lines,
    data: Measurements,
    target: Array,
    noise: Noise,
    joint_names: tuple[str, ...],
) -> Array:
    """Matrices (n, 3, 3) after which every residual scatters like a coordinate.

    The identity if the device is exact or no joint scatters. In a sample in which one
    joint turned alone only that joint scatters: the others kept their pulse.
    """
    whole = np.broadcast_to(np.eye(3), (len(data), 3, 3))
    if noise.point < EXACT or not noise.joints.any():
        return whole
    J = joint_jacobian(lines, data.q, target)
    scatters = np.ones((len(data), len(lines)))
    for i, name in enumerate(joint_names):
        alone = np.array(data.moving) != ""
        scatters[alone, i] = (np.array(data.moving) == name)[alone]
    J = J * (scatters * noise.joints / noise.point)[:, None, :]
    return np.asarray(
        np.linalg.inv(np.linalg.cholesky(whole + J @ np.swapaxes(J, 1, 2)))
    )


def _cylindrical(
    lines: Lines, i: int, data: Measurements, members: NDArray[np.intp]
) -> tuple[float, Array, Array, Array]:
    """Mean radius, distances from the axis, heights along it, angles about it."""
    points, q = data.points[members], data.q[members]
    for j in range(i):
        points = turned(lines, j, -q[:, j], points)
    v, w = (vectors[i] for vectors in lines.bases())
    away = points - lines.points[i]
    x, y = away @ v, away @ w
    flat = np.hypot(x, y)
    return float(flat.mean()), flat, away @ lines.directions[i], np.arctan2(y, x)
