"""Where the scan ends and the body does not: tissue at the edges of what was seen."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.patients.values import SKIN_HU
from borecheck.patients.volume import LABELS, Plane, Volume

Mask = NDArray[np.bool_]

END, SIDE, CIRCLE = "end", "side", "circle"

# Directions of LPS, by axis and sign.
_NAMES = (("left", "right"), ("posterior", "anterior"), ("superior", "inferior"))

# Tissue that is cut leaves more than that at an edge, [mm^2]: noise does not.
LEAST_MM2 = 100.0
# So near to the circle a voxel is at it, [voxels].
_NEAR = 1.5


@dataclass(frozen=True)
class Cut:
    """An edge of what was seen at which tissue ends.

    Attributes:
        kind: END, SIDE or CIRCLE.
        where: The way it faces in the patient's words: "superior end".
        area: Of tissue there, [mm^2].
    """

    kind: str
    where: str
    area: float

    def to_json(self) -> dict[str, Any]:
        """For the result."""
        return {"kind": self.kind, "where": self.where, "area_m2": self.area / 1e6}

    @property
    def told(self) -> str:
        """In words."""
        what = {
            END: f"the scan ends within the body at its {self.where}",
            SIDE: f"the image's {self.where} edge cuts the body or the couch",
            CIRCLE: "the circle of the field of view cuts the body or the couch",
        }[self.kind]
        return f"{what} ({self.area / 100:.3g} cm2): beyond is unknown"


def tissue(volume: Volume, plane: Plane) -> Mask:
    """Voxels that are no air: above the skin's threshold, or labelled."""
    with np.errstate(invalid="ignore"):
        mask: Mask = plane > (0.0 if volume.kind == LABELS else SKIN_HU)
    return mask


def facing(direction: NDArray[np.float64]) -> str:
    """The nearest of left, right, posterior, anterior, superior, inferior."""
    axis = int(np.argmax(np.abs(direction)))
    return _NAMES[axis][int(direction[axis] < 0.0)]


def seen(volume: Volume) -> Mask:
    """Voxels of any slice within the circle, (rows, columns); all without one."""
    if volume.circle is None:
        return np.ones((volume.rows, volume.columns), dtype=bool)
    return np.asarray(_radii(volume) <= volume.circle.radius)


def rim(volume: Volume) -> Mask:
    """Voxels of any slice just within the circle, (rows, columns)."""
    if volume.circle is None:
        return np.zeros((volume.rows, volume.columns), dtype=bool)
    radii, near = _radii(volume), _NEAR * max(volume.spacing)
    return np.asarray(radii > volume.circle.radius - near)


def _radii(volume: Volume) -> NDArray[np.float64]:
    """Distances of the voxels of a slice from the circle's centre, [mm]."""
    assert volume.circle is not None
    down, across = volume.spacing
    x = across * np.arange(volume.columns) - volume.circle.centre[0]
    y = down * np.arange(volume.rows) - volume.circle.centre[1]
    return np.hypot(x[None, :], y[:, None])


def cuts_of(volume: Volume, masks: Iterator[Mask]) -> tuple[Cut, ...]:
    """Edges at which there is tissue.

    Args:
        volume: The scan.
        masks: Tissue, slice by slice.
    """
    down, across = volume.spacing
    high = float(np.median(np.abs(np.diff(volume.places[:, 2]))))
    areas = dict.fromkeys(("first", "last", "top", "bottom", "left", "right"), 0.0)
    circle, at_rim = 0.0, rim(volume)
    for k, mask in enumerate(masks):
        if k == 0:
            areas["first"] = float(mask.sum()) * down * across
        if k == volume.slices - 1:
            areas["last"] = float(mask.sum()) * down * across
        areas["top"] += float(mask[0].sum()) * across * high
        areas["bottom"] += float(mask[-1].sum()) * across * high
        areas["left"] += float(mask[:, 0].sum()) * down * high
        areas["right"] += float(mask[:, -1].sum()) * down * high
        if volume.circle is not None:
            circle += float((mask & at_rim).sum()) / _NEAR * max(down, across) * high
    along = volume.origins[-1] - volume.origins[0]
    ways = {
        **{"first": -along, "last": along, "top": -volume.down},
        **{"bottom": volume.down, "left": -volume.across, "right": volume.across},
    }
    found = []
    for name, area in areas.items():
        kind = END if name in ("first", "last") else SIDE
        where = facing(ways[name]) + (" end" if kind == END else "")
        if area > LEAST_MM2:
            found.append(Cut(kind, where, area))
    if circle > LEAST_MM2:
        found.append(Cut(CIRCLE, "circle", circle))
    return tuple(found)
