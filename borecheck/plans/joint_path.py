"""A joint path as it was read: waypoints, their times if there are any, what to say."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

# Times say nothing about where a robot is between two waypoints.
BETWEEN_WAYPOINTS = (
    "what a controller makes of timed waypoints: joints are taken to go straight from "
    "one to the next, its splines may not"
)


@dataclass(frozen=True, eq=False)
class JointPath:
    """Waypoints, straight between.

    Attributes:
        waypoints: (k, n), in the order of the robot's joints, [m] and [rad].
        times: Of each, growing, [s]; None where the file says none.
        notes: What of the file is not used, and for what the rest is.
    """

    waypoints: NDArray[np.float64]
    times: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()

    def times_at(self, fractions: Sequence[float]) -> list[float] | None:
        """When the path is at these fractions of itself, [s].

        Waypoint k of n is at fraction k / (n - 1); between two, time runs evenly.
        """
        if self.times is None:
            return None
        at = np.linspace(0.0, 1.0, len(self.times))
        return [float(time) for time in np.interp(fractions, at, self.times)]


def time_note(times: NDArray[np.float64]) -> str:
    """What the times of a path are taken for."""
    return (
        f"its times, {times[0]:g} to {times[-1]:g} s, are the axis of its curves; the "
        "verdict is of the way, at any speed"
    )


def first_not_after(times: Sequence[float]) -> int | None:
    """The first waypoint whose time is not after the one before it, if any is."""
    steps = enumerate(pairwise(times), 1)
    return next((k for k, (before, after) in steps if not after > before), None)
