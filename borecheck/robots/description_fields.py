"""Whether the fields of a description hold what they must, before any file is read."""

import math
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from borecheck.errors import UsageError
from borecheck.robots.description import (
    ROLES,
    Argument,
    Description,
    JointMap,
    RobotDescription,
    ScannerDescription,
)

_TEXTS = ("name", "title", "source")
_PATHS = ("xacro", "shipped")
HOOKS = ("meshes", "forward", "inverse", "dimensions")
_LINKS = ("needle_link", "tool_frame", "base_frame", "insertion_joint", "scanner")
_NUMBERS = ("home", "joints")  # of a robot and of a scanner
_QUANTITIES = (None, "length", "angle")


def check_fields(description: Description, package: str) -> None:
    """Nothing, if every field is of its kind.

    Raises:
        UsageError: The first that is not: package, field, value, what is allowed.
    """
    for problem in _problems(description):
        raise UsageError(f"{package}: {problem}")


def not_among(field: str, name: object, kind: str, known: list[str]) -> str:
    """The line for a name that does not exist, with the nearest that does."""
    close = get_close_matches(str(name), known, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    return f"{field} {name!r} is no {kind}{hint} (known: {', '.join(known) or 'none'})"


def _problems(description: Description) -> Iterator[str]:
    yield from _kinds(description)
    for name, argument in description.arguments.items():
        yield from _argument(name, argument)
    if isinstance(description, RobotDescription):
        yield from _robot(description)
    if isinstance(description, ScannerDescription):
        yield from _mappings(description.roles, "roles")
        for link, role in description.roles.items():
            if role not in ROLES:
                yield not_among(f"roles[{link!r}]", role, "role", list(ROLES))
        yield from _numbers(description.joints, "joints")
        yield from _mappings(description.points, "points")


def _kinds(description: Description) -> Iterator[str]:
    for field in (*_TEXTS, *HOOKS, *_LINKS):
        value = getattr(description, field, None)
        if not isinstance(value, str | None) or (field in _TEXTS and not value):
            yield f"{field} is {value!r}, not a text"
    for field in HOOKS:
        value = getattr(description, field, None)
        if value and not all(value.partition(":")):
            yield f"{field} {value!r} is not of the form 'module:function'"
    for field in _PATHS:
        value = getattr(description, field)
        if not isinstance(value, Path) and (field == "xacro" or value is not None):
            yield f"{field} is {value!r}, not a pathlib.Path"
    if not description.xacro.is_file():
        yield f"xacro {description.xacro} is no file: does the wheel hold it?"
    yield from _phrases(description.not_modelled, "not_modelled")
    yield from _mappings(description.arguments, "arguments")


def _argument(name: str, argument: Any) -> Iterator[str]:
    where = f"arguments[{name!r}]"
    if not isinstance(argument, Argument):
        yield f"{where} is {argument!r}, not an Argument"
        return
    if not isinstance(argument.default, str):
        yield f"{where} default {argument.default!r} is neither text nor number"
    yield from _phrases(argument.choices, f"{where} choices")
    if argument.quantity not in _QUANTITIES:
        yield f"{where} quantity {argument.quantity!r} is none of length, angle, None"
    if argument.choices and argument.default not in argument.choices:
        listed = ", ".join(argument.choices)
        yield f"{where} default {argument.default!r} is none of its choices: {listed}"


def _robot(description: RobotDescription) -> Iterator[str]:
    yield from _numbers(description.home, "home")
    yield from _mappings(description.frames, "frames")
    radius = description.needle_radius
    if not _is_number(radius) or radius < 0.0:
        yield f"needle_radius is {radius!r}, not a length in metres, 0 or more"
    if not isinstance(description.joints, tuple | list) or not all(
        isinstance(joint, JointMap) for joint in description.joints
    ):
        yield f"joints is {description.joints!r}, not a tuple of JointMap"
    for joint in description.joints:
        if not _is_number(joint.offset) or joint.sign not in (1, -1):
            yield f"joints: {joint!r}: sign is 1 or -1, offset a number"
    if description.inverse and not description.joints:
        yield "inverse needs joints: a JointMap for each variable that it returns"
    for pair in description.allowed_contacts:
        if len(pair) != 3 or not all(isinstance(text, str) for text in pair):
            yield f"allowed_contacts: {pair!r} is not (link, link, reason)"
    yield from _phrases(description.closed_form_arguments, "closed_form_arguments")
    for name in description.closed_form_arguments:
        if name not in description.arguments:
            known = list(description.arguments)
            yield not_among("closed_form_arguments", name, "argument", known)


def _phrases(value: Any, field: str) -> Iterator[str]:
    if isinstance(value, str):
        yield f"{field} is the bare text {value!r}, not a tuple: ({value!r},)"
    elif not isinstance(value, tuple | list) or not all(
        isinstance(phrase, str) for phrase in value
    ):
        yield f"{field} is {value!r}, not a tuple of texts"


def _mappings(value: Any, field: str) -> Iterator[str]:
    if not isinstance(value, Mapping):
        yield f"{field} is {value!r}, not a dict"


def _numbers(value: Any, field: str) -> Iterator[str]:
    yield from _mappings(value, field)
    for name, number in value.items():
        if not _is_number(number):
            yield f"{field}[{name!r}] is {number!r}, not a number in metres or radians"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)
