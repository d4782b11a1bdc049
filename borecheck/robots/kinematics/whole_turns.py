"""Whole turns of joints: the same placement, with the joint where it is wanted."""

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from borecheck.robots.kinematics.needle_task import NeedleTask
from borecheck.robots.model import RobotModel

Array = NDArray[np.float64]


def single_turning(model: RobotModel) -> NDArray[np.int64]:
    """Entries of q that turn one joint alone: a whole turn of it changes nothing."""
    drivers = [model.driver(j.name, j.type) for j, _ in model.moving_limits()]
    driven = Counter(source for source, factor, _ in drivers if factor != 0.0)
    return np.array(
        [i for i, j in enumerate(model.free_joints) if j.is_angle and driven[i] == 1],
        dtype=np.int64,
    )


def nearest_turns(
    turning: NDArray[np.int64], qs: Array, near: Array, task: NeedleTask
) -> Array:
    """Configurations (k, n) with turning joints as near as can be to others, (n,).

    Within limits where some number of whole turns is; else half a turn away at most.
    """
    qs = qs.copy()
    for i in turning:
        turn = 2.0 * np.pi
        q = qs[:, i] + turn * np.round((near[i] - qs[:, i]) / turn)
        q = np.where(q > task.upper[i], q - turn, q)
        qs[:, i] = np.where(q < task.lower[i], q + turn, q)
    return qs
