"""Targets: a cone about a virtual needle tip, a line, and a pose held."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.refusals import refuse_no_numbers
from crane.turning import turns

Array = NDArray[np.float64]

# Assumed, the paper draws its cone only: half angle, and tip ahead of frame 8.
ANGLE = np.radians(10.0)
AHEAD = 0.150
STEPS = 1200


def cone(
    T: ArrayLike, steps: int = STEPS, angle: float = ANGLE, ahead: float = AHEAD
) -> Array:
    """One turn of a remote centre of motion: the needle goes round a cone; eq. (23).

    Args:
        T: Pose of frame 8 on the cone's axis, (4, 4).
        steps: Controller periods a turn.
        angle: Between axis and needle, [rad].
        ahead: Of frame 8 to the virtual tip, which stays, [m].

    Returns:
        (steps + 1, 4, 4); the last is the first.

    Raises:
        ValueError: A pose, angle or length that is none, or no step.
    """
    _refuse_steps(steps)
    refuse_no_numbers(T=T, angle=angle, ahead=ahead)
    T = np.asarray(T, float)
    phi = np.linspace(0.0, 2.0 * np.pi, steps + 1)
    w = angle * np.column_stack([np.cos(phi), np.sin(phi), 0.0 * phi])
    targets = np.tile(T, (steps + 1, 1, 1))
    targets[:, :3, :3] = T[:3, :3] @ turns(w)
    tip = T[:3, 3] + ahead * T[:3, 2]
    targets[:, :3, 3] = tip - ahead * targets[:, :3, 2]
    return targets


def path_per_step(
    angle: float = ANGLE, ahead: float = AHEAD, steps: int = STEPS
) -> tuple[float, float]:
    """What frame 8 and the needle's axis travel in a period, [m] and [rad]."""
    _refuse_steps(steps)
    circle = 2.0 * np.pi * float(np.sin(angle)) / steps
    return ahead * circle, circle


def line(T: ArrayLike, steps: int, step: ArrayLike) -> Array:
    """Frame 8 goes straight on by `step` (3,) [m] a period, (steps + 1, 4, 4)."""
    _refuse_steps(steps)
    refuse_no_numbers(T=T, step=step)
    targets = np.tile(np.asarray(T, float), (steps + 1, 1, 1))
    targets[:, :3, 3] += np.arange(steps + 1)[:, None] * np.asarray(step, float)
    return targets


def held(T: ArrayLike, steps: int) -> Array:
    """One pose all the time, (steps + 1, 4, 4)."""
    return line(T, steps, np.zeros(3))


def _refuse_steps(steps: int) -> None:
    if not steps >= 1 or steps != int(steps):
        raise ValueError(f"steps = {steps!r}: a whole number from 1 up")
