"""Any scan as a volume: a DICOM folder, NIfTI, NRRD, segmentations of Slicer."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from borecheck.patients.dicom_headers import read_folder
from borecheck.patients.dicom_series import series_of
from borecheck.patients.dicom_volume import read_series
from borecheck.patients.nifti_volume import read_nifti
from borecheck.patients.nrrd_volume import read_nrrd
from borecheck.patients.volume import Volume, VolumeError, steps_told

_NIFTI = (".nii", ".nii.gz")
_NRRD = (".nrrd",)

Progress = Callable[[int, int], None]


def read_volume(
    path: Path, series: str | None = None, progress: Progress | None = None
) -> Volume:
    """The volume that lies there; its voxels are read when they are asked for.

    Args:
        path: A folder, or a file.
        series: Of a folder with several: UID or number.
        progress: Called with files done and all files.

    Raises:
        VolumeError: Nothing that can be read; the line names file and cause.
        UsageError: A library of the extra `ct` is not installed.
    """
    _refuse_absent(path)
    volume = _read(path, series, progress)
    return replace(volume, notes=(*volume.notes, *steps_told(volume)))


def _read(path: Path, series: str | None, progress: Progress | None) -> Volume:
    name = path.name.lower()
    if path.is_file() and name.endswith((*_NIFTI, *_NRRD)):
        if series is not None:
            raise VolumeError(path, "is one volume: leave out --series")
        return read_nifti(path) if name.endswith(_NIFTI) else read_nrrd(path)
    return read_series(path, series, progress)


def list_series(path: Path, progress: Progress | None = None) -> list[dict[str, Any]]:
    """What a folder holds, for `--list`.

    Raises:
        VolumeError: It is no folder of DICOM files.
    """
    _refuse_absent(path)
    if path.is_file():
        raise VolumeError(path, "is a file: --list shows the series of a folder")
    return [one.to_json() for one in series_of(read_folder(path, progress))]


def _refuse_absent(path: Path) -> None:
    try:
        found = path.exists()
    except OSError as error:
        raise VolumeError(path, f"cannot be read: {error.strerror}") from error
    if not found:
        raise VolumeError(path, "there is no such file or folder")
