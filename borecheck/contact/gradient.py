"""How the clearance changes with every joint: nearest points and the Jacobian."""

import numpy as np
from numpy.typing import NDArray

from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS, WORLD

Array = NDArray[np.float64]


def of_distance(
    chain: JointChain,
    placed: Array,
    frame: int,
    on_link: Array,
    on_obstacle: Array,
) -> Array:
    """Derivative of the distance of two nearest points by every entry of q, (joints,).

    The point on the link moves with it, that on the obstacle stands still. That the
    nearest points wander over their surfaces changes nothing to first order.

    Args:
        chain: The robot's.
        placed: T_world_frame of every frame, (n, 4, 4).
        frame: The link's.
        on_link: Nearest point of the link, (3,), world, [m].
        on_obstacle: Nearest point of the obstacle, (3,), world, [m].
    """
    away = (on_link - on_obstacle) / np.linalg.norm(on_link - on_obstacle)
    gradient = np.zeros(chain.joint_count)
    while frame != WORLD:
        kind, T = chain.kind[frame], placed[frame]
        # Turning about an axis and sliding along it leave its direction as it is.
        axis = T[:3, :3] @ chain.axis[frame]
        if kind == TURNS:
            velocity = np.cross(axis, on_link - T[:3, 3])
        elif kind == SLIDES:
            velocity = axis
        else:
            velocity = np.zeros(3)
        if kind in (TURNS, SLIDES):
            change = chain.factor[frame] * float(away @ velocity)
            gradient[chain.source[frame]] += change
        frame = int(chain.parent[frame])
    return gradient
