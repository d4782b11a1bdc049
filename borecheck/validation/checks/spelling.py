"""Spelling checks: unknown elements and attributes, which parsers skip in silence."""

from collections.abc import Iterator

from borecheck.robots.urdf.rules import shapes
from borecheck.validation.checks.ruled import problems
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register


@register("D105", "unknown-element", "document", "WWW")
def unknown_element(robot: CheckedUrdf) -> Iterator[Problem]:
    """An element that URDF does not know.

    Why: Parsers skip it without a word: a misspelt <collision> means no collision.

    Fix: Correct the spelling, or put extensions into their own namespace.

    Libraries: urdf_parser_py warns; every other parser is silent.
    """
    return problems(robot, shapes.unknown_elements)


@register("D106", "unknown-attribute", "document", "WWW")
def unknown_attribute(robot: CheckedUrdf) -> Iterator[Problem]:
    """An attribute that the element does not have.

    Why: Parsers skip it without a word: a misspelt rpy means no rotation.

    Fix: Correct the spelling, or remove it.

    Libraries: urdf_parser_py warns; every other parser is silent.
    """
    return problems(robot, shapes.unknown_attributes)
