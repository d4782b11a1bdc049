"""The motion of a needle plan in a scene: of several ways the one with most room."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.queries import Queries, queries
from borecheck.core.once import once_per_pair
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import PlanMotion, plan_motion
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

# How well clearances are known to choose by, relative.
WITHIN = 0.1
# Ranks a configuration in which the robot touches itself behind all others, [m].
TOUCHES = 10.0


def needle_motion(robot: Robot, scene: Scene, plan: NeedlePlan) -> PlanMotion:
    """The motion that carries out a plan.

    An arm that can reach it in several ways takes the one with most room to what stands
    around it; which one that is decides nothing about the verdict.

    Raises:
        UsageError, UnreachableError: See `plan_motion`.
    """
    if scene.doubt is not None or not scene.obstacles:
        return plan_motion(robot, plan)
    return plan_motion(robot, plan, room=partial(_room, robot, scene))


def _room(robot: Robot, scene: Scene, qs: Array) -> Array:
    """Distance to the nearest obstacle, without needle and patients, (k,), [m]."""
    asked = _without_needle(robot, scene)
    room = asked.clearance(qs, within=WITHIN)[:, 0]
    return np.where(asked.touches(qs), np.minimum(room, 0.0) - TOUCHES, room)


@once_per_pair
def _asked(robot: Robot, scene: Scene, link: str) -> Queries:
    patients = [o.name for o in scene.obstacles if o.role == "patient"]
    return queries(robot, scene, skip=[(link, name) for name in patients])


def _without_needle(robot: Robot, scene: Scene) -> Queries:
    return _asked(robot, scene, robot.needle_with_tip().link)
