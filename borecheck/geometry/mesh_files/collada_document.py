"""A Collada document: its XML, its own <asset>, and what its references lead to."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import Any

import numpy as np
from lxml import etree

from borecheck.core.text import printable
from borecheck.errors import MeshError
from borecheck.geometry.mesh_files.numbers import shown
from borecheck.geometry.mesh_files.text_ends import trimmed, without_mark

File = str | PathLike[str]
Element = Any  # lxml has no types of its own

NAMESPACES = (
    "http://www.collada.org/2005/11/COLLADASchema",  # 1.4
    "http://www.collada.org/2008/03/COLLADASchema",  # 1.5
)
_UP_AXES = ("X_UP", "Y_UP", "Z_UP")
_SPACE = b" \t\r\n"
_DEEPEST = 200  # nested elements; real files have about ten
_ENCODING = re.compile(rb"^<\?xml[^>]*\bencoding\s*=\s*[\"']([\w.-]+)[\"']")
# In these a DOCTYPE is spelt in the bytes that are looked for before anything is
# parsed; in others (EBCDIC, UTF-7) it could hide.
_PLAIN = re.compile(rb"(?i)utf-?(8|16|16le|16be)|us-ascii|ascii|iso-?8859-?\d+|latin-?1"
                    rb"|windows-125\d|cp125\d")  # fmt: skip


@dataclass(frozen=True, eq=False)
class Document:
    """A parsed file.

    Attributes:
        root: The element COLLADA.
        file: Named in errors.
        warnings: What stood around the XML.
    """

    root: Element
    file: File
    warnings: tuple[str, ...] = ()

    def error(self, problem: str, element: Element | None = None) -> MeshError:
        """What is wrong, with the line of the element."""
        where = f"line {element.sourceline}" if element is not None else None
        return MeshError(self.file, problem, where)

    def children(self, element: Element, *names: str) -> list[Element]:
        """Children of the document's own namespace, of these names."""
        return [child for child in element if self.name(child) in names]

    def only(self, element: Element, name: str) -> Element | None:
        """The child of that name, or None.

        Raises:
            MeshError: There are two.
        """
        found = self.children(element, name)
        if len(found) > 1:
            raise self.error(f"a second <{name}>", found[1])
        return found[0] if found else None

    def name(self, element: Element) -> str:
        """Tag of an element without its namespace; with it if that is a foreign one."""
        tag = str(element.tag)
        if tag.startswith(self._prefix):
            return tag[len(self._prefix) :]
        found = etree.QName(element)
        return f"{found.namespace}:{found.localname}"

    @cached_property
    def _prefix(self) -> str:
        namespace = etree.QName(self.root).namespace
        return "" if namespace is None else f"{{{namespace}}}"

    def target(self, element: Element, attribute: str, *kinds: str) -> Element:
        """What `#id` in an attribute refers to: the one element of these kinds.

        Raises:
            MeshError: Another file, nothing, or more than one.
        """
        reference = element.get(attribute, "")
        said = f"<{self.name(element)}> refers to {_shown(reference)}"
        if not reference.startswith("#"):
            raise self.error(f"{said}, which is no place in this file", element)
        found = [e for e in self._by_id.get(reference[1:], []) if self.name(e) in kinds]
        if not found:
            raise self.error(f"{said}, and there is no such <{kinds[0]}>", element)
        if len(found) > 1:
            raise self.error(f"{said}, and there are {len(found)} of that id", element)
        return found[0]

    def all(self, name: str) -> list[Element]:
        """All elements of the document's own namespace and that name."""
        return [e for e in self.root.iter(f"{{*}}{name}") if self.name(e) == name]

    def with_id(self, word: str) -> list[Element]:
        """All elements of that id."""
        return self._by_id.get(word, [])

    @cached_property
    def _by_id(self) -> dict[str, list[Element]]:
        found: dict[str, list[Element]] = {}
        for element in self.root.iter("*"):
            word = element.get("id")
            if word is not None:
                found.setdefault(word, []).append(element)
        return found

    @cached_property
    def asset(self) -> Element | None:
        """The document's own <asset>, wherever among the root's children it stands."""
        return self.only(self.root, "asset")

    @cached_property
    def states_unit(self) -> bool:
        """Whether the file says its unit; by the standard it is metres when unsaid."""
        return self.asset is not None and self.only(self.asset, "unit") is not None

    @cached_property
    def metres(self) -> float:
        """Metres per unit of the file.

        Raises:
            MeshError: The unit is no positive number.
        """
        if self.asset is None:
            return 1.0
        return self.metres_in(self.asset)

    def metres_in(self, asset: Element) -> float:
        """Metres per unit that an <asset> states, 1 when it does not."""
        unit = self.only(asset, "unit")
        if unit is None:
            return 1.0
        name = unit.get("name", "meter").lower()
        if unit.get("meter") is None and name not in ("meter", "metre", "m"):
            raise self.error('names a unit without its meter="..."', unit)
        try:
            metres = float(unit.get("meter", "1"))
        except ValueError:
            metres = np.nan
        if not (np.isfinite(metres) and metres > 0.0):
            problem = "states a unit that is no positive number of metres"
            raise MeshError(self.file, problem)
        return metres

    @cached_property
    def states_up_axis(self) -> bool:
        """Whether the file says its up axis; by the standard it is y when unsaid."""
        return self.asset is not None and self.only(self.asset, "up_axis") is not None

    @cached_property
    def up_axis(self) -> str:
        """X_UP, Y_UP or Z_UP of the document.

        Raises:
            MeshError: Another word.
        """
        return "Y_UP" if self.asset is None else self.up_axis_in(self.asset)

    def up_axis_in(self, asset: Element) -> str:
        """The up axis that an <asset> states, Y_UP when it does not."""
        axis = self.only(asset, "up_axis")
        word = "Y_UP" if axis is None else (axis.text or "").strip()
        if word not in _UP_AXES:
            raise self.error(f"up axis {_shown(word)} is none of {', '.join(_UP_AXES)}")
        return word

    def check_asset_of(self, element: Element) -> None:
        """An <asset> further down that states another unit or up axis is refused.

        Raises:
            MeshError: It does; who reads the file must not guess which one holds.
        """
        asset = self.only(element, "asset")
        if asset is None:
            return
        other_unit = self.only(asset, "unit") is not None
        other_axis = self.only(asset, "up_axis") is not None
        if other_unit and self.metres_in(asset) != self.metres:
            raise self.error(f"<{self.name(element)}> states another unit", asset)
        if other_axis and self.up_axis_in(asset) != self.up_axis:
            raise self.error(f"<{self.name(element)}> states another up axis", asset)


def read_document(data: bytes, file: File) -> Document:
    """Parse a file; nothing is expanded, fetched or run.

    Raises:
        MeshError: No Collada, damaged, nested without end, or it brings a DOCTYPE.
    """
    data, warnings = _bare(data)
    _refuse_entities(data, file)
    parser = etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=True,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError, LookupError) as error:
        reason = printable(" ".join(str(error).split())[:120])
        raise MeshError(file, f"cannot be read as Collada: {reason}") from error
    if root.getroottree().docinfo.doctype:
        raise MeshError(file, "defines its own XML entities, which is refused")
    found = etree.QName(root)
    if found.localname != "COLLADA" or found.namespace not in (*NAMESPACES, None):
        word = _shown(str(root.tag))
        raise MeshError(file, f"cannot be read as Collada: the root is {word}")
    if _depth(root) > _DEEPEST:
        raise MeshError(file, f"nests its elements more than {_DEEPEST} deep")
    return Document(root, file, warnings)


def _bare(data: bytes) -> tuple[bytes, tuple[str, ...]]:
    """The XML alone, and what stood around it."""
    bare = without_mark(data.lstrip(_SPACE)).lstrip(_SPACE)
    shifted = bare != without_mark(data)
    warnings = ("white space before its <?xml is left out",) if shifted else ()
    if b"\0" in bare[:4] or bare.startswith((b"\xff\xfe", b"\xfe\xff")):
        return bare, warnings  # UTF-16 may end in a zero byte
    bare, more = trimmed(bare)
    return bare, (*warnings, *more)


def _refuse_entities(data: bytes, file: File) -> None:
    bare = data.replace(b"\0", b"")  # UTF-16 puts them between the letters
    if b"<!DOCTYPE" in bare or b"<!ENTITY" in bare:
        raise MeshError(file, "defines its own XML entities, which is refused")
    encoding = _ENCODING.match(bare.lstrip(b"\xff\xfe"))
    if encoding is not None and not _PLAIN.fullmatch(encoding[1]):
        word = shown(encoding[1])
        raise MeshError(file, f"is written in {word}: save it as UTF-8")


def _depth(root: Element) -> int:
    deepest, depth = 0, 0
    for event, _ in etree.iterwalk(root, events=("start", "end")):
        depth += 1 if event == "start" else -1
        deepest = max(deepest, depth)
    return deepest


def descendants(document: Document, element: Element) -> Iterator[tuple[str, Element]]:
    """Name without any namespace, and element, of all below; foreign ones too."""
    for found in element.iter("*"):
        if found is not element:
            yield str(etree.QName(found).localname), found


def _shown(text: str) -> str:
    return shown(text.encode("utf-8", "backslashreplace"))
