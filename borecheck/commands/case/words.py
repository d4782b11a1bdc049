"""Puts a case file into the words of a command line; what is typed there wins."""

import argparse
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from borecheck.commands.case.keys import Key
from borecheck.commands.case.reading import Case, read_case
from borecheck.commands.case.values import arguments
from borecheck.errors import BorecheckError, CaseError, UnknownNameError, UsageError

SUFFIX = ".toml"
# Commands that take a case in the place of ROBOT and SCENE, or beside their files.
COMMANDS = ("check", "setup", "route", "compare", "view", "fk", "verify")

# Between names that one option takes: `tip:z`, `finger:palm`, `mount=+90`.
_SEPARATORS = re.compile("[:=,]")

_PLACES = {"robot": "robot", "scene": "scanner"}

AddArguments = Callable[[argparse.ArgumentParser], None]


@dataclass(frozen=True)
class CaseUse:
    """What a command takes from a case file.

    Attributes:
        file: The file as the user named it.
        sha256: Of its bytes.
        overridden: Its keys that the command line gives otherwise.
        unused: Its keys that this command has no use for.
        taken: Its other keys and their texts.
    """

    file: str
    sha256: str
    overridden: tuple[str, ...]
    unused: tuple[str, ...]
    taken: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain values for `json.dumps`."""
        found = asdict(self)
        del found["taken"]  # what was asked stands elsewhere in a result
        return found

    def placed(self, error: UnknownNameError) -> BorecheckError:
        """The error with the file and the key that hold the name, if one does."""
        for key, texts in self.taken:
            if any(error.name in _SEPARATORS.split(text) for text in texts):
                return CaseError(self.file, [f"{key}: {error}"])
        return error


@dataclass(frozen=True)
class _Typed:
    """What stands on the command line.

    Attributes:
        options: Values by option, of those that are given.
        words: Those that are no option's.
        flags: Options of this command that take no value.
        known: All options and places of this command.
        places: Those of them that are ROBOT and SCENE without an option.
        required: Places that must be filled.
    """

    options: dict[str, Any]
    words: list[str]
    flags: frozenset[str]
    known: frozenset[str]
    places: frozenset[str]
    required: frozenset[str]


def with_case(
    words: Sequence[str], bare: argparse.ArgumentParser, add_arguments: AddArguments
) -> tuple[list[str], CaseUse | None]:
    """The words with those of the case file that one of them names, if one does.

    Args:
        words: The command and what follows it.
        bare: A parser without arguments yet, which tells of errors in its own way.
        add_arguments: What fills the command's parser.

    Raises:
        UsageError: Two case files.
        InputError: The case cannot be read.
        CaseError: It holds what it may not.
    """
    typed = _typed(words, bare, add_arguments)
    files = [place for place in typed.words if place.lower().endswith(SUFFIX)]
    if not files:
        return list(words), None
    if len(files) > 1:
        raise UsageError(f"two case files: {files[0]} and {files[1]}; give one")
    case = read_case(Path(files[0]))
    return _joined(list(words), case, files[0], typed)


def _typed(
    words: Sequence[str], parser: argparse.ArgumentParser, add_arguments: AddArguments
) -> _Typed:
    """What is on the command line, whatever is missing there."""
    add_arguments(parser)
    actions = list(parser._actions)
    for action in actions:
        action.default = argparse.SUPPRESS
        if not action.option_strings:
            parser._remove_action(action)
    for group in parser._mutually_exclusive_groups:
        group.required = False
    found, rest = parser.parse_known_args(list(words[1:]))
    places = [a for a in actions if a.dest in _PLACES and not a.option_strings]
    return _Typed(
        vars(found),
        [word for word in rest if not word.startswith("-")],
        frozenset(a.dest for a in actions if a.nargs == 0),
        frozenset(a.dest for a in actions),
        frozenset(a.dest for a in places),
        frozenset(a.dest for a in places if a.nargs != "*"),
    )


def _joined(
    words: list[str], case: Case, word: str, typed: _Typed
) -> tuple[list[str], CaseUse]:
    """The words with the case's in its place and behind them, and what became of it."""
    given = set(typed.options) | _given_places(word, typed)
    filled = set(given)
    places: list[str] = []
    options: list[str] = []
    overridden: list[str] = []
    unused: list[str] = []
    taken: list[tuple[str, tuple[str, ...]]] = []
    for key, texts in case.entries:
        if key.option not in typed.known:
            unused.append(key.shown)
            continue
        kept, lost = _kept(key, texts, given, typed)
        overridden += lost
        taken.append((key.shown, tuple(kept)))
        filled |= {key.option for _ in kept}
        if key.option in typed.places:
            places += map(_no_option, kept)
        else:
            options += _as_option(key, kept, typed)
    for place in sorted(typed.required - filled):
        what = _PLACES[place]
        raise UsageError(f"{case.file} names no {what}, and the command line none")
    at = words.index(word)
    joined = [*words[:at], *places, *words[at + 1 :], *options]
    use = CaseUse(word, case.sha256, tuple(overridden), tuple(unused), tuple(taken))
    return joined, use


def _given_places(word: str, typed: _Typed) -> set[str]:
    """Which places other words have: ROBOT stands before a case, SCENE behind it."""
    if not typed.places:
        return set()
    at = typed.words.index(word)
    before, behind = typed.words[:at], typed.words[at + 1 :]
    found = {"robot"} if before else set()
    return found | ({"scene"} if before[1:] or behind else set())


def _kept(
    key: Key, texts: Sequence[str], given: set[str], typed: _Typed
) -> tuple[list[str], list[str]]:
    """The texts that the command line leaves, and the names of what it replaces."""
    if given.intersection(key.goes_with):
        return [], [key.shown]
    if key.kind is arguments:
        typed_there = {
            text.partition("=")[0] for text in typed.options.get(key.option, ())
        }
        typed_there |= given & {"mount"} if key.option == "arg" else set()
        names = [text.partition("=")[0] for text in texts]
        kept = [t for t, n in zip(texts, names, strict=True) if n not in typed_there]
        return kept, [f"{key.shown}.{name}" for name in names if name in typed_there]
    if key.option in given:
        return [], [key.shown]
    return list(texts), []


def _as_option(key: Key, texts: Sequence[str], typed: _Typed) -> list[str]:
    option = f"--{key.option.replace('_', '-')}"
    return [option if key.option in typed.flags else f"{option}={t}" for t in texts]


def _no_option(text: str) -> str:
    """A place's word that argparse cannot take for an option."""
    return f"./{text}" if text.startswith("-") else text
