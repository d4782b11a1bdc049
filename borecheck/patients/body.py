"""What of a scan's tissue is the patient: couch and specks out, everything else stays.

Nothing that could be the body is taken away. Of the couch only wide shells go that lie
behind the body: thinner than the body's parts, below its lowest line (its convex hull
as seen from the couch, slice by slice). What is removed is told with its volume; what
is in doubt stays, which makes the obstacle larger, never smaller.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from borecheck.patients.edges import LEAST_MM2
from borecheck.patients.raster import Cells, Raster
from borecheck.patients.volume import Array

KEPT, SPECK, COUCH = "kept", "speck", "couch"

# "Largest component" would drop both arms of a patient; a speck is below it, [mm^3].
LEAST_MM3 = 10_000.0
# A shell thinner than it is no part of a body: an opening of so many cells, [cells].
_OPENING = 5
# Of a couch one sees at least so much across; a finger is narrower, [mm].
_WIDE_MM = 100.0
# What lies behind the trunk and is this thick somewhere is body all the same, [mm].
_MASSIVE_MM = 20.0
# Of many specks so many are listed.
_LISTED = 12

_ALL = np.ones((3, 3, 3), dtype=bool)


@dataclass(frozen=True)
class Component:
    """A connected piece of tissue.

    Attributes:
        kind: KEPT, SPECK or COUCH.
        volume: Of the cells that hold it, [mm^3].
        pieces: How many it sums up.
    """

    kind: str
    volume: float
    pieces: int = 1

    def to_json(self) -> dict[str, Any]:
        """For the result."""
        kept = self.kind == KEPT
        return {
            "kept": kept,
            "what": "body" if kept else self.kind,
            "volume_m3": self.volume / 1e9,
            "pieces": self.pieces,
        }


@dataclass(frozen=True, eq=False)
class Body:
    """The patient in cells.

    Attributes:
        raster: The cells that hold the patient, hollows within a slice filled.
        removed: Cells of tissue that is not the patient's.
        filled: Cells of hollows.
        components: Pieces kept and removed.
    """

    raster: Raster
    removed: Cells
    filled: Cells
    components: tuple[Component, ...]


def body_of(raster: Raster, down: Array | None) -> Body:
    """The patient among the tissue of a scan.

    Args:
        raster: All tissue.
        down: Where the couch is from the body, along the raster's axes (u, v, w);
            None: no couch is looked for.
    """
    tissue = raster.cells
    couch = np.zeros_like(tissue) if down is None else _couch(raster, down)
    rest = tissue & ~couch
    labels, count = ndimage.label(rest, structure=_ALL)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    sizes[0] = 0
    kept = np.array([raster.volume_of(n) >= LEAST_MM3 for n in sizes])
    kept |= _cut_off(labels, len(sizes), raster)
    if count:
        kept[int(np.argmax(sizes))] = True
    kept[0] = False
    body = kept[labels]
    filled = _hollows(body)
    return Body(
        raster.with_cells(body | filled),
        tissue & ~body,
        filled,
        _components(raster, sizes, kept, int(couch.sum())),
    )


def _components(
    raster: Raster, sizes: NDArray[np.int64], kept: Cells, couch: int
) -> tuple[Component, ...]:
    found = [Component(KEPT, raster.volume_of(n)) for n in np.sort(sizes[kept])[::-1]]
    if len(found) > _LISTED:
        small = found[_LISTED:]
        whole = sum(one.volume for one in small)
        found = [*found[:_LISTED], Component(KEPT, whole, len(small))]
    specks = sizes[~kept]
    if specks.sum():
        volume = raster.volume_of(int(specks.sum()))
        found.append(Component(SPECK, volume, int((specks > 0).sum())))
    if couch:
        found.append(Component(COUCH, raster.volume_of(couch)))
    return tuple(found)


def _cut_off(labels: NDArray[np.int32], count: int, raster: Raster) -> Cells:
    """Pieces that the scan's ends cut: a corner of something larger, (count,)."""
    found = np.zeros(count, dtype=bool)
    for end in (labels[0], labels[-1]):
        areas = np.bincount(end.ravel(), minlength=count) * raster.size[0]
        found |= areas * raster.size[1] > LEAST_MM2
    found[0] = False
    return found


def _hollows(body: Cells) -> Cells:
    """Cells that tissue encloses within a layer: lungs, bowel."""
    filled = np.zeros_like(body)
    for k, layer in enumerate(body):
        filled[k] = ndimage.binary_fill_holes(layer) & ~layer
    return filled


def _couch(raster: Raster, down: Array) -> Cells:
    """Cells of wide shells, and of wide slabs, behind the body."""
    axis = int(np.argmax(np.abs(down[:2])))  # 0: u, 1: v
    if abs(down[axis]) < np.sqrt(0.5):
        return np.zeros_like(raster.cells)
    cells = raster.cells if axis == 1 else raster.cells.transpose(0, 2, 1)
    if down[axis] < 0:
        cells = cells[:, ::-1]
    across = raster.size[0 if axis == 1 else 1]
    deep = raster.size[axis]
    found = _behind(cells, deep, across)
    if down[axis] < 0:
        found = found[:, ::-1]
    return found if axis == 1 else found.transpose(0, 2, 1)


def _behind(cells: Cells, deep: float, across: float) -> Cells:
    """As `_couch`, of cells (layers, depth, across) whose depth grows downwards.

    Args:
        cells: Tissue.
        deep: Size of a cell downwards, [mm].
        across: Size of a cell across, [mm].
    """
    opened = ndimage.binary_opening(cells, _disc())
    labels, count = ndimage.label(opened, structure=_ALL)
    if count == 0:
        return np.zeros_like(cells)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    trunk = labels == int(np.argmax(sizes))
    shells = _thin_pieces(labels, _below(trunk), (deep, across))
    core = opened & ~shells
    return _wide_only(cells & _below(core), max(1, int(_WIDE_MM / across)))


def _disc() -> Cells:
    """One layer of a round opening."""
    r = _OPENING // 2
    y, x = np.mgrid[-r : r + 1, -r : r + 1]
    return np.asarray((x * x + y * y <= r * r + 1)[None])


def _below(core: Cells) -> Cells:
    """Cells below the lower convex hull of a layer's core, with an opening's slack."""
    depth, across = core.shape[1:]
    rows = np.arange(depth)[:, None]
    found = np.zeros_like(core)
    for k, layer in enumerate(core):
        columns = np.flatnonzero(layer.any(axis=0))
        if len(columns) == 0:
            continue
        lowest = depth - 1 - np.argmax(layer[::-1, columns], axis=0)
        x, y = _hull(columns, lowest)
        line = np.interp(np.arange(across), x, y, left=np.inf, right=np.inf)
        found[k] = rows > line[None, :] + _OPENING // 2
    return found


def _hull(x: NDArray[np.int64], y: NDArray[np.int64]) -> tuple[list[int], list[int]]:
    """The part of the convex hull of points, x ascending, where y is largest."""
    kept: list[tuple[int, int]] = []
    for point in zip(x.tolist(), y.tolist(), strict=True):
        while len(kept) > 1 and _turns_up(kept[-2], kept[-1], point):
            kept.pop()
        kept.append(point)
    return [p[0] for p in kept], [p[1] for p in kept]


def _turns_up(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) >= 0


def _thin_pieces(
    labels: NDArray[np.int32], part: Cells, size: tuple[float, float]
) -> Cells:
    """Pieces that lie wholly in `part` and are nowhere as thick as an arm."""
    inside = np.bincount(labels[part], minlength=int(labels.max()) + 1)
    whole = np.bincount(labels.ravel())
    found = np.zeros(labels.shape, dtype=bool)
    for k, box in enumerate(ndimage.find_objects(labels)):
        if box is None or inside[k + 1] != whole[k + 1]:
            continue
        piece = labels[box] == k + 1
        if 2.0 * _thickest(piece, size) < _MASSIVE_MM:
            found[box] |= piece
    return found


def _thickest(piece: Cells, size: tuple[float, float]) -> float:
    """Radius of the largest disc that fits into a layer of the piece, [mm]."""
    radii = (
        ndimage.distance_transform_edt(np.pad(layer, 1), sampling=size).max()
        for layer in piece
    )
    return max(map(float, radii))


def _wide_only(cells: Cells, wide: int) -> Cells:
    """The connected pieces that reach over at least so many cells across."""
    labels, _ = ndimage.label(cells, structure=_ALL)
    boxes = ndimage.find_objects(labels)
    chosen = np.zeros(len(boxes) + 1, dtype=bool)
    for k, box in enumerate(boxes):
        chosen[k + 1] = box is not None and box[2].stop - box[2].start >= wide
    return chosen[labels]
