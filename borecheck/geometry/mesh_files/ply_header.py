"""The header of a PLY file: byte order, elements and their properties."""

from dataclasses import dataclass
from os import PathLike

from borecheck.errors import MeshError
from borecheck.geometry.mesh_files.numbers import integer, shown

File = str | PathLike[str]

_TYPES = {
    b"char": "i1", b"int8": "i1", b"uchar": "u1", b"uint8": "u1",
    b"short": "i2", b"int16": "i2", b"ushort": "u2", b"uint16": "u2",
    b"int": "i4", b"int32": "i4", b"uint": "u4", b"uint32": "u4",
    b"float": "f4", b"float32": "f4", b"double": "f8", b"float64": "f8",
}  # fmt: skip
_ORDERS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
CORNER_LISTS = (b"vertex_indices", b"vertex_index")
_MAX_HEADER = 1_000_000  # bytes; a header is a few hundred


@dataclass(frozen=True)
class Property:
    """A column, or a list in each row; types as numpy names them, without order."""

    name: bytes
    type: str
    count_type: str | None  # of a list


@dataclass(frozen=True)
class Element:
    """A kind of row, how many there are, and what each holds."""

    name: bytes
    count: int
    properties: tuple[Property, ...]


def read_header(data: bytes, file: File) -> tuple[str, list[Element], int]:
    """Byte order ("" for text), elements, and where the body begins.

    Raises:
        MeshError: Cut short, or a line that PLY 1.0 does not know.
    """
    if data[:3] != b"ply" or data[3:4] not in (b"\n", b"\r"):
        raise MeshError(file, "does not begin with the word ply")
    order: str | None = None
    elements: list[Element] = []
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
            elements.append(Element(words[1], count, ()))
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
    element: Element, words: list[bytes], file: File, where: str
) -> Element:
    is_list = len(words) == 5 and words[1] == b"list"
    types = words[2:4] if is_list else words[1:2]
    unknown = [word for word in types if word not in _TYPES]
    if unknown or not (is_list or len(words) == 3):
        raise MeshError(file, f"wrong property {shown(b' '.join(words[1:]))}", where)
    count_type = _TYPES[words[2]] if is_list else None
    counts_or_indices = types[: 2 if words[-1] in CORNER_LISTS else 1]
    if is_list and any("f" in _TYPES[word] for word in counts_or_indices):
        raise MeshError(file, "a list counted or indexed by fractions", where)
    if any(known.name == words[-1] for known in element.properties):
        raise MeshError(file, f"property {shown(words[-1])} twice", where)
    new = Property(words[-1], _TYPES[types[-1]], count_type)
    return Element(element.name, element.count, (*element.properties, new))
