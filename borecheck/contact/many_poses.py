"""Contact at many configurations in one call: kinematics and search both compiled.

The placements come from the compiled chain, which agrees with Pinocchio to rounding
(tests hold it to 1e-12); a verdict with reasons for one pose is `contact.check`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.pose_batch import prepared
from borecheck.contact.pose_book import FREE
from borecheck.errors import JointLimitError, UsageError
from borecheck.robots.given import Given, configurations, refuse_others
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


def first_contacts(
    robot: Robot,
    scene: Scene,
    qs: ArrayLike | Sequence[Given],
    *,
    narrowphase: str = "exact",
    containment: bool = True,
    threads: int = 1,
) -> NDArray[np.bool_]:
    """Whether the robot touches anything, itself included, at each configuration, (n,).

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        qs: Configurations, (n, joints), [m] and [rad].
        narrowphase: exact, two-sided, paper:robot or paper:scanner.
        containment: Whether to ask also if a solid holds another; most of the time
            goes there. A surface that is open, or whose parts cancel, and might hold
            something counts as contact.
            False: surfaces only, for who knows that nothing starts inside.
        threads: How many poses are worked on at once.

    Raises:
        UsageError: Wrong shape or numbers that are not finite; or the unit of an
            obstacle was guessed, and a bare "no contact" could not say so.
        JointLimitError: A configuration beyond a joint limit: which one.
    """
    refuse_others(robot, scene)
    if scene.doubt is not None:
        raise UsageError(scene.doubt)
    batch = prepared(robot, scene)
    asked_at = as_configurations(robot, qs)
    asked = batch.ask(asked_at, narrowphase, solids=containment, threads=threads)
    if asked.beyond:
        refuse_beyond_limits(robot, asked_at)
    return asked.states != FREE


def as_configurations(robot: Robot, qs: ArrayLike | Sequence[Given]) -> Array:
    """A copy of qs (n, joints), of the right shape and finite; limits are not asked.

    Raises:
        UsageError: Wrong shape or numbers that are not finite.
    """
    return np.ascontiguousarray(configurations(robot, qs))


def refuse_beyond_limits(robot: Robot, configurations: Array) -> None:
    """Names the first configuration with a free or mimic joint beyond its limits.

    Raises:
        JointLimitError: If there is one.
    """
    beyond = robot.model.beyond_limits(configurations)
    if beyond.any():
        k = int(np.argmax(beyond))
        try:
            robot.model.check_limits(configurations[k])
        except JointLimitError as error:
            raise JointLimitError(f"configuration {k}: {error}") from error
