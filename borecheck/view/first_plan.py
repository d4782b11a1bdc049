"""A needle plan to begin with: where the patient is highest, straight down."""

import numpy as np
from numpy.typing import NDArray

from borecheck.plans.needle_plan import NeedlePlan
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


def first_plan(robot: Robot, scene: Scene) -> NeedlePlan:
    """A plan to begin with: 60 mm straight down from the patient's top, or from 0."""
    top = 0.0
    for obstacle in scene.obstacles:
        if obstacle.role == "patient":
            low, high = obstacle.mesh.bounds
            if low[0] < 0.0 < high[0] and low[1] < 0.0 < high[1]:
                top = _height_at_axis(obstacle.mesh.corners)
    return NeedlePlan(
        "live", np.array([0.0, 0.0, top]), np.array([0.0, 0.0, top - 0.06])
    )


def _height_at_axis(corners: Array) -> float:
    """Where a vertical line through the origin leaves a surface at its top, [m]."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v, w = _cross(b, c), _cross(c, a), _cross(a, b)
    area = u + v + w
    hit = (area != 0.0) & (
        ((u >= 0) & (v >= 0) & (w >= 0)) | ((u <= 0) & (v <= 0) & (w <= 0))
    )
    if not hit.any():
        return 0.0
    z = (u * a[:, 2] + v * b[:, 2] + w * c[:, 2])[hit] / area[hit]
    return float(z.max())


def _cross(p: Array, q: Array) -> Array:
    product: Array = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    return product
