"""The functions that a description names, and what is wrong with them.

Hooks are texts `module:function`, imported only when they are needed.
"""

import re
import sys
import traceback
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from borecheck.errors import BorecheckError, UsageError
from borecheck.robots.description.records import Description, RobotDescription

HOOKS = (
    "meshes",
    "forward",
    "inverse",
    "dimensions",
    "family",
    "about_target",
)


def hook(reference: str) -> Callable[..., Any]:
    """The function that a text `module:function` names, imported now."""
    module, _, function = reference.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), function)
    return found


def plugin_hook(
    description: Description,
    field: str,
    find: Callable[[str], Callable[..., Any]],
    wrong: Callable[[Any], str | None],
) -> Callable[..., Any]:
    """The function that a field names; what goes wrong in it is told as the package's.

    Args:
        description: Of the robot or scanner.
        field: One of `HOOKS`, given in the description.
        find: From the text to the function: `hook`.
        wrong: What is wrong with what the function returned, or None.

    Raises:
        UsageError: No such module or function; when called: its own exception, or a
            result that is not as docs/adding_a_robot.md says.
    """
    kind = "robot" if isinstance(description, RobotDescription) else "scanner"
    reference = getattr(description, field)
    whose = f"{kind} {description.name}: {field} {reference!r}"
    function, problem = _found(reference, find)
    if function is None:
        raise UsageError(f"{whose} {problem}")

    def called(*values: Any, **arguments: Any) -> Any:
        try:
            result = function(*values, **arguments)
        except (BorecheckError, MemoryError):
            raise
        except Exception as error:
            raise UsageError(f"{whose} failed: {told(error)}") from error
        problem = wrong(result)
        if problem is not None:
            raise UsageError(f"{whose} returned {type(result).__name__}: {problem}")
        return result

    return called


def broken_hooks(description: Description) -> Iterator[str]:
    """What is wrong with each function that cannot be used; imports them all."""
    for field, reference in named_hooks(description):
        _, problem = _found(reference, hook)
        if problem is not None:
            yield f"{field} {reference!r} {problem}"


def missing_hooks(description: Description) -> Iterator[str]:
    """As `broken_hooks`, as far as it shows without importing sound modules.

    A closed form takes as long to import as a pose to check, and few commands use it:
    a module is imported here only if its text does not hold the function's name. Who
    needs the function is told then.
    """
    for field, reference in named_hooks(description):
        module, _, function = reference.partition(":")
        if module in sys.modules or not _has_word(_text(module), function):
            _, problem = _found(reference, hook)
            if problem is not None:
                yield f"{field} {reference!r} {problem}"


def named_hooks(description: Description) -> Iterator[tuple[str, str]]:
    """(field, `module:function`) of the hooks that a description names."""
    for field in HOOKS:
        reference = getattr(description, field, None)
        if reference:
            yield field, reference


def told(error: BaseException) -> str:
    """Kind, text and place of an exception out of a package."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"SyntaxError: {error.msg} ({error.filename}, line {error.lineno})"
    places = traceback.extract_tb(error.__traceback__)
    theirs = [place for place in places if not _is_ours(place.filename)]
    where = f" ({theirs[-1].filename}, line {theirs[-1].lineno})" if theirs else ""
    return f"{type(error).__name__}: {error}{where}"


def _is_ours(file: str) -> bool:
    """Whether a frame is of this folder or of Python's import system."""
    return Path(file).parent == Path(__file__).parent or "importlib" in file


def _has_word(text: str, word: str) -> bool:
    return re.search(rf"\b{re.escape(word)}\b", text) is not None


def _text(module: str) -> str:
    """The source of a module; empty where there is none to read."""
    try:
        spec = find_spec(module)
        origin = Path((spec.origin if spec else None) or "")
        return origin.read_text(encoding="utf-8")
    except (Exception, SystemExit):  # noqa: BLE001 - a package may raise anything
        return ""


def _found(
    reference: str, find: Callable[[str], Callable[..., Any]]
) -> tuple[Callable[..., Any] | None, str | None]:
    """The function, or what is wrong with its name."""
    try:
        function = find(reference)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - see above
        return None, f"cannot be loaded: {told(error)}"
    if not callable(function):
        return None, f"is {function!r}, not a function"
    return function, None
