"""CRANE's answers at chosen (q5, q6, q8), for one needle or many; numpy only.

With the axis of q7 square to the needle, `A + B cos q4 + D sin q4 = 0` has two roots
q4 wherever `n_x^2 + (sin q6 cos q5)^2 <= 1`; q7 and the stages follow. Whether there
are roots is decided once, by `room`, for all who ask.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.dimensions import Dimensions, from_arguments
from crane.refusals import refuse_no_numbers, unit

Array = NDArray[np.float64]

# What rounding takes from a direction, [rad]: so far a needle may be from the nearest
# that the arm can point to, and nearer than this to the arm every roll of it is right.
AT_THE_EDGE = 4.0 * float(np.finfo(float).eps)
FREE = 4.0 * AT_THE_EDGE

_NOTHING: Mapping[str, float] = MappingProxyType({})


def many_q5_q6(
    tips: ArrayLike,
    directions: ArrayLike,
    q5: ArrayLike,
    q6: ArrayLike,
    q8: ArrayLike,
    *,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Array:
    """Both branches of `inverse.inverse_q5_q6`, for many needles at once.

    Args:
        tips: Needle tips in the scanner's frame I, (n, 3), [m].
        directions: (n, 3), of any length but 0.
        q5: [rad], (n,).
        q6: [rad], (n,).
        q8: [m], (n,).
        perturbed: As for `kinematics.forward`.
        **arguments: As for `kinematics.forward`.

    Returns:
        (n, 2, 8): NaN where there is no branch; two equal rows at a double root; where
        q4 is free, q4 = 0 and the second row is NaN.

    Raises:
        ValueError: A number is not finite, or a direction has no length.
    """
    d = from_arguments(arguments, perturbed)
    q5, q6, q8 = (np.asarray(v, float) for v in (q5, q6, q8))
    refuse_no_numbers(tips=np.asarray(tips, float), q5=q5, q6=q6, q8=q8)
    p8, n = seen_from_base(d, np.asarray(tips, float), unit(directions))
    (plus, minus), none, free = q4_roots(n, q5, q6)
    q = np.stack([finished(d, p8, n, q4, q5, q6, q8) for q4 in (plus, minus)], axis=-2)
    q[none] = np.nan
    q[free, 1] = np.nan
    return q


def seen_from_base(
    d: Dimensions, tips: Array, directions: Array
) -> tuple[Array, Array]:
    """Origins of frame 8 [m] and directions of needles in I, seen from the base.

    Args:
        d: The dimensions.
        tips: Needle tips, (..., 3), [m].
        directions: Unit directions, (..., 3).
    """
    c, s = np.cos(d.base_yaw), np.sin(d.base_yaw)
    R_I_base = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    base = np.array([d.base_x, d.base_y, d.base_z])
    return (tips - base - d.ahead * directions) @ R_I_base, directions @ R_I_base


def q4_roots(
    n: Array, q5: Array, q6: Array
) -> tuple[tuple[Array, Array], NDArray[np.bool_], NDArray[np.bool_]]:
    """The two roots of A + B cos q4 + D sin q4 = 0; where there is none; which is free.

    Args:
        n: Unit direction of the needle in the base's frame, (..., 3).
        q5: [rad], (...).
        q6: [rad], (...).
    """
    S5, C5, S6, C6 = np.sin(q5), np.cos(q5), np.sin(q6), np.cos(q6)
    A = -S6 * C5 * n[..., 0]
    B = S6 * S5 * n[..., 2] + C6 * n[..., 1]
    D = C6 * n[..., 2] - S6 * S5 * n[..., 1]
    space, none, free = room(n, q5, q6)
    root = np.sqrt(np.maximum(space, 0.0))
    first, second = (
        np.where(free, 0.0, np.arctan2(-A * D + s * B, -A * B - s * D))
        for s in (root, -root)
    )
    return (first, second), none, free


def room(
    n: Array, q5: Array, q6: Array
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """What is left of 1 = n_x^2 + (sin q6 cos q5)^2; where nothing; where q4 is free.

    With s = |sin q6 cos q5| the part of q7's axis along the arm and c that across it, h
    the needle's across: `h^2 - s^2 = c^2 - n_x^2`, and each difference is taken where
    its parts are small. The arm can point to within about s - h (or |n_x| - c) of the
    needle: that angle, and not its square, is what rounding may take.

    Args:
        n: Unit direction of the needle in the base's frame, (..., 3).
        q5: [rad], (...).
        q6: [rad], (...).
    """
    h, x = np.hypot(n[..., 1], n[..., 2]), np.abs(n[..., 0])
    s = np.abs(np.sin(q6) * np.cos(q5))
    c = np.hypot(np.cos(q6), np.sin(q6) * np.sin(q5))
    along = s < c
    more, less = np.where(along, h, c), np.where(along, s, x)
    free = np.maximum(more, less) <= FREE
    none = (more - less < -AT_THE_EDGE) & ~free
    return np.asarray((more - less) * (more + less)), np.asarray(none), np.asarray(free)


def finished(
    d: Dimensions, p8: Array, n: Array, q4: Array, q5: Array, q6: Array, q8: Array
) -> Array:
    """The configuration with the first angles known: q7, then the stages.

    Args:
        d: The dimensions.
        p8: Origin of frame 8 seen from the base, (..., 3), [m].
        n: Unit direction of the needle, likewise.
        q4: [rad], (...), as all joints.
        q5: [rad].
        q6: [rad].
        q8: [m].
    """
    q4, q5, q6, q8 = np.broadcast_arrays(q4, q5, q6, q8)
    S4, C4, S5, C5 = np.sin(q4), np.cos(q4), np.sin(q5), np.cos(q5)
    zero = np.zeros_like(S4)
    z5 = np.stack([zero, C4, S4], -1)
    x5 = np.stack([C5, S5 * S4, -S5 * C4], -1)
    z6 = np.stack([S5, -C5 * S4, C5 * C4], -1)
    x6 = times(np.cos(q6), x5) + times(np.sin(q6), z5)
    z7 = times(np.cos(q6), z5) - times(np.sin(q6), x5)
    q7 = np.arctan2(-np.sum(n * z6, -1), np.sum(n * x6, -1))
    x7 = times(np.sin(q7), x6) + times(np.cos(q7), z6)
    p5 = p8 - times(d.d8 + q8, n) - d.a8 * x7 - d.d7 * z7 - d.a7 * x6 - d.a6 * x5
    return np.stack([-p5[..., 1], p5[..., 2], p5[..., 0], q4, q5, q6, q7, q8], -1)


def times(by: Array, v: Array) -> Array:
    """Every vector v (..., 3) times its number."""
    return np.asarray(by)[..., None] * v
