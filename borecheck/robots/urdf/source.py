"""URDF text as an XML tree that knows its file, lines and element paths.

Strangers' files come through here, so it refuses what could hurt: entities, giant
files, deep nesting. What parsers disagree about (an undeclared prefix, an odd XML
version) is read leniently and kept as a defect.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from borecheck.errors import UrdfError
from borecheck.robots.urdf.text import (
    MAX_BYTES,
    SourceDefect,
    as_utf8,
    decoded,
    mend_version,
    without_stray,
)

LONGEST_TAG = 40  # lines of one start tag
MAX_DEPTH = 64  # a URDF needs 5 levels, with ros2_control and Gazebo 10
MAX_ELEMENTS = 500_000
MAX_ATTRIBUTES = 100  # of one element; URDF knows 8. Looking through n takes n^2 steps


class Place(NamedTuple):
    """Where something stands: file, line (1-based), element path."""

    file: str
    line: int
    path: str

    @property
    def text(self) -> str:
        """As one line."""
        return f"{self.file}:{self.line}: {self.path}"


@dataclass(frozen=True, eq=False)
class Source:
    """One URDF text, parsed.

    Attributes:
        file: The file as the user named it.
        text: The URDF text (after expansion, if it was a xacro).
        root: The lxml root element.
        defects: What other parsers refuse.
        origins: For a xacro: (file, line) of each element, in document order.
    """

    file: str
    text: str
    root: Any
    defects: tuple[SourceDefect, ...] = ()
    origins: tuple[tuple[Path, int], ...] = ()

    def place(self, element: Any) -> Place:
        """File, line and path of an element."""
        if not isinstance(element.tag, str):  # a comment has its parent's path
            parent = element.getparent()
            path = self.path(self.root if parent is None else parent)
            return Place(self.file, element.sourceline or 1, path)
        path = self.path(element)
        origin = self._origin.get(element)
        if origin is not None:
            return Place(str(origin[0]), origin[1], path)
        return Place(self.file, self.line(element), path)

    def line(self, element: Any) -> int:
        """The line where a start tag begins; libxml2 names the one where it ends."""
        end: int = element.sourceline or 1
        if end > len(self._lines):
            return end
        opening = f"<{element.tag.rpartition('}')[2]}"
        for line in range(end, max(0, end - LONGEST_TAG), -1):
            text = self._lines[line - 1]
            if opening in text:
                return line
            if line < end and ">" in text:
                break  # the end of a tag before
        return end

    def path(self, element: Any) -> str:
        """The path of an element: `robot/joint[@name='theta']/limit`."""
        steps = []
        while (parent := element.getparent()) is not None:
            if parent not in self._steps:
                self._steps[parent] = _child_steps(parent)
            steps.append(self._steps[parent][element])
            element = parent
        return "/".join([tag_of(element), *reversed(steps)])

    @cached_property
    def _lines(self) -> list[str]:
        return self.text.split("\n")

    @cached_property
    def _steps(self) -> dict[Any, dict[Any, str]]:
        """The path steps of the children of elements asked for so far."""
        return {}

    @cached_property
    def _origin(self) -> dict[Any, tuple[Path, int]]:
        return dict(zip(elements(self.root), self.origins, strict=False))


def read(
    data: bytes | str, file: str, origins: Sequence[tuple[Path, int]] = ()
) -> Source:
    """Parses URDF text.

    Args:
        data: The text, or the file's bytes (their XML declaration names the coding).
        file: What to call it in findings and errors.
        origins: For an expanded xacro, where each element came from.

    Raises:
        UrdfError: Not well-formed (with line and column), empty, or refused.
    """
    raw = as_utf8(data, file)
    if len(raw) > MAX_BYTES:
        raise UrdfError(file, f"is larger than {MAX_BYTES // 10**6} MB; refused")
    raw, stray = without_stray(raw)
    if not raw.strip():
        raise UrdfError(file, "is empty")
    raw, version = mend_version(raw)
    root, prefixes = _parse(raw, file)
    _drop_default_namespace(root)
    text = data if isinstance(data, str) else decoded(raw, root)
    _check_limits(root, text, file)
    return Source(file, text, root, (*stray, *version, *prefixes), tuple(origins))


def elements(root: Any) -> Iterator[Any]:
    """All elements in document order; comments and instructions are left out."""
    return (element for element in root.iter() if isinstance(element.tag, str))


def children(element: Any, tag: str | None = None) -> list[Any]:
    """Child elements, all or those of one tag."""
    return [
        child
        for child in element
        if isinstance(child.tag, str) and (tag is None or child.tag == tag)
    ]


def tag_of(element: Any) -> str:
    """The tag as written, a namespace in braces replaced by its prefix."""
    tag = str(element.tag)
    if tag.startswith("{"):
        local = tag.rpartition("}")[2]
        return f"{element.prefix}:{local}" if element.prefix else local
    return tag


def _child_steps(parent: Any) -> dict[Any, str]:
    """Tag and unique name, or tag and position, of each child element."""
    found = children(parent)
    tags = Counter(child.tag for child in found)
    names = Counter((child.tag, child.get("name")) for child in found)
    seen: Counter[str] = Counter()
    steps = {}
    for child in found:
        tag, name = tag_of(child), child.get("name")
        seen[child.tag] += 1
        if name is not None and names[child.tag, name] == 1:
            steps[child] = f"{tag}[@name={_quoted(name)}]"
        else:
            steps[child] = tag if tags[child.tag] == 1 else f"{tag}[{seen[child.tag]}]"
    return steps


def _quoted(name: str) -> str:
    return f'"{name}"' if "'" in name else f"'{name}'"


def _parse(raw: bytes, file: str) -> tuple[Any, tuple[SourceDefect, ...]]:
    from lxml import etree

    parser = _parser(recover=False)
    try:
        return etree.fromstring(raw, parser), ()
    except etree.XMLSyntaxError as error:
        log = list(parser.error_log)  # the error's own log holds older errors too
        if not log or not all(e.domain_name == "NAMESPACE" for e in log):
            raise _syntax_error(error, file) from error
    except ValueError as error:
        raise UrdfError(file, f"not XML: {error}") from error
    root = etree.fromstring(raw, _parser(recover=True))
    defects = (SourceDefect("prefix", e.line, _plain(e.message)) for e in log)
    return root, tuple(defects)


def _drop_default_namespace(root: Any) -> None:
    """URDF parsers see `<link>` whatever `xmlns=` says; so do we."""
    for element in elements(root):
        if element.tag.startswith("{") and element.prefix is None:
            element.tag = element.tag.rpartition("}")[2]


def _parser(recover: bool) -> Any:
    from lxml import etree

    return etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        dtd_validation=False,
        huge_tree=False,
        recover=recover,
    )


def _syntax_error(error: Any, file: str) -> UrdfError:
    line, column = error.position
    problem = f"not well-formed XML: {_plain(error.msg)}"
    return UrdfError(file, problem, f"line {line}, column {column}")


def _plain(message: str | None) -> str:
    text = " ".join((message or "unknown reason").split())
    return re.sub(r", line \d+, column \d+$", "", text)


def _is_bare_doctype(text: str) -> bool:
    """Whether a document type is no more than `<!DOCTYPE robot>`."""
    bare = r"\s+[^\s<>\[\]\"']+\s*>"
    return all(re.match(bare, rest) for rest in text.split("<!DOCTYPE")[1:])


def _check_limits(root: Any, text: str, file: str) -> None:
    if root.getroottree().docinfo.doctype and not _is_bare_doctype(text):
        problem = "has a document type (DOCTYPE) with entities or files; refused"
        raise UrdfError(file, problem)
    count, stack = 0, [(root, 1)]
    while stack:
        element, depth = stack.pop()
        count += 1
        if depth > MAX_DEPTH:
            where = f"line {element.sourceline}"
            raise UrdfError(file, f"nests deeper than {MAX_DEPTH} levels", where)
        if count > MAX_ELEMENTS:
            raise UrdfError(file, f"holds more than {MAX_ELEMENTS} elements; refused")
        if len(element.attrib) > MAX_ATTRIBUTES:
            problem = f"an element has more than {MAX_ATTRIBUTES} attributes; refused"
            raise UrdfError(file, problem, f"line {element.sourceline}")
        stack.extend((child, depth + 1) for child in element)
