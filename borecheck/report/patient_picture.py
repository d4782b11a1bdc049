"""A scan with the outline of its obstacle in three slices, and the body in the bore."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from borecheck.report.display import deflated, packed
from borecheck.report.figures_still import Image, Stage, looking, png

if TYPE_CHECKING:
    from borecheck.patients.obstacle import PatientObstacle
    from borecheck.patients.volume import Volume
    from borecheck.robots.scene import Obstacle

Array = NDArray[np.float64]

WIDTH, HEIGHT = 640, 440  # of one of the four pictures, [px]
SEEN, ASSUMED = (40, 190, 110), (245, 150, 20)
# What is shown of Hounsfield units, from black to white.
_BLACK, _WHITE = -1100.0, 400.0
_MARGIN = 1.04
_GAP = 4


def preview(
    made: "PatientObstacle", T_frame_lps: Array, around: "Sequence[Obstacle]"
) -> bytes:
    """A PNG of four pictures: slices across, frontal and lateral; the body as placed.

    Args:
        made: The obstacle.
        T_frame_lps: Where its coordinates lie, (4, 4), [m].
        around: What stands around it.
    """
    volume = made.volume
    R, shift = T_frame_lps[:3, :3], T_frame_lps[:3, 3]
    # along the slices' axes, [mm]
    corners = 1e3 * (made.mesh.corners - shift) @ R @ volume.axes.T
    seen = corners[~made.assumed].reshape(-1, 3)
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    slices = _slices(volume, middle)
    tiles = [
        _tile(volume, corners, made.assumed, middle, axes, slices)
        for axes in ((0, 1), (0, 2), (1, 2))
    ]
    tiles.append(_placed(made, around))
    gap = np.full((HEIGHT, _GAP, 3), 255, dtype=np.uint8)
    rows = [np.hstack([tiles[k], gap, tiles[k + 1]]) for k in (0, 2)]
    between = np.full((_GAP, rows[0].shape[1], 3), 255, dtype=np.uint8)
    return png(np.vstack([rows[0], between, rows[1]]))


def _slices(volume: "Volume", middle: Array) -> Mapping[tuple[int, int], Array]:
    """Voxels in three planes through a point: (rows, columns), (slices, ...)."""
    down, across = volume.spacing
    heights = volume.places[:, 2]
    at = int(np.argmin(np.abs(heights - middle[2])))
    frontal = np.zeros((volume.slices, volume.columns))
    lateral = np.zeros((volume.slices, volume.rows))
    whole = np.zeros((volume.rows, volume.columns))
    for k, plane in enumerate(volume.planes()):
        row = round((middle[1] - volume.places[k, 1]) / down)
        column = round((middle[0] - volume.places[k, 0]) / across)
        frontal[k] = plane[np.clip(row, 0, volume.rows - 1)]
        lateral[k] = plane[:, np.clip(column, 0, volume.columns - 1)]
        if k == at:
            whole = plane.astype(np.float64)
    return {(0, 1): whole, (0, 2): frontal, (1, 2): lateral}


def _tile(
    volume: "Volume",
    corners: Array,
    assumed: NDArray[np.bool_],
    middle: Array,
    axes: tuple[int, int],
    slices: Mapping[tuple[int, int], Array],
) -> Image:
    """One plane of the scan with the outline of the obstacle."""
    x, y = axes
    centre = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
    extent = np.ptp(corners.reshape(-1, 3), axis=0) * _MARGIN
    scale = max(extent[x] / WIDTH, extent[y] / HEIGHT)  # [mm] of a pixel
    up = _up(volume, y)
    across = centre[x] + scale * (np.arange(WIDTH) - WIDTH / 2)
    along = centre[y] - up * scale * (np.arange(HEIGHT) - HEIGHT / 2)
    image = _grey(_sampled(volume, slices[axes], axes, across, along, middle))
    normal = 3 - x - y
    for part, colour in ((~assumed, SEEN), (assumed, ASSUMED)):
        points = _outline(corners[part], normal, middle[normal], scale)
        i = np.rint((points[:, x] - centre[x]) / scale + WIDTH / 2).astype(int)
        j = np.rint(-up * (points[:, y] - centre[y]) / scale + HEIGHT / 2).astype(int)
        kept = (i >= 1) & (i < WIDTH - 1) & (j >= 1) & (j < HEIGHT - 1)
        for dj in (0, 1):
            for di in (0, 1):
                image[j[kept] + dj, i[kept] + di] = colour
    return image


def _up(volume: "Volume", axis: int) -> float:
    """Whether an axis is drawn upwards (1) or downwards: anterior, superior are up."""
    direction = volume.axes[axis]
    k = int(np.argmax(np.abs(direction)))
    forward = {0: 1.0, 1: -1.0, 2: 1.0}[k]  # left, anterior, superior
    return forward * float(np.sign(direction[k]))


def _sampled(
    volume: "Volume",
    values: Array,
    axes: tuple[int, int],
    across: Array,
    along: Array,
    middle: Array,
) -> Array:
    """The nearest voxels at places of a picture; nan outside the scan."""
    down, right = volume.spacing
    heights = volume.places[:, 2]
    if axes == (0, 1):
        k = int(np.argmin(np.abs(heights - middle[2])))
        rows = np.rint((along - volume.places[k, 1]) / down)[:, None]
        columns = np.rint((across - volume.places[k, 0]) / right)[None, :]
    else:
        step = down if axes[0] == 1 else right
        number = np.abs(heights[:, None] - along[None, :]).argmin(axis=0)
        lowest, highest = heights.min(), heights.max()
        off = (along < lowest) | (along > highest)
        rows = np.where(off, -1, number)[:, None].astype(float)
        begin = volume.places[number, axes[0]][:, None]
        columns = np.rint((across[None, :] - begin) / step)
    rows, columns = np.broadcast_arrays(rows, columns)
    inside = (rows >= 0) & (rows < values.shape[0])
    inside &= (columns >= 0) & (columns < values.shape[1])
    found = np.full(rows.shape, np.nan)
    at = rows[inside].astype(int), columns[inside].astype(int)
    found[inside] = values[at]
    return found


def _grey(values: Array) -> Image:
    """Brightness; what is outside the scan is a dark blue."""
    high = _WHITE if float(np.nanmin(values, initial=0.0)) < 0.0 else 2.0
    low = _BLACK if high == _WHITE else -0.5
    shade = np.clip((np.nan_to_num(values) - low) / (high - low), 0.0, 1.0)
    image = np.repeat(np.rint(255 * shade)[..., None], 3, axis=2).astype(np.uint8)
    image[np.isnan(values)] = (22, 28, 44)
    return image


def _outline(corners: Array, axis: int, at: float, step: float) -> Array:
    """Points, half a pixel apart, where triangles cross a plane, (n, 3)."""
    heights = corners[..., axis] - at
    found = []
    crossed = (heights.min(axis=1) < 0.0) & (heights.max(axis=1) > 0.0)
    for triangle, height in zip(corners[crossed], heights[crossed], strict=True):
        ends = []
        for a, b in ((0, 1), (1, 2), (2, 0)):
            if (height[a] < 0.0) != (height[b] < 0.0):
                share = height[a] / (height[a] - height[b])
                ends.append(triangle[a] + share * (triangle[b] - triangle[a]))
        first, last = ends[0], ends[-1]
        count = max(2, int(2.0 * np.linalg.norm(last - first) / step))
        found.append(first + np.linspace(0.0, 1.0, count)[:, None] * (last - first))
    return np.concatenate(found) if found else np.zeros((0, 3))


def _placed(made: "PatientObstacle", around: "Sequence[Obstacle]") -> Image:
    """The body as it is placed, with what stands around it cut open."""
    blocks: list[dict[str, Any]] = [
        {"name": o.name, "role": o.role, **packed(o.mesh)} for o in around
    ]
    blocks.append({"name": "patient", "role": "patient", **packed(made.mesh)})
    nowhere = deflated(np.zeros((1, 0, 3, 4), dtype="<f4"))
    stage = Stage(
        {
            **{"frames": [], "links": [], "obstacles": blocks},
            "motions": [{"poses": 1, "placements": nowhere}],
        },
        WIDTH,
        HEIGHT,
    )
    low, high = made.mesh.bounds
    centre = (low + high) / 2
    width = 2.2 if around else 1.5 * float(np.linalg.norm(high - low))
    side = np.array([0.0, -1.0, 0.0])
    view = looking(centre, (0.75, 0.9, -0.45), width)
    cuts = {"housing": (side, 0.0)} if around else None
    return stage.image(0, 0, view, cuts)
