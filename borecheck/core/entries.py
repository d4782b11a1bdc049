"""Entry points of installed packages, read once for a search path."""

import sys
from collections.abc import Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any


def entries(group: str) -> list[EntryPoint]:
    """Those of a group, by name.

    Reading every installed package's takes a hundredth of a second, and a check asks
    several times; what is installed while a process runs, on the same path, is not
    seen.
    """
    found: Iterable[EntryPoint] = _all(tuple(sys.path)).select(group=group)
    return sorted(found, key=lambda entry: entry.name)


@cache
def _all(path: tuple[str, ...]) -> Any:  # EntryPoints; until Python 3.12 with a dict
    return entry_points()
