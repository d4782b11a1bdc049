"""The MRI arm's joint positions for a needle, in closed form; numpy only.

The last three axes meet in the wrist centre, so that the first three joints place it
and the last three turn the hand: 2 ways to face it, 2 elbows, 2 wrists.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck_models import closed_form
from borecheck_models.closed_form import Solutions, needle_asked_for, within_limits
from mri_arm.dimensions import LIMITS, Dimensions, from_arguments

Array = NDArray[np.float64]

# Below this the axes 4 and 6 are in line and only q4 + q6 has a meaning: q4 is then 0.
WRIST_IN_LINE = 1e-9
# Branches of a wrist nearer to it are not called all: sin(q5).
IN_LINE_AT_MOST = 1e-6

# Rolls tried about the needle when the caller names none (needle at right angles).
ROLLS = 24

ANGLES = tuple(name for name in LIMITS if name != "insertion")

_NOTHING: Mapping[str, float] = MappingProxyType({})


def inverse(
    tip: ArrayLike,
    direction: ArrayLike,
    insertion: float,
    *,
    rolls: Sequence[float] | None = None,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Solutions:
    """Joint positions for a needle tip and direction; nothing is ever clipped.

    The roll about the needle is free. A needle along axis 6 leaves it to q6, which is
    then chosen as `rolls` (default 0); one at right angles changes the whole arm with
    it, and the default is 24 rolls all round.

    Args:
        tip: Needle tip in the scanner's frame I, (3,), [m].
        direction: The way the needle points, (3,), of any length but 0.
        insertion: Position of the insertion axis, which must be chosen, [m].
        rolls: Values of q6 (along), or turns about the needle of the hand from the
            attitude in which it reaches away from axis 1 (square), [rad].
        perturbed: As for `kinematics.forward`.
        **arguments: As for `kinematics.forward`.

    Raises:
        ValueError: A number is not finite, or the direction has no length.
    """
    d = from_arguments(arguments, perturbed)
    tip, direction = needle_asked_for(tip, direction, insertion)
    if d.tool_square > 0.5:
        return _square(d, tip, direction, insertion, rolls)
    found: list[Array] = []
    R = _any_rotation(direction)  # any roll of the hand will do: q6 is overwritten
    for q6 in (0.0,) if rolls is None else rolls:
        for q in _branches(d, tip, R, insertion):
            q[5] = q6
            found.append(q)
    solutions = _sorted(found, d, tip, direction, insertion)
    return replace(solutions, complete=_are_all(found))


def _are_all(found: list[Array]) -> bool:
    """Whether branches with a chosen q6 are all: no wrist is in line, q4 left open."""
    return all(abs(math.sin(q[4])) > IN_LINE_AT_MOST for q in found)


def inverse_pose(
    T_I_E: ArrayLike,
    insertion: float = 0.0,
    *,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Solutions:
    """Joint positions for the whole pose of the needle, its roll included.

    Args:
        T_I_E: Pose of the needle tip in the scanner's frame, (4, 4).
        insertion: Position of the insertion axis [m].
        perturbed: As for `kinematics.forward`.
        **arguments: As for `kinematics.forward`.
    """
    d = from_arguments(arguments, perturbed)
    T = np.array(T_I_E, dtype=np.float64)
    tip, direction = needle_asked_for(T[:3, 3], T[:3, 2], insertion)
    found = list(_branches(d, tip, T[:3, :3], insertion))
    return _sorted(found, d, tip, direction, insertion)


def broken_limits(q: ArrayLike) -> tuple[str, ...]:
    """The joints of q (7,) beyond their limits, a phrase each; empty if none."""
    return closed_form.broken_limits(q, LIMITS, ANGLES)


def _square(
    d: Dimensions,
    tip: Array,
    direction: Array,
    insertion: float,
    rolls: Sequence[float] | None,
) -> Solutions:
    away = tip - np.array([d.base_x, d.base_y, tip[2]])
    away = away - (away @ direction) * direction
    if np.linalg.norm(away) < 1e-6:
        away = _any_rotation(direction)[:, 0]
    away = away / np.linalg.norm(away)
    across = np.cross(direction, away)
    if rolls is None:
        rolls = [2.0 * math.pi * k / ROLLS for k in range(ROLLS)]
    found: list[Array] = []
    for roll in rolls:
        reach = math.cos(roll) * away + math.sin(roll) * across
        # y_E = -(the way the hand reaches), z_E = the needle
        R = np.column_stack([np.cross(-reach, direction), -reach, direction])
        found.extend(_branches(d, tip, R, insertion))
    return _sorted(found, d, tip, direction, insertion)


def _sorted(
    found: list[Array], d: Dimensions, tip: Array, direction: Array, insertion: float
) -> Solutions:
    if not found:
        return Solutions((), (_out_of_reach(d, tip),))
    solutions = within_limits(found, LIMITS, ANGLES)
    nearest_first = sorted(solutions.rejected, key=lambda phrases: phrases.count(";"))
    return replace(solutions, rejected=tuple(nearest_first))


def _out_of_reach(d: Dimensions, tip: Array) -> str:
    shoulder = np.array([d.base_x, d.base_y, d.base_z + d.shoulder])
    far = float(np.linalg.norm(tip - shoulder))
    return (
        f"the wrist cannot get there: the tip is {far:.3f} m from the shoulder, "
        f"the arm to the wrist is {d.upper_arm + d.forearm:.3f} m"
    )


def _branches(
    d: Dimensions, tip: Array, R_I_E: Array, insertion: float
) -> Iterator[Array]:
    """All joint positions, limits not looked at, each (7,)."""
    R6 = _hand(d, R_I_E)
    wrist = tip - (d.needle + insertion) * R_I_E[:, 2] - d.flange * R6[:, 1]
    x, y, z = wrist - np.array([d.base_x, d.base_y, d.base_z + d.shoulder])
    far = math.hypot(x, y)
    s3 = (far**2 + z**2 - d.upper_arm**2 - d.forearm**2) / (2 * d.upper_arm * d.forearm)
    if abs(s3) > 1.0:
        return
    for facing in (1.0, -1.0):
        q1 = math.atan2(-facing * x, facing * y) - d.base_yaw
        for q3 in (math.asin(s3), math.pi - math.asin(s3)):
            rise = math.atan2(
                d.upper_arm + d.forearm * math.sin(q3), d.forearm * math.cos(q3)
            )
            q2 = math.atan2(z, facing * far) - rise
            W = _forearm_rotation(q1 + d.base_yaw, q2 + q3).T @ R6
            for q4, q5, q6 in _wrist(W):
                q = np.array([q1, q2, q3, q4, q5, q6, 0.0])
                q = (q + math.pi) % (2.0 * math.pi) - math.pi
                q[6] = insertion
                yield q


def _hand(d: Dimensions, R_I_E: Array) -> Array:
    """Axes of frame 6: the needle's frame leaned back, x_6 = x_E."""
    lean = 0.5 * math.pi * d.tool_square
    c, s = math.cos(lean), math.sin(lean)
    x, y, z = R_I_E.T
    return np.column_stack([x, c * z - s * y, -s * z - c * y])


def _forearm_rotation(yaw: float, pitch: float) -> Array:
    S1, C1, S, C = math.sin(yaw), math.cos(yaw), math.sin(pitch), math.cos(pitch)
    return np.array([[C1, -S1 * C, S1 * S], [S1, C1 * C, -C1 * S], [0.0, S, C]])


def _wrist(W: Array) -> Iterator[tuple[float, float, float]]:
    """q4, q5, q6 with Ry(q4) Rx(q5) Ry(q6) = W, both ways."""
    sine = math.hypot(W[0, 1], W[2, 1])
    if sine < WRIST_IN_LINE:
        straight = W[1, 1] > 0.0
        sine_6 = -W[2, 0] if straight else W[2, 0]
        yield 0.0, 0.0 if straight else math.pi, math.atan2(sine_6, W[0, 0])
        return
    for sign in (1.0, -1.0):
        yield (
            math.atan2(sign * W[0, 1], sign * W[2, 1]),
            math.atan2(sign * sine, W[1, 1]),
            math.atan2(sign * W[1, 0], -sign * W[1, 2]),
        )


def _any_rotation(direction: Array) -> Array:
    """A rotation whose z axis is the direction."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = np.cross(helper, direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])
