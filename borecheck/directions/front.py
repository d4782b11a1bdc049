"""The cells that a map is still at work on, and how they are split."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.directions.leaves import Leaves
from borecheck.directions.questions import Questions
from borecheck.directions.setup import MapSetup

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Cells of the first round are about so wide, [rad].
FIRST = np.radians(30.0)


@dataclass(frozen=True, eq=False)
class Front:
    """Cells of one size that are not decided, and what is left to ask of them.

    Attributes:
        leaves: The cells.
        skin_cell: Candidates of the skin: their cell, (c,).
        skin_triangle: And their triangle.
        near: A lower bound of the skin's distance in every cell, (k,), [m].
        was_asked: Whether `left` is all that is open of a cell, (k,).
        left: Pairs and ranges that are open.
    """

    leaves: Leaves
    skin_cell: Ids
    skin_triangle: Ids
    near: Array
    was_asked: Bools
    left: Questions


def first_front(setup: MapSetup) -> Front:
    """The whole chart in large cells, of which nothing is known."""
    low, high = first_cells(setup.limits)
    cell, triangle = setup.skin.all_triangles(len(low))
    return Front(
        Leaves.unknown(low, high),
        cell,
        triangle,
        np.full(len(low), setup.skin.near),
        np.zeros(len(low), np.bool_),
        Questions.none(),
    )


def first_cells(limits: Array) -> tuple[Array, Array]:
    """Cells about as wide as FIRST that tile the chart: low and high ends, (k, 2)."""
    counts = np.maximum(np.round((limits[1] - limits[0]) / FIRST), 1).astype(int)
    edges = [np.linspace(limits[0, k], limits[1, k], counts[k] + 1) for k in range(2)]
    low = np.array([(a, b) for a in edges[0][:-1] for b in edges[1][:-1]])
    high = np.array([(a, b) for a in edges[0][1:] for b in edges[1][1:]])
    return low, high


def children(front: Front, split: Ids) -> Front:
    """Four cells of each that is split, with what is open of it."""
    parents = front.leaves.take(split)
    middle = parents.centre
    edges = np.stack([parents.low, middle, parents.high])
    low, high = [], []
    for a in range(2):
        for b in range(2):
            low.append(np.stack([edges[a, :, 0], edges[b, :, 1]], axis=1))
            high.append(np.stack([edges[a + 1, :, 0], edges[b + 1, :, 1]], axis=1))
    leaves = Leaves.unknown(np.concatenate(low), np.concatenate(high))
    count = len(split)
    number = np.full(len(front.leaves), -1)
    number[split] = np.arange(count)
    kept = np.flatnonzero(number[front.skin_cell] >= 0)
    cell, triangle = number[front.skin_cell[kept]], front.skin_triangle[kept]
    asked = front.left.take(number[front.left.cell] >= 0)
    asked = asked.with_cells(number[asked.cell])
    return Front(
        leaves,
        np.concatenate([cell + k * count for k in range(4)]),
        np.tile(triangle, 4),
        np.tile(front.near[split], 4),
        np.tile(front.was_asked[split], 4),
        Questions.joined([asked.with_cells(asked.cell + k * count) for k in range(4)]),
    )
