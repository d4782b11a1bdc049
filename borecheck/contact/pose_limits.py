"""Joint limits as kernels take them."""

import numpy as np

from borecheck.contact.pose_book import Limits
from borecheck.robots.model import LIMIT_TOLERANCE
from borecheck.robots.robot import Robot


def limits_of(robot: Robot) -> Limits:
    """Limits of every joint that can move, mimic joints too, with their tolerance."""
    model = robot.model
    rows = [
        (*model.driver(joint.name, joint.type), *limits)
        for joint, limits in model.moving_limits()
    ]
    table = np.array(rows, np.float64).reshape(-1, 5)
    return Limits(
        np.ascontiguousarray(table[:, 0].astype(np.int64)),
        np.ascontiguousarray(table[:, 1]),
        np.ascontiguousarray(table[:, 2]),
        np.ascontiguousarray(table[:, 3] - LIMIT_TOLERANCE),
        np.ascontiguousarray(table[:, 4] + LIMIT_TOLERANCE),
    )
