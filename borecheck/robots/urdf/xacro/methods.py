"""The methods of texts and collections that an expression may call.

Each is the method of that name; those that could make a text out of all proportion are
asked for its length first. `pop` is the only one that changes its owner: files walk
through lists with it.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from borecheck.robots.urdf.xacro.values import MAX_SIZE, ExpressionError


def _refuse_length(length: int) -> None:
    if length > MAX_SIZE:
        raise ExpressionError(f"a value is larger than {MAX_SIZE} letters or entries")


def _replace(text: str, old: str, new: str, count: int = -1) -> str:
    hits = text.count(old) if count < 0 else min(text.count(old), count)
    _refuse_length(len(text) + hits * len(new))
    return text.replace(old, new, count)


def _join(text: str, parts: Iterable[str]) -> str:
    parts = list(parts)
    _refuse_length(len(text) * len(parts) + sum(map(len, parts)))
    return text.join(parts)


def _filled(method: Callable[..., str]) -> Callable[..., str]:
    """A method that widens a text."""

    def fill(text: str, width: int, *letter: str) -> str:
        _refuse_length(width)
        return method(text, width, *letter)

    return fill


def _get(owner: dict[Any, Any], key: Any, other: Any = None) -> Any:
    if key not in owner:
        return other
    return owner[key]  # a dictionary from YAML wraps what it gives


def _items(owner: dict[Any, Any]) -> list[tuple[Any, Any]]:
    return [(key, owner[key]) for key in owner]


_TEXT = (
    *("lower", "upper", "strip", "lstrip", "rstrip", "title", "capitalize"),
    *("split", "rsplit", "splitlines", "partition", "rpartition", "startswith"),
    *("endswith", "find", "rfind", "index", "rindex", "count", "isdigit", "isalpha"),
    *("isalnum", "isnumeric", "isdecimal", "isspace", "islower", "isupper"),
    *("removeprefix", "removesuffix", "swapcase", "casefold"),
)

METHODS: Mapping[type, Mapping[str, Callable[..., Any]]] = {
    str: {
        **{name: getattr(str, name) for name in _TEXT},
        "replace": _replace,
        "join": _join,
        **{n: _filled(getattr(str, n)) for n in ("ljust", "rjust", "center", "zfill")},
    },
    list: {n: getattr(list, n) for n in ("index", "count", "copy", "pop")},
    tuple: {"index": tuple.index, "count": tuple.count},
    dict: {
        "keys": lambda owner: list(owner),
        "values": lambda owner: [owner[key] for key in owner],
        "items": _items,
        "get": _get,
        "copy": dict.copy,
        "pop": dict.pop,
    },
    set: {
        "union": set.union,
        "intersection": set.intersection,
        "difference": set.difference,
        "issubset": set.issubset,
    },
    float: {"is_integer": float.is_integer},
}
