"""Arms without a family, but with a closed form: all its branches.

Where the closed form gives every branch, and something stands against each of them that
no turn about the needle would change, that is a proof.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import inverse
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import inverse_of
from borecheck.robots.description import Solutions
from borecheck.robots.robot import Robot
from borecheck.setup.candidates import Tried, noted
from borecheck.setup.family import rotated
from borecheck.setup.mechanics import twists
from borecheck.setup.terms import LIMITS, NO_ANSWER, Terms, links_moved_by

Array = NDArray[np.float64]

# Turns about the needle that are tried where a joint does nothing else.
ROLLS = 12
# A joint whose unit of motion moves the needle by less, [m] and [rad], turns about it.
NO_MOTION = 1e-9


def enumerated(terms: Terms, plan: NeedlePlan) -> Tried:
    """Every branch of the description's inverse, turns about the needle with it."""
    robot = terms.robot
    found = _closed_form(robot, plan)
    tried = Tried(complete=bool(getattr(found, "complete", False)))
    tried.add([LIMITS if tried.complete else NO_ANSWER] * len(found.rejected))
    tried.said = found.rejected
    for q in _in_urdf(robot, found):
        rolls = rolling(robot, q)
        rolled = _rolled(robot, q, rolls)
        codes = terms.broken(rolled)
        tried.add(codes)
        noted(terms, tried, rolled, codes, plan)
        if rolls and not _whatever_the_roll(terms, rolled, rolls[0]):
            tried.complete = False
    return tried


def none_tilted(terms: Terms, plan: NeedlePlan, turn: Array) -> bool:
    """Whether no branch keeps the constraints with the needle turned, proven.

    Args:
        terms: What is asked.
        plan: The needle.
        turn: Rotation vector about its entry, (3,), [rad].
    """
    way = plan.length * rotated(turn[None], plan.direction)[0]
    tried = enumerated(terms, replace(plan, target=plan.entry + way))
    return tried.complete and not tried.best


def _whatever_the_roll(terms: Terms, qs: Array, joint: int) -> bool:
    """Whether what stands against a branch does not depend on a turn of that joint."""
    moved = links_moved_by(terms.robot, terms.robot.model.joint_names[joint])
    return bool(terms.stand_without(qs[:1], moved)[0])


def _closed_form(robot: Robot, plan: NeedlePlan) -> Solutions:
    """What the description's inverse says at the entry, the drive retracted."""
    description = robot.description
    assert description is not None  # who has a closed form has a description
    T = inverse(robot.T_scene_base)
    tip = T[:3, :3] @ plan.entry + T[:3, 3]
    arguments = {n: robot.arguments[n] for n in description.closed_form_arguments}
    held = _retracted(robot)
    found: Solutions = inverse_of(description)(
        tip, T[:3, :3] @ plan.direction, 0.0 if held is None else held, **arguments
    )
    return found


def _retracted(robot: Robot) -> float | None:
    """Where the insertion joint stands before it drives the needle, [m]."""
    name = robot.needle_with_tip().insertion
    if name is None:
        return None
    return float(robot.model.lower[robot.model.joint_names.index(name)])


def _in_urdf(robot: Robot, found: Solutions) -> list[Array]:
    description = robot.description
    assert description is not None
    return [
        robot.model.configuration(
            {
                joint.name: joint.sign * float(value) + joint.offset
                for joint, value in zip(description.joints, q, strict=True)
            }
        )
        for q in found.configurations
    ]


def _rolled(robot: Robot, q: Array, rolls: list[int]) -> Array:
    """A branch with the joint that only turns about the needle at several places."""
    for joint in rolls[:1]:
        low, high = robot.model.lower[joint], robot.model.upper[joint]
        low, high = (low, high) if np.isfinite(high - low) else (-np.pi, np.pi)
        qs = np.tile(q, (ROLLS + 1, 1))
        qs[1:, joint] = low + (np.arange(ROLLS) + 0.5) / ROLLS * (high - low)
        return qs
    return q[None]


def rolling(robot: Robot, q: Array) -> list[int]:
    """Joints that turn about the needle's own line at q, and move its tip nowhere."""
    moved = twists(robot, q[None])
    turns = np.linalg.norm(moved.angular[0], axis=1)
    tip = np.linalg.norm(moved.linear[0], axis=1)
    tilts = np.linalg.norm(np.cross(moved.angular[0], moved.axis[0]), axis=1)
    only = (turns > 0.5) & (tip < NO_MOTION) & (tilts < NO_MOTION)
    return [int(j) for j in np.flatnonzero(only)]
