"""A scan's tissue as cells of one size, which hold every voxel box of tissue.

The cells' axes are those of the slices (`Volume.axes`): along rows, along columns,
along the normal. In them every voxel is a box along the axes, tilt or not; a cell is
tissue as soon as a box of tissue reaches into it. So the cells contain the voxels by
construction.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from math import ceil

import numpy as np
from numpy.typing import NDArray

from borecheck.patients.edges import tissue
from borecheck.patients.volume import Array, Volume

Cells = NDArray[np.bool_]
Ids = NDArray[np.int64]
Progress = Callable[[int, int], None]

# Cells are about so large, [mm], and larger where there would be more than so many.
_FINE_MM = 1.6
_MOST_CELLS = 12_000_000
# Boxes that only touch a cell, to rounding, do not reach into it; share of a cell.
_TOUCH = 1e-6


@dataclass(frozen=True, eq=False)
class Raster:
    """Cells, and where they are.

    Attributes:
        cells: Tissue, (layers, rows, columns).
        low: The corner where all three numbers are least, along the axes, (3,), [mm].
        size: Of a cell along columns (u), rows (v), layers (w), (3,), [mm].
    """

    cells: Cells
    low: Array
    size: Array

    def padded(self, before: tuple[int, ...], after: tuple[int, ...]) -> "Raster":
        """With empty cells around, counts in the order (w, v, u)."""
        wide = np.pad(self.cells, list(zip(before, after, strict=True)))
        return Raster(wide, self.low - self.size * np.array(before[::-1]), self.size)

    def with_cells(self, cells: Cells) -> "Raster":
        """Other cells at the same places."""
        return replace(self, cells=cells)

    def centres(self, axis: int) -> Array:
        """Centres of the cells along u (0), v (1) or w (2), [mm]."""
        count = self.cells.shape[2 - axis]
        return np.asarray(self.low[axis] + self.size[axis] * (np.arange(count) + 0.5))

    def volume_of(self, count: int) -> float:
        """Volume of so many cells, [mm^3]."""
        return float(count * np.prod(self.size))

    def holding(self, places: Array, axis: int) -> Ids:
        """Numbers of the cells along an axis that hold these places, clipped."""
        found = np.floor((places - self.low[axis]) / self.size[axis]).astype(np.int64)
        return np.clip(found, 0, self.cells.shape[2 - axis] - 1)

    def at(self, volume: Volume, k: int) -> tuple[int, Ids, Ids]:
        """Numbers of the cells that hold slice k's voxels, to index `cells` by."""
        down, across = volume.spacing
        u, v, w = volume.places[k]
        columns = self.holding(u + across * np.arange(volume.columns), 0)
        rows = self.holding(v + down * np.arange(volume.rows), 1)
        layer = int(self.holding(np.array([w]), 2)[0])
        return layer, rows[:, None], columns[None, :]


def moved(cells: Cells, by: Array) -> Cells:
    """Cells moved by a part of a cell: every cell that they reach into.

    Args:
        cells: (w, v, u), or one layer (v, u).
        by: In the order u, v, w, [cells].
    """
    found = np.zeros_like(cells)
    axes = tuple(range(cells.ndim))
    ways = [{int(np.floor(x + 1e-9)), int(np.ceil(x - 1e-9))} for x in by[::-1]]
    for way in product(*ways):
        found |= np.roll(cells, way, axis=axes)
    return found


def slabs(volume: Volume) -> tuple[Array, Array]:
    """Lower and upper ends of the voxels of every slice along the normal, [mm]."""
    w = volume.places[:, 2]
    middles = (w[1:] + w[:-1]) / 2
    first, last = 2 * w[0] - middles[0], 2 * w[-1] - middles[-1]
    ends = np.concatenate([[first], middles, [last]])
    return np.minimum(ends[:-1], ends[1:]), np.maximum(ends[:-1], ends[1:])


def rasterised(volume: Volume, progress: Progress | None = None) -> Raster:
    """The cells that hold a scan's tissue; slices are read one after the other."""
    size, low, counts = _grid(volume)
    cells = np.zeros(counts[::-1], dtype=bool)
    raster = Raster(cells, low, size)
    lower, upper = slabs(volume)
    down, across = volume.spacing
    columns = np.arange(volume.columns)
    rows = np.arange(volume.rows)
    for k, plane in enumerate(volume.planes()):
        mask = tissue(volume, plane)
        u, v = volume.places[k, :2]
        wide = _reaching(mask, u + across * columns, across, raster, 0)
        wide = _reaching(wide.T, v + down * rows, down, raster, 1).T
        a, b = _range(lower[k], upper[k], low[2], size[2], counts[2])
        cells[a:b] |= wide
        if progress is not None:
            progress(k + 1, volume.slices)
    return raster


def _grid(volume: Volume) -> tuple[Array, Array, tuple[int, int, int]]:
    """Size, low corner and numbers of cells (u, v, w) that hold the whole scan."""
    down, across = volume.spacing
    lower, upper = slabs(volume)
    half = np.array([across, down]) / 2
    first = volume.places[:, :2].min(axis=0) - half
    last = volume.places[:, :2].max(axis=0) + half
    last += np.array([across * (volume.columns - 1), down * (volume.rows - 1)])
    low = np.array([*first, lower.min()])
    extent = np.array([*last, upper.max()]) - low
    step = float(np.median(volume.places[1:, 2] - volume.places[:-1, 2]))
    voxel = np.array([across, down, abs(step)])
    size = voxel * np.maximum(1.0, np.round(_FINE_MM / voxel))
    while np.prod(np.ceil(extent / size)) > _MOST_CELLS:
        size = size + voxel * (size <= size.min() + 1e-9)
    counts = [max(1, ceil(n - _TOUCH)) for n in extent / size]
    return size, low, (counts[0], counts[1], counts[2])


def _reaching(
    mask: Cells, centres: Array, width: float, to: Raster, axis: int
) -> Cells:
    """Columns of cells, (rows, cells), into which a box of tissue of a row reaches."""
    low, size = to.low[axis], to.size[axis]
    count = to.cells.shape[2 - axis]
    edges = low + size * np.arange(count + 1)
    slack = _TOUCH * size
    # the boxes, sorted along the axis, that end above a cell's low edge and begin
    # below its high edge
    first = np.searchsorted(centres + width / 2, edges[:-1] + slack)
    last = np.searchsorted(centres - width / 2, edges[1:] - slack)
    counted = np.zeros((len(mask), mask.shape[1] + 1), dtype=np.int32)
    np.cumsum(mask, axis=1, out=counted[:, 1:])
    return np.asarray(counted[:, np.maximum(first, last)] > counted[:, first])


def _range(
    low: float, high: float, origin: float, size: float, count: int
) -> tuple[int, int]:
    a = int(np.floor((low - origin) / size + _TOUCH))
    b = int(np.ceil((high - origin) / size - _TOUCH))
    return max(0, a), min(count, max(b, a + 1))
