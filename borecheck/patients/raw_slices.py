"""Numbers of a file, slice by slice, compressed or not; never more than one in memory.

What a header claims is compared with what the file holds: a small file that claims a
large volume ends with one line, not with a full memory.
"""

import gzip
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.patients.volume import MOST_VOXELS, VolumeError

_CHUNK = 1 << 20


def raw_slices(
    path: Path,
    offset: int,
    slices: int,
    count: int,
    dtype: Any,
    *,
    gz: bool,
    begin: int = 0,
) -> Iterator[Any]:
    """Slices of `count` numbers each.

    Args:
        path: The file.
        offset: Where they begin, [bytes]; of what is within, if it is compressed.
        slices: How many.
        count: Numbers in each.
        dtype: Their type.
        gz: Whether the file is gzip from `begin` on.
        begin: What is before it is not looked at, [bytes].

    Raises:
        VolumeError: The file ends early, or is damaged.
    """
    kind = np.dtype(dtype)
    if kind.kind not in "iuf" or kind.itemsize > 8:
        raise VolumeError(path, f"holds {kind} numbers, which are no image")
    if slices * count > MOST_VOXELS:
        raise VolumeError(path, f"claims {slices * count:,} voxels")
    try:
        with path.open("rb") as file:
            file.seek(begin)
            stream = gzip.GzipFile(fileobj=file) if gz else file
            _exactly(stream, offset)  # gone over
            yield from _slices(path, stream, slices, count, kind)
    except (OSError, EOFError, zlib.error) as error:
        raise VolumeError(path, f"is damaged or cut short ({error})") from error


def _slices(
    path: Path, stream: Any, slices: int, count: int, kind: Any
) -> Iterator[Any]:
    size = count * kind.itemsize
    for k in range(slices):
        data = _exactly(stream, size)
        if len(data) < size:
            raise VolumeError(
                path, f"is cut short: slice {k + 1} of {slices} is not whole"
            )
        yield np.frombuffer(data, dtype=kind)


def _exactly(stream: Any, size: int) -> bytes:
    """Up to `size` bytes; memory grows with what is there, not with what is claimed."""
    parts, left = [], size
    while left > 0:
        part = stream.read(min(left, _CHUNK))
        if not part:
            break
        parts.append(part)
        left -= len(part)
    return b"".join(parts)
