"""Closed surfaces and what they hold, for `verify.check`: numpy only."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def _merged(vertices: Array, triangles: Indices) -> Indices:
    """Triangles by distinct places: vertices at equal coordinates count as one."""
    same = np.unique(vertices, axis=0, return_inverse=True)[1].reshape(-1)
    return np.asarray(same[triangles], dtype=np.int64)


def is_closed(vertices: Array, triangles: Indices) -> bool:
    """Whether every edge is run through as often one way as the other.

    Solids that share an edge, as boxes face to face do, are closed together: what
    winds round a point is then still a whole number of times.
    """
    t = _merged(vertices, triangles)
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]]
    forth, there = np.unique(edges, axis=0, return_counts=True)
    back, again = np.unique(edges[:, ::-1], axis=0, return_counts=True)
    return np.array_equal(forth, back) and np.array_equal(there, again)


def connected_corners(vertices: Array, triangles: Indices) -> Array:
    """One corner of every connected part, (c, 3): labels sink to the smallest."""
    t = _merged(vertices, triangles)
    label = np.arange(int(t.max()) + 1)
    while True:
        least = label[t].min(axis=1)
        before = label.copy()
        np.minimum.at(label, t.reshape(-1), np.repeat(least, 3))
        label = label[label]
        if np.array_equal(label, before):
            break
    roots = np.unique(label[t[:, 0]])
    return np.array(
        [vertices[triangles[np.argmax(label[t[:, 0]] == r), 0]] for r in roots]
    )


def winding_number(point: Array, corners: Array) -> int:
    """How often a closed surface (m, 3, 3) winds round a point that is not on it.

    The sum of the signed solid angles of all triangles (Van Oosterom and Strackee).
    """
    a, b, c = (corners[:, k] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    top = np.einsum("ij,ij->i", a, np.cross(b, c))
    dot = np.einsum
    bottom = la * lb * lc + dot("ij,ij->i", a, b) * lc
    bottom += dot("ij,ij->i", b, c) * la + dot("ij,ij->i", c, a) * lb
    return round(float(np.arctan2(top, bottom).sum()) / (2.0 * np.pi))
