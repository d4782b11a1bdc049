"""Where in a cell contact is looked for, for all of its directions."""

import numpy as np
from numpy.typing import NDArray

from borecheck.directions.questions import Cells, Questions
from borecheck.directions.reach import visited
from borecheck.directions.setup import MapSetup
from borecheck.directions.skin import SkinOfCells
from borecheck.directions.witnesses import Candidates, Witnesses

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# In larger cells points move too far for any to prove contact, [rad].
LARGEST = np.radians(4.0)


class Touching:
    """Looks for witnesses in what is open of cells.

    Args:
        setup: The map's.
    """

    def __init__(self, setup: MapSetup) -> None:
        self._setup = setup
        self._witnesses = Witnesses(setup)

    def of_cells(
        self, cells: Cells, skin: SkinOfCells, left: Questions
    ) -> tuple[Ids, Array]:
        """Witnesses of cells that are in contact everywhere, and their stations.

        Args:
            cells: The cells.
            skin: What is known of their skin.
            left: What is open of them.

        Returns:
            Part, obstacle and point, (k, 3), -1 where there is none; stations, (k,).
        """
        witness = np.full((len(cells), 3), -1)
        station = np.full(len(cells), np.nan)
        nearest = self._nearest(cells, left)
        stations, usable = self._stations(nearest, skin)
        for at in stations:
            rows = np.flatnonzero(usable & (witness[nearest.cell, 0] < 0))
            asked = nearest.take(rows)
            point = self._witnesses.prove(
                cells,
                Candidates(asked.cell, asked.part, asked.obstacle, at[rows]),
            )
            found = asked.take(point >= 0)
            witness[found.cell] = np.stack(
                [found.part, found.obstacle, point[point >= 0]], axis=1
            )
            station[found.cell] = at[rows][point >= 0]
        return witness, station

    def _nearest(self, cells: Cells, left: Questions) -> Questions:
        """Of every small cell the open range that comes nearest, if it may touch."""
        small = cells.half.max(axis=1) <= 0.5 * LARGEST
        # within a range of stations the distance changes by no more than they do
        least = left.near - 0.5 * (left.high - left.low)
        may_touch = (least <= self._setup.asked.margin) & small[left.cell]
        return left.take(may_touch).nearest_of_each()

    def _stations(
        self, nearest: Questions, skin: SkinOfCells
    ) -> tuple[tuple[Array, ...], NDArray[np.bool_]]:
        """Stations to try, which all directions of a cell visit, and where there are.

        The insertion brings what it moves from the approach down to the target; the
        rest of the arm ends at the skin.
        """
        low, high, all_visit = visited(self._setup, skin)
        inserted = self._setup.inserted[nearest.part]
        begin = np.where(inserted, 0.0, low[nearest.cell])
        end = np.maximum(high[nearest.cell], begin)
        middle = np.clip(0.5 * (nearest.low + nearest.high), begin, end)
        return (middle, begin, end), inserted | all_visit[nearest.cell]
