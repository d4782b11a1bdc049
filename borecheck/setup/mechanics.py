"""What a needle's forces ask of the joints, and how well its direction can be changed.

All of many configurations at once, for any chain; torques against the efforts that the
URDF states.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from borecheck.core.once import once_per_record
from borecheck.robots.kinematics.forward import FIXED, SLIDES
from borecheck.robots.kinematics.needle_inverse import NumericalInverse
from borecheck.robots.kinematics.needle_task import NeedleTask
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Twists:
    """How each joint moves the needle, of configurations (n, joints).

    Attributes:
        tip: (n, 3), scene's frame, [m].
        axis: The way it points, (n, 3).
        linear: Velocity of the tip by each joint, (n, joints, 3).
        angular: Angular velocity likewise, (n, joints, 3).
        reach: Distance of the tip from each joint's origin, (n, joints), [m].
    """

    tip: Array
    axis: Array
    linear: Array
    angular: Array
    reach: Array

    @cached_property
    def manipulability(self) -> Array:
        """Mu of [CRANE] eq. (25), (n,): sqrt(det(J J^T)) of the two tilting rows.

        By Cauchy and Binet the sum over pairs of joints of (n . (w_i x w_j))^2, which
        takes no difference of large numbers.
        """
        n = self.axis
        u = np.cross(n, np.eye(3)[np.abs(n).argmin(axis=1)])
        u /= np.linalg.norm(u, axis=1, keepdims=True)
        a = np.einsum("njk,nk->nj", self.angular, u)
        b = np.einsum("njk,nk->nj", self.angular, np.cross(n, u))
        both = a[:, :, None] * b[:, None, :]
        both = both - np.swapaxes(both, 1, 2)
        return np.sqrt(0.5 * np.einsum("nij,nij->n", both, both))

    def torques(self, force: float, moment: float) -> Array:
        """The largest |J^T F| of each joint, (n, joints), [Nm] or [N]; eq. (17).

        Args:
            force: Along the needle, either way, [N].
            moment: About any axis, [Nm].
        """
        along = np.abs(np.einsum("njk,nk->nj", self.linear, self.axis))
        return force * along + moment * np.linalg.norm(self.angular, axis=2)


def twists(robot: Robot, qs: Array) -> Twists:
    """How the joints move a robot's needle at configurations (n, joints)."""
    task = needle_task(robot)
    chain, way = task.chain, task.way
    placed = chain.placements(qs, way)
    T = placed[:, -1]
    tip, axis = T[:, :3, 3], T[:, :3, :3] @ task.axis
    along = (placed[:, :, :3, :3] @ chain.axis[way][:, :, None])[..., 0]
    linear = np.zeros((len(qs), chain.joint_count, 3))
    angular = np.zeros_like(linear)
    reach = np.zeros(linear.shape[:2])
    for k, frame in enumerate(way):
        if chain.kind[frame] == FIXED:
            continue
        j, factor = int(chain.source[frame]), float(chain.factor[frame])
        if chain.kind[frame] == SLIDES:
            linear[:, j] += factor * along[:, k]
            continue
        lever = tip - placed[:, k, :3, 3]
        reach[:, j] = np.linalg.norm(lever, axis=1)
        linear[:, j] += factor * _cross(along[:, k], lever)
        angular[:, j] += factor * along[:, k]
    return Twists(tip, axis, linear, angular, reach)


def _cross(u: Array, v: Array) -> Array:
    """As `np.cross` along the last axis, which takes several times as long."""
    a, b, c = u[..., 0], u[..., 1], u[..., 2]
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=-1)


@once_per_record
def needle_task(robot: Robot) -> NeedleTask:
    """The needle's tip and direction as functions of q.

    Raises:
        UsageError: The robot has no needle with a tip.
    """
    return NumericalInverse.of(robot).task


@once_per_record
def efforts(robot: Robot) -> Array:
    """What each free joint can hold, (joints,), [Nm] or [N]; inf where none is stated.

    A stated effort of 0 is how files say that nobody knows it.
    """
    stated = {}
    for joint in ElementTree.fromstring(robot.urdf_text).iter("joint"):
        limit = joint.find("limit")
        text = None if limit is None else limit.get("effort")
        stated[joint.get("name")] = _effort(text)
    return np.array([stated.get(name, math.inf) for name in robot.model.joint_names])


def _effort(text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        return math.inf
    return value if value > 0.0 else math.inf
