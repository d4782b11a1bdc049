"""Boxes in the world round placed meshes, and how far they are apart."""

import numpy as np

from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.geometry.tree.boxes import ROOT, child_box


@kernel
def world_boxes(nodes, frames, placements, i, reach):  # type: ignore[no-untyped-def]
    """Boxes in the world round all meshes of pose i, low and high, (k, 2, 3).

    The box of the whole mesh, turned: it grows by more than what float64 is off by.
    """
    for k in range(len(frames)):
        cx, cy, cz, hx, hy, hz = child_box(nodes, 8 * int(frames[k, ROOT]))
        x, y, z = cx + frames[k, 0], cy + frames[k, 1], cz + frames[k, 2]
        size = abs(x) + abs(y) + abs(z) + hx + hy + hz
        for r in range(3):
            u, v, w = (
                placements[i, k, r, 0],
                placements[i, k, r, 1],
                placements[i, k, r, 2],
            )
            t = placements[i, k, r, 3]
            middle = u * x + v * y + w * z + t
            half = abs(u) * hx + abs(v) * hy + abs(w) * hz
            half += 1e-12 * (size + abs(t))
            reach[k, 0, r], reach[k, 1, r] = middle - half, middle + half


@kernel(**INLINE)
def gap_between(reach_a, a, reach_b, b):  # type: ignore[no-untyped-def]
    """Distance between two boxes, 0 if they meet; rounded down."""
    square = 0.0
    for r in range(3):
        gap = max(
            reach_a[a, 0, r] - reach_b[b, 1, r], reach_b[b, 0, r] - reach_a[a, 1, r]
        )
        square += max(0.0, gap) ** 2
    return np.sqrt(square) * (1.0 - 1e-12)
