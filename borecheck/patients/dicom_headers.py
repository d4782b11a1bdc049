"""What a DICOM file says of its image: the tags that place it, and no other.

Tags that name a person, a place or a time are never read. A file that is no slice of a
scan is left out with a reason; a slice that lacks what places it keeps its fault.
"""

import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.patients.libraries import library
from borecheck.patients.volume import FARTHEST_MM, Array, VolumeError, told_by

# The whole list of what is read.
TAGS = (
    *("SOPClassUID", "SOPInstanceUID", "SeriesInstanceUID", "FrameOfReferenceUID"),
    *("Modality", "ImageType", "SamplesPerPixel", "PatientPosition"),
    *("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"),
    *("Rows", "Columns", "NumberOfFrames", "PhotometricInterpretation"),
    *("BitsAllocated", "BitsStored", "HighBit", "PixelRepresentation"),
    *("PixelPaddingValue", "RescaleSlope", "RescaleIntercept", "RescaleType"),
    *("ReconstructionDiameter", "ReconstructionTargetCenterPatient"),
    *("ConvolutionKernel", "AcquisitionNumber"),
)

MOST_FILES = 20_000

_SECONDARY_CAPTURE = "1.2.840.10008.5.1.4.1.1.7"
_DIRECTORY = "1.2.840.10008.1.3.10"
_DEFLATED = "1.2.840.10008.1.2.1.99"


@dataclass(frozen=True)
class SliceHeader:
    """One image.

    Attributes:
        file: Where it is.
        origin: Centre of its first pixel, LPS, [mm].
        orientation: Directions of a row and of a column, six cosines.
        spacing: Distance of rows, of columns, [mm].
        size: Rows, columns.
        series: UID, or empty.
        frame: UID of the frame of reference, or empty.
        instance: UID of the image, or empty.
        position: Patient position, or empty.
        kernel: Of the reconstruction.
        acquisition: Number, as text.
        slope: To Hounsfield units.
        intercept: To Hounsfield units.
        padding: Stored value that is no tissue.
        diameter: Of the reconstructed circle, [mm].
        target: Its centre, LPS, [mm].
    """

    file: Path
    origin: tuple[float, ...]
    orientation: tuple[float, ...]
    spacing: tuple[float, float]
    size: tuple[int, int]
    series: str
    frame: str
    instance: str
    position: str
    kernel: str
    acquisition: str
    slope: float
    intercept: float
    padding: int | None
    diameter: float | None
    target: tuple[float, ...] | None

    @property
    def row(self) -> Array:
        """Along a row, (3,)."""
        return np.array(self.orientation[:3])

    @property
    def column(self) -> Array:
        """Along a column, (3,)."""
        return np.array(self.orientation[3:])

    @property
    def normal(self) -> Array:
        """Of the image's plane, (3,)."""
        return np.cross(self.row, self.column)


@dataclass(frozen=True)
class Folder:
    """What lies in a folder.

    Attributes:
        slices: Images that can be placed.
        faults: Images of a scan that cannot: series, file name, what is missing.
        dropped: Names of files that are no slices of a scan, and why.
    """

    slices: tuple[SliceHeader, ...]
    faults: tuple[tuple[str, str, str], ...]
    dropped: tuple[tuple[str, str], ...]


class _NoSliceError(Exception):
    """A file that is no slice of a scan; the text is the reason."""


class _FaultyError(Exception):
    """A slice that cannot be placed; series and reason."""


def read_folder(
    folder: Path, progress: Callable[[int, int], None] | None = None
) -> Folder:
    """All files below a folder, in no order that matters.

    Raises:
        VolumeError: More files than any scan has.
    """
    files = _files_below(folder)
    slices, faults, dropped = [], [], []
    for k, file in enumerate(files):
        name = str(file.relative_to(folder)) if file != folder else file.name
        try:
            slices.append(read_header(file))
        except _NoSliceError as reason:
            dropped.append((name, str(reason)))
        except _FaultyError as fault:
            series, problem = fault.args
            faults.append((series, name, problem))
        if progress is not None:
            progress(k + 1, len(files))
    return Folder(tuple(slices), tuple(faults), tuple(dropped))


def _files_below(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return [folder]
    found = []
    for top, folders, names in os.walk(folder):
        folders.sort()
        found += [Path(top) / name for name in sorted(names)]
        if len(found) > MOST_FILES:
            raise VolumeError(folder, f"holds more than {MOST_FILES:,} files")
    if not found:
        raise VolumeError(folder, "is empty")
    return [file for file in found if file.is_file()]


def read_header(file: Path) -> SliceHeader:
    """One file's image, without its pixels.

    Raises:
        _NoSliceError: It is no slice of a scan.
        _FaultyError: It is one that cannot be placed.
    """
    tags = _tags(file)
    series = ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _refuse_others(tags)
            series = _text(tags, "SeriesInstanceUID")
            return _header(file, tags, series)
    except (_NoSliceError, _FaultyError):
        raise
    except Exception as error:
        raise _FaultyError(series, f"a tag is malformed ({told_by(error)})") from error


def _tags(file: Path) -> Any:
    pydicom = library("pydicom")
    errors = library("pydicom.errors")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what matters is checked tag by tag
            meta = library("pydicom.filereader").read_file_meta_info(file)
            if str(meta.get("TransferSyntaxUID", "")) == _DEFLATED:
                raise _NoSliceError("is deflated DICOM, which is not read")
            return pydicom.dcmread(
                file, stop_before_pixels=True, specific_tags=list(TAGS)
            )
    except _NoSliceError:
        raise
    except (errors.InvalidDicomError, IsADirectoryError):
        raise _NoSliceError("is not DICOM") from None
    except PermissionError:
        raise _NoSliceError("no permission to read it") from None
    except Exception as error:
        raise _NoSliceError(
            f"is not DICOM that can be read ({told_by(error)})"
        ) from error


def _refuse_others(tags: Any) -> None:
    """Whatever is no single grey slice of a CT."""
    if _text(tags, "Rows") == "":
        raise _NoSliceError("holds no image")
    sop = _text(tags, "SOPClassUID")
    if sop == _DIRECTORY:
        raise _NoSliceError("is a DICOM directory")
    if sop.startswith(_SECONDARY_CAPTURE):
        raise _NoSliceError("is a secondary capture, not a scan")
    if "LOCALIZER" in _texts(tags, "ImageType"):
        raise _NoSliceError("is a localizer (scout)")
    if _text(tags, "SamplesPerPixel") not in ("", "1"):
        raise _NoSliceError("is a colour image")
    if _text(tags, "NumberOfFrames") not in ("", "1"):
        raise _NoSliceError(
            "holds several frames (enhanced DICOM): convert it to slices"
        )
    if _text(tags, "PhotometricInterpretation") not in ("", "MONOCHROME2"):
        raise _NoSliceError("is no picture of black air and white bone (photometric)")
    modality = _text(tags, "Modality")
    if modality != "CT":
        raise _NoSliceError(f"is no CT (modality {modality[:16] or 'not stated'})")


def _header(file: Path, tags: Any, series: str) -> SliceHeader:
    def numbers(name: str, count: int) -> tuple[float, ...]:
        value = tags.get(name)
        if value is None or value == "":
            raise _FaultyError(series, f"{name} is missing")
        found = tuple(float(x) for x in np.atleast_1d(value))
        if len(found) != count or not np.isfinite(found).all():
            raise _FaultyError(series, f"{name} is not {count} numbers")
        if max(map(abs, found)) > FARTHEST_MM:
            raise _FaultyError(series, f"{name} is beyond 100 m")
        return found

    origin = numbers("ImagePositionPatient", 3)
    orientation = numbers("ImageOrientationPatient", 6)
    _refuse_skewed(orientation, series)
    down, across = numbers("PixelSpacing", 2)
    target = tags.get("ReconstructionTargetCenterPatient")
    diameter = tags.get("ReconstructionDiameter")
    padding = tags.get("PixelPaddingValue")
    size = int(numbers("Rows", 1)[0]), int(numbers("Columns", 1)[0])
    return SliceHeader(
        file=file,
        origin=origin,
        orientation=orientation,
        spacing=(down, across),
        size=size,
        series=series,
        frame=_text(tags, "FrameOfReferenceUID"),
        instance=_text(tags, "SOPInstanceUID"),
        position=_text(tags, "PatientPosition"),
        kernel="/".join(_texts(tags, "ConvolutionKernel")),
        acquisition=_text(tags, "AcquisitionNumber"),
        slope=_slope(tags, numbers("RescaleSlope", 1)[0], series),
        intercept=numbers("RescaleIntercept", 1)[0],
        padding=None if padding in (None, "") else int(padding),
        diameter=None
        if diameter in (None, "")
        else numbers("ReconstructionDiameter", 1)[0],
        target=None
        if target is None or target == ""
        else numbers("ReconstructionTargetCenterPatient", 3),
    )


def _slope(tags: Any, slope: float, series: str) -> float:
    unit = _text(tags, "RescaleType")
    if not slope > 0.0:
        raise _FaultyError(series, f"RescaleSlope is {slope:g}")
    if unit not in ("", "HU"):
        raise _FaultyError(series, f"RescaleType is {unit[:16]}, not HU")
    return slope


def _refuse_skewed(orientation: tuple[float, ...], series: str) -> None:
    row, column = np.array(orientation[:3]), np.array(orientation[3:])
    lengths = np.array([row @ row, column @ column])
    if np.abs(lengths - 1.0).max() > 1e-3 or abs(row @ column) > 1e-3:
        raise _FaultyError(
            series, "ImageOrientationPatient is no pair of unit vectors at right angles"
        )


def _text(tags: Any, name: str) -> str:
    value = tags.get(name)
    return "" if value is None else str(value).strip()


def _texts(tags: Any, name: str) -> list[str]:
    value = tags.get(name)
    if value is None:
        return []
    many = [value] if isinstance(value, str) else value
    return [str(word).strip() for word in np.atleast_1d(many)]
