"""NRRD files as volumes: CT, label maps, and segmentations of Slicer (`.seg.nrrd`)."""

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.patients.libraries import library
from borecheck.patients.raw_slices import raw_slices
from borecheck.patients.values import kind_of
from borecheck.patients.volume import (
    LABELS,
    MOST_VOXELS,
    Plane,
    Volume,
    VolumeError,
    told_by,
)

Array = NDArray[np.float64]

_TO_LPS = {
    "left-posterior-superior": (1.0, 1.0, 1.0),
    "lps": (1.0, 1.0, 1.0),
    "right-anterior-superior": (-1.0, -1.0, 1.0),
    "ras": (-1.0, -1.0, 1.0),
    "left-anterior-superior": (1.0, -1.0, 1.0),
    "las": (1.0, -1.0, 1.0),
}
_TYPES = {
    **dict.fromkeys(("signed char", "int8", "int8_t"), "i1"),
    **dict.fromkeys(("uchar", "unsigned char", "uint8", "uint8_t"), "u1"),
    **dict.fromkeys(("short", "short int", "signed short", "int16", "int16_t"), "i2"),
    **dict.fromkeys(("ushort", "unsigned short", "uint16", "uint16_t"), "u2"),
    **dict.fromkeys(("int", "signed int", "int32", "int32_t"), "i4"),
    **dict.fromkeys(("uint", "unsigned int", "uint32", "uint32_t"), "u4"),
    "float": "f4",
    "double": "f8",
}
_RAW, _GZIP = ("raw",), ("gzip", "gz")
_LONGEST_HEADER = 1 << 20


def read_nrrd(path: Path) -> Volume:
    """The volume of a `.nrrd` or `.seg.nrrd` file.

    Raises:
        VolumeError: It cannot be read, states no place, or lies in several files.
    """
    header, offset = _header(path)
    sizes, directions, layers = _axes(path, header)
    origin = _numbers(path, header, "space origin", 3)
    space = str(header.get("space", "")).lower()
    if space not in _TO_LPS:
        raise VolumeError(path, f"space {space!r} is none of {', '.join(_TO_LPS)}")
    flip = np.array(_TO_LPS[space])
    M, origin = directions * flip, origin * flip
    planes = _Planes(
        path, offset, sizes, layers, _type(path, header), _gz(path, header)
    )
    segments = _segments(header)
    return Volume(
        file=str(path),
        kind=LABELS if segments or layers > 1 else kind_of(path, planes),
        origins=origin + np.outer(np.arange(sizes[2]), M[2]),
        across=M[0],
        down=M[1],
        rows=sizes[1],
        columns=sizes[0],
        planes=planes,
        segments=segments,
    )


def _header(path: Path) -> tuple[Any, int]:
    """Pynrrd's header, and where the data begin, [bytes]."""
    nrrd = library("nrrd", "pynrrd")
    try:
        with path.open("rb") as stream:
            head = stream.read(_LONGEST_HEADER)
            end = re.search(rb"\r?\n\r?\n", head)
            if not head.startswith(b"NRRD") or end is None:
                raise VolumeError(path, "is no NRRD file with a header and data")
            stream.seek(0)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # what is read is checked below
                header = nrrd.read_header(stream)
    except (VolumeError, OSError):
        raise
    except Exception as error:
        raise VolumeError(
            path, f"its header cannot be read ({told_by(error)})"
        ) from error
    if "data file" in header or "datafile" in header:
        raise VolumeError(path, "keeps its data in another file: save it as one .nrrd")
    return header, end.end()


def _axes(path: Path, header: Any) -> tuple[tuple[int, int, int], Array, int]:
    """Sizes of the three axes in space, their directions (3, 3), layers before them."""
    try:
        sizes = [int(n) for n in header["sizes"]]
        directions = np.array(header["space directions"], dtype=np.float64)
        rows = directions.reshape(len(sizes), 3)
    except (KeyError, TypeError, ValueError, OverflowError):
        raise VolumeError(
            path, "states no sizes or no `space directions`: it has no place"
        ) from None
    layers = 1
    if len(sizes) == 4 and np.isnan(rows[0]).all():
        layers, sizes, rows = sizes[0], sizes[1:], rows[1:]
    if len(sizes) != 3 or not np.isfinite(rows).all():
        raise VolumeError(path, f"holds an image of {tuple(sizes)}, not one volume")
    if (
        min(sizes) < 1
        or layers < 1
        or layers * np.prod(sizes, dtype=float) > MOST_VOXELS
    ):
        raise VolumeError(path, f"claims {layers} x {tuple(sizes)} voxels")
    return (sizes[0], sizes[1], sizes[2]), rows, layers


def _numbers(path: Path, header: Any, name: str, count: int) -> Array:
    try:
        found = np.array(header[name], dtype=np.float64)
    except (KeyError, TypeError, ValueError):
        raise VolumeError(path, f"states no `{name}`: it has no place") from None
    if found.shape != (count,) or not np.isfinite(found).all():
        raise VolumeError(path, f"`{name}` is not {count} numbers")
    return found


def _type(path: Path, header: Any) -> Any:
    name = str(header.get("type", "")).lower()
    if name not in _TYPES:
        raise VolumeError(path, f"type {name!r} is no number of an image")
    kind = np.dtype(_TYPES[name])
    endian = str(header.get("endian", "little")).lower()
    if kind.itemsize > 1 and "endian" not in header:
        raise VolumeError(path, "states no `endian`")
    return kind.newbyteorder(">" if endian == "big" else "<")


def _gz(path: Path, header: Any) -> bool:
    encoding = str(header.get("encoding", "")).lower()
    if encoding not in (*_RAW, *_GZIP):
        raise VolumeError(path, f"encoding {encoding!r} is not read, raw and gzip are")
    if any(
        header.get(key) for key in ("line skip", "lineskip", "byte skip", "byteskip")
    ):
        raise VolumeError(path, "skips lines or bytes, which is not read")
    return encoding in _GZIP


def _segments(header: Any) -> dict[int, str]:
    """Names of Slicer's segments by label; every layer counts from its own."""
    found: dict[int, str] = {}
    for k in range(10_000):
        if f"Segment{k}_ID" not in header and f"Segment{k}_Name" not in header:
            break
        label = str(header.get(f"Segment{k}_LabelValue", k + 1))
        layer = str(header.get(f"Segment{k}_Layer", "0"))
        if label.isdecimal() and layer.isdecimal() and max(len(label), len(layer)) < 6:
            name = str(header.get(f"Segment{k}_Name", f"segment {k}"))
            found[int(layer) * 100_000 + int(label)] = name
    return found


@dataclass(frozen=True)
class _Planes:
    """Reads slices of the last axis; of several layers the highest label's place."""

    path: Path
    offset: int
    sizes: tuple[int, int, int]
    layers: int
    kind: Any
    gz: bool

    def __call__(self) -> Iterator[Plane]:
        columns, rows, slices = self.sizes
        count = columns * rows * self.layers
        found = raw_slices(
            self.path, 0, slices, count, self.kind, gz=self.gz, begin=self.offset
        )
        for values in found:
            # the first axis changes fastest
            layers = values.reshape(rows, columns, self.layers)
            yield layers.max(axis=2).astype(np.float32)
