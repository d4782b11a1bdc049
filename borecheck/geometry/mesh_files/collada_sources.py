"""Numbers of a Collada file: positions behind an input, lists in an element's text."""

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh_files.collada_document import Document, Element

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

_AXES = ["X", "Y", "Z"]


def positions(document: Document, vertex: Element) -> Array:
    """The points behind an input VERTEX: its <vertices>' one POSITION, (n, 3).

    Raises:
        MeshError: It leads nowhere, or not to whole points x, y, z.
    """
    vertices = document.target(vertex, "source", "vertices")
    inputs = document.children(vertices, "input")
    positions = [i for i in inputs if i.get("semantic") == "POSITION"]
    if len(positions) != 1:
        said = f"<vertices> has {len(positions)} inputs POSITION, not one"
        raise document.error(said, vertices)
    source = document.target(positions[0], "source", "source")
    common = document.only(source, "technique_common")
    accessor = None if common is None else document.only(common, "accessor")
    if accessor is None:
        raise document.error("a source of positions without an <accessor>", source)
    return _accessed(document, accessor)


def _accessed(document: Document, accessor: Element) -> Array:
    """The points that an accessor picks out of its array, (n, 3)."""
    array = document.target(accessor, "source", "float_array")
    values = floats(document, array)
    if len(values) != natural(document, array, "count"):
        said = f"<float_array> says {array.get('count')} and holds {len(values)}"
        raise document.error(said, array)
    names = [param.get("name") for param in document.children(accessor, "param")]
    if [name for name in names if name is not None] != _AXES:
        raise document.error("positions that are not X, Y, Z", accessor)
    count = natural(document, accessor, "count")
    offset = natural(document, accessor, "offset", 0)
    stride = natural(document, accessor, "stride", 1)
    columns = offset + np.array([k for k, name in enumerate(names) if name is not None])
    if stride < len(names) or count > len(values):
        raise document.error("an <accessor> that makes no sense", accessor)
    if count and (count - 1) * stride + int(columns.max()) >= len(values):
        raise document.error("an <accessor> beyond the end of its array", accessor)
    return values[np.arange(count)[:, None] * stride + columns]


def floats(document: Document, element: Element) -> Array:
    """The numbers in an element's text.

    Raises:
        MeshError: A word that is no number.
    """
    try:
        return np.array(_words(element), dtype=np.float64)
    except (ValueError, OverflowError):
        name = document.name(element)
        raise document.error(f"<{name}> holds no list of numbers", element) from None


def integers(document: Document, element: Element) -> Ids:
    """The whole numbers in an element's text.

    Raises:
        MeshError: A word that is none.
    """
    try:
        return np.array(_words(element), dtype=np.int64)
    except (ValueError, OverflowError):
        name = document.name(element)
        raise document.error(f"<{name}> holds no whole numbers", element) from None


def _words(element: Element) -> list[bytes]:
    """Words of an element that holds nothing but text."""
    text = element.text or ""
    if len(element) or "_" in text:  # Python takes 1_000 for a number
        raise ValueError
    return text.encode("ascii").split()


def natural(
    document: Document, element: Element, attribute: str, unsaid: int | None = None
) -> int:
    """A count or an offset from 0; `unsaid` when the attribute is not there.

    Raises:
        MeshError: No such number.
    """
    text = element.get(attribute)
    if text is None and unsaid is not None:
        return unsaid
    word = (text or "").strip()
    if not (word.isascii() and word.isdecimal() and len(word) <= 12):
        said = f"<{document.name(element)}> has no {attribute} that is a number"
        raise document.error(said, element)
    return int(word)
