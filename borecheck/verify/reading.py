"""Certificates and their meshes from files, for `verify.check`: numpy only.

Nothing of a file is believed: sizes are bounded before memory is asked for, no object
is unpickled, a key given twice or a number that is none is refused, and every mesh is
named by a hash of its own that covers types, shapes and data.
"""

import hashlib
import io
import json
import stat
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.verify.fields import Rejected

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Arrays = tuple[Array, Indices]
Meshes = Mapping[str, Arrays] | Iterable[Arrays] | str | Path

# Larger files are not read, [bytes]: a certificate, and its meshes unpacked.
MOST_TEXT = 1 << 28
MOST_PACKED = 1 << 29
# No mesh is packed closer than this; what is, would fill the memory.
CLOSEST = 200
MOST_ARRAYS = 20_000
# No coordinate is larger, [m]: `verify.read_statement` shows what float64 carries.
LARGEST_PLACE = 1e3


class Missing(Rejected):
    """The file itself cannot be had: nothing was said about a certificate."""


def read_document(source: str | Path | Mapping[str, Any]) -> dict[str, Any]:
    """The plain values of a certificate.

    Args:
        source: A file, or its content; of content, too, a plain copy is made, so that
            what is checked cannot change.
    """
    if isinstance(source, Mapping):
        text = json.dumps(dict(source))
    else:
        data = _content(Path(source), MOST_TEXT)
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            raise Rejected("not a certificate: no text") from None
    try:
        found = json.loads(text, object_pairs_hook=_once, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise Rejected(f"not a certificate: no JSON ({error})") from None
    if type(found) is not dict:
        raise Rejected("not a certificate: no record")
    return found


def read_meshes(meshes: Meshes) -> dict[str, Arrays]:
    """Meshes by their hash, which is computed here.

    Args:
        meshes: Arrays (vertices (n, 3) [m], triangles (m, 3)) in any order or under
            any names, or the `.npz` file with them.
    """
    if isinstance(meshes, str | Path):
        found = _unpacked(Path(meshes))
    else:
        given = meshes.values() if isinstance(meshes, Mapping) else meshes
        found = [_checked(*both) for both in given]
    return {mesh_hash(*mesh): mesh for mesh in found}


def mesh_hash(vertices: Array, triangles: Indices) -> str:
    """SHA-256 over type, shape and data of both arrays, in this order."""
    digest = hashlib.sha256(b"borecheck mesh 2\n")
    for values, kind in ((vertices, "<f8"), (triangles, "<i8")):
        rows, columns = values.shape
        digest.update(f"{kind} {rows} {columns}\n".encode())
        digest.update(np.ascontiguousarray(values, dtype=kind).tobytes())
    return digest.hexdigest()


def _content(file: Path, most: int) -> bytes:
    """The bytes of an ordinary file; a pipe or device might never end."""
    try:
        if not stat.S_ISREG(file.stat().st_mode):
            raise Missing("is no ordinary file")
        with file.open("rb") as opened:
            data = opened.read(most + 1)
    except OSError as error:
        raise Missing(f"cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise Missing(f"cannot be read: {error}") from None
    if len(data) > most:
        raise Rejected(f"not read: larger than {most >> 20} MB")
    return data


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key is given twice")
    return found


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is no number")


def _unpacked(file: Path) -> list[Arrays]:
    try:
        data = _content(file, MOST_PACKED)
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _of_archive(archive)
    except Rejected as problem:
        raise Rejected(f"its meshes, {file.name}: {problem}") from None
    except Exception as error:  # noqa: BLE001 - a damaged archive raises anything
        raise Rejected(
            f"its meshes, {file.name}: cannot be read ({type(error).__name__})"
        ) from None


def _of_archive(archive: zipfile.ZipFile) -> list[Arrays]:
    entries = archive.infolist()
    sizes = {entry.filename: entry.file_size for entry in entries}
    if len(sizes) != len(entries) or len(entries) > MOST_ARRAYS:
        raise Rejected("a name is given twice, or there are too many")
    if sum(sizes.values()) > MOST_PACKED or any(
        entry.file_size > CLOSEST * entry.compress_size + 1_000 for entry in entries
    ):
        raise Rejected("unpacks to more than a mesh would")
    stems = {name.removesuffix(".npy").rpartition(".")[0] for name in sizes}
    if len(sizes) != 2 * len(stems):
        raise Rejected("holds something else than meshes")
    return [
        _checked(
            _numbers(archive.read(f"{stem}.vertices.npy"), "<f8"),
            _numbers(archive.read(f"{stem}.triangles.npy"), "<i8"),
        )
        for stem in sorted(stems)
    ]


def _numbers(data: bytes, kind: str) -> NDArray[Any]:
    """An array in numpy's own file form: of that type, (n, 3), and nothing else."""
    stream = io.BytesIO(data)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise Rejected("an array of an unknown form")
    shape, by_columns, dtype = np.lib.format.read_array_header_1_0(stream)
    rest = data[stream.tell() :]
    if dtype != np.dtype(kind) or by_columns or len(shape) != 2 or shape[1] != 3:
        raise Rejected("an array of another type or shape")
    if shape[0] * 24 != len(rest):
        raise Rejected("an array that is cut off")
    return np.frombuffer(rest, dtype=kind).reshape(shape)


def _checked(points: Any, corners: Any) -> Arrays:
    """Vertices and triangles that are a surface; copies."""
    given, indices = np.asarray(points), np.asarray(corners)
    if given.dtype.kind not in "fiu" or indices.dtype.kind not in "iu":
        raise Rejected("a mesh is not made of numbers")
    if given.ndim != 2 or given.shape[1] != 3 or indices.ndim != 2:
        raise Rejected("a mesh has no vertices or triangles of three")
    if indices.shape[1] != 3 or len(indices) == 0:
        raise Rejected("a mesh has no triangles of three corners")
    vertices = np.array(given, dtype=np.float64, order="C")
    if not (np.abs(vertices) <= LARGEST_PLACE).all():  # NaN is not, either
        raise Rejected(f"a mesh has a vertex that is not within {LARGEST_PLACE:g} m")
    if int(indices.min()) < 0 or int(indices.max()) >= len(vertices):
        raise Rejected("a mesh has a triangle whose corner is no vertex")
    return vertices, np.array(indices, dtype=np.int64, order="C")
