"""Inverse kinematics on needles that are known to be reachable."""

import time
from dataclasses import dataclass

import numpy as np

from borecheck.robots.kinematics.needle_inverse import NumericalInverse
from borecheck.robots.robot import Robot

# A tip that is farther off, [m], or a direction, is a false "found".
FALSE = 1e-9


@dataclass
class Found:
    """What came of all poses of one arm.

    Attributes:
        poses: How many were asked.
        found: For how many a configuration was found.
        branches: Configurations in all.
        tip: The largest error of a tip by Pinocchio, [m].
        turned: That of a unit vector along the needle.
        false: Configurations that are not there, or beyond a limit.
        seconds: For all of them.
    """

    poses: int = 0
    found: int = 0
    branches: int = 0
    tip: float = 0.0
    turned: float = 0.0
    false: int = 0
    seconds: float = 0.0


def solved(robot: Robot, count: int, seed: int) -> Found:
    """Needles of configurations drawn within the limits, asked back.

    Args:
        robot: An arm whose needle has a tip.
        count: How many.
        seed: Of the draws.
    """
    solver = NumericalInverse.of(robot)
    frame, axis = solver.needle.tip or "", solver.needle.axis
    found = Found()
    rng = np.random.default_rng(seed)
    for q in robot.model.random_configurations(rng, count):
        T = robot.placements(q)[frame]
        tip, way = T[:3, 3], T[:3, :3] @ axis
        begun = time.perf_counter()
        answer = solver.solutions(tip, way).configurations
        found.seconds += time.perf_counter() - begun
        found.poses += 1
        found.found += bool(answer)
        found.branches += len(answer)
        for one in answer:
            at = robot.placements(one)[frame]
            off = float(np.linalg.norm(at[:3, 3] - tip))
            turned = float(np.linalg.norm(at[:3, :3] @ axis - way))
            beyond = bool(robot.model.beyond_limits(one[None])[0])
            found.tip, found.turned = max(found.tip, off), max(found.turned, turned)
            found.false += beyond or off > FALSE or turned > FALSE
    return found
