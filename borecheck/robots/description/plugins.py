"""Where installed robots and scanners are found, and what a broken package is told.

Whatever a package raises or fills in wrongly is one line that names robot and package,
with the file and line where it happened, and takes no other package down.
"""

import re
from collections.abc import Sequence
from dataclasses import fields
from functools import cache
from importlib.metadata import EntryPoint
from itertools import chain
from pathlib import Path
from typing import Any

from borecheck.core.entries import entries
from borecheck.errors import BorecheckError, UnknownNameError, UsageError
from borecheck.robots.description.fields import field_problems, not_among
from borecheck.robots.description.hooks import missing_hooks, told
from borecheck.robots.description.records import (
    Argument,
    Description,
    JointMap,
    RobotDescription,
    ScannerDescription,
    Solutions,
)

_KINDS: dict[str, type[Description]] = {
    "robots": RobotDescription,
    "scanners": ScannerDescription,
}
_RECORDS = {
    record.__name__: record
    for record in (Argument, JointMap, Solutions, *_KINDS.values())
}
_UNKNOWN_FIELD = re.compile(r"(\w+)\.__init__\(\) got an unexpected keyword.*? '(\w+)'")


def installed_names(group: str) -> list[str]:
    """Names in the entry-point group `borecheck.<group>`, sorted."""
    return sorted({entry.name for entry in _entries(group)})


@cache
def installed_folders() -> tuple[Path, ...]:
    """Folders of all installed descriptions, and of the meshes shipped with them."""
    found: list[Path] = []
    for group in _KINDS:
        for name in installed_names(group):
            try:
                description: Description = installed(group, group, name)
            except BorecheckError:
                continue  # a plug-in that cannot be loaded brings no files
            found.append(description.xacro.parent)
            found += [] if description.shipped is None else [description.shipped]
    return tuple(found)


def installed(group: str, kind: str, name: str) -> Any:
    """The installed description of that name, its fields looked at.

    Raises:
        UnknownNameError: None is installed; lists those that are.
        UsageError: Its package cannot be loaded, or a field holds what it must not.
    """
    named = [entry for entry in _entries(group) if entry.name == name]
    if not named:
        raise UnknownNameError(kind, name, installed_names(group))
    try:
        return _sound(named, _KINDS[group])
    except UsageError as error:
        raise UsageError(f"{package_of(group, name)}: {error}") from error


def package_of(group: str, name: str) -> str:
    """`robot tilt_arm (package tilt-arm)`, for messages."""
    named = [entry for entry in _entries(group) if entry.name == name]
    names = sorted({entry.dist.name for entry in named if entry.dist is not None})
    package = f" (package {', '.join(names)})" if names else ""
    return f"{group.removesuffix('s')} {name}{package}"


def _sound(named: Sequence[EntryPoint], kind: type[Description]) -> Description:
    """What an entry point names, if it is a description without a defect."""
    entry = named[0]
    if any(other.value != entry.value for other in named):
        values = " and ".join(sorted(entry.value for entry in named))
        raise UsageError(f"the name is taken twice, by {values}")
    description = _loaded(entry)
    if not isinstance(description, kind):
        given = type(description).__name__
        raise UsageError(f"{entry.value} is {given}, not {kind.__name__}")
    if description.name != entry.name:
        raise UsageError(
            f"name {description.name!r} must be the entry point's, {entry.name!r}"
        )
    for problem in chain(field_problems(description), missing_hooks(description)):
        raise UsageError(problem)
    return description


def _loaded(entry: EntryPoint) -> Any:
    try:
        return entry.load()
    except (Exception, SystemExit) as error:  # a stranger's module may raise anything
        hint = _nearest_field(str(error))
        raise UsageError(
            f"{entry.value} cannot be loaded: {told(error)}{hint}"
        ) from error


def _nearest_field(message: str) -> str:
    """The fields of a record, where a package gave one that there is not."""
    found = _UNKNOWN_FIELD.search(message)
    record = _RECORDS.get(found.group(1)) if found else None
    if found is None or record is None:
        return ""
    known = [field.name for field in fields(record)]
    return f": {not_among(record.__name__, found.group(2), 'field', known)}"


def _entries(group: str) -> list[EntryPoint]:
    return entries(f"borecheck.{group}")
