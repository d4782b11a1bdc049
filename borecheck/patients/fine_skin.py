"""The skin as the scan has it: the surface between air and tissue, at full resolution.

It is what an obstacle is proven to contain. Slabs of slices are handed out one after
the other, so that a long scan is never whole in memory; neighbours share a slice, so
that nothing lies between them.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.patients.body import Body
from borecheck.patients.libraries import library
from borecheck.patients.values import SKIN_HU
from borecheck.patients.volume import LABELS, Array, Plane, Volume

# Voxels of a slab: its surface and their tree stay small.
_SLAB_VOXELS = 6_000_000
_AIR, _INSIDE = -1024.0, 100.0


@dataclass(frozen=True, eq=False)
class SkinSlab:
    """A part of the skin.

    Attributes:
        vertices: Along the slices' axes (u, v, w), (n, 3), [mm].
        triangles: (m, 3).
        done: Slices handed out so far.
    """

    vertices: Array
    triangles: NDArray[np.int64]
    done: int


def skin_slabs(volume: Volume, body: Body) -> Iterator[SkinSlab]:
    """The skin of the body that was kept, slab by slab; ends are closed."""
    count = max(2, _SLAB_VOXELS // (volume.rows * volume.columns))
    planes: list[Plane] = [_empty(volume)]
    numbers = [-1]
    for k, plane in enumerate(volume.planes()):
        planes.append(_kept(volume, body, k, plane))
        numbers.append(k)
        if k == volume.slices - 1:
            planes.append(_empty(volume))
            numbers.append(k + 1)
        elif len(planes) <= count:
            continue
        slab = _surface(volume, planes, numbers)
        if slab is not None:
            yield slab
        planes, numbers = planes[-1:], numbers[-1:]


def _empty(volume: Volume) -> Plane:
    return np.full((volume.rows + 2, volume.columns + 2), _AIR, dtype=np.float32)


def _kept(volume: Volume, body: Body, k: int, plane: Plane) -> Plane:
    """A slice with a rim of air, without what was removed, hollows filled."""
    at = body.raster.at(volume, k)
    values = np.where(np.isnan(plane), np.float32(_AIR), plane)
    if volume.kind == LABELS:
        values = np.where(values > 0, np.float32(0.0), np.float32(2 * SKIN_HU))
    values[body.filled[at]] = np.maximum(values[body.filled[at]], np.float32(_INSIDE))
    values[body.removed[at]] = _AIR
    framed = _empty(volume)
    framed[1:-1, 1:-1] = values
    return framed


def _surface(
    volume: Volume, planes: list[Plane], numbers: list[int]
) -> SkinSlab | None:
    values = np.stack(planes)
    if not values.max() > SKIN_HU:
        return None
    measure = library("skimage.measure", "scikit-image")
    points, triangles, _, _ = measure.marching_cubes(
        values, SKIN_HU, allow_degenerate=False
    )
    k = points[:, 0] + numbers[0]
    j, i = points[:, 1] - 1.0, points[:, 2] - 1.0
    every = np.arange(-1, volume.slices + 1)
    places = np.vstack(
        [
            2 * volume.places[0] - volume.places[1],
            volume.places,
            2 * volume.places[-1] - volume.places[-2],
        ]
    )
    down, across = volume.spacing
    at = [np.interp(k, every, places[:, axis]) for axis in range(3)]
    vertices = np.stack([at[0] + across * i, at[1] + down * j, at[2]], axis=1)
    done = min(volume.slices, numbers[-1] + 1)
    return SkinSlab(vertices, np.asarray(triangles, dtype=np.int64), done)
