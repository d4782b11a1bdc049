"""A DICOM series as a volume: planes where their positions say, pixels as they come.

Order and steps follow from ImagePositionPatient alone; file names, InstanceNumber,
SliceThickness and GantryDetectorTilt count for nothing.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.core.patient_frame import POSITIONS
from borecheck.patients.dicom_headers import SliceHeader, read_folder
from borecheck.patients.dicom_series import chosen, dropped_told
from borecheck.patients.libraries import library
from borecheck.patients.volume import (
    HOUNSFIELD,
    FieldOfView,
    Plane,
    Volume,
    VolumeError,
    told_by,
)

# Two images nearer than that are at one place, [mm].
_SAME_PLACE_MM = 0.01

# A step of about a whole number of usual ones, if few are, is a slice that is missing.
_WHOLE, _FEW = 0.05, 0.25
# No scan of a body has steps so far apart, [mm].
_LARGEST_STEP_MM = 12.0


def read_series(
    path: Path,
    wanted: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Volume:
    """The volume of a folder's series, or of one file's.

    Args:
        path: A folder.
        wanted: UID or number of the series; None: the longest.
        progress: Called with files done and all files.

    Raises:
        VolumeError: No series, or one of which no volume can be made.
    """
    folder = read_folder(path, progress)
    series, said = chosen(path, folder, wanted)
    images = _one_each(path, series.slices)
    first = images[0]
    row = first.row / np.linalg.norm(first.row)
    column = first.column / np.linalg.norm(first.column)
    volume = Volume(
        file=str(path),
        kind=HOUNSFIELD,
        origins=np.array([one.origin for one in images]),
        across=row * first.spacing[1],
        down=column * first.spacing[0],
        rows=first.size[0],
        columns=first.size[1],
        planes=_Planes(tuple(images)),
        position=_position(path, images),
        circle=_circle(images),
        frame_of_reference=first.frame or None,
        dropped=dropped_told(folder, series),
        notes=(*said, *_uids_told(images)),
        series=series.name,
    )
    _refuse_gaps(volume)
    return volume


def _one_each(path: Path, images: Sequence[SliceHeader]) -> list[SliceHeader]:
    """The images, of which no two are at one place; copies of a file are one.

    Raises:
        VolumeError: Two images of one place that differ: phases, or a second series.
    """
    kept: list[SliceHeader] = []
    for one in images:
        if not kept or _apart(kept[-1], one) > _SAME_PLACE_MM:
            kept.append(one)
        elif not _is_copy(kept[-1], one):
            names = f"{kept[-1].file.name} and {one.file.name}"
            phases = kept[-1].acquisition != one.acquisition
            why = "acquisitions or phases are mixed" if phases else "doubled slices"
            raise VolumeError(
                path, f"two images at one position ({why}): {names}: sort them apart"
            )
    return kept


def _apart(a: SliceHeader, b: SliceHeader) -> float:
    """Distance of two planes along their normal, [mm]."""
    return float(abs(a.normal @ (np.array(b.origin) - a.origin)))


def _is_copy(a: SliceHeader, b: SliceHeader) -> bool:
    return (
        a.origin == b.origin
        and bool(a.instance)
        and a.instance == b.instance
        and a.file.read_bytes() == b.file.read_bytes()
    )


def _refuse_gaps(volume: Volume) -> None:
    """A slice that is missing between others, or steps that no scan has.

    Raises:
        VolumeError: It names the step and where it is.
    """
    steps = volume.steps
    usual = float(np.median(steps))
    times = steps / usual
    whole = (times > 1.5) & (np.abs(times - np.round(times)) < _WHOLE * times)
    at = int(np.argmax(steps))
    where = f"after slice {at + 1} of {volume.slices}"
    if whole.any() and whole.sum() <= _FEW * len(steps):
        missing = round(float(times[at])) - 1
        slices = "a slice is" if missing == 1 else f"{missing} slices are"
        raise VolumeError(
            volume.file,
            f"{slices} missing: a step of {steps[at]:.4g} mm {where}, among steps of "
            f"{usual:.4g} mm: uneven",
        )
    if steps[at] > _LARGEST_STEP_MM:
        raise VolumeError(
            volume.file, f"a gap of {steps[at]:.4g} mm {where}: too far to close"
        )


def _position(path: Path, images: Sequence[SliceHeader]) -> str | None:
    """How the patient lies; all images must agree.

    Raises:
        VolumeError: They do not, or it is no code of DICOM's that is known.
    """
    found = sorted({one.position for one in images})
    if len(found) > 1:
        raise VolumeError(path, f"PatientPosition changes in the series: {found}")
    if not found[0]:
        return None
    if found[0] not in POSITIONS:
        known = ", ".join(POSITIONS)
        raise VolumeError(path, f"PatientPosition {found[0]!r} is none of {known}")
    return found[0]


def _circle(images: Sequence[SliceHeader]) -> FieldOfView | None:
    """The reconstructed circle, if the series states it and where its centre is."""
    first = images[0]
    if first.diameter is None or not first.diameter > 0.0:
        return None
    width = first.spacing[1] * first.size[1]
    height = first.spacing[0] * first.size[0]
    if first.target is not None:
        way = np.array(first.target) - first.origin
        centre = np.array([way @ first.row, way @ first.column])
    elif max(abs(width - first.diameter), abs(width - height)) > 0.02 * width:
        return None  # a part of it, and nobody says which
    else:
        centre = np.array([width - first.spacing[1], height - first.spacing[0]]) / 2
    return FieldOfView(centre, first.diameter / 2)


def _uids_told(images: Sequence[SliceHeader]) -> tuple[str, ...]:
    """A line about UIDs that are empty."""
    lacking = [
        name
        for name, values in (
            ("SeriesInstanceUID", [one.series for one in images]),
            ("SOPInstanceUID", [one.instance for one in images]),
            ("FrameOfReferenceUID", [one.frame for one in images]),
        )
        if not all(values)
    ]
    if not lacking:
        return ()
    return (
        f"UIDs are empty ({', '.join(lacking)}): images were told apart by frame of "
        "reference, orientation, size and spacing",
    )


@dataclass(frozen=True)
class _Planes:
    """Reads the images one after the other."""

    images: tuple[SliceHeader, ...]

    def __call__(self) -> Iterator[Plane]:
        for image in self.images:
            yield _hounsfield(image)


def _hounsfield(image: SliceHeader) -> Plane:
    """Pixels in Hounsfield units, nan where the file holds padding.

    Raises:
        VolumeError: The pixels cannot be decoded.
    """
    stored = _stored(image)
    values = stored.astype(np.float32) * np.float32(image.slope)
    values += np.float32(image.intercept)
    if image.padding is not None:
        values[stored == image.padding] = np.nan
    return values


def _stored(image: SliceHeader) -> Any:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            dataset = library("pydicom").dcmread(image.file)
            _refuse_bombs(image, dataset)
            pixels = dataset.pixel_array
    except VolumeError:
        raise
    except Exception as error:
        raise VolumeError(
            image.file, f"its pixels cannot be read ({told_by(error)})"
        ) from error
    if pixels.shape != image.size:
        raise VolumeError(
            image.file, f"its pixels are {pixels.shape}, not {image.size} as it states"
        )
    return pixels


def _refuse_bombs(image: SliceHeader, dataset: Any) -> None:
    """A small file that claims pixels which would fill the memory."""
    rows, columns = image.size
    if (int(dataset.Rows), int(dataset.Columns)) != image.size:
        raise VolumeError(image.file, "changed while it was read")
    if max(rows, columns) > 8192:
        raise VolumeError(image.file, f"claims {rows} x {columns} pixels")
