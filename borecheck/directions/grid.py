"""Cells of a map on their finest grid: who is where, and which hang together."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from borecheck.directions.leaves import Leaves

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Grid:
    """The finest grid that all cells of a map are made of.

    Attributes:
        leaves: The cells.
        limits: Of the chart, (2, 2), [rad].
    """

    leaves: Leaves
    limits: Array

    @cached_property
    def step(self) -> Array:
        """Widths of the finest cells, (2,), [rad]."""
        return np.asarray((self.leaves.high - self.leaves.low).min(axis=0))

    @cached_property
    def owner(self) -> Ids:
        """The cell of every place of the grid, (a, b)."""
        shape = np.round((self.limits[1] - self.limits[0]) / self.step).astype(int)
        owner = np.full(shape, -1)
        begin = np.round((self.leaves.low - self.limits[0]) / self.step).astype(int)
        end = np.round((self.leaves.high - self.limits[0]) / self.step).astype(int)
        for k, ((a, b), (c, d)) in enumerate(zip(begin, end, strict=True)):
            owner[a:c, b:d] = k
        return owner

    def cell_at(self, angles: Array) -> Ids:
        """The cell that holds coordinates (k, 2), (k,); -1 outside the chart."""
        with np.errstate(invalid="ignore"):
            outside = ~((angles >= self.limits[0]) & (angles <= self.limits[1])).all(1)
        inside = np.where(outside[:, None], self.limits[0], angles)
        place = np.floor((inside - self.limits[0]) / self.step).astype(int)
        place = np.clip(place, 0, np.array(self.owner.shape) - 1)
        return np.where(outside, -1, self.owner[place[:, 0], place[:, 1]])

    def regions(self, state: int) -> list[Ids]:
        """Cells of one state that hang together over edges, region by region."""
        left = {int(k) for k in np.flatnonzero(self.leaves.state == state)}
        beside = self._neighbours
        found = []
        while left:
            region, waiting = [], [left.pop()]
            while waiting:
                cell = waiting.pop()
                region.append(cell)
                more = beside.get(cell, set()) & left
                left -= more
                waiting.extend(more)
            found.append(np.array(sorted(region)))
        return found

    @cached_property
    def _neighbours(self) -> dict[int, set[int]]:
        """Cells that share an edge with each."""
        a, b = self.owner, self.leaves.state[self.owner]
        pairs = []
        for first, second, same in (
            (a[1:], a[:-1], b[1:] == b[:-1]),
            (a[:, 1:], a[:, :-1], b[:, 1:] == b[:, :-1]),
        ):
            chosen = same & (first != second)
            pairs.append(np.stack([first[chosen], second[chosen]], axis=1))
        beside: dict[int, set[int]] = {}
        for x, y in np.unique(np.concatenate(pairs), axis=0).tolist():
            beside.setdefault(x, set()).add(y)
            beside.setdefault(y, set()).add(x)
        return beside
