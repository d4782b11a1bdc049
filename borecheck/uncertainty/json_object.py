"""A JSON object that a user wrote, read with one clear line for what is wrong."""

import json
from pathlib import Path
from typing import Any

from borecheck.core.small_files import read_at_most
from borecheck.errors import InputError, UsageError

MAX_BYTES = 1_000_000


def number(value: Any, whose: str) -> float:
    """A JSON number as float, refused where it is none or too large for one."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UsageError(f"{whose}: {_short(value)} is no number with or without unit")
    try:
        return float(value)
    except OverflowError:
        raise UsageError(f"{whose}: {_short(value)} is too large") from None


def _short(value: Any) -> str:
    """A value of a file in at most 40 characters."""
    if isinstance(value, int) and not isinstance(value, bool):
        return (
            f"a number of {value.bit_length()} bits"
            if abs(value) > 1e30
            else f"{value}"
        )
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object, refused where a key stands twice: one of the two is a mistake."""
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise UsageError(f"{_short(key)} stands twice in one object")
        found[key] = value
    return found


def read_object(path: Path) -> dict[str, Any]:
    """The object that a file holds.

    Raises:
        InputError: It cannot be read, is too large, or holds no object.
    """
    content = read_at_most(path, MAX_BYTES)
    try:
        document = json.loads(content.decode("utf-8-sig"), object_pairs_hook=_once)
    except (ValueError, RecursionError) as error:
        raise InputError(path, f"no JSON: {error}") from error
    except UsageError as error:
        raise InputError(path, str(error)) from error
    if not isinstance(document, dict):
        raise InputError(path, "is no JSON object")
    return document
