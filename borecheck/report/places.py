"""Where a pose is decided, and from where it is seen best.

The page's panes look at the same places in the same way: web/src/places.js.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Plan = tuple[Sequence[float], Sequence[float]]

# Frame of the narrowest place, [m]: ten times the gap, within these.
LEAST_FRAME, MOST_FRAME = 0.06, 0.3


@dataclass(frozen=True, eq=False)
class Place:
    """A place worth looking at.

    Attributes:
        at: The place, (3,), [m].
        axis: Unit vector across the gap or into the surface that is touched, if known.
        frame: The length worth seeing there, [m].
    """

    at: Array
    axis: Array | None
    frame: float


def place_of(
    closest: Mapping[str, Any] | None, lit: Array, plan: Plan | None
) -> Place | None:
    """The contact, else the closest pair, else the middle of the plan.

    Args:
        closest: The closest pair, if known.
        lit: Corners of triangles in contact, (n, 2, 3, 3), the robot's first.
        plan: Entry and target.
    """
    if len(lit):
        sizes = np.ptp(lit, axis=2).max(axis=2)
        k = int(np.argmin(sizes.min(axis=1)))
        small = lit[k, int(np.argmin(sizes[k]))]
        middle = (small.min(axis=0) + small.max(axis=0)) / 2.0
        return Place(middle, _normal(lit[k, 1]), MOST_FRAME)
    if closest is not None:
        a, b = np.array(closest["points"], dtype=np.float64)
        gap = float(np.linalg.norm(b - a))
        if gap == 0.0:
            return Place(a, None, MOST_FRAME)
        frame = max(LEAST_FRAME, 2.5 * gap, min(10.0 * gap, MOST_FRAME))
        return Place((a + b) / 2.0, (b - a) / gap, frame)
    if plan is not None:
        return Place(np.mean(np.array(plan), axis=0), None, MOST_FRAME)
    return None


def _normal(triangle: Array) -> Array | None:
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    length = float(np.linalg.norm(normal))
    return normal / length if length > 0.0 else None


def across(axis: Array | None, ahead: float, near: float) -> Array:
    """A direction of looking across which the gap lies, almost along the bore.

    Args:
        axis: Unit vector across the gap, or None.
        ahead: 1 from the end of the bore where x is least, -1 from the other one.
        near: Which side of the y axis the eye is on, 1 or -1.
    """
    wanted = np.array([[ahead, -0.35 * near, -0.3], [0.35 * ahead, -near, -0.3]])
    if axis is not None:
        wanted -= np.outer(wanted @ axis, axis)
    best = wanted[0] if np.linalg.norm(wanted[0]) > 0.4 else wanted[1]
    direction: Array = best / np.linalg.norm(best)
    return direction
