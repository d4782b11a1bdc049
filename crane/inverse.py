"""CRANE's joint positions for a needle, in closed form; numpy only.

A needle leaves three of the eight joints free. Two sets of coordinates for them:
(q5, q6, q8), [CRANE] section V's own, and (psi, q7, q8) with the roll psi about the
needle, which is single-valued and solvable wherever the arm can point (docs/crane.md).
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck_models import closed_form
from borecheck_models.closed_form import Solutions, needle_asked_for
from crane.branches import (
    FREE,
    finished,
    q4_roots,
    room,
    seen_from_base,
    times,
)
from crane.dimensions import ANGLES, LIMITS, Dimensions, from_arguments
from crane.refusals import refuse_no_numbers, unit

Array = NDArray[np.float64]

# Values of psi and q7 tried when the caller names none: every 15 degrees.
ROLLS, TIPS = 24, 13

_NOTHING: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class Branches:
    """The arm's answers to a needle pose at chosen (q5, q6, q8).

    Attributes:
        configurations: None, one (a double root) or two, each (8,); limits are not
            looked at.
        q4_is_free: The needle lies along the arm and q6 (or q5 and q6) leaves the roll
            of the arm open: the one configuration given has q4 = 0.
    """

    configurations: tuple[Array, ...]
    q4_is_free: bool = False


def exists(direction: ArrayLike, q5: ArrayLike, q6: ArrayLike) -> NDArray[np.bool_]:
    """Whether any q4 and q7 point the needle there: n_x^2 + (sin q6 cos q5)^2 <= 1.

    Args:
        direction: Of the needle in the base's frame, (..., 3), of any length but 0.
        q5: [rad].
        q6: [rad].

    Raises:
        ValueError: A number is not finite, or a direction has no length.
    """
    n, q5, q6 = unit(direction), np.asarray(q5, float), np.asarray(q6, float)
    refuse_no_numbers(q5=q5, q6=q6)
    return ~room(n, q5, q6)[1]


def inverse_q5_q6(
    tip: ArrayLike,
    direction: ArrayLike,
    q5: float,
    q6: float,
    q8: float,
    *,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Branches:
    """All joint positions that put the needle there with q5, q6 and q8 as given.

    Args:
        tip: Needle tip in the scanner's frame I, (3,), [m].
        direction: The way the needle points, (3,), of any length but 0.
        q5: [rad].
        q6: [rad].
        q8: [m].
        perturbed: As for `kinematics.forward`.
        **arguments: As for `kinematics.forward`.

    Raises:
        ValueError: A number is not finite, or the direction has no length.
    """
    d = from_arguments(arguments, perturbed)
    p8, n = _in_base(d, tip, direction, q8)
    refuse_no_numbers(q5=q5, q6=q6)
    angles, none, free = q4_roots(n, np.array(q5), np.array(q6))
    if none:
        return Branches(())
    double = free or float(angles[0]) == float(angles[1])
    at = np.array([angles[0]] if double else angles)
    found = finished(d, p8, n, at, np.array(q5), np.array(q6), np.array(q8))
    return Branches(tuple(found), q4_is_free=bool(free))


def inverse_roll(
    tip: ArrayLike,
    direction: ArrayLike,
    psi: ArrayLike,
    q7: ArrayLike,
    q8: ArrayLike,
    *,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Array:
    """The joint positions that put the needle there with psi, q7 and q8 as given.

    There is one wherever |q5| < 90 deg, and it depends smoothly on all three. Where the
    arm would have to stand at |q5| = 90 deg exactly, the row is NaN.

    Args:
        tip: Needle tip in the scanner's frame I, (3,), [m].
        direction: The way the needle points, (3,), of any length but 0.
        psi: Roll of frame 8 about the needle, [rad]; at 0 its x axis lies in the plane
            of the needle and the arm, towards the arm's end.
        q7: [rad].
        q8: [m].
        perturbed: As for `kinematics.forward`.
        **arguments: As for `kinematics.forward`.

    Returns:
        q, (..., 8), in the broadcast shape of psi, q7, q8; limits are not looked at.

    Raises:
        ValueError: A number is not finite, or the direction has no length.
    """
    d = from_arguments(arguments, perturbed)
    tip, n = _in_base(d, tip, direction, 0.0)
    psi, q7, q8 = np.broadcast_arrays(*(np.asarray(v, float) for v in (psi, q7, q8)))
    refuse_no_numbers(psi=psi, q7=q7, q8=q8)
    e1, e2 = roll_axes(n)
    x8 = times(np.cos(psi), e1) + times(np.sin(psi), e2)
    return standing(d, tip, n, x8, q7, q8)


def standing(
    d: Dimensions, p8: Array, n: Array, x8: Array, q7: Array, q8: Array
) -> Array:
    """The arm that stands behind frame 8, seen from the base; limits are not looked at.

    Args:
        d: The dimensions.
        p8: Origin of frame 8, (..., 3), [m].
        n: Unit direction of the needle, its z axis, likewise.
        x8: Its x axis, likewise.
        q7: [rad], (...).
        q8: [m].

    Returns:
        q, (..., 8); NaN where |q5| would be 90 deg.
    """
    q7, q8 = np.broadcast_arrays(q7, q8, x8[..., 0])[:2]
    x6 = times(np.sin(q7), x8) + times(np.cos(q7), n)
    z6 = times(np.cos(q7), x8) - times(np.sin(q7), n)
    z7 = np.cross(x8, n)
    x = np.array([1.0, 0.0, 0.0])
    # z6 = C5 x4 + S5 x with x4 square to the arm: no difference of large numbers
    S5, C5 = z6[..., 0], np.hypot(z6[..., 1], z6[..., 2])
    up = np.where(C5 > FREE, C5, np.nan)
    zero = np.zeros_like(S5)
    x4 = np.stack([zero, z6[..., 1] / up, z6[..., 2] / up], axis=-1)
    z5 = np.stack([zero, x4[..., 2], -x4[..., 1]], axis=-1)
    x5 = times(C5, x) - times(S5, x4)
    p5 = p8 - times(d.d8 + q8, n) - d.a8 * x8 - d.d7 * z7 - d.a7 * x6 - d.a6 * x5
    q4 = np.arctan2(-x4[..., 1], x4[..., 2])
    q6 = np.arctan2(np.sum(x6 * z5, axis=-1), np.sum(x6 * x5, axis=-1))
    q5 = np.arctan2(S5, C5)
    return np.stack(
        [-p5[..., 1], p5[..., 2], p5[..., 0], q4, q5, q6, q7, q8 + 0.0 * q5], axis=-1
    )


def roll_axes(direction: ArrayLike) -> tuple[Array, Array]:
    """The axes e1, e2 (3,) square to a needle, from which the roll psi is measured.

    Args:
        direction: In the base's frame, (3,), of any length but 0.

    Raises:
        ValueError: A number is not finite, or the direction has no length.
    """
    n = unit(direction)
    along = np.array([1.0, 0.0, 0.0])
    if abs(n[0]) > 1.0 - 1e-6:  # the needle lies along the arm: any plane will do
        along = np.array([0.0, 0.0, 1.0])
    e1 = along - (along @ n) * n
    e1 /= np.linalg.norm(e1)
    return e1, np.cross(n, e1)


def inverse(
    tip: ArrayLike,
    direction: ArrayLike,
    insertion: float,
    *,
    rolls: Sequence[float] | None = None,
    tips: Sequence[float] | None = None,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Solutions:
    """Joint positions for a needle tip and direction; nothing is ever clipped.

    The roll about the needle and q7 are free. Of a grid of both, all within the limits
    are given, those first whose turning axes are farthest from their limits. The order
    depends on the direction alone: along a needle's line the same roll stays the same.

    Args:
        tip: Needle tip in the scanner's frame I, (3,), [m].
        direction: The way the needle points, (3,), of any length but 0.
        insertion: q8, which must be chosen, [m].
        rolls: Values of psi (`inverse_roll`), [rad]; default 24 all round.
        tips: Values of q7, [rad]; default 13 over its limits.
        perturbed: As for `kinematics.forward`.
        **arguments: As for `kinematics.forward`.

    Raises:
        ValueError: A number is not finite, or the direction has no length.
    """
    if rolls is None:
        rolls = [2.0 * math.pi * k / ROLLS for k in range(ROLLS)]
    if tips is None:
        tips = list(np.linspace(*LIMITS["q7"], TIPS))
    psi, q7 = np.meshgrid(rolls, tips, indexing="ij")
    kwargs = {"perturbed": perturbed, **arguments}
    grid = inverse_roll(tip, direction, psi, q7, insertion, **kwargs)  # type: ignore[arg-type]
    qs = grid.reshape(-1, 8)
    qs = qs[np.isfinite(qs).all(axis=1)]
    within = qs[within_limits(qs)]
    if len(within) == 0:
        return Solutions((), tuple(_nearest_misses(qs)))
    ordered = within[np.argsort(_crowding(within), kind="stable")]
    ordered.setflags(write=False)
    return Solutions(tuple(ordered), ())


def within_limits(qs: ArrayLike) -> NDArray[np.bool_]:
    """Which configurations (..., 8) lie within the limits, their ends included."""
    q = np.asarray(qs, dtype=np.float64)
    low, high = np.array(list(LIMITS.values())).T
    return np.asarray(((q >= low) & (q <= high)).all(axis=-1))


def broken_limits(q: ArrayLike) -> tuple[str, ...]:
    """The joints of q (8,) beyond their limits, a phrase each; empty if none."""
    return closed_form.broken_limits(q, LIMITS, ANGLES)


def _crowding(qs: Array) -> Array:
    """How near a limit the worst turning axis is, (n,): 0 in the middle, 1 at one."""
    low, high = np.array([LIMITS[name] for name in ANGLES]).T
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    # rounded: equal ones keep the order of the grid wherever the needle is
    return np.asarray(np.abs((qs[:, 3:7] - middle) / half).max(axis=1).round(9))


def _nearest_misses(qs: Array) -> Iterator[str]:
    """What the least broken configuration breaks, and how many were tried."""
    low, high = np.array(list(LIMITS.values())).T
    beyond = np.maximum(low - qs, qs - high) / (high - low)
    if len(qs) == 0:
        yield "no roll about the needle lets the arm point there"
        return
    nearest = qs[int(np.argmin(np.maximum(beyond, 0.0).sum(axis=1)))]
    yield "; ".join(broken_limits(nearest)) + f" (the least of {len(qs)} rolls and q7)"


def _in_base(
    d: Dimensions, tip: ArrayLike, direction: ArrayLike, number: float
) -> tuple[Array, Array]:
    """Where frame 8 must be [m], and the unit direction, seen from the base."""
    p8, n = seen_from_base(d, *needle_asked_for(tip, direction, number))
    return p8, n / math.hypot(*n)
