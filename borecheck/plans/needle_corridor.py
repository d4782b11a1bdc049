"""The corridor of a robot's needle: along a plan's line, or along a path's insertion.

A corridor is as wide as the needle. Where no description states how wide that is, it is
measured from the needle's triangles, where they enter.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import UsageError
from borecheck.plans.corridor import Corridor
from borecheck.plans.needle_plan import MIN_PATH, plan_problem
from borecheck.robots.needle import WIDEST
from borecheck.robots.needle_shape import FOREMOST, half_width
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]

# The corridor of a path goes along its last leg.
LAST_LEG = "last-leg"
# A waypoint is on the needle's last line up to this, [m], and of the unit vector along
# it: a fraction of what the corridor leaves beside the needle over a leg of 100 mm.
ON_LINE, TURNED = 0.5e-3, 5e-3


def corridor_along(
    robot: Robot, waypoints: Array, entry: Array, target: Array
) -> Corridor:
    """Where the needle may be in the patient on a motion, from entry to target.

    Args:
        robot: A robot with a needle.
        waypoints: The motion, (k, n); its end is where the needle is deepest.
        entry: On the skin, scanner's frame, (3,), [m].
        target: Where the tip ends, (3,).

    Raises:
        UsageError: The robot has no needle, the points make no needle path, or what is
            called a needle is too thick for one.
    """
    problem = plan_problem(entry, target)
    if problem is not None:
        raise UsageError(f"corridor: {problem}")
    entry, target = np.array(entry, np.float64), np.array(target, np.float64)
    if robot.needle is None:
        raise UsageError(f"{robot.name} has no needle: state it with --needle LINK")
    radius = robot.needle.radius
    if radius is None:
        radius = _measured(robot, robot.needle.link, waypoints[-1], target - entry)
    return Corridor(entry, target, radius)


def last_leg(robot: Robot, waypoints: Array) -> Corridor:
    """The corridor along the last leg of a path: its needle's way straight in.

    The leg begins at the first waypoint from which on the tip stays on the line that
    the needle has at the end, pointing along it.

    Raises:
        UsageError: As in `corridor_along`; or the needle has no frame at its tip, or
            does not go where it points at the end.
    """
    needle = robot.needle_with_tip()
    target, direction = _needle_at(robot, waypoints[-1])
    entry = target
    for q in waypoints[-2::-1]:
        tip, along = _needle_at(robot, q)
        aside = tip - target - ((tip - target) @ direction) * direction
        turned = np.linalg.norm(along - direction)
        back = (entry - tip) @ direction
        if np.linalg.norm(aside) > ON_LINE or turned > TURNED or back < 0.0:
            break
        entry = tip
    if np.linalg.norm(target - entry) < MIN_PATH:
        raise UsageError(
            f"--corridor {LAST_LEG}: at the path's end {needle.link} does not go along "
            "itself: give entry and target"
        )
    return corridor_along(robot, waypoints, entry, target)


def _needle_at(robot: Robot, q: Array) -> tuple[Array, Array]:
    needle = robot.needle_with_tip()
    T = robot.placements(q)[needle.tip or ""]
    return T[:3, 3], T[:3, :3] @ needle.axis


def needle_radius(robot: Robot) -> float:
    """Half the width of a robot's needle, [m]; 0 without one.

    Raises:
        UsageError: What is called a needle is too thick for one.
    """
    needle = robot.needle
    if needle is None or needle.radius is not None or needle.tip is None:
        return (needle.radius or 0.0) if needle is not None else 0.0
    axis = robot.placements(robot.home)[needle.tip][:3, :3] @ needle.axis
    return _measured(robot, needle.link, robot.home, FOREMOST * axis)


def _measured(robot: Robot, link: str, q: Array, along: Array) -> float:
    """Half the needle's width where it enters, seen along its line, [m]."""
    T = robot.placements(q)[link]
    corners = [part.mesh.corners for part in robot.parts if part.link == link]
    placed = np.concatenate(corners) @ T[:3, :3].T + T[:3, 3]
    length = float(np.linalg.norm(along))
    width = half_width(placed, along / length, min(length, FOREMOST))
    if width > WIDEST:
        raise UsageError(
            f"{link} is {2e3 * width:.1f} mm thick where it would enter, and nothing "
            f"over {2e3 * WIDEST:g} mm may enter a patient"
        )
    return width
