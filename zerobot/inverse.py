"""Zerobot's joint positions for a needle, in closed form; numpy only.

The inverse of [Matsuno2020] eq. (3) and the remote centre of its section 2.2.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck_models import closed_form
from borecheck_models.closed_form import Solutions, needle_asked_for, within_limits
from zerobot.dimensions import LIMITS, Dimensions, from_arguments

Array = NDArray[np.float64]

# Below this distance of the direction from the bore axis q4 has no meaning: the
# rounding of a unit vector (1e-16) would be turned into an angle of any size.
ALONG_BORE = 1e-9

ANGLES = ("q4", "q5")

_NOTHING: Mapping[str, float] = MappingProxyType({})


def inverse(
    tip: ArrayLike,
    direction: ArrayLike,
    insertion: float,
    *,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Solutions:
    """Joint positions for a needle tip and direction; nothing is ever clipped.

    Two branches: |q5| below and above 90 deg. The roll about the needle is not free,
    so there are no others.

    Args:
        tip: Needle tip in the world frame W, (3,), [m].
        direction: The way the needle points, (3,), of any length but 0.
        insertion: q6, which is free and must be chosen, [m].
        perturbed: As for `kinematics.forward`.
        **arguments: As for `kinematics.forward`.

    Raises:
        ValueError: A number is not finite, or the direction has no length.
    """
    d = from_arguments(arguments, perturbed)
    tip, direction = needle_asked_for(tip, direction, insertion)
    if math.hypot(direction[1], direction[2]) < ALONG_BORE:
        return Solutions((), ("the needle is along the bore axis: q5 = +-90 deg",))
    branches = [_branch(d, tip, direction, insertion, sign) for sign in (1.0, -1.0)]
    return replace(within_limits(branches, LIMITS, ANGLES), complete=True)


def broken_limits(q: ArrayLike) -> tuple[str, ...]:
    """The joints of q (6,) beyond their limits, a phrase each; empty if none."""
    return closed_form.broken_limits(q, LIMITS, ANGLES)


def remote_centre(
    q: ArrayLike,
    dq4: float,
    dq5: float,
    *,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Array:
    """Joint positions after turning q4 and q5 about the needle tip, which stays.

    Args:
        q: Joint positions, (6,).
        dq4: Turn about the long arm, [rad].
        dq5: Turn of the needle holder, [rad].
        perturbed: As for `kinematics.forward`.
        **arguments: As for `kinematics.forward`.

    Returns:
        Joint positions, (6,), not checked against the limits. [Matsuno2020] section 2.2
    """
    d = from_arguments(arguments, perturbed)
    q = np.array(q, dtype=np.float64)
    turned = q + np.array([0.0, 0.0, 0.0, dq4, dq5, 0.0])
    turned[:3] += _tip_relative(d, turned) - _tip_relative(d, q)
    return turned


def _branch(
    d: Dimensions, tip: Array, direction: Array, insertion: float, branch: float
) -> Array:
    """The configuration with cos(q5) of the sign of `branch`."""
    s = d.mount_sign
    nx, ny, nz = direction
    q5 = math.atan2(-s * nx, branch * math.hypot(ny, nz))
    q4 = math.atan2(branch * s * ny, -branch * nz)
    o = d.offsets
    q4, q5 = (math.remainder(a, 2.0 * math.pi) for a in (q4 - o[3], q5 - o[4]))
    q = np.array([0.0, 0.0, 0.0, q4, q5, insertion])
    a, b, c = _tip_relative(d, q)
    x, y, z = tip
    q[0] = z - d.l6 + a - o[0]
    q[1] = -x - d.l4 + s * d.l1 + b - o[1]
    q[2] = d.l3 - y - d.l5 + c - o[2]
    return q


def _tip_relative(d: Dimensions, q: Array) -> Array:
    """How far q1, q2, q3 must go to keep the tip where it is, (3,), [m]."""
    o = d.offsets
    q4, q5, q6 = q[3] + o[3], q[4] + o[4], q[5] + o[5]
    s = d.mount_sign
    S4, C4, S5, C5 = math.sin(q4), math.cos(q4), math.sin(q5), math.cos(q5)
    L, l7, ly = q6 + d.l9 + d.lE + d.tip_offset_z, d.l7 - d.tip_offset_x, d.tip_offset_y
    rho = d.l2 + L * C5 + l7 * S5
    return np.array(
        [C4 * rho - S4 * ly, s * (l7 * C5 - L * S5), s * (S4 * rho + C4 * ly)]
    )
