"""The plain forms of the published all-pairs algorithm, for comparison only."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from borecheck.geometry.triangles.narrowphase import leaf
from borecheck.geometry.triangles.published import NARROWPHASES, triangle_row

Array = NDArray[np.float64]

_TWO_SIDED = NARROWPHASES["two-sided"]
_CHUNK = 500_000  # pairs at a time


@njit(cache=True, nogil=True, error_model="numpy")
def scalar_loop(alpha, beta):  # type: ignore[no-untyped-def]
    """Contacts among all pairs, one pair after the other."""
    count = 0
    for i in range(len(alpha)):
        a = triangle_row(alpha, i)
        for j in range(len(beta)):
            count += leaf(_TWO_SIDED, a, triangle_row(beta, j))
    return count


def chunked_numpy(alpha: Array, beta: Array) -> int:
    """Contacts of edges of beta through alpha, in blocks that fit into memory."""
    step, count = max(1, _CHUNK // len(beta)), 0
    corners = beta.reshape(-1, 3, 3)
    for k in range(0, len(alpha), step):
        a = alpha[k : k + step].reshape(-1, 1, 3, 3)
        normal = np.cross(a[:, :, 1] - a[:, :, 0], a[:, :, 2] - a[:, :, 0])
        side = np.einsum("iax,ijcx->ijc", normal, corners[None] - a[:, :, :1])
        crossed = ~((side > 0).all(axis=2) | (side < 0).all(axis=2))
        i, j = np.nonzero(crossed)
        count += _edges_through(a[i, 0], corners[j], side[i, j])
    return count


def _edges_through(a: Array, b: Array, side: Array) -> int:
    hit = np.zeros(len(a), dtype=bool)
    for e in range(3):
        p, q = b[:, e], b[:, (e + 1) % 3]
        turns = [
            np.einsum("ij,ij->i", q - p, np.cross(a[:, k] - p, a[:, (k + 1) % 3] - p))
            for k in range(3)
        ]
        same = np.stack(turns)
        inside = (same >= 0).all(axis=0) | (same <= 0).all(axis=0)
        hit |= inside & (side[:, e] * side[:, (e + 1) % 3] <= 0)
    return int(hit.sum())
