"""Forward kinematics as the textbook has it: products of matrices, nothing compiled."""

import numpy as np
from numpy.typing import NDArray

from borecheck.motion.bounds import Route
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS

Array = NDArray[np.float64]


def relative_placement(chain: JointChain, way: Route, theta: Array) -> Array:
    """T_a_b (4, 4) for joint values (n,): by products of matrices."""
    T = np.eye(4)
    for j, forward in zip(way.joints, way.forward, strict=True):
        step = chain.origin[j] @ joint_motion(chain, int(j), float(theta[j]))
        T = T @ (step if forward else np.linalg.inv(step))
    return T


def joint_motion(chain: JointChain, j: int, theta: float) -> Array:
    """The transform of joint j alone, (4, 4)."""
    T = np.eye(4)
    if chain.kind[j] == SLIDES:
        T[:3, 3] = theta * chain.axis[j]
    elif chain.kind[j] == TURNS:
        x, y, z = chain.axis[j]
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        T[:3, :3] += np.sin(theta) * K + (1.0 - np.cos(theta)) * (K @ K)
    return T
