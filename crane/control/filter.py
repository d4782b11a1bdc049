"""What the controller takes for the joints' positions: eq. (30), numpy only."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PERIOD = 1e-3  # [s]; a public controller of this line of robots runs at 1 kHz
WEIGHT = 0.98  # a of eq. (30), lost; assumed


@dataclass
class ComplementaryFilter:
    """Motors' speed above a changeover frequency, joint encoders below.

    Attributes:
        coupling: C_cable that is believed, (4, 4).
        estimate: q5 to q8, (4,).
        weight: a.
        period: dt, [s].
    """

    coupling: Array
    estimate: Array
    weight: float = WEIGHT
    period: float = PERIOD

    def step(self, motor_speed: Array, encoders: Array) -> Array:
        """The new estimate, (4,), from motors [rad/s] and encoders, (4,) each."""
        predicted = self.estimate + self.coupling @ motor_speed * self.period
        self.estimate = self.weight * predicted + (1.0 - self.weight) * encoders
        return self.estimate


def changeover(weight: float = WEIGHT, period: float = PERIOD) -> float:
    """Where motors and encoders count alike, [Hz]: (1 - a) / (2 pi a dt)."""
    return (1.0 - weight) / (2.0 * float(np.pi) * weight * period)


def lag_of_estimate(
    off: Array, motor_speed: Array, weight: float = WEIGHT, period: float = PERIOD
) -> Array:
    """How far the estimate stays behind while motors run evenly, (4,).

    Args:
        off: C believed minus C true, (4, 4).
        motor_speed: [rad/s], (4,).
        weight: a.
        period: dt, [s].
    """
    return np.asarray(weight / (1.0 - weight) * period * (off @ motor_speed))
