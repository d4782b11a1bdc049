"""Reads a case file strictly: every key is known and of its kind, or it is refused."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from borecheck.commands.case.keys import KEYS, ONE_OF, Key
from borecheck.commands.case.values import BODY, CaseValueError, meant
from borecheck.core.small_files import read_at_most
from borecheck.errors import CaseError, InputError

# A case of a hundred patients is smaller; what nests deeper or runs on longer in one
# line than any case does would keep the parser busy for minutes.
MAX_BYTES = 100_000
MAX_LINE = 2_000

_BY_NAME = {key.name: key for key in KEYS}
_TABLES = tuple(dict.fromkeys(key.name.partition(".")[0] for key in KEYS))


@dataclass(frozen=True)
class Case:
    """A case file as it was read.

    Attributes:
        file: As the user named it.
        sha256: Of its bytes.
        entries: Every key that it holds, and the texts of the option it stands for.
    """

    file: Path
    sha256: str
    entries: tuple[tuple[Key, tuple[str, ...]], ...]


def read_case(file: Path) -> Case:
    """The case, its paths seen from the folder that it lies in.

    Raises:
        InputError: It cannot be read, or is no TOML.
        CaseError: A line for every key that is unknown or holds what it may not.
    """
    if not file.is_file():
        raise InputError(
            file, "is no file" if file.exists() else "there is no such file"
        )
    content = read_at_most(file, MAX_BYTES)
    problems: list[str] = []
    found = _entries(_parsed(file, content), file.parent, problems)
    entries = sorted(found, key=lambda entry: KEYS.index(entry[0]))
    for group in ONE_OF:
        given = [key.shown for key, _ in entries if key.name in group]
        if len(given) > 1:
            problems.append(f"{' and '.join(given)}: give one of them")
    if problems:
        raise CaseError(file, problems)
    return Case(file, sha256(content).hexdigest(), tuple(entries))


def _parsed(file: Path, content: bytes) -> dict[str, Any]:
    for number, line in enumerate(content.split(b"\n"), 1):
        if len(line) > MAX_LINE:
            raise InputError(file, f"is longer than {MAX_LINE} bytes", f"line {number}")
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(file, "is no text in UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(file, f"is no TOML: {error}") from error
    except (RecursionError, ValueError) as error:
        raise InputError(file, "is no case: it nests, or counts, too far") from error


def _entries(
    document: Mapping[str, Any], folder: Path, problems: list[str]
) -> Iterator[tuple[Key, tuple[str, ...]]]:
    """What the file holds; what is wrong with it is added to the problems."""
    for name, value in document.items():
        if name not in _TABLES:
            problems.append(f"{name}: unknown key{meant(name, _TABLES)}")
        elif name in _BY_NAME:
            yield from _entry(name, value, folder, problems)
        elif not isinstance(value, dict):
            problems.append(f"{name}: is no table; write [{name}]")
        else:
            yield from _table(name, value, folder, problems)


def _table(
    name: str, table: Mapping[str, Any], folder: Path, problems: list[str]
) -> Iterator[tuple[Key, tuple[str, ...]]]:
    inner = [
        key.name.partition(".")[2] for key in KEYS if key.name.startswith(f"{name}.")
    ]
    found = dict(table)
    if "body" in inner:
        inner = [key for key in (*inner, *BODY) if key != "body"]
        body = {key: found.pop(key) for key in tuple(found) if key in BODY}
        if body:
            yield from _entry(f"{name}.body", body, folder, problems)
    for key, value in found.items():
        if key in inner:
            yield from _entry(f"{name}.{key}", value, folder, problems)
        else:
            problems.append(f"{name}.{key}: unknown key{meant(key, inner)}")


def _entry(
    name: str, value: Any, folder: Path, problems: list[str]
) -> Iterator[tuple[Key, tuple[str, ...]]]:
    key = _BY_NAME[name]
    try:
        yield key, tuple(key.kind(value, folder))
    except CaseValueError as problem:
        problems.append(f"{key.shown}{problem.below}: {problem}")
