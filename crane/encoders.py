"""What CRANE's encoders read; simulated series of motors and joints. numpy only."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.dimensions import LIMITS
from crane.excitation import MOTOR_STEP
from crane.transmission import CABLE, CABLE_JOINTS

Array = NDArray[np.float64]

# AS5048B (section V-D): 14 bits a turn.
JOINT_STEP = 2.0 * np.pi / 2**14
# Assumed: the magnet of q8 turns with its capstan of 12.7 mm (the precursor's).
CAPSTAN = 12.7e-3


@dataclass(frozen=True)
class Series:
    """Motors m5 to m8 [rad] and joints q5 to q8 [rad, q8 m], (n, 4) each."""

    motors: Array
    joints: Array


def rounded(values: ArrayLike, step: ArrayLike) -> Array:
    """What an encoder of that resolution reads, to the nearest step.

    Args:
        values: [rad] or [m].
        step: Resolution in the same unit; 0 reads exactly.
    """
    values = np.asarray(values, float)
    step = np.broadcast_to(np.asarray(step, float), values.shape)
    safe = np.where(step > 0.0, step, 1.0)
    return np.where(step > 0.0, np.round(values / safe) * safe, values)


def simulated_series(
    samples: int,
    rng: np.random.Generator,
    *,
    cable: ArrayLike = CABLE,
    bits: bool = True,
    offset: ArrayLike = 0.0,
    in_step: bool = False,
) -> Series:
    """A calibration motion: every joint swings over 80 % of its range at its own pace.

    Args:
        samples: Instants.
        rng: Of the phases.
        cable: The true C_cable.
        bits: Whether encoders have their resolution; else they are exact.
        offset: Added to what the joint encoders read, (4,) or one number.
        in_step: The mistake: m6 is driven with m5.
    """
    C = np.asarray(cable, float)
    low, high = np.array([LIMITS[name] for name in CABLE_JOINTS]).T
    # no two have a common period, so that no motion is a multiple of another
    turns = np.array([3.0, 4.236, 5.449, 7.141]) * 2.0 * np.pi
    t = np.linspace(0.0, 1.0, samples)[:, None]
    swing = np.sin(turns * t + rng.uniform(0.0, 2.0 * np.pi, 4))
    q = 0.5 * (low + high) + 0.4 * (high - low) * swing
    m = np.linalg.solve(C, q.T).T
    if in_step:
        m[:, 1] = 0.5 * m[:, 0]
    read = m @ C.T + offset
    if not bits:
        return Series(m, read)
    steps = JOINT_STEP * np.array([1.0, 1.0, 1.0, 0.5 * CAPSTAN])
    return Series(rounded(m, MOTOR_STEP), rounded(read, steps))
