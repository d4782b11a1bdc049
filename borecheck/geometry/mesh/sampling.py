"""Points spread over a surface and directions spread over a sphere, always the same."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Two irrational steps fill the unit square evenly (the R2 sequence).
_STEPS = (0.7548776662466927, 0.5698402909980532)


def points_on_triangles(corners: Array, count: int) -> Array:
    """Points spread over triangles by area.

    Args:
        corners: Of the triangles, (m, 3, 3).
        count: How many points.

    Returns:
        (count, 3); fewer if no triangle has an area.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    total = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1))
    if not total[-1] > 0.0:
        return np.array(a[:count])
    k = np.arange(count)
    at = (k + 0.5) / count * total[-1]
    pick = np.minimum(np.searchsorted(total, at), len(corners) - 1)
    u, v = (np.modf(k * step)[0] for step in _STEPS)
    flip = u + v > 1.0
    u, v = np.where(flip, 1.0 - u, u)[:, None], np.where(flip, 1.0 - v, v)[:, None]
    return np.asarray(a[pick] + u * (b - a)[pick] + v * (c - a)[pick])


def directions_on_sphere(count: int) -> Array:
    """Unit vectors spread evenly (golden spiral), (count, 3)."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + 5.0**0.5) * k
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
