"""Fewer triangles for display: vertices of one cell of a grid become one."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# Halvings of the cell size; beyond them the count changes by a few per cent only.
_STEPS = 7


def thinned(vertices: Array, triangles: Ids, most: int) -> tuple[Array, Ids, float]:
    """A coarser surface with at most `most` triangles.

    Args:
        vertices: (n, 3), [m].
        triangles: (m, 3), indices of vertices.
        most: How many triangles may be left.

    Returns:
        Vertices, triangles, and how far a vertex moved at most, [m].
    """
    low = float(np.ptp(vertices, axis=0).max()) / 2048.0
    high = low
    best = _clustered(vertices, triangles, high)
    while len(best[1]) > most:
        low, high = high, 2.0 * high
        best = _clustered(vertices, triangles, high)
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        trial = _clustered(vertices, triangles, middle)
        if len(trial[1]) > most:
            low = middle
        else:
            high, best = middle, trial
    return best


def _clustered(
    vertices: Array, triangles: Ids, cell: float
) -> tuple[Array, Ids, float]:
    places = np.floor((vertices - vertices.min(axis=0)) / cell).astype(np.int64)
    size = places.max(axis=0) + 1
    keys = (places[:, 0] * size[1] + places[:, 1]) * size[2] + places[:, 2]
    _, group = np.unique(keys, return_inverse=True)
    count = np.bincount(group)
    means = np.stack([np.bincount(group, vertices[:, k]) / count for k in range(3)], 1)
    moved = float(np.linalg.norm(vertices - means[group], axis=1).max())
    corners = group[triangles]
    a, b, c = corners.T
    corners = corners[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(corners, axis=1), axis=0, return_index=True)
    return means, corners[np.sort(first)], moved
