"""Where the links are when joints, dimensions and registration are off by a little."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import axis_rotation, inverse
from borecheck.robots.model import RobotModel
from borecheck.robots.robot import Robot, complete_arguments, read_urdf
from borecheck.robots.urdf.reach import ANYWHERE
from borecheck.robots.urdf.xacro import expand
from borecheck.uncertainty.covariance import REGISTRATION, Uncertainty

Array = NDArray[np.float64]

# Step of the differences by which arguments and joints act, [m] or [rad]: rounding
# gives 1e-11 of it, curvature 1e-5 of the derivative.
STEP = 1e-5


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

    Joints and registration act exactly; dimensions through the twist that each gives
    every link at q (their errors are small, and each would need a new model).

    Args:
        robot: The robot.
        q: Configuration in the order of the model, (n,).
        uncertainty: Which quantities are off.
    """

    def __init__(self, robot: Robot, q: ArrayLike, uncertainty: Uncertainty) -> None:
        self.robot = robot
        self.q = robot.model.check_configuration(q)
        self.uncertainty = uncertainty
        self.nominal = robot.placements(self.q)
        self._places = [
            robot.model.joint_names.index(name) for name in uncertainty.joints.names
        ]
        self._joint_twists = [self._by_joint(place) for place in self._places]
        self._dimension_twists = [
            self._by_argument(name) for name in uncertainty.dimensions.names
        ]

    def placements(self, x: ArrayLike) -> dict[str, Array]:
        """T_scene_link (4, 4) of every link, the quantities being off by x."""
        dq, dp, registration = self._split(np.asarray(x, dtype=np.float64))
        q = self.q.copy()
        q[self._places] += dq
        placed = self.robot.placements(q)
        T = _motion(registration[:3], registration[3:])
        if len(dp) == 0:
            return {link: T @ P for link, P in placed.items()}
        return {link: T @ self._moved(link, dp) @ P for link, P in placed.items()}

    def gradient(self, link: str, point: Array, normal: Array) -> Array:
        """How a point of a link moves along `normal` with every quantity, (n,)."""
        rates = [twists[link].at(point) for twists in self._joint_twists]
        rates += [twists[link].at(point) for twists in self._dimension_twists]
        for name in self.uncertainty.registration.names:
            axis = np.eye(3)[REGISTRATION.index(name) % 3]
            turns = name.startswith("r")
            rates.append(np.cross(axis, point) if turns else axis)
        return np.array([normal @ rate for rate in rates])

    def _split(self, x: Array) -> tuple[Array, Array, Array]:
        n, m = len(self._places), len(self._dimension_twists)
        registration = np.zeros(6)
        for value, name in zip(
            x[n + m :], self.uncertainty.registration.names, strict=True
        ):
            registration[REGISTRATION.index(name)] = value
        return x[:n], x[n : n + m], registration

    def _moved(self, link: str, dp: Array) -> Array:
        linear, angular = np.zeros(3), np.zeros(3)
        for value, twists in zip(dp, self._dimension_twists, strict=True):
            linear += value * twists[link].linear
            angular += value * twists[link].angular
        return _motion(linear, angular)

    def _by_joint(self, index: int) -> dict[str, Twist]:
        step = np.zeros(len(self.q))
        step[index] = STEP
        return _twists(
            self.robot.placements(self.q - step), self.robot.placements(self.q + step)
        )

    def _by_argument(self, name: str) -> dict[str, Twist]:
        behind = _with_argument(self.robot, name, -STEP).placements(self.q)
        ahead = _with_argument(self.robot, name, STEP).placements(self.q)
        root = self.robot.T_scene_root
        return _twists(
            {link: root @ T for link, T in behind.items()},
            {link: root @ T for link, T in ahead.items()},
        )


@lru_cache(maxsize=64)
def _with_argument(robot: Robot, name: str, by: float) -> RobotModel:
    """The model with one xacro argument changed; meshes are not looked at."""
    changed = repr(float(robot.arguments[name]) + by)
    arguments = {**robot.arguments, name: changed}
    if robot.description is None:
        text, _ = read_urdf(robot.file, arguments, robot.roots)
    else:
        arguments = complete_arguments(robot.description, arguments)
        text = expand(robot.file, arguments, ANYWHERE).text
    return RobotModel(text, str(robot.file))


def _twists(behind: dict[str, Array], ahead: dict[str, Array]) -> dict[str, Twist]:
    """Twist of every link by the difference over 2 STEP."""
    found = {}
    for link, T in ahead.items():
        change = T @ inverse(behind[link])
        skew = 0.5 * (change[:3, :3] - change[:3, :3].T)
        angular = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
        found[link] = Twist(change[:3, 3] / (2.0 * STEP), angular / (2.0 * STEP))
    return found


def _motion(linear: Array, angular: Array) -> Array:
    """A small motion: turn about the origin by a rotation vector, then move."""
    T = np.eye(4)
    angle = float(np.linalg.norm(angular))
    if angle > 0.0:
        T[:3, :3] = axis_rotation(angular / angle, angle)
    T[:3, 3] = linear
    return T
