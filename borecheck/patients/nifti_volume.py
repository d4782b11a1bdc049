"""NIfTI files as volumes: world axes RAS become LPS, the affine as it is stated."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.patient_frame import LPS_FROM_RAS
from borecheck.patients.libraries import library
from borecheck.patients.raw_slices import raw_slices
from borecheck.patients.values import kind_of
from borecheck.patients.volume import Plane, Volume, VolumeError, told_by

Array = NDArray[np.float64]

_MM = {"mm": 1.0, "meter": 1000.0, "micron": 0.001, "unknown": 1.0}

# Two affines of one file may differ by so much at its corners, [mm].
_AGREE_MM = 1.0

# No header with its extensions is longer, [bytes].
_FARTHEST_VOXELS = 1 << 24


def read_nifti(path: Path) -> Volume:
    """The volume of a `.nii` or `.nii.gz` file.

    Raises:
        VolumeError: It cannot be read, or states no place.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what is read is checked below
            M, origin, planes, notes = _stated(path, *_header(path))
    except VolumeError:
        raise
    except Exception as error:
        raise VolumeError(
            path, f"its header cannot be read ({told_by(error)})"
        ) from error
    shape = planes.shape
    return Volume(
        file=str(path),
        kind=kind_of(path, planes),
        origins=origin + np.outer(np.arange(shape[2]), M[:, 2]),
        across=M[:, 0],
        down=M[:, 1],
        rows=shape[1],
        columns=shape[0],
        planes=planes,
        notes=("world axes are RAS, turned to LPS", *notes),
    )


def _stated(
    path: Path, header: Any, offset: int
) -> tuple[Array, Array, "_Planes", tuple[str, ...]]:
    """Directions (3, 3) and origin in LPS, [mm]; the voxels; what is said about it."""
    shape = tuple(int(n) for n in header.get_data_shape())
    if len(shape) < 3 or any(n != 1 for n in shape[3:]):
        raise VolumeError(path, f"holds an image of {shape}, not one volume")
    affine = _affine(path, header, shape)
    unit = header.get_xyzt_units()[0]
    scale = _MM.get(unit, 1.0)
    M = LPS_FROM_RAS @ affine[:3, :3] * scale
    origin = LPS_FROM_RAS @ affine[:3, 3] * scale
    planes = _Planes(path, offset, shape[:3], header.get_data_dtype(), _slope(header))
    usual = "states no unit of length: NIfTI's usual one, mm, is taken"
    return M, origin, planes, (usual,) if unit == "unknown" else ()


def _header(path: Path) -> tuple[Any, int]:
    """Nibabel's header, and where the voxels begin."""
    nibabel = library("nibabel")
    try:
        image = nibabel.load(path)
        if not isinstance(image, nibabel.Nifti1Image):  # Nifti2Image is one, too
            raise VolumeError(path, "is no NIfTI file in one piece")
        offset = int(image.dataobj.offset)
        if not 0 <= offset <= _FARTHEST_VOXELS:
            raise VolumeError(path, f"its voxels begin at byte {offset}")
        return image.header, offset
    except VolumeError:
        raise
    except Exception as error:
        raise VolumeError(
            path, f"is no NIfTI file that can be read ({told_by(error)})"
        ) from error


def _affine(path: Path, header: Any, shape: tuple[int, ...]) -> Array:
    """From voxel numbers to RAS, (4, 4).

    Raises:
        VolumeError: The file states none, or two that differ.
    """
    q, has_q = header.get_qform(coded=True)
    s, has_s = header.get_sform(coded=True)
    if not has_q and not has_s:
        raise VolumeError(path, "states no place (sform and qform codes are 0)")
    if has_q and has_s:
        ends = np.array(np.meshgrid(*[(0, n - 1) for n in shape[:3]])).reshape(3, -1)
        apart = (s[:3, :3] - q[:3, :3]) @ ends + (s[:3, 3] - q[:3, 3])[:, None]
        most = float(np.linalg.norm(apart, axis=0).max())
        if not most <= _AGREE_MM:
            raise VolumeError(
                path, f"sform and qform differ by {most:.3g} mm: which is right?"
            )
    return np.array(s if has_s else q, dtype=np.float64)


def _slope(header: Any) -> tuple[float, float]:
    slope, intercept = header.get_slope_inter()
    return (
        1.0 if slope is None else float(slope),
        0.0 if intercept is None else float(intercept),
    )


@dataclass(frozen=True)
class _Planes:
    """Reads slices of the last axis, one after the other."""

    path: Path
    offset: int
    shape: tuple[int, ...]
    dtype: Any
    scaling: tuple[float, float] = field(default=(1.0, 0.0))

    def __call__(self) -> Iterator[Plane]:
        columns, rows, slices = self.shape
        slope, intercept = self.scaling
        gz = self.path.suffix.lower() == ".gz"
        found = raw_slices(
            self.path, self.offset, slices, columns * rows, self.dtype, gz=gz
        )
        for values in found:
            plane = values.astype(np.float32).reshape(rows, columns)
            yield plane * np.float32(slope) + np.float32(intercept)
