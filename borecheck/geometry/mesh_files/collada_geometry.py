"""A <geometry> of Collada as triangles: its sources and its primitives.

Why an own reader: pycollada drops polygons with holes, reads every number as float32
and triangle fans as single triangles. Here every child of <mesh> that the standard
knows becomes triangles, has no surface (lines), or is refused by its name.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh_files.collada_document import Document, Element
from borecheck.geometry.mesh_files.collada_sources import integers, natural, positions
from borecheck.geometry.mesh_files.polygons import fan

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

_WITHOUT_SURFACE = ("lines", "linestrips")
_IN_SOURCE = (
    *("asset", "float_array", "int_array", "bool_array", "Name_array", "IDREF_array"),
    *("technique_common", "technique"),
)


def corners_of(document: Document, geometry: Element) -> Array:
    """Corners of all triangles of a <geometry>, (n, 3, 3), in the unit of the file.

    Raises:
        MeshError: It is no <mesh>, is not whole, or holds what is not read here.
    """
    mesh = _mesh(document, geometry)
    found = [np.zeros((0, 3, 3))]
    for child in mesh:
        name = document.name(child)
        if name in _PRIMITIVES:
            primitive = _primitive(document, child)
            found.append(primitive.points[_PRIMITIVES[name](primitive)])
        elif name in _WITHOUT_SURFACE:
            _check_lines(document, child, name)
        elif name not in ("source", "vertices", "extra"):
            raise document.error(f"<{name}> in a <mesh> is not read", child)
    return np.concatenate(found)


def _check_lines(document: Document, element: Element, name: str) -> None:
    """Lines have no surface, if they are what they say."""
    lists = document.children(element, "p")
    offsets = [natural(document, i, "offset") for i in _inputs(document, element)]
    pairs = sum(len(integers(document, p)) for p in lists) / 2.0 / (max(offsets) + 1)
    found = pairs if name == "lines" else len(lists)
    if found != natural(document, element, "count"):
        said = f"<{name}> says {element.get('count')} and holds {found:g}"
        raise document.error(said, element)


def _inputs(document: Document, element: Element) -> list[Element]:
    inputs = document.children(element, "input")
    if not inputs:
        raise document.error(f"<{document.name(element)}> has no <input>", element)
    return inputs


def _mesh(document: Document, geometry: Element) -> Element:
    for child in geometry:
        if document.name(child) not in ("asset", "extra", "mesh"):
            problem = "is not read: export a triangle mesh"
            raise document.error(f"<{document.name(child)}> {problem}", child)
    document.check_asset_of(geometry)
    mesh = document.only(geometry, "mesh")
    if mesh is None:
        raise document.error("a <geometry> without a <mesh>", geometry)
    document.only(mesh, "vertices")
    for source in document.children(mesh, "source"):
        for child in source:
            if document.name(child) not in _IN_SOURCE:
                name = document.name(child)
                raise document.error(f"<{name}> in a <source> is not read", child)
    return mesh


@dataclass(frozen=True, eq=False)
class _Primitive:
    """What a primitive is made of.

    Attributes:
        document: The file.
        element: <triangles>, <polylist> ...
        points: The positions that its VERTEX input leads to, (n, 3).
        stride: Indices a corner.
        offset: Which of them is the vertex.
    """

    document: Document
    element: Element
    points: Array
    stride: int
    offset: int

    @property
    def count(self) -> int:
        """What the attribute `count` says."""
        return natural(self.document, self.element, "count")

    def corner_lists(self) -> list[Ids]:
        """Vertex numbers of each <p>, in file order."""
        return [self._corners(p) for p in self.document.children(self.element, "p")]

    def check_count(self, found: int) -> None:
        """Refused when the file holds another number of pieces than it says."""
        if found != self.count:
            name = self.document.name(self.element)
            said = f"<{name}> says {self.count} and holds {found}"
            raise self.document.error(said, self.element)

    def _corners(self, p: Element) -> Ids:
        numbers = integers(self.document, p)
        if len(numbers) % self.stride:
            said = f"{len(numbers)} indices, not a multiple of {self.stride}"
            raise self.document.error(said, p)
        corners = numbers[self.offset :: self.stride]
        if len(corners) and not 0 <= corners.min() <= corners.max() < len(self.points):
            said = f"names a vertex that is none of the {len(self.points)}"
            raise self.document.error(said, p)
        return corners


def _primitive(document: Document, element: Element) -> _Primitive:
    inputs = _inputs(document, element)
    offsets = [natural(document, i, "offset") for i in inputs]
    own = [k for k, i in enumerate(inputs) if i.get("semantic") == "VERTEX"]
    name = document.name(element)
    if len(own) != 1:
        raise document.error(f"<{name}> has {len(own)} inputs VERTEX, not one", element)
    for child in element:
        if document.name(child) not in ("input", "p", "vcount", "extra"):
            problem = f"<{document.name(child)}> in <{name}> is not read"
            raise document.error(f"{problem}: export triangles", child)
    points = positions(document, inputs[own[0]])
    return _Primitive(document, element, points, max(offsets) + 1, offsets[own[0]])


def _triangles(primitive: _Primitive) -> Ids:
    corners = _all(primitive.corner_lists())
    if len(corners) % 3:
        raise primitive.document.error("a triangle is cut off", primitive.element)
    primitive.check_count(len(corners) // 3)
    return corners.reshape(-1, 3)


def _polylist(primitive: _Primitive) -> Ids:
    document, element = primitive.document, primitive.element
    lists = document.children(element, "vcount")
    counts = _all([integers(document, vcount) for vcount in lists])
    corners = _all(primitive.corner_lists())
    primitive.check_count(len(counts))
    if (counts < 0).any() or int(counts.sum()) != len(corners):
        raise document.error("<vcount> and <p> do not agree", element)
    return fan(primitive.points, counts, corners, document.file)


def _polygons(primitive: _Primitive) -> Ids:
    lists = primitive.corner_lists()
    primitive.check_count(len(lists))
    counts = np.array([len(corners) for corners in lists], dtype=np.int64)
    return fan(primitive.points, counts, _all(lists), primitive.document.file)


def _fans(primitive: _Primitive) -> Ids:
    """Every <p> is a fan about its first corner."""
    lists = primitive.corner_lists()
    primitive.check_count(len(lists))
    return _stacked(
        np.stack([np.full(len(p) - 2, p[0]), p[1:-1], p[2:]], axis=1)
        for p in _long_enough(primitive, lists)
    )


def _strips(primitive: _Primitive) -> Ids:
    """Every <p> is a strip; each second triangle is wound the other way."""
    lists = primitive.corner_lists()
    primitive.check_count(len(lists))
    strips = []
    for p in _long_enough(primitive, lists):
        strip = np.stack([p[:-2], p[1:-1], p[2:]], axis=1)
        strip[1::2] = strip[1::2, [1, 0, 2]]
        strips.append(strip)
    return _stacked(strips)


_PRIMITIVES = {
    "triangles": _triangles,
    "polylist": _polylist,
    "polygons": _polygons,
    "trifans": _fans,
    "tristrips": _strips,
}


def _long_enough(primitive: _Primitive, lists: list[Ids]) -> list[Ids]:
    if any(len(p) < 3 for p in lists):
        raise primitive.document.error("fewer than three corners", primitive.element)
    return lists


def _all(lists: list[Ids]) -> Ids:
    return np.concatenate([np.zeros(0, dtype=np.int64), *lists])


def _stacked(parts: Iterable[Ids]) -> Ids:
    return np.concatenate([np.zeros((0, 3), dtype=np.int64), *parts])
