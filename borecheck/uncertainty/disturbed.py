"""The robot when joints, dimensions and registration are off by a little."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import inverse
from borecheck.motion.bounds import refuse_skewed
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.robot import Robot
from borecheck.uncertainty.covariance import REGISTRATION, Uncertainty
from borecheck.uncertainty.dimensions import STEP, dimensions_of, rotation

Array = NDArray[np.float64]


class Disturbance:
    """What errors x do to a robot, in the order of `uncertainty.names`.

    Joints are off by the same amount at every configuration, dimensions change the
    chain and the parts, registration moves the whole robot.

    Args:
        robot: The robot.
        uncertainty: Which quantities are off.

    Raises:
        UsageError: A dimension that does not act in proportion to its error.
    """

    def __init__(self, robot: Robot, uncertainty: Uncertainty) -> None:
        self.robot, self.uncertainty = robot, uncertainty
        self.frame_of, self.nominal = chain_of(robot)
        refuse_skewed(self.nominal)
        self.dimensions = dimensions_of(robot, uncertainty.dimensions)
        names = robot.model.joint_names
        self.places = [names.index(name) for name in uncertainty.joints.names]
        n, m = len(self.places), len(uncertainty.dimensions.names)
        self.of_joints = slice(0, n)
        self.of_dimensions = slice(n, n + m)
        self.of_registration = slice(n + m, len(uncertainty.names))

    def joints(self, x: Array) -> Array:
        """By how much every joint of the robot is off, (joints,)."""
        off = np.zeros(len(self.robot.model.joint_names))
        off[self.places] = x[self.of_joints]
        return off

    def registration(self, x: Array) -> Array:
        """By how much the robot is shifted and turned about the origin, (6,)."""
        off = np.zeros(6)
        names = self.uncertainty.registration.names
        off[[REGISTRATION.index(n) for n in names]] = x[self.of_registration]
        return off

    def chain(self, x: Array) -> JointChain:
        """The chain with dimensions and registration off; joints are not in it."""
        chain = self.dimensions.applied(self.nominal, x[self.of_dimensions])
        off = self.registration(x)
        if not off.any():
            return chain
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotation(off[3:]), off[:3]
        origin = chain.origin.copy()
        origin[0] = T @ origin[0]
        return replace(chain, origin=origin)


@dataclass(frozen=True, eq=False)
class Twist:
    """Rate of a link's motion: velocity at the scene's origin, angular velocity."""

    linear: Array
    angular: Array

    def at(self, point: Array) -> Array:
        """Velocity of the link's point, (3,), per unit of the quantity."""
        return self.linear + np.cross(self.angular, point)


class Disturbed:
    """A robot at q whose quantities are off by x, in the order of `uncertainty.names`.

    Args:
        robot: The robot.
        q: Configuration in the order of the model, (n,).
        uncertainty: Which quantities are off.
    """

    def __init__(self, robot: Robot, q: ArrayLike, uncertainty: Uncertainty) -> None:
        self.robot = robot
        self.q = robot.model.check_configuration(q)
        self.uncertainty = uncertainty
        self._disturbance = Disturbance(robot, uncertainty)
        self.nominal = self.placements(np.zeros(len(uncertainty.names)))
        self._twists = [self._twist(k) for k in range(len(uncertainty.names))]

    def placements(self, x: ArrayLike) -> dict[str, Array]:
        """T_scene_link (4, 4) of every link, the quantities being off by x."""
        off = np.asarray(x, dtype=np.float64)
        q = self.q + self._disturbance.joints(off)
        chain = self._disturbance.chain(off)
        frames = chain.placed(chain.thetas(q))
        return {link: frames[k] for link, k in self._disturbance.frame_of.items()}

    def gradient(self, link: str, point: Array, normal: Array) -> Array:
        """How a point of a link moves along `normal` with every quantity, (n,)."""
        return np.array([normal @ twists[link].at(point) for twists in self._twists])

    def _twist(self, k: int) -> dict[str, Twist]:
        step = STEP * np.eye(len(self.uncertainty.names))[k]
        return _twists(self.placements(-step), self.placements(step))


def _twists(behind: dict[str, Array], ahead: dict[str, Array]) -> dict[str, Twist]:
    """Twist of every link by the difference over 2 STEP."""
    found = {}
    for link, T in ahead.items():
        change = T @ inverse(behind[link])
        skew = 0.5 * (change[:3, :3] - change[:3, :3].T)
        angular = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
        found[link] = Twist(change[:3, 3] / (2.0 * STEP), angular / (2.0 * STEP))
    return found
