"""Is a tree read from a file a tree of this mesh? Kernels check nothing of it.

A wrong reference would read foreign memory; a box that does not hold its triangles, or
a triangle that no way leads to, would lose a contact in silence.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.tree.build import (
    CHILD_ROW,
    NO_BOX,
    ROWS,
    WIDTH,
    TreeArrays,
    frame_of,
)

# How far boxes are rounded outwards: see `build`.
_ROUNDED, _SMALLEST = 1e-5, 1e-30


def is_sound(tree: TreeArrays, corners: NDArray[np.float64]) -> bool:
    """Whether every triangle is reached, and held by each box on the way to it.

    Args:
        tree: What the file holds.
        corners: The mesh's triangles, (m, 9), [m].
    """
    if not _has_shape(tree, len(corners)):
        return False
    points = corners.reshape(-1, 3, 3)
    if not np.array_equal(tree.frame, frame_of(points)):
        return False
    leaves = points[tree.order] - tree.frame[:3]
    references = tree.nodes.view(np.int32)[:, CHILD_ROW]
    lower, upper = leaves.min(axis=1), leaves.max(axis=1)
    room = tree.frame[3] * (1.0 + _ROUNDED) + _SMALLEST
    return bool(_depth(tree.nodes, references, lower, upper, room) == tree.depth)


def _has_shape(tree: TreeArrays, count: int) -> bool:
    """Whether all references stay inside the arrays and name each thing once."""
    shapes = tree.nodes.ndim == 3 and tree.nodes.shape[1:] == (ROWS, WIDTH)
    if not (shapes and len(tree.nodes) and tree.frame.shape == (4,)):
        return False
    if tree.order.shape != (count,) or tree.order.min() < 0:
        return False
    if (np.bincount(tree.order, minlength=count) != 1).any():
        return False
    used = tree.nodes[:, 3] >= 0.0
    references = tree.nodes.view(np.int32)[:, CHILD_ROW][used]
    children, leaves = references[references >= 0], ~references[references < 0]
    inside = np.array_equal(np.sort(children), np.arange(1, len(tree.nodes)))
    return inside and np.array_equal(np.sort(leaves), np.arange(count))


@kernel
def _depth(nodes, references, lower, upper, room):  # type: ignore[no-untyped-def]
    """Nodes on the longest way down, or -1 where a box or an order is wrong.

    Nodes stand behind those that refer to them, so there is no circle, and the way
    back over the list meets every node after all that is below it.

    Args:
        nodes: The tree's boxes.
        references: Their references, (n, 8), in range.
        lower: Least coordinates of every leaf's triangle, from the centre, (m, 3).
        upper: Largest ones.
        room: No box reaches beyond: comparisons of larger numbers allow too little.
    """
    count = len(nodes)
    bounds = np.empty((count, 2, 3))
    depths = np.zeros(count, np.int64)
    for node in range(count - 1, -1, -1):
        bounds[node, 0], bounds[node, 1] = np.inf, -np.inf
        for slot in range(WIDTH):
            if not nodes[node, 3, slot] >= 0.0:
                for row in range(3, 6):
                    if nodes[node, row, slot] != NO_BOX:
                        return -1
                continue
            child = references[node, slot]
            if 0 <= child <= node:
                return -1
            deep = depths[child] if child >= 0 else 0
            depths[node] = max(depths[node], deep + 1)
            for d in range(3):
                low = bounds[child, 0, d] if child >= 0 else lower[~child, d]
                high = bounds[child, 1, d] if child >= 0 else upper[~child, d]
                centre = np.float64(nodes[node, d, slot])
                half = np.float64(nodes[node, 3 + d, slot])
                if not (centre - half <= low and high <= centre + half):
                    return -1
                if not abs(centre) + half <= room:
                    return -1
                bounds[node, 0, d] = min(bounds[node, 0, d], low)
                bounds[node, 1, d] = max(bounds[node, 1, d], high)
    return depths[0]
