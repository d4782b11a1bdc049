"""A motion is not clear where it is nearest to what of an obstacle was only assumed.

See `contact.unseen`: of a motion the certified least clearance to each such obstacle
alone says where it is nearest.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.unseen import why_unseen
from borecheck.motion.least_clearance import least_clearance
from borecheck.motion.outcome import PathVerdict, in_doubt
from borecheck.motion.problem import PathProblem
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


def without_unseen(
    scene: Scene, problem: PathProblem, points: Array, found: PathVerdict
) -> PathVerdict:
    """The same without `clear` where nobody has seen what is nearest.

    Args:
        scene: What stands around the robot.
        problem: Its obstacles are those of the scene, in order.
        points: The waypoints, (k, n).
        found: What is known of the obstacles, with the least clearance if that is.
    """
    if not found.clear:
        return found
    for k, obstacle in scene.unseen.items():
        least = found.least
        if least is None or least.pair[1] != k:
            least = least_clearance(_with_only(problem, k), points, found)
        closest = None if least is None else least.closest_to(obstacle.role)
        reason = why_unseen(obstacle, closest)
        if reason is not None:
            return in_doubt(found, reason)
    return found


def _with_only(problem: PathProblem, obstacle: int) -> PathProblem:
    """The robot, and one of the obstacles alone."""
    others = set(range(len(problem.obstacles))) - {obstacle}
    excluded = {(i, j) for i in range(len(problem.parts)) for j in others}
    return replace(problem, self_pairs=(), excluded=problem.excluded | excluded)
