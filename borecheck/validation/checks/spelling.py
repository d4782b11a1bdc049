"""Spelling checks: unknown elements and attributes, which parsers skip in silence."""

from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from typing import Any

from borecheck.robots.urdf.source import children, tag_of
from borecheck.validation.checks.document import standard
from borecheck.validation.reading.draft import Robot
from borecheck.validation.reading.schema import FREE, SCHEMA
from borecheck.validation.registry import Hit, check


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word that is most like a misspelt one."""
    names = list(known)
    by_letters = {"".join(sorted(name.lower())): name for name in names}
    same_letters = by_letters.get("".join(sorted(word.lower())))
    if same_letters is not None:
        return same_letters
    lowered = {name.lower(): name for name in names}
    close = get_close_matches(word.lower(), lowered, n=1, cutoff=0.7)
    return lowered[close[0]] if close else None


@check("D105", "unknown-element", "document", "WWW")
def unknown_element(robot: Robot) -> Iterator[Hit]:
    """An element that URDF does not know.

    Why: Parsers skip it without a word: a misspelt <collision> means no collision.

    Mend: Correct the spelling, or put extensions into their own namespace.

    Libraries: urdf_parser_py warns; every other parser is silent.
    """
    for element in standard(robot):
        known = SCHEMA.get(tag_of(element))
        if known is None:
            continue
        for child in children(element):
            tag = tag_of(child)
            if tag not in known[1] and tag not in FREE and ":" not in tag:
                yield _unknown(child, f"<{tag}>", tag, known[1], None, tag_of(element))


@check("D106", "unknown-attribute", "document", "WWW")
def unknown_attribute(robot: Robot) -> Iterator[Hit]:
    """An attribute that the element does not have.

    Why: Parsers skip it without a word: a misspelt rpy means no rotation.

    Mend: Correct the spelling, or remove it.

    Libraries: urdf_parser_py warns; every other parser is silent.
    """
    for element in standard(robot):
        known = SCHEMA.get(tag_of(element))
        if known is None:
            continue
        for attribute in element.attrib:
            if attribute not in known[0] and not attribute.startswith("{"):
                what, where = f"attribute {attribute!r}", tag_of(element)
                yield _unknown(element, what, attribute, known[0], attribute, where)


def _unknown(
    element: Any,
    what: str,
    word: str,
    known: tuple[str, ...],
    attribute: str | None,
    where: str,
) -> Hit:
    close = nearest(word, known)
    hint = f"Write {close!r}." if close else None
    guess = f"; did you mean {close!r}?" if close else ""
    message = f"{what} is not known in <{where}>{guess}"
    return Hit(element, message, attribute, hint=hint)
