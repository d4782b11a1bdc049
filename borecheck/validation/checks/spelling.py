"""Spelling checks: unknown elements and attributes, which parsers skip in silence."""

from collections.abc import Iterator

from borecheck.robots.urdf.rules import shapes
from borecheck.validation.checks.ruled import hits
from borecheck.validation.reading.draft import Robot
from borecheck.validation.registry import Hit, check


@check("D105", "unknown-element", "document", "WWW")
def unknown_element(robot: Robot) -> Iterator[Hit]:
    """An element that URDF does not know.

    Why: Parsers skip it without a word: a misspelt <collision> means no collision.

    Mend: Correct the spelling, or put extensions into their own namespace.

    Libraries: urdf_parser_py warns; every other parser is silent.
    """
    return hits(robot, shapes.unknown_elements)


@check("D106", "unknown-attribute", "document", "WWW")
def unknown_attribute(robot: Robot) -> Iterator[Hit]:
    """An attribute that the element does not have.

    Why: Parsers skip it without a word: a misspelt rpy means no rotation.

    Mend: Correct the spelling, or remove it.

    Libraries: urdf_parser_py warns; every other parser is silent.
    """
    return hits(robot, shapes.unknown_attributes)
