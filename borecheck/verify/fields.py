"""Values of a certificate, each asked for its type, size and range before it is used.

A certificate comes from anybody. What Python would take for a number (True, "1", NaN,
a list of one) is none here, and what is not expected is refused, not left unread.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# No name is longer than this, [characters].
LONGEST_TEXT = 10_000


class Rejected(Exception):  # noqa: N818 - not an error: the answer of the check
    """A statement of the certificate that does not hold, or is none."""


def record(
    value: Any, what: str, fields: Iterable[str], optional: Iterable[str] = ()
) -> dict[str, Any]:
    """A record with exactly these fields; of the optional ones any."""
    if type(value) is not dict:
        raise Rejected(f"{what} is no record")
    needed = set(fields)
    missing = sorted(needed - value.keys())
    if missing:
        raise Rejected(f"{what} lacks {', '.join(missing)}")
    strange = sorted(value.keys() - needed - set(optional))
    if strange:
        raise Rejected(f"{what} holds what is unknown: {', '.join(strange)[:200]}")
    return value


def listed(value: Any, what: str, most: int, least: int = 0) -> list[Any]:
    """A list of at least and at most so many things."""
    if type(value) is not list:
        raise Rejected(f"{what}: not a list")
    if not least <= len(value) <= most:
        raise Rejected(f"{what}: {len(value)} of them, not {least} to {most}")
    return value


def text(value: Any, what: str) -> str:
    """A text of sane length."""
    if type(value) is not str or len(value) > LONGEST_TEXT:
        raise Rejected(f"{what} is no text, or too long")
    return value


def whole(value: Any, what: str, low: int, high: int) -> int:
    """A whole number from low to high; 1.0 and True are none."""
    if type(value) is not int or not low <= value <= high:
        raise Rejected(f"{what} is no whole number from {low} to {high}")
    return value


def number(value: Any, what: str, low: float, high: float) -> float:
    """A number from low to high."""
    if type(value) not in (int, float) or not low <= value <= high:
        raise Rejected(f"{what} is no number from {low:g} to {high:g}")
    return float(value)


def array(value: Any, what: str, shape: Sequence[int | None], largest: float) -> Array:
    """Nested lists as an array of that shape (None: any length), none beyond largest.

    Every element is asked for its type: numpy itself would take True and "1".
    """
    level = [value]
    for size in shape:
        if not all(type(x) is list and size in (None, len(x)) for x in level):
            raise Rejected(f"{what}: not numbers in the shape {_shape(shape)}")
        level = [x for items in level for x in items]
        if size is None and len(level) == 0:
            raise Rejected(f"{what}: empty")
    if not all(type(x) is float or type(x) is int for x in level):
        raise Rejected(f"{what}: holds what is no number")
    if not all(-largest <= x <= largest for x in level):
        raise Rejected(f"{what}: holds a number that is not within {largest:g}")
    found = np.array(value, dtype=np.float64)
    if found.ndim != len(shape):
        raise Rejected(f"{what}: not numbers in the shape {_shape(shape)}")
    return found


def _shape(shape: Sequence[int | None]) -> str:
    return " x ".join("n" if size is None else str(size) for size in shape)
