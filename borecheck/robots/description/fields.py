"""Whether the fields of a description hold what they must, before a file is read."""

import math
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from borecheck.robots.description.hooks import HOOKS
from borecheck.robots.description.records import (
    ROLES,
    Argument,
    Description,
    JointMap,
    RobotDescription,
    ScannerDescription,
)

_TEXTS = ("name", "title", "source")
_NAMES = ("needle_link", "tool_frame", "base_frame", "insertion_joint", "scanner")
_QUANTITIES = (None, "length", "angle")


def not_among(field: str, name: object, kind: str, known: list[str]) -> str:
    """The line for a name that does not exist, with the nearest that does."""
    close = get_close_matches(str(name), known, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    return f"{field} {name!r} is no {kind}{hint} (known: {', '.join(known) or 'none'})"


def field_problems(description: Description) -> Iterator[str]:
    """What is wrong with the fields, a line each: field, value, what is right.

    Only the first is to be relied on: later ones may follow from it.
    """
    yield from _texts(description)
    yield from _paths(description)
    yield from _phrases(description.not_modelled, "not_modelled")
    yield from _mapping(description.arguments, "arguments")
    for name, argument in description.arguments.items():
        yield from _argument(name, argument)
    if isinstance(description, RobotDescription):
        yield from _robot(description)
    if isinstance(description, ScannerDescription):
        yield from _scanner(description)


def _texts(description: Description) -> Iterator[str]:
    for field in (*_TEXTS, *HOOKS, *_NAMES):
        value = getattr(description, field, None)
        if not isinstance(value, str | None) or (field in _TEXTS and not value):
            yield f"{field} is {value!r}, not a text"
    for field in HOOKS:
        value = getattr(description, field, None)
        if value and not all(value.partition(":")):
            yield f"{field} {value!r} is not of the form 'module:function'"


def _paths(description: Description) -> Iterator[str]:
    for field in ("xacro", "shipped"):
        value = getattr(description, field)
        if not isinstance(value, Path) and (field == "xacro" or value is not None):
            yield f"{field} is {value!r}, not a pathlib.Path"
    if not description.xacro.is_file():
        yield f"xacro {description.xacro} is no file: does the package ship it?"
    if description.shipped is not None and not description.shipped.is_dir():
        yield f"shipped {description.shipped} is no folder: does the package ship it?"
    if description.meshes and description.shipped is None:
        yield "meshes needs shipped: the folder with the coarse meshes of the defaults"


def _argument(name: str, argument: Any) -> Iterator[str]:
    where = f"arguments[{name!r}]"
    if not isinstance(argument, Argument):
        yield f"{where} is {argument!r}, not an Argument"
        return
    if not isinstance(argument.default, str):
        right = repr(str(argument.default))
        yield f"{where}: default {argument.default!r} is not a text; write {right}"
    yield from _phrases(argument.choices, f"{where}: choices")
    if argument.quantity not in _QUANTITIES:
        yield f"{where}: quantity {argument.quantity!r} is none of length, angle, None"
    if argument.choices and argument.default not in argument.choices:
        listed = ", ".join(argument.choices)
        yield f"{where}: default {argument.default!r} is none of its choices: {listed}"
    if argument.quantity is not None and not _is_float(argument.default):
        yield (
            f"{where}: default {argument.default!r} is no number: give metres or "
            "radians without a unit"
        )


def _robot(description: RobotDescription) -> Iterator[str]:
    yield from _numbers(description.home, "home")
    yield from _mapping(description.frames, "frames")
    radius = description.needle_radius
    if not _is_number(radius) or radius < 0.0:
        yield f"needle_radius is {radius!r}, not a length in metres, 0 or more"
    if not isinstance(description.joints, tuple | list):
        yield f"joints is {description.joints!r}, not a tuple of JointMap"
    for joint in description.joints:
        if not isinstance(joint, JointMap):
            yield f"joints: {joint!r} is not a JointMap"
        elif not (_is_number(joint.sign) and joint.sign and _is_number(joint.offset)):
            yield f"joints: {joint!r}: sign is 1 or -1, offset a number"
    if description.inverse and not description.joints:
        yield "inverse needs joints: a JointMap for each variable that it returns"
    if not isinstance(description.allowed_contacts, tuple | list):
        yield f"allowed_contacts is {description.allowed_contacts!r}, not a tuple"
    for pair in description.allowed_contacts:
        if not _is_allowed(pair):
            yield f"allowed_contacts: {pair!r} is not (link, link, reason)"
    yield from _phrases(description.closed_form_arguments, "closed_form_arguments")
    for name in description.closed_form_arguments:
        if name not in description.arguments:
            known = list(description.arguments)
            yield not_among("closed_form_arguments", name, "argument", known)


def _scanner(description: ScannerDescription) -> Iterator[str]:
    yield from _mapping(description.roles, "roles")
    for link, role in description.roles.items():
        if role not in ROLES:
            yield not_among(f"roles[{link!r}]", role, "role", list(ROLES))
    yield from _numbers(description.joints, "joints")
    yield from _mapping(description.points, "points")


def _is_allowed(pair: Any) -> bool:
    is_triple = isinstance(pair, tuple | list) and len(pair) == 3
    return is_triple and all(isinstance(text, str) for text in pair)


def _phrases(value: Any, field: str) -> Iterator[str]:
    if isinstance(value, str):
        yield f"{field} is the bare text {value!r}, not a tuple: ({value!r},)"
    elif not isinstance(value, tuple | list) or not all(
        isinstance(phrase, str) for phrase in value
    ):
        yield f"{field} is {value!r}, not a tuple of texts"


def _mapping(value: Any, field: str) -> Iterator[str]:
    if not isinstance(value, Mapping):
        yield f"{field} is {value!r}, not a dict"


def _numbers(value: Any, field: str) -> Iterator[str]:
    yield from _mapping(value, field)
    for name, number in value.items():
        if not _is_number(number):
            yield f"{field}[{name!r}] is {number!r}, not a number in metres or radians"


def _is_number(value: Any) -> bool:
    try:
        return not isinstance(value, str | bool) and math.isfinite(value)
    except TypeError:
        return False


def _is_float(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
