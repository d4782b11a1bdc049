"""STL files, binary and text.

Why an own reader: trimesh takes 1.6 s to import; meshio passes a text file cut short
and takes any line with three words at its end for a vertex; numpy-stl rounds text to
float32. This one refuses what is not whole, and keeps every number: the float32 of a
binary file becomes the same number in float64, text is read as float64.

STL repeats the corners of every triangle. They stay so: triangle k has the vertices
3k, 3k+1, 3k+2. Nothing is merged; who needs neighbours compares coordinates.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.core.whole_files import write_whole
from borecheck.errors import GeometryError, InputError, MeshError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.frames import stated_in
from borecheck.geometry.mesh_files.numbers import number, shown
from borecheck.geometry.mesh_files.polygons import RawMesh
from borecheck.geometry.mesh_files.text_ends import trimmed, without_mark

File = str | PathLike[str]

OURS = b"borecheck"  # what a file that we wrote begins with
_HEADER = 80
_LOOKED_AT = 1024  # bytes that tell text from binary
# Lines of comment may stand before the first solid.
_FIRST_SOLID = re.compile(rb"(?:\s|[#;!][^\r\n]*[\r\n]|//[^\r\n]*[\r\n])*solid", re.I)
_COMMENTS = (b"#", b";", b"!", b"//")
_NAME_LINES = re.compile(rb"^[ \t]*(?:end)?solid[^\r\n]*", re.I | re.M)
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])


def parse_stl(data: bytes, file: File) -> RawMesh:
    """The triangles of an STL file, in file order; the normals are not used.

    Raises:
        MeshError: Cut short, longer than it says, or no STL.
    """
    if _is_binary(data):
        return _parse_binary(data, file)
    text, warnings = trimmed(data)
    is_text = b"\0" not in text[:_LOOKED_AT]
    if is_text and _FIRST_SOLID.match(text[:_LOOKED_AT]):
        return _parse_text(text, file, warnings)
    is_long = len(text) >= _HEADER + 4
    says_why = _no_solid if is_text and is_long else _what_is_wrong
    raise MeshError(file, says_why(data))


def write_stl(path: Path, mesh: TriangleMesh) -> None:
    """Write a binary STL, whole or not at all; coordinates are rounded to float32.

    Raises:
        MeshError: The folder cannot be written, or a coordinate does not fit float32.
    """
    content = stl_bytes(path, mesh)
    try:
        write_whole(path, content)
    except InputError as error:
        raise MeshError(path, error.problem) from error


def stl_bytes(path: Path, mesh: TriangleMesh) -> bytes:
    """What `write_stl` writes.

    Raises:
        MeshError: A coordinate does not fit float32; it names the file that was meant.
    """
    try:
        return binary_stl(mesh.corners, OURS + b", metres")
    except GeometryError as error:
        raise MeshError(path, str(error)) from error


def binary_stl(corners: NDArray[np.float64], header: bytes) -> bytes:
    """Triangles as binary STL, rounded to float32.

    Args:
        corners: (n, 3, 3), in the file's unit.
        header: What the file says of itself, at most 80 bytes.

    Raises:
        GeometryError: A coordinate does not fit float32.
    """
    records = np.zeros(len(corners), dtype=_RECORD)
    with np.errstate(over="ignore"):
        records["corners"] = corners
    if not np.isfinite(records["corners"]).all():
        raise GeometryError("a coordinate is too large for STL (float32)")
    records["normal"] = _unit_normals(corners)
    count = np.array(len(records), dtype="<u4").tobytes()
    return header.ljust(_HEADER) + count + records.tobytes()


def _is_binary(data: bytes) -> bool:
    """Whether the size is what the triangle count asks for ("solid" proves nothing)."""
    return len(data) >= _HEADER + 4 and len(data) == _expected_size(data)


def _expected_size(data: bytes) -> int:
    count = int.from_bytes(data[_HEADER : _HEADER + 4], "little")
    return _HEADER + 4 + count * _RECORD.itemsize


def _no_solid(text: bytes) -> str:
    first = without_mark(text).split(maxsplit=1)[:1] or [b""]
    return f"no STL file: it begins with {shown(first[0])}, not with solid"


def _what_is_wrong(data: bytes) -> str:
    if len(data) < _HEADER + 4:
        return f"too short for an STL file ({len(data)} bytes)"
    says = int.from_bytes(data[_HEADER : _HEADER + 4], "little")
    holds = (len(data) - _HEADER - 4) // _RECORD.itemsize
    if holds < says:
        return f"cut short: the header says {says} triangles, {holds} are there"
    extra = len(data) - _expected_size(data)
    return f"{extra} bytes too many for the {says} triangles that the header says"


def _parse_binary(data: bytes, file: File) -> RawMesh:
    records = np.frombuffer(data, dtype=_RECORD, offset=_HEADER + 4)
    with np.errstate(invalid="ignore"):  # a signalling NaN is reported later
        corners = records["corners"].astype(np.float64)
    return replace(_soup(corners), frame=stated_in([data[:_HEADER]], file))


def _parse_text(data: bytes, file: File, warnings: tuple[str, ...]) -> RawMesh:
    corners: list[float] = []
    lines = _words(data)
    for at, words in lines:
        if not corners and words[0].startswith(_COMMENTS):
            continue
        if words[0] != b"solid":
            raise MeshError(file, f"{shown(words[0])} outside of a solid", f"line {at}")
        _read_solid(lines, corners, file)
    soup = _soup(np.array(corners, dtype=np.float64).reshape(-1, 3, 3))
    before = data[: data.lower().find(b"solid")]
    frame = stated_in([before, *_NAME_LINES.findall(data)], file)
    return replace(soup, frame=frame, warnings=warnings)


def _read_solid(
    lines: Iterator[tuple[int, list[bytes]]], corners: list[float], file: File
) -> None:
    for at, words in lines:
        if words[0] == b"endsolid":
            return
        if words[0] != b"facet":
            raise MeshError(
                file, f"{shown(words[0])} where facet or endsolid is due", f"line {at}"
            )
        _expect(lines, b"outer", file)
        for _ in range(3):
            at, words = _expect(lines, b"vertex", file)
            if len(words) != 4:
                raise MeshError(file, "a vertex is not 3 numbers", f"line {at}")
            corners.extend(number(word, file, at) for word in words[1:])
        _expect(lines, b"endloop", file)
        _expect(lines, b"endfacet", file)
    raise MeshError(file, "cut short: there is no endsolid")


def _expect(
    lines: Iterator[tuple[int, list[bytes]]], keyword: bytes, file: File
) -> tuple[int, list[bytes]]:
    at, words = next(lines, (0, [b""]))
    if at == 0:
        raise MeshError(file, f"cut short: {keyword.decode()} is missing at the end")
    if words[0] != keyword:
        raise MeshError(
            file, f"{shown(words[0])} where {keyword.decode()} is due", f"line {at}"
        )
    return at, words


def _words(data: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Line number and words of every line that is not blank, in lower case."""
    for at, line in enumerate(data.splitlines(), start=1):
        words = line.lower().split()
        if words:
            yield at, words


def _soup(corners: NDArray[np.float64]) -> RawMesh:
    vertices = corners.reshape(-1, 3)
    return RawMesh(vertices, np.arange(len(vertices)).reshape(-1, 3))


def _unit_normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    a, b, c = (corners[:, k] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
