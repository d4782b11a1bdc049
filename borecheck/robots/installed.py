"""Where installed robots and scanners are found, and what a broken package is told.

A package is another's code: whatever it raises is told in one line that names the
package, with the file and line where it happened.
"""

import traceback
from collections.abc import Callable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from borecheck.errors import BorecheckError, UnknownNameError, UsageError
from borecheck.robots.description import (
    Description,
    RobotDescription,
    ScannerDescription,
    hook,
)
from borecheck.robots.description_fields import check_fields

KINDS: dict[str, type[Description]] = {
    "robots": RobotDescription,
    "scanners": ScannerDescription,
}


def installed_names(group: str) -> list[str]:
    """Names in the entry-point group `borecheck.<group>`, sorted."""
    return sorted(_entries(group))


@cache
def installed_folders() -> tuple[Path, ...]:
    """Folders of all installed descriptions, and of the meshes shipped with them."""
    found: list[Path] = []
    for group in KINDS:
        for name in installed_names(group):
            try:
                description: Description = installed(group, group, name)
            except BorecheckError:
                continue  # a plug-in that cannot be loaded brings no files
            found.append(description.xacro.parent)
            found += [] if description.shipped is None else [description.shipped]
    return tuple(found)


def installed(group: str, kind: str, name: str) -> Any:
    """The installed description of that name, its fields checked.

    Raises:
        UnknownNameError: None is installed; lists those that are.
        UsageError: Its package cannot be loaded, or a field holds what it must not.
    """
    entries = _entries(group)
    if name not in entries:
        raise UnknownNameError(kind, name, sorted(entries))
    package = f"{group.removesuffix('s')} package {name}"
    try:
        description = entries[name].load()
    except Exception as error:  # a stranger's module may raise anything
        raise UsageError(f"{package} cannot be loaded: {_told(error)}") from error
    wanted = KINDS[group]
    if not isinstance(description, wanted):
        raise UsageError(
            f"{package}: {entries[name].value} is {type(description).__name__}, "
            f"not {wanted.__name__}"
        )
    if description.name != name:
        raise UsageError(
            f"{package}: name {description.name!r} is not the entry point's name, "
            f"{name!r}: they must be the same"
        )
    check_fields(description, package)
    return description


def plugin_hook(
    description: Description, field: str, gives: Callable[[Any], str | None]
) -> Callable[..., Any]:
    """The function that a field names; what it raises is told as the package's.

    Args:
        description: Of the robot or scanner.
        field: `forward`, `inverse`, `dimensions` or `meshes`.
        gives: What is wrong with what it returned, or None.

    Raises:
        UsageError: No such module or function; when called: its own exception, or a
            result that is not as docs/adding_a_robot.md says.
    """
    reference = getattr(description, field)
    whose = f"package of {description.name}: {field} {reference!r}"
    try:
        function = hook(reference)
    except Exception as error:
        raise UsageError(f"{whose} cannot be loaded: {_told(error)}") from error
    if not callable(function):
        raise UsageError(f"{whose} is no function")

    def called(*values: Any, **arguments: Any) -> Any:
        try:
            result = function(*values, **arguments)
        except (BorecheckError, MemoryError):
            raise
        except Exception as error:
            raise UsageError(
                f"{whose} failed, which is the plug-in's: {_told(error)}"
            ) from error
        problem = gives(result)
        if problem is not None:
            raise UsageError(f"{whose} returned {type(result).__name__}: {problem}")
        return result

    return called


def _told(error: Exception) -> str:
    """Kind, text and place of an exception out of a package."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"SyntaxError: {error.msg} ({error.filename}, line {error.lineno})"
    places = traceback.extract_tb(error.__traceback__)
    # what called the package is left out, and Python's import system
    own = [
        p for p in places if p.filename != __file__ and "importlib" not in p.filename
    ]
    where = f" ({own[-1].filename}, line {own[-1].lineno})" if own else ""
    return f"{type(error).__name__}: {error}{where}"


def _entries(group: str) -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=f"borecheck.{group}")}
