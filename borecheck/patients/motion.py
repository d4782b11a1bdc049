"""How the patient may move while the robot does, and what lies on him: swept cells."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from borecheck.patients.beyond import Extended
from borecheck.patients.raster import moved
from borecheck.patients.volume import Array, Volume

BREATHING, SAG, COVER = "breathing", "couch sag", "cover"

_ANTERIOR = np.array([0.0, -1.0, 0.0])  # LPS


@dataclass(frozen=True)
class Motion:
    """A way by which every part of the body may be displaced.

    Attributes:
        kind: BREATHING (forwards), SAG (downwards) or COVER (upwards).
        length: [mm].
    """

    kind: str
    length: float

    def way(self, volume: Volume, up: Array) -> Array:
        """The displacement along the slices' axes, (3,), [mm].

        Args:
            volume: The scan.
            up: Away from the couch, in LPS, (3,), unit.
        """
        direction = {BREATHING: _ANTERIOR, SAG: -up, COVER: up}[self.kind]
        return np.asarray(volume.axes @ direction * self.length)

    @property
    def told(self) -> str:
        """In words."""
        way = {BREATHING: "forwards", SAG: "downwards", COVER: "upwards"}[self.kind]
        return (
            f"{self.kind}: the obstacle holds the body moved {way} by 0 to "
            f"{self.length:g} mm"
        )


def swept(whole: Extended, ways: Sequence[tuple[Array, Motion]]) -> Extended:
    """Cells of the body at every place of its motions, one motion after the other."""
    for way, _ in ways:
        size = whole.raster.size
        steps = max(1, ceil(float(np.abs(way / size).max())))
        room = tuple(int(n) for n in (np.ceil(np.abs(way) / size) + 1)[::-1])
        raster = whole.raster.padded(room, room)
        assumed = np.pad(whole.assumed, [(n, n) for n in room])
        cells, still = raster.cells.copy(), assumed.copy()
        for k in range(1, steps + 1):
            by = way / size * (k / steps)
            cells |= moved(raster.cells, by)
            still |= moved(assumed, by)
        seen = cells & ~still
        whole = Extended(raster.with_cells(cells), cells & ~seen)
    return whole
