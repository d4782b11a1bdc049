"""How precisely the needle tip is placed: encoder pulses, parameters, both together.

First order (Jacobians) and Monte Carlo, which must agree. The printed repeatability of
[Heikkila2010] section 2 is reproduced in one stated pose and reading.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mri_arm.dimensions import ENCODER_DEG, Dimensions, from_arguments
from mri_arm.kinematics import forward, jacobian
from mri_arm.parameters import NAMES, chain, nominal

Array = NDArray[np.float64]

# [Heikkila2010] section 2: "+/- 0.26 mm, +/- 0.24 mm and +/- 0.37 mm in x, y and z".
PUBLISHED_REPEATABILITY = (0.26e-3, 0.24e-3, 0.37e-3)

# The pose in which our assumed lengths give these figures, [deg]: q1..q6. Needle at
# right angles, base straight (base_yaw 0). Found by solving for q1, q3 and q5.
REPEATABILITY_POSE_DEG = (47.3, -2.0, -40.58, 0.0, -64.81, 0.0)

# Readings of "calculated from the encoder resolutions": factor on a pulse for each
# joint, and whether the joints' shares add up or their squares.
READINGS: Mapping[str, tuple[float, bool]] = {
    "one sigma of even quantisation, root of squares": (1.0 / np.sqrt(12.0), True),
    "half a pulse, root of squares": (0.5, True),
    "half a pulse, sum": (0.5, False),
    "one pulse, root of squares": (1.0, True),
    "one pulse, sum": (1.0, False),
}


@dataclass(frozen=True, eq=False)
class Spread:
    """Covariance of a point by two roads.

    Attributes:
        first_order: J C J^T, (3, 3), [m^2].
        monte_carlo: Of drawn samples, (3, 3), [m^2].
        largest: Largest deviation drawn along x, y, z, (3,), [m].
    """

    first_order: Array
    monte_carlo: Array
    largest: Array


def pulses() -> Array:
    """Encoder resolutions of q1..q6, (6,), [rad]."""
    return np.radians(ENCODER_DEG)


def repeatability(
    q: ArrayLike,
    reading: str = "one sigma of even quantisation, root of squares",
    needle_mount: str = "along",
) -> Array:
    """Uncertainty of the needle tip from the encoders along x, y, z, (3,), [m].

    Args:
        q: q1..q6, (6,), [rad].
        reading: One of `READINGS`.
        needle_mount: "along" or "square".
    """
    factor, squares = READINGS[reading]
    J = jacobian(
        np.append(np.asarray(q, dtype=np.float64), 0.0), needle_mount=needle_mount
    )
    shares = np.abs(J[:3, :6]) * factor * pulses()
    total = np.sqrt((shares**2).sum(axis=1)) if squares else shares.sum(axis=1)
    return np.asarray(total)


def needle_in_hand(needle_mount: str = "along") -> Array:
    """The needle tip in frame 6 with the insertion at 0, (3,), [m]."""
    d: Dimensions = from_arguments({"needle_mount": needle_mount})
    lean = 0.5 * np.pi * d.tool_square
    return np.array([0.0, d.flange + d.needle * np.cos(lean), -d.needle * np.sin(lean)])


def tip_of_parameters(
    q: ArrayLike, parameters: Mapping[str, ArrayLike], tool: Array
) -> Array:
    """A point of the hand by the paper's 24 parameters, in W, (3,) or (n, 3), [m]."""
    T = chain(q, parameters)
    return np.asarray(T[..., :3, :3] @ tool + T[..., :3, 3])


def parameter_jacobian(q: ArrayLike, tool: Array) -> Array:
    """Derivative of the point by the 24 parameters, (3, 24), by differences."""
    step = 1e-6
    columns = []
    for name in NAMES:
        values = nominal()
        ahead = tip_of_parameters(q, values | {name: values[name] + step}, tool)
        behind = tip_of_parameters(q, values | {name: values[name] - step}, tool)
        columns.append((ahead - behind) / (2.0 * step))
    return np.array(columns).T


def spread(
    q: ArrayLike,
    parameter_covariance: ArrayLike,
    joint_sigma: ArrayLike,
    rng: np.random.Generator,
    draws: int = 20000,
    needle_mount: str = "along",
) -> Spread:
    """Spread of the needle tip from uncertain parameters and joint values, in W.

    Args:
        q: q1..q6, (6,), [rad].
        parameter_covariance: Of the 24 parameters in the order of `NAMES`, (24, 24).
        joint_sigma: Standard deviations of q1..q6, (6,), [rad].
        rng: For the Monte Carlo road.
        draws: How many.
        needle_mount: "along" or "square".
    """
    q = np.asarray(q, dtype=np.float64)
    C = np.asarray(parameter_covariance, dtype=np.float64)
    sigma = np.asarray(joint_sigma, dtype=np.float64)
    tool = needle_in_hand(needle_mount)
    A = parameter_jacobian(q, tool)
    R_I_W = forward(np.zeros(7))["W"][:3, :3]
    J_I = jacobian(np.append(q, 0.0), needle_mount=needle_mount)[:3, :6]
    J = np.asarray(R_I_W.T @ J_I)
    first = A @ C @ A.T + (J * sigma**2) @ J.T
    drawn = rng.multivariate_normal(np.zeros(len(NAMES)), C, draws)
    values = {n: nominal()[n] + drawn[:, i] for i, n in enumerate(NAMES)}
    moved = q + sigma * rng.normal(size=(draws, 6))
    off = tip_of_parameters(moved, values, tool) - tip_of_parameters(q, nominal(), tool)
    return Spread(first, np.cov(off.T), np.abs(off).max(axis=0))
