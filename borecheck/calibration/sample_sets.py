"""Which joint values to measure at: three base points with small random variation.

[Heikkila2010] section 4: repeating the same place adds nothing when an image is
thresholded, so every base point gets a little motion of its own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines, positions
from borecheck.calibration.serial_arm import SerialArm

Array = NDArray[np.float64]

BASE_POINTS = 3
FULL_CIRCLE = 2.0 * np.pi / BASE_POINTS

# Assumed: the paper says "small random variation"; 4 deg leaves the base points apart.
VARIATION = np.radians(4.0)

# Attitudes of the joints below that are tried to bring the target off the axis.
ATTITUDES = 200


@dataclass(frozen=True, eq=False)
class Sweep:
    """Joint values at which one joint is measured.

    Attributes:
        joint: The joint that turns.
        q: Joint angles, (n, k), [rad].
    """

    joint: str
    q: Array


def base_points(lower: float, upper: float, variation: float = VARIATION) -> Array:
    """Three angles around the middle of the range, 120 deg apart if limits allow it."""
    room = 0.5 * (upper - lower) - variation
    apart = min(FULL_CIRCLE, max(room, 0.0))
    return 0.5 * (lower + upper) + apart * np.array([-1.0, 0.0, 1.0])


def split(samples: int) -> list[int]:
    """How many samples each base point gets: 182 is 61, 61, 60."""
    return [len(part) for part in np.array_split(np.arange(samples), BASE_POINTS)]


def angles(
    rng: np.random.Generator,
    bases: Sequence[float] | Array,
    samples: int,
    variation: float = VARIATION,
) -> Array:
    """Angles around base points, (samples,), [rad]."""
    centres = np.repeat(bases, split(samples))
    return np.asarray(centres + rng.uniform(-variation, variation, samples))


def sweep(
    arm: SerialArm,
    joint: int,
    samples: int,
    rng: np.random.Generator,
    *,
    target: Array,
    variation: float = VARIATION,
    visible: float = np.inf,
) -> Sweep:
    """Joint values to find one axis.

    Joints above stand at zero (or where they can), joints below stand so that the
    target is far from the axis: a bent wrist makes the disc of a forearm's turn large.

    Args:
        arm: The nominal arm.
        joint: Index of the joint that turns.
        samples: How many.
        rng: Source of the small variation.
        target: Where the target is at zero, (3,), in the world frame [m].
        variation: Half width of the variation, [rad].
        visible: Largest angle from the middle of the range that devices see, [rad].
    """
    q = np.repeat(attitude(arm, joint, target)[None], samples, axis=0)
    middle = 0.5 * (arm.lower[joint] + arm.upper[joint])
    lower = max(arm.lower[joint], middle - visible)
    bases = base_points(lower, min(arm.upper[joint], middle + visible), variation)
    q[:, joint] = angles(rng, bases, samples, variation)
    return Sweep(arm.joint_names[joint], q)


def sweeps(
    arm: SerialArm,
    samples: int | Sequence[int],
    rng: np.random.Generator,
    target: Array,
    variation: float = VARIATION,
    visible: Mapping[str, float] = MappingProxyType({}),
) -> list[Sweep]:
    """Joint values to find every axis; `samples` for each joint."""
    counts = [samples] * len(arm.lines) if isinstance(samples, int) else samples
    return [
        sweep(
            arm,
            i,
            count,
            rng,
            target=target,
            variation=variation,
            visible=visible.get(arm.joint_names[i], np.inf),
        )
        for i, count in enumerate(counts)
    ]


def attitude(arm: SerialArm, joint: int, target: Array) -> Array:
    """Where the other joints stand while one turns, (k,), [rad].

    The same for every call: the attitudes are drawn with a fixed seed.
    """
    tried = arm.random(np.random.default_rng(joint), ATTITUDES, share=0.7)
    tried[:, : joint + 1] = arm.resting()[: joint + 1]
    straight = arm.resting()
    tried = np.vstack([straight, tried])
    x = positions(arm.lines, tried, target)
    line = _turned_line(arm.lines, joint, straight)
    away = x - line.points[joint]
    radius = np.linalg.norm(np.cross(away, line.directions[joint]), axis=1)
    # resting is kept where it is nearly as good: less to drive, less to explain
    return tried[0] if radius[0] > 0.8 * radius.max() else tried[int(radius.argmax())]


def _turned_line(lines: Lines, joint: int, q: Array) -> Lines:
    """The axes at a configuration, as far as this joint's is concerned."""
    upstream = np.where(np.arange(len(lines)) < joint, q, 0.0)[None]
    here = positions(lines, upstream, lines.points[joint])[0]
    ahead = positions(lines, upstream, lines.points[joint] + lines.directions[joint])[0]
    points, directions = lines.points.copy(), lines.directions.copy()
    points[joint], directions[joint] = here, ahead - here
    return Lines(points, directions)
