"""How a path was found, in words."""

from collections.abc import Iterator, Mapping
from typing import Any


def route_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """Length of the way and where it was written; nothing for other results."""
    route = document.get("route")
    if route is None:
        return
    yield (
        f"way from {route['from']} to {route['to']}: {route['reason']}; "
        f"{route['edges']} edges asked for, seed {route['seed']}"
    )
    if route.get("path") is not None:
        yield f"path: {route['path']}"
