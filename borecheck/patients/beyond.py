"""The patient beyond what was seen: straight on, by a stated length, and marked.

Where the scan ends within the body, its last layer goes on along the way from slice to
slice; where the image's edge or the circle of the field of view cuts it, its rim goes
on outwards. That is an assumption: what is nearest to it is unknown, and farther on
still more so.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np

from borecheck.patients.edges import LEAST_MM2
from borecheck.patients.raster import Cells, Ids, Raster, moved, slabs
from borecheck.patients.volume import Array, Volume

# What is within so many cells of an edge is at it.
_AT_EDGE = 1.5


@dataclass(frozen=True, eq=False)
class Extended:
    """A body with what is assumed of it.

    Attributes:
        raster: Body and continuation.
        assumed: Cells of the continuation alone.
    """

    raster: Raster
    assumed: Cells


def extended(volume: Volume, raster: Raster, length: float) -> Extended:
    """The body with its continuation.

    Args:
        volume: The scan.
        raster: The body.
        length: How far it goes on, [mm].
    """
    known, aside = _aside(volume, raster, length)
    return _ends(volume, known, aside, length)


def _aside(volume: Volume, raster: Raster, length: float) -> tuple[Raster, Cells]:
    """The body in a raster with room, and what goes on sideways."""
    margin = [ceil(length / s) for s in raster.size[:2]]
    pads = (0, margin[1], margin[0])
    wide = raster.padded(pads, pads)
    assumed = np.zeros_like(wide.cells)
    lower, upper = slabs(volume)
    middles = wide.centres(2)
    order = np.argsort(volume.places[:, 2])
    middle = np.clip(middles, lower.min(), upper.max())
    offsets = np.stack(
        [
            np.interp(middle, volume.places[order, 2], volume.places[order, axis])
            for axis in (0, 1)
        ],
        axis=1,
    )
    before: Array | None = None
    for k, offset in enumerate(offsets):
        if before is None or np.abs(offset - before).max() > 1e-9:
            outside, sources = _projection(volume, wide, offset, length)
            before = offset
        assumed[k][outside] = wide.cells[k][sources]
    assumed &= ~wide.cells
    return wide, assumed


def _projection(
    volume: Volume, wide: Raster, offset: Array, length: float
) -> tuple[Cells, tuple[Ids, Ids]]:
    """Cells of a layer outside what was seen, and the seen cell that each continues."""
    down, across = volume.spacing
    near = _AT_EDGE * wide.size[:2]
    x, y = np.meshgrid(wide.centres(0) - offset[0], wide.centres(1) - offset[1])
    left, top = -across / 2 + near[0], -down / 2 + near[1]
    right = across * (volume.columns - 0.5) - near[0]
    bottom = down * (volume.rows - 0.5) - near[1]
    to_x, to_y = np.clip(x, left, right), np.clip(y, top, bottom)
    if volume.circle is not None:
        cx, cy = volume.circle.centre
        radius = volume.circle.radius - float(near.max())
        from_centre = np.hypot(to_x - cx, to_y - cy)
        share = np.minimum(1.0, radius / np.maximum(from_centre, 1e-9))
        to_x, to_y = cx + share * (to_x - cx), cy + share * (to_y - cy)
    away = np.hypot(to_x - x, to_y - y)
    outside = (away > 1e-9) & (away <= length + float(near.max()))
    rows = wide.holding(to_y[outside] + offset[1], 1)
    columns = wide.holding(to_x[outside] + offset[0], 0)
    return outside, (rows, columns)


def _ends(volume: Volume, known: Raster, aside: Cells, length: float) -> Extended:
    """First and last layer carried on along the way from slice to slice."""
    whole = known.cells | aside
    u, v, w = volume.axes @ (volume.origins[-1] - volume.origins[0])
    drift = np.array([u, v]) / w  # sideways for each mm upwards
    count = ceil(length / known.size[2])
    shift = np.abs(drift) * length / known.size[:2]
    pads = (count, ceil(shift[1]), ceil(shift[0]))
    wide = known.with_cells(whole).padded(pads, pads)
    seen = known.padded(pads, pads).cells
    cells = wide.cells
    for layer, step in ((count, -1), (len(cells) - 1 - count, 1)):
        end = cells[layer].copy()
        if float(end.sum()) * known.size[0] * known.size[1] <= LEAST_MM2:
            continue
        for k in range(1, count + 1):
            way = drift * (step * k * known.size[2]) / known.size[:2]
            cells[layer + step * k] |= moved(end, way)
    return Extended(wide, cells & ~seen)
