"""A scan as a value: planes of voxels, each where its own position says.

Coordinates are the patient's, LPS as in DICOM, in millimetres, of voxel centres. Slices
are read one after the other, so that no scan need fit into memory.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import BorecheckError

Array = NDArray[np.float64]
Plane = NDArray[np.float32]

# What a voxel holds.
HOUNSFIELD, LABELS = "hounsfield", "labels"

# 2,000 slices of 512 x 512 are half of it.
MOST_VOXELS = 1_200_000_000
MOST_COLUMNS = 8192

# A patient's coordinates beyond that are a mistake of the file, [mm].
FARTHEST_MM = 1e5

# Steps that differ by more are uneven: positions are written with two to six decimals.
_EVEN_MM, _EVEN_SHARE = 0.02, 0.01


class VolumeError(BorecheckError):
    """A scan that no obstacle can be made of; its text names the file and the cause."""

    def __init__(self, file: object, problem: str) -> None:
        super().__init__(f"{file}: {problem}")
        self.problem = problem


def told_by(error: Exception) -> str:
    """What a library raised, in one short line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())[:160]}"


@dataclass(frozen=True)
class FieldOfView:
    """The circle that a CT reconstructs; what lies outside was not seen.

    Attributes:
        centre: From the first voxel of each slice along rows and columns, (2,), [mm].
        radius: [mm].
    """

    centre: Array
    radius: float


@dataclass(frozen=True, eq=False)
class Volume:
    """Voxels, slice by slice.

    Attributes:
        file: Folder or file, as the user named it.
        kind: HOUNSFIELD or LABELS.
        origins: Centre of the first voxel of every slice, (n, 3), LPS, [mm].
        across: From one column to the next, (3,), [mm].
        down: From one row to the next, (3,), [mm]; at right angles to `across`.
        rows: Rows of a slice.
        columns: Columns of a slice.
        planes: Begins to read: slices (rows, columns) in the order of `origins`;
            nan where the file holds padding.
        position: How the patient lies, DICOM's code; None if the file does not say.
        circle: What the scanner saw, if that is less than the image.
        frame_of_reference: DICOM's UID, if the file has one.
        dropped: What of the folder was left out, and why.
        notes: What the user should know about how it was read.
        doubts: What was assumed; until somebody says so, nothing is clear.
        segments: Names of labels by number, if the file states them.
        series: UID or number of the series that was read.
    """

    file: str
    kind: str
    origins: Array
    across: Array
    down: Array
    rows: int
    columns: int
    planes: Callable[[], Iterator[Plane]]
    position: str | None = None
    circle: FieldOfView | None = None
    frame_of_reference: str | None = None
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    segments: dict[int, str] = field(default_factory=dict)
    series: str | None = None

    def __post_init__(self) -> None:
        _refuse_impossible(self)

    @property
    def slices(self) -> int:
        """Number of slices."""
        return len(self.origins)

    @property
    def spacing(self) -> tuple[float, float]:
        """Distance of rows, and of columns, [mm]."""
        return float(np.linalg.norm(self.down)), float(np.linalg.norm(self.across))

    @cached_property
    def axes(self) -> Array:
        """Unit vectors along rows, along columns and along the normal, (3, 3) rows."""
        u = self.across / np.linalg.norm(self.across)
        v = self.down / np.linalg.norm(self.down)
        return np.stack([u, v, np.cross(u, v)])

    @cached_property
    def places(self) -> Array:
        """Origins along `axes`, (n, 3), [mm]: the third is the slice's own plane."""
        return self.origins @ self.axes.T

    @cached_property
    def steps(self) -> Array:
        """Lengths of the ways from slice to slice, (n - 1,), [mm]."""
        return np.linalg.norm(np.diff(self.origins, axis=0), axis=1)

    @property
    def is_even(self) -> bool:
        """Whether all steps are one, as far as positions are written."""
        ways = np.diff(self.origins, axis=0)
        limit = max(_EVEN_MM, _EVEN_SHARE * float(np.median(self.steps)))
        return bool(np.abs(ways - np.median(ways, axis=0)).max() <= limit)

    @property
    def step(self) -> Array | None:
        """From slice to slice, (3,), LPS, [mm]; None where steps are uneven."""
        if not self.is_even:
            return None
        whole = self.origins[-1] - self.origins[0]
        return np.asarray(whole / (self.slices - 1))

    @property
    def shear_deg(self) -> float:
        """Angle between the way from slice to slice and their normal, [degrees]."""
        whole = self.origins[-1] - self.origins[0]
        along = abs(float(whole @ self.axes[2])) / float(np.linalg.norm(whole))
        return float(np.degrees(np.arccos(min(1.0, along))))

    @cached_property
    def corners(self) -> Array:
        """Centres of the corner voxels, (8, 3), LPS, [mm].

        By slice, row and column, the column changing first.
        """
        right = self.across * (self.columns - 1)
        below = self.down * (self.rows - 1)
        return np.array(
            [
                origin + row + column
                for origin in (self.origins[0], self.origins[-1])
                for row in (np.zeros(3), below)
                for column in (np.zeros(3), right)
            ]
        )

    def to_json(self) -> dict[str, Any]:
        """Its geometry."""
        step = self.step
        return {
            "kind": self.kind,
            "slices": self.slices,
            "rows": self.rows,
            "columns": self.columns,
            "spacing_down_across_mm": list(self.spacing),
            "corners_lps_mm": self.corners.tolist(),
            "step_lps_mm": None if step is None else step.tolist(),
            "steps_mm": [float(self.steps.min()), float(self.steps.max())],
            "origins_lps_mm": None if step is not None else self.origins.tolist(),
            "shear_deg": self.shear_deg,
            "position": self.position,
            "series": self.series,
        }


def _refuse_impossible(volume: Volume) -> None:
    """Numbers that no scan of a patient has."""

    def refuse(problem: str) -> None:
        raise VolumeError(volume.file, problem)

    n, rows, columns = volume.slices, volume.rows, volume.columns
    for vector in (volume.origins, volume.across, volume.down):
        if not np.isfinite(vector).all() or np.abs(vector).max() > FARTHEST_MM:
            refuse("a position or direction is no length within 100 m")
    for name, spacing in zip(("rows", "columns"), volume.spacing, strict=True):
        if not 0.01 <= spacing <= 50.0:
            refuse(f"{name} are {spacing:g} mm apart, not from 0.01 to 50 mm")
    if n < 2:
        refuse("one slice has no thickness: at least two are needed")
    if not (2 <= rows <= MOST_COLUMNS and 2 <= columns <= MOST_COLUMNS):
        refuse(f"slices of {rows} x {columns} voxels are no images")
    if n * rows * columns > MOST_VOXELS:
        refuse(f"{n} x {rows} x {columns} voxels are more than {MOST_VOXELS:,}")
    heights = np.diff(volume.places[:, 2])
    if not ((heights > 0.0).all() or (heights < 0.0).all()):
        refuse("slices do not follow one another along their normal")
    skew = float(volume.across @ volume.down)
    if abs(skew) > 1e-3 * volume.spacing[0] * volume.spacing[1]:
        refuse("rows and columns are not at right angles: resample it")


def steps_told(volume: Volume) -> tuple[str, ...]:
    """Lines about tilt and uneven steps; planes stay where they are."""
    lines = []
    if volume.shear_deg > 0.1:
        lines.append(
            f"the stack is sheared by {volume.shear_deg:.3g} degrees (gantry tilt): "
            "every slice is taken in its own plane"
        )
    if not volume.is_even:
        low, high = float(volume.steps.min()), float(volume.steps.max())
        lines.append(
            f"steps are uneven, {low:.4g} to {high:.4g} mm: every slice is taken in "
            "its own plane, no spacing is averaged"
        )
    return tuple(lines)
