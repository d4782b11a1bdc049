"""A xacro file as a DOM whose elements carry file and line; and back to text."""

from collections.abc import Callable
from typing import Any

from borecheck.errors import UrdfError
from borecheck.robots.urdf.xacro.run import MARK, Run

MAX_NODES = 60_000  # read by one expansion; the PR2 has 6,000
MAX_ATTRIBUTES = 100_000  # PR2: 3,000
MAX_DEPTH = 200  # of elements; the PR2 has 12. Each is marked in as many steps
MAX_COPIES = 40_000  # of nodes, for each use of a macro or block; PR2: 8,000


def parse_document(data: bytes, run: Run) -> Any:
    """The DOM of the file that was read last.

    Raises:
        UrdfError: It has a document type, or too many nodes.
        ExpatError: Not well-formed.
    """
    from xml.dom import expatbuilder

    number, path = len(run.files) - 1, run.files[-1]

    class Builder(expatbuilder.ExpatBuilderNS):
        depth = 0

        def start_element_handler(self, name: str, attributes: Any) -> None:
            run.count("nodes", MAX_NODES)
            self.depth += 1
            if self.depth > MAX_DEPTH:
                where = f"line {self.getParser().CurrentLineNumber}"
                raise UrdfError(path, f"nests deeper than {MAX_DEPTH} levels", where)
            declared = len(self._ns_ordered_prefixes)  # type: ignore[attr-defined]
            run.count("attributes", MAX_ATTRIBUTES, len(attributes) // 2 + declared)
            super().start_element_handler(name, attributes)
            line = self.getParser().CurrentLineNumber
            element: Any = self.curNode
            element.setAttribute(MARK, f"{number}:{line}")

        def end_element_handler(self, name: str) -> None:
            self.depth -= 1
            super().end_element_handler(name)

        def character_data_handler_cdata(self, data: str) -> None:
            run.count("nodes", MAX_NODES)
            super().character_data_handler_cdata(data)

        def comment_handler(self, data: str) -> None:
            run.count("nodes", MAX_NODES)
            super().comment_handler(data)

        def pi_handler(self, target: str, data: str) -> None:
            run.count("nodes", MAX_NODES)
            super().pi_handler(target, data)

        def start_doctype_decl_handler(self, *_: Any) -> None:
            line = f"line {self.getParser().CurrentLineNumber}"
            raise UrdfError(path, "xacro: a document type (DOCTYPE) is refused", line)

    document = Builder().parseString(data)
    for name in ("createElementNS", "createTextNode", "createComment"):
        setattr(document, name, _counting(getattr(document, name), run))
    return document


def _counting(create: Callable[..., Any], run: Run) -> Callable[..., Any]:
    """What makes a node of a copy (of a macro, of a block), counted."""

    def counted(*given: Any) -> Any:
        run.count("copied nodes", MAX_COPIES)
        return create(*given)

    return counted


def unmark(node: Any) -> None:
    """Takes the mark off one element."""
    if node.hasAttribute(MARK):
        node.removeAttribute(MARK)


def serialised(document: Any) -> str:
    """The document as text."""
    _drop_blank(document.documentElement)
    return str(document.toprettyxml(indent="  "))


def _drop_blank(node: Any) -> None:
    stack = [node]
    while stack:
        element = stack.pop()
        for child in list(element.childNodes):
            if child.nodeType == child.TEXT_NODE and not child.data.strip():
                element.removeChild(child)
            elif child.nodeType == child.ELEMENT_NODE:
                stack.append(child)
