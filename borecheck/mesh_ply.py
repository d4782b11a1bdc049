"""PLY files, text and binary of both byte orders.

Why an own reader: trimesh takes 1.6 s to import; meshio knows `vertex_indices` but
not `vertex_index`, reads uchar as signed, and takes words for NaN.
"""

from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import MeshError
from borecheck.mesh_polygons import RawMesh, fan
from borecheck.mesh_text import integer, shown

File = str | PathLike[str]

_TYPES = {
    b"char": "i1", b"int8": "i1", b"uchar": "u1", b"uint8": "u1",
    b"short": "i2", b"int16": "i2", b"ushort": "u2", b"uint16": "u2",
    b"int": "i4", b"int32": "i4", b"uint": "u4", b"uint32": "u4",
    b"float": "f4", b"float32": "f4", b"double": "f8", b"float64": "f8",
}  # fmt: skip
_ORDERS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
_CORNERS = (b"vertex_indices", b"vertex_index")
_MAX_HEADER = 1_000_000  # bytes; a header is a few hundred


@dataclass(frozen=True)
class _Property:
    name: bytes
    type: str
    count_type: str | None  # of a list


@dataclass(frozen=True)
class _Element:
    name: bytes
    count: int
    properties: tuple[_Property, ...]


_Columns = dict[bytes, NDArray[np.float64]]
_Lists = tuple[NDArray[np.int64], NDArray[np.float64]]  # counts, all items


def parse_ply(data: bytes, file: File) -> RawMesh:
    """Vertices and faces in file order; polygons become fans of triangles.

    Raises:
        MeshError: Cut short, bytes left over, a header that makes no sense, or faces
            that cannot be cut into triangles.
    """
    order, elements, at = _read_header(data, file)
    source = _Binary(data, at, order, file) if order else _Text(data[at:], file)
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
    return RawMesh(vertices, fan(vertices, counts, indices, file))


def _points(columns: _Columns, file: File) -> NDArray[np.float64]:
    missing = [axis for axis in (b"x", b"y", b"z") if axis not in columns]
    if missing:
        raise MeshError(file, f"vertices have no {missing[0].decode()}", "header")
    return np.stack([columns[b"x"], columns[b"y"], columns[b"z"]], axis=1)


def _faces(
    lists: dict[bytes, _Lists], file: File
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    for name in _CORNERS:
        if name in lists:
            counts, items = lists[name]
            return counts, items.astype(np.int64)
    raise MeshError(file, "faces have no list vertex_indices", "header")


# --- header -----------------------------------------------------------------------


def _read_header(data: bytes, file: File) -> tuple[str, list[_Element], int]:
    """Byte order ("" for text), elements, and where the body begins."""
    if data[:3] != b"ply" or data[3:4] not in (b"\n", b"\r"):
        raise MeshError(file, "does not begin with the word ply")
    order: str | None = None
    elements: list[_Element] = []
    at = data.find(b"\n") + 1
    for line_number in range(2, _MAX_HEADER):
        end = data.find(b"\n", at, _MAX_HEADER)
        if at == 0 or end < 0:
            break
        words = data[at:end].split()
        at = end + 1
        where = f"line {line_number}"
        if not words or words[0] in (b"comment", b"obj_info"):
            continue
        if words == [b"end_header"]:
            if order is None:
                raise MeshError(file, "the header names no format", where)
            return order, elements, at
        if words[0] == b"format":
            order = _order(words, file, where)
        elif words[0] == b"element" and len(words) == 3:
            count = integer(words[2], file, line_number)
            if count < 0 or any(e.name == words[1] for e in elements):
                raise MeshError(file, f"wrong element {shown(words[1])}", where)
            elements.append(_Element(words[1], count, ()))
        elif words[0] == b"property" and elements:
            elements[-1] = _with_property(elements[-1], words, file, where)
        else:
            raise MeshError(file, f"{shown(words[0])} in the header", where)
    raise MeshError(file, "cut short: the header has no end_header")


def _order(words: list[bytes], file: File, where: str) -> str:
    if len(words) != 3 or words[1] not in _ORDERS or words[2] != b"1.0":
        raise MeshError(file, "a format that is not PLY 1.0", where)
    return _ORDERS[words[1]]


def _with_property(
    element: _Element, words: list[bytes], file: File, where: str
) -> _Element:
    is_list = len(words) == 5 and words[1] == b"list"
    types = words[2:4] if is_list else words[1:2]
    unknown = [word for word in types if word not in _TYPES]
    if unknown or not (is_list or len(words) == 3):
        raise MeshError(file, f"wrong property {shown(b' '.join(words[1:]))}", where)
    count_type = _TYPES[words[2]] if is_list else None
    if (
        is_list
        and "f" in f"{count_type}{_TYPES[words[3]] if words[-1] in _CORNERS else ''}"
    ):
        raise MeshError(file, "a list counted or indexed by fractions", where)
    if any(known.name == words[-1] for known in element.properties):
        raise MeshError(file, f"property {shown(words[-1])} twice", where)
    new = _Property(words[-1], _TYPES[types[-1]], count_type)
    return _Element(element.name, element.count, (*element.properties, new))


# --- bodies -----------------------------------------------------------------------


class _Binary:
    """The body of a binary file; nothing is allocated that the bytes do not fill."""

    def __init__(self, data: bytes, at: int, order: str, file: File) -> None:
        self.data, self.at, self.order, self.file = data, at, order, file

    def read(self, element: _Element) -> tuple[_Columns, dict[bytes, _Lists]]:
        smallest = sum(
            np.dtype(p.count_type or p.type).itemsize for p in element.properties
        )
        if element.count * smallest > len(self.data) - self.at:
            raise self._cut_short(element)
        if all(p.count_type is None for p in element.properties):
            return self._read_fixed(element, element.properties), {}
        return self._read_equal_lists(element) or self._read_rows(element)

    def _read_fixed(
        self, element: _Element, properties: tuple[_Property, ...]
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
        self, element: _Element
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

    def _read_rows(self, element: _Element) -> tuple[_Columns, dict[bytes, _Lists]]:
        rows = _Rows(element)
        for _ in range(element.count):
            for p in element.properties:
                n = 1
                if p.count_type is not None:
                    n = int(self._take(p.count_type, 1, element)[0])
                rows.add(p, self._take(p.type, n, element))
        return rows.finish()

    def _take(self, kind: str, n: int, element: _Element) -> NDArray[np.float64]:
        size = np.dtype(kind).itemsize * n
        if n < 0 or size > len(self.data) - self.at:
            raise self._cut_short(element)
        items = np.frombuffer(self.data, self.order + kind, n, self.at)
        self.at += size
        with np.errstate(invalid="ignore"):
            return items.astype(np.float64)

    def _cut_short(self, element: _Element) -> MeshError:
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

    def read(self, element: _Element) -> tuple[_Columns, dict[bytes, _Lists]]:
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

    def _take(self, kind: str, n: int, element: _Element) -> list[float]:
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

    def _cut_short(self, element: _Element) -> MeshError:
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

    def __init__(self, element: _Element) -> None:
        self.element = element
        self.scalars: dict[bytes, list[float]] = {}
        self.counts: dict[bytes, list[int]] = {}
        self.items: dict[bytes, list[float]] = {}
        for p in element.properties:
            if p.count_type is None:
                self.scalars[p.name] = []
            else:
                self.counts[p.name], self.items[p.name] = [], []

    def add(self, p: _Property, values: "list[float] | NDArray[np.float64]") -> None:
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


def _said(element: _Element) -> str:
    return f"elements {shown(element.name)}"
