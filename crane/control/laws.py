"""What the loop must do by theory: lag behind a moving target, limits of its gain."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.control.controller import Gains
from crane.control.loop import closed_loop
from crane.control.plant import Plant
from crane.control.trajectory import held

Array = NDArray[np.float64]

# What a loop starts with, [m]: small, so that the arm's turning changes nothing.
NUDGE = 1e-6


def lag(path: ArrayLike, gain: ArrayLike) -> Array:
    """Error behind a target that goes `path` a period: path / K, in path's unit.

    The loop is x[k+1] = x[k] + K (r[k] - x[k]): its error settles where K takes back in
    a period what the target went on.
    """
    return np.asarray(np.asarray(path, float) / np.asarray(gain, float))


def gain_limit(delay: ArrayLike) -> Array:
    """The gain at which a loop with that many periods of delay begins to swing.

    z^(n+1) - z^n + K has a pair of roots on the unit circle at K = 2 cos(n pi/(2n+1)).
    """
    n = np.asarray(delay, float)
    return np.asarray(2.0 * np.cos(n * np.pi / (2.0 * n + 1.0)))


def noise_gain(gain: ArrayLike) -> Array:
    """Rms of the true error per rms of the tracker's white noise: root(K / (2 - K))."""
    K = np.asarray(gain, float)
    return np.asarray(np.sqrt(K / (2.0 - K)))


def found_limits(
    plant: Plant,
    q0: ArrayLike,
    delays: ArrayLike,
    *,
    halvings: int = 9,
    steps: int = 1200,
) -> Array:
    """The same limits by bisection of the simulated loop, all delays side by side.

    Args:
        plant: The arm.
        q0: Configuration at which its needle is to stay, (8,).
        delays: Periods of delay, (n,).
        halvings: Of the bracket 0 to 2.5.
        steps: Periods that decide whether a disturbance grows.
    """
    late = np.asarray(delays, dtype=np.int_)
    low, high = np.zeros(len(late)), np.full(len(late), 2.5)
    T = plant.placement(np.asarray(q0, float)[None])[0]
    T[:3, 3] += NUDGE * np.array([0.6, 0.0, 0.8])
    targets = held(T, steps)
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        error = errors_of(plant, targets, q0, middle, late)
        grows = growing(error)
        low, high = np.where(grows, low, middle), np.where(grows, middle, high)
    return np.asarray(0.5 * (low + high))


def growing(error: Array) -> NDArray[np.bool_]:
    """Which of the errors (steps, n) swing up: the last quarter is above the third."""
    half, last = len(error) // 2, 3 * len(error) // 4
    late, before = error[last:].max(axis=0), error[half:last].max(axis=0)
    return np.asarray((late > before) | ~(late < 100.0 * NUDGE))


def errors_of(
    plant: Plant, targets: Array, q0: ArrayLike, gain: Array, late: NDArray[np.int_]
) -> Array:
    """Errors (steps, n); a loop that has flown off keeps what it had grown to."""
    gains = Gains(K_ee=gain, K_null=0.0, damping=1e-12)
    with np.errstate(over="ignore", invalid="ignore"):
        run = closed_loop(plant, targets, q0, gains, delay=late)
    return np.nan_to_num(run.position, nan=np.inf)
