"""Numbers in the attributes of elements: strict with a reason, or lenient."""

import re
from typing import Any

import numpy as np

from borecheck.core.se3 import Array, transform

_NUMBER = re.compile(
    r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(inf|nan)[a-z]*", re.I | re.A
)


class NotNumbersError(ValueError):
    """An attribute that should hold numbers and does not; the text says how."""


def parse_numbers(text: str, count: int | None = None) -> tuple[float, ...]:
    """The numbers in an attribute, separated by white space.

    Args:
        text: The attribute's text.
        count: How many there must be; any number if None.

    Raises:
        NotNumbersError: Not numbers, not finite, or not so many; the message names
            the text and the reason.
    """
    words = text.split()
    for word in words:
        if _NUMBER.fullmatch(word) is None:
            raise NotNumbersError(f"{text!r}: {word!r} is not a number")
    values = tuple(_to_float(word, text) for word in words)
    if count is not None and len(values) != count:
        plural = "number" if count == 1 else "numbers"
        raise NotNumbersError(f"{text!r} holds {len(values)}, not {count} {plural}")
    return values


def _to_float(word: str, text: str) -> float:
    try:
        value = float(word)
    except ValueError:
        raise NotNumbersError(f"{text!r}: {word!r} is not a number") from None
    if value != value or value in (float("inf"), float("-inf")):
        raise NotNumbersError(f"{text!r}: {word} is not finite")
    return value


Vector = tuple[float, ...]


def numbers(element: Any, attribute: str, count: int) -> Vector | None:
    """The numbers of an attribute, or None if it is missing or malformed."""
    text = None if element is None else element.get(attribute)
    if text is None:
        return None
    try:
        return parse_numbers(text, count)
    except NotNumbersError:
        return None


def number(element: Any, attribute: str) -> float | None:
    """The number of an attribute, or None if it is missing or malformed."""
    found = numbers(element, attribute, 1)
    return None if found is None else found[0]


def first(element: Any, tag: str) -> Any:
    """The first child of that tag, or None."""
    return None if element is None else element.find(tag)


def placement(element: Any) -> Array | None:
    """The transform of an element's `<origin>`; None if it is malformed."""
    origin = first(element, "origin")
    if origin is None:
        return np.eye(4)
    values = []
    for attribute in ("xyz", "rpy"):
        vector = numbers(origin, attribute, 3)
        if vector is None and attribute in origin.attrib:
            return None
        values.append(vector or (0.0, 0.0, 0.0))
    return transform(*values)
