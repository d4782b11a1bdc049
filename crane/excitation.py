"""Whether a series of motors moves enough, and apart enough, to tell their effects.

A motor's own motion, what of it the other motors do not explain, is held against the
least step that its encoder shows: an encoder that flickers between two counts has moved
nothing. numpy only.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Maxon ENX (section V-D), its lines are not printed; assumed 1024, four edges each.
MOTOR_STEP = 2.0 * np.pi / 4096
# No encoder shows less, [rad] or [m].
FINEST = 1e-9

# Own motion in steps of the encoder, rms: rounding to steps (their root of 12) then
# takes less than a thousandth from an entry.
LEAST_STEPS = 10.0
# Spread of the motors' motions beyond which their effects cannot be told apart.
WORST_CONDITION = 1e3
# A joint's motion by its own motor, in what remains unexplained of it: below, an entry
# rests on errors more than on motion.
LEAST_EFFECT = 3.0


def excitation(
    M: Array, names: tuple[str, ...], intercept: bool
) -> tuple[Array, float]:
    """Own motion of every motor, rms [rad], and how far apart the motions are.

    Args:
        M: Series, (n, motors), [rad].
        names: Of the motors.
        intercept: Whether a constant counts as a motion.

    Returns:
        (motors,), and the condition of the motions, each in its own size; 1 is best.

    Raises:
        ValueError: A motor that stands still or flickers, or motors driven in step.
    """
    moved = M - M.mean(axis=0)
    steps = np.array([_step(column) for column in M.T])
    spread = np.sqrt(np.mean(moved**2, axis=0))
    still = np.flatnonzero(spread < LEAST_STEPS * steps)
    if len(still):
        moves = ", ".join(f"{spread[i] / steps[i]:.1f}" for i in still)
        raise ValueError(
            f"{', '.join(names[i] for i in still)} stands still: it moves by {moves} "
            f"steps of its encoder, rms, and less than {LEAST_STEPS:.0f} tell nothing "
            "of its effect"
        )
    size = np.linalg.norm(moved if intercept else M, axis=0)
    _, values, ways = np.linalg.svd((moved if intercept else M) / size, False)
    least = max(float(values[-1]), float(np.finfo(float).tiny))
    condition = float(values[0]) / least
    inverse = np.sum((ways / np.maximum(values, least)[:, None]) ** 2, axis=0)
    own = size / np.sqrt(len(M) * inverse)
    if condition > WORST_CONDITION or (own < LEAST_STEPS * steps).any():
        named = [names[i] for i in np.flatnonzero(np.abs(ways[-1]) > 0.1)]
        raise ValueError(
            f"{' and '.join(named)} are driven in step (condition {condition:.1e}): M "
            "M^T of eq. (9) is singular, their effects cannot be told apart; drive "
            "them at frequencies of their own"
        )
    return own, condition


def _step(motor: Array) -> float:
    """The least step that a series shows, no coarser than the motors' encoders."""
    gaps = np.diff(np.unique(motor))
    gaps = gaps[gaps > FINEST]
    return float(min(gaps.min(), MOTOR_STEP)) if len(gaps) else FINEST
