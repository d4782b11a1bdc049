"""Wavefront OBJ files: vertices and faces only (no normals, textures, materials).

Why an own reader: trimesh takes 1.6 s to import and reorders faces by material;
meshio reads negative indices wrongly and raises whatever numpy raises.
"""

import re
from collections.abc import Iterator
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import MeshError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.frames import stated_in
from borecheck.geometry.mesh_files.numbers import integer, number, shown
from borecheck.geometry.mesh_files.polygons import RawMesh, fan
from borecheck.geometry.mesh_files.text_ends import trimmed

File = str | PathLike[str]

# Statements that move no vertex and make no surface. All others (free-form curves
# and surfaces, calls of other files) would be geometry lost in silence: refused.
_WITHOUT_SURFACE = frozenset(
    b"vt vn vp g o s mg usemtl usemap mtllib maplib l p bevel c_interp d_interp "
    b"lod shadow_obj trace_obj".split()
)

_COMMENT = re.compile(rb"#[^\r\n]*")


def parse_obj(data: bytes, file: File) -> RawMesh:
    """Vertices and faces in file order; polygons become fans of triangles.

    Raises:
        MeshError: A line that is no OBJ statement, a last line without end of a mesh
            that is not closed, an index without vertex, or a face that a fan does not
            cover.
    """
    data, warnings = trimmed(data)
    vertices: list[list[float]] = []
    counts: list[int] = []
    indices: list[int] = []
    for at, words in _statements(data):
        if words[0] == b"v":
            vertices.append(_vertex(words, file, at))
        elif words[0] == b"f":
            counts.append(len(words) - 1)
            indices.extend(_index(word, len(vertices), file, at) for word in words[1:])
        elif words[0] not in _WITHOUT_SURFACE:
            raise MeshError(
                file, f"{shown(words[0])} is no statement known here", f"line {at}"
            )
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    faces = np.array(counts, dtype=np.int64)
    triangles = fan(points, faces, np.array(indices, dtype=np.int64), file)
    if warnings or not data.endswith((b"\n", b"\r")):
        # OBJ has no end mark. "f 7 8 1" may be the begin of "f 7 8 12".
        if not _is_whole(points, triangles):
            raise MeshError(file, "the last line has no line end: cut short?")
        warnings = (*warnings, "its last line has no end, but its surface is closed")
    frame = stated_in(_COMMENT.findall(data), file)
    return RawMesh(points, triangles, frame=frame, warnings=warnings)


def _is_whole(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> bool:
    """Whether nothing can be missing: a closed surface that uses every vertex."""
    if not len(triangles) or not np.isfinite(points).all():
        return False
    if not np.array_equal(np.unique(triangles), np.arange(len(points))):
        return False
    return TriangleMesh("obj", points, triangles).is_closed


def _statements(data: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """First line number and words of every statement, continued lines joined."""
    begun: list[bytes] = []
    for at, line in enumerate(data.splitlines(), start=1):
        text = line.split(b"#", 1)[0].rstrip()
        begun.extend(text.removesuffix(b"\\").split())
        if begun and not text.endswith(b"\\"):
            yield at, begun
            begun = []
    if begun:
        yield at, begun


def _vertex(words: list[bytes], file: File, at: int) -> list[float]:
    numbers = [number(word, file, at) for word in words[1:]]
    if len(numbers) not in (3, 4, 6, 7):  # x y z [w] [r g b]
        raise MeshError(file, f"a vertex of {len(numbers)} numbers", f"line {at}")
    if len(numbers) == 4 and numbers[3] != 1.0:
        raise MeshError(file, f"vertex weight {numbers[3]}, not 1", f"line {at}")
    return numbers[:3]


def _index(word: bytes, n_vertices: int, file: File, at: int) -> int:
    """Index from 0 of `7`, `7/2`, `7//3`, `7/2/3`, or `-1` for the latest vertex."""
    index = integer(word.split(b"/", 1)[0], file, at)
    zero_based = n_vertices + index if index < 0 else index - 1
    if index == 0 or zero_based < 0:
        raise MeshError(file, f"names vertex {index}, which is none", f"line {at}")
    return zero_based
