"""PLY files, text and binary of both byte orders.

Why an own reader: trimesh takes 1.6 s to import; meshio knows `vertex_indices` but
not `vertex_index`, reads uchar as signed, and takes words for NaN.
"""

import re
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import MeshError
from borecheck.geometry.mesh_files.frames import stated_in
from borecheck.geometry.mesh_files.numbers import shown
from borecheck.geometry.mesh_files.ply_header import (
    CORNER_LISTS,
    Element,
    Property,
    read_header,
)
from borecheck.geometry.mesh_files.polygons import RawMesh, fan
from borecheck.geometry.mesh_files.text_ends import trimmed, without_mark

File = str | PathLike[str]

_COMMENT = re.compile(rb"^(?:comment|obj_info)[^\r\n]*", re.M)
_Columns = dict[bytes, NDArray[np.float64]]
_Lists = tuple[NDArray[np.int64], NDArray[np.float64]]  # counts, all items


def parse_ply(data: bytes, file: File) -> RawMesh:
    """Vertices and faces in file order; polygons become fans of triangles.

    Raises:
        MeshError: Cut short, bytes left over, a header that makes no sense, or faces
            that cannot be cut into triangles.
    """
    data = without_mark(data)
    order, elements, at = read_header(data, file)
    warnings: tuple[str, ...] = ()
    source: _Binary | _Text
    if order:  # of a binary file every byte counts
        source = _Binary(data, at, order, file)
    else:
        body, warnings = trimmed(data[at:])
        source = _Text(body, file)
    vertices = np.zeros((0, 3))
    counts = np.zeros(0, dtype=np.int64)
    indices = np.zeros(0, dtype=np.int64)
    for element in elements:
        columns, lists = source.read(element)
        if element.name == b"vertex":
            vertices = _points(columns, file)
        elif element.name == b"face":
            counts, indices = _faces(lists, file)
        elif element.name == b"tristrips":
            raise MeshError(file, "holds triangle strips, not faces: export triangles")
    source.check_end()
    triangles = fan(vertices, counts, indices, file)
    frame = stated_in(_COMMENT.findall(data[:at]), file)
    return RawMesh(vertices, triangles, frame=frame, warnings=warnings)


def _points(columns: _Columns, file: File) -> NDArray[np.float64]:
    missing = [axis for axis in (b"x", b"y", b"z") if axis not in columns]
    if missing:
        raise MeshError(file, f"vertices have no {missing[0].decode()}", "header")
    return np.stack([columns[b"x"], columns[b"y"], columns[b"z"]], axis=1)


def _faces(
    lists: dict[bytes, _Lists], file: File
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    for name in CORNER_LISTS:
        if name in lists:
            counts, items = lists[name]
            return counts, items.astype(np.int64)
    raise MeshError(file, "faces have no list vertex_indices", "header")


class _Binary:
    """The body of a binary file; nothing is allocated that the bytes do not fill."""

    def __init__(self, data: bytes, at: int, order: str, file: File) -> None:
        self.data, self.at, self.order, self.file = data, at, order, file

    def read(self, element: Element) -> tuple[_Columns, dict[bytes, _Lists]]:
        smallest = sum(
            np.dtype(p.count_type or p.type).itemsize for p in element.properties
        )
        if element.count * smallest > len(self.data) - self.at:
            raise self._cut_short(element)
        if all(p.count_type is None for p in element.properties):
            return self._read_fixed(element, element.properties), {}
        return self._read_equal_lists(element) or self._read_rows(element)

    def _read_fixed(
        self, element: Element, properties: tuple[Property, ...]
    ) -> _Columns:
        fields = [(f"p{i}", self.order + p.type) for i, p in enumerate(properties)]
        row = np.dtype(fields)
        if row.itemsize == 0:
            return {}
        rows = np.frombuffer(self.data, row, element.count, self.at)
        self.at += element.count * row.itemsize
        with np.errstate(invalid="ignore"):
            return {
                p.name: rows[f"p{i}"].astype(np.float64)
                for i, p in enumerate(properties)
            }

    def _read_equal_lists(
        self, element: Element
    ) -> tuple[_Columns, dict[bytes, _Lists]] | None:
        """The usual case at full speed: one list, always of the same length."""
        if len(element.properties) != 1 or element.count == 0:
            return None
        (only,) = element.properties
        count_type = np.dtype(self.order + str(only.count_type))
        length = int(np.frombuffer(self.data, count_type, 1, self.at)[0])
        if not 0 <= length <= 16:
            return None
        row = np.dtype([("n", count_type), ("items", self.order + only.type, length)])
        if element.count * row.itemsize > len(self.data) - self.at:
            return None
        rows = np.frombuffer(self.data, row, element.count, self.at)
        if not (rows["n"] == length).all():
            return None
        self.at += element.count * row.itemsize
        counts = np.full(element.count, length, dtype=np.int64)
        return {}, {only.name: (counts, rows["items"].astype(np.float64).reshape(-1))}

    def _read_rows(self, element: Element) -> tuple[_Columns, dict[bytes, _Lists]]:
        rows = _Rows(element)
        for _ in range(element.count):
            for p in element.properties:
                n = 1
                if p.count_type is not None:
                    n = int(self._take(p.count_type, 1, element)[0])
                rows.add(p, self._take(p.type, n, element))
        return rows.finish()

    def _take(self, kind: str, n: int, element: Element) -> NDArray[np.float64]:
        size = np.dtype(kind).itemsize * n
        if n < 0 or size > len(self.data) - self.at:
            raise self._cut_short(element)
        items = np.frombuffer(self.data, self.order + kind, n, self.at)
        self.at += size
        with np.errstate(invalid="ignore"):
            return items.astype(np.float64)

    def _cut_short(self, element: Element) -> MeshError:
        return MeshError(
            self.file,
            f"cut short or damaged: {element.count} {_said(element)} do not fit",
        )

    def check_end(self) -> None:
        left = len(self.data) - self.at
        if left:
            raise MeshError(self.file, f"{left} bytes more than the header says")


class _Text:
    """The body of a text file, word by word."""

    def __init__(self, body: bytes, file: File) -> None:
        self.words, self.at, self.file = body.split(), 0, file
        self.ends_with_line = body.endswith((b"\n", b"\r"))

    def read(self, element: Element) -> tuple[_Columns, dict[bytes, _Lists]]:
        rows = _Rows(element)
        if element.count * len(element.properties) > len(self.words) - self.at:
            raise self._cut_short(element)
        if not element.properties:
            return {}, {}
        for _ in range(element.count):
            for p in element.properties:
                n = 1
                if p.count_type is not None:
                    n = int(self._take("i8", 1, element)[0])
                rows.add(p, self._take(p.type, n, element))
        return rows.finish()

    def _take(self, kind: str, n: int, element: Element) -> list[float]:
        words = self.words[self.at : self.at + max(n, 0)]
        if n < 0 or len(words) < n:
            raise self._cut_short(element)
        self.at += n
        try:
            if any(b"_" in word for word in words):
                raise ValueError
            if "f" in kind:
                return [float(word) for word in words]
            return [int(word) if len(word) < 18 else _no_number() for word in words]
        except ValueError:
            text = shown(b" ".join(words))
            raise MeshError(self.file, f"{text} in {_said(element)}") from None

    def _cut_short(self, element: Element) -> MeshError:
        return MeshError(
            self.file, f"cut short: {element.count} {_said(element)} are not all there"
        )

    def check_end(self) -> None:
        if not self.ends_with_line:  # "3 1 2 1" may be the begin of "3 1 2 12"
            raise MeshError(self.file, "the last line has no line end: cut short?")
        left = len(self.words) - self.at
        if left:
            raise MeshError(self.file, f"{left} words more than the header says")


class _Rows:
    """Values of one element, gathered row by row."""

    def __init__(self, element: Element) -> None:
        self.element = element
        self.scalars: dict[bytes, list[float]] = {}
        self.counts: dict[bytes, list[int]] = {}
        self.items: dict[bytes, list[float]] = {}
        for p in element.properties:
            if p.count_type is None:
                self.scalars[p.name] = []
            else:
                self.counts[p.name], self.items[p.name] = [], []

    def add(self, p: Property, values: "list[float] | NDArray[np.float64]") -> None:
        if p.count_type is None:
            self.scalars[p.name].append(float(values[0]))
        else:
            self.counts[p.name].append(len(values))
            self.items[p.name].extend(float(v) for v in values)

    def finish(self) -> tuple[_Columns, dict[bytes, _Lists]]:
        columns = {name: np.array(v) for name, v in self.scalars.items()}
        lists = {
            name: (np.array(counts, dtype=np.int64), np.array(self.items[name]))
            for name, counts in self.counts.items()
        }
        return columns, lists


def _no_number() -> float:
    raise ValueError


def _said(element: Element) -> str:
    return f"elements {shown(element.name)}"
