"""Whether robot and obstacle are nearest where the obstacle was seen, or only assumed.

A scan of a patient ends somewhere, and nobody has seen what continues the body beyond
it: where that is nearest, nothing is clear. Every such obstacle is asked alone, because
something else that is nearer does not show where a patient ends.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.clearance import to_obstacles
from borecheck.contact.verdict import Closest
from borecheck.plans.corridor import Corridor
from borecheck.robots.obstacle_files import Obstacle
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


def why_unseen(obstacle: Obstacle, closest: Closest | None) -> str | None:
    """Why the nearest place of an obstacle proves nothing; None if it was seen.

    Args:
        obstacle: Part of it may be assumed.
        closest: Nearest points of the robot and this obstacle; None: not known.
    """
    if obstacle.assumed is None:
        return None
    if closest is None:
        what = f"where {obstacle.name} is nearest, and whether it was seen there"
        return f"{what}, is not known"
    if not obstacle.assumed.triangles[closest.triangles[1]]:
        return None
    return (
        f"{closest.link} is nearest to {obstacle.name}, "
        f"{1e3 * closest.distance:.1f} mm, where that is assumed, not seen: "
        f"{obstacle.assumed.reason}"
    )


def why_unseen_at(
    robot: Robot,
    scene: Scene,
    placements: dict[str, Array],
    corridor: Corridor | None,
    closest: Closest,
) -> str | None:
    """As `why_unseen`, of all obstacles at one pose.

    Args:
        robot: The robot.
        scene: What stands around it.
        placements: T_scene_link of every link.
        corridor: Where the needle may be in the patient.
        closest: Nearest points of the robot and all obstacles.
    """
    for obstacle in scene.unseen.values():
        nearest: Closest | None = closest
        if closest.obstacle != obstacle.name:
            alone = replace(scene, obstacles=(obstacle,))
            nearest, _ = to_obstacles(robot, alone, placements, corridor)
        reason = why_unseen(obstacle, nearest)
        if reason is not None:
            return reason
    return None
