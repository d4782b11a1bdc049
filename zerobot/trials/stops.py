"""Where an approach stops: the first place at a wanted distance, never passed."""

from collections.abc import Callable

from zerobot.trials.published import DISTANCES_MM

# Issue: distances are met to 1 um; the certified distance is good to far less.
STOP_TOLERANCE = 1e-7
MAX_STEPS = 200

# An approach begins beyond the farther stop by so much [m].
START_BEYOND = 0.005


def solve_stop(
    distance: Callable[[float], float], start: float, end: float, wanted: float
) -> float | None:
    """The first place after `start` where the distance falls to `wanted`.

    The distance changes by at most 1 m per metre of travel, so that a step of
    (distance - wanted) never passes the place; secant steps that stay beyond it
    shorten the way.

    Args:
        distance: Distance by travel, [m].
        start: Where the approach begins, [m].
        end: Where the joint limit ends it, [m].
        wanted: The distance to stop at, [m].

    Returns:
        The travel, [m], or None if the distance stays larger up to `end`.
    """
    at, gap = start, distance(start) - wanted
    if gap < 0.0:
        return None
    for _ in range(MAX_STEPS):
        if gap <= STOP_TOLERANCE:
            return at
        if at >= end:
            return None
        ahead = min(end, at + max(gap, STOP_TOLERANCE / 2))
        there = distance(ahead) - wanted
        slope = (gap - there) / (ahead - at)
        at, gap = ahead, there
        if gap > STOP_TOLERANCE and slope > 1e-6:
            reach = min(end, at + 0.98 * gap / slope)
            tried = distance(reach) - wanted
            if tried >= 0.0:
                at, gap = reach, tried
    return None


def back_off(
    distance: Callable[[float], float], at: float, first: float
) -> float | None:
    """Back along the axis until the robot is farther off than the first stop."""
    needed = 1e-3 * DISTANCES_MM[0] + START_BEYOND
    for _ in range(MAX_STEPS):
        missing = needed - distance(at)
        if missing <= 0.0:
            return at
        if at <= first:
            return None
        at = max(first, at - max(missing, 1e-3))
    return None
