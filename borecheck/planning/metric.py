"""How far apart two configurations are, in metres: the largest motion of any point."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.motion.bounds import gains, route
from borecheck.motion.problem import PathProblem
from borecheck.robots.kinematics.forward import WORLD
from borecheck.robots.model import RobotModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Metric:
    """A bound on how far any point of the robot goes between two configurations, [m].

    Metres of a slide and radians of a hinge are not to be added; what they do to the
    robot's points is. Of each part, every joint before it counts with the largest
    reach that the part can have from it, anywhere within the limits.

    Attributes:
        reach: What a change of each joint moves a part by at most, (parts, joints),
            [m/rad] or 1.
    """

    reach: Array

    def between(self, a: ArrayLike, b: ArrayLike) -> Array:
        """Distances (...,) of configurations (..., joints), [m]."""
        change = np.abs(np.asarray(b) - np.asarray(a))
        return np.asarray((change @ self.reach.T).max(axis=-1, initial=0.0))

    @property
    def scale(self) -> Array:
        """What a change of each joint moves any point by at most, (joints,)."""
        largest = self.reach.max(axis=0, initial=0.0)
        return np.asarray(np.where(largest > 0.0, largest, 1.0))  # it moves nothing

    def length(self, way: ArrayLike) -> float:
        """Length of a way through configurations (k, joints), [m]."""
        points = np.asarray(way)
        return float(self.between(points[:-1], points[1:]).sum())


def metric_of(problem: PathProblem, model: RobotModel) -> Metric:
    """The metric of a robot as the certified search sees it."""
    chain = problem.chain
    low, high = sampled_box(model, np.zeros(len(model.free_joints)))
    largest = np.abs(chain.thetas(np.array([low, high]))).max(axis=0)
    reach = np.zeros((len(problem.parts), len(low)))
    for row, part in zip(reach, problem.parts, strict=True):
        way = route(chain, WORLD, part.frame)
        gain = gains(chain, way, part.radius, largest)
        for j, g in zip(way.joints, gain, strict=True):
            if chain.source[j] >= 0:
                row[chain.source[j]] += g * abs(chain.factor[j])
    return Metric(reach)


def sampled_box(model: RobotModel, about: Array) -> tuple[Array, Array]:
    """Where configurations are sampled: the limits; of what turns on, one turn about.

    Args:
        model: The robot's joints.
        about: A configuration, (joints,).
    """
    turns = np.array([joint.type == "continuous" for joint in model.free_joints])
    low = np.where(turns, about - np.pi, model.lower)
    high = np.where(turns, about + np.pi, model.upper)
    return low, high
