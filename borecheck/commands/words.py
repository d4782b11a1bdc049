"""Words of a command line that mean nothing: told with what may have been meant."""

import argparse
import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path

from borecheck.errors import UnknownNameError, UsageError

_OPTION = re.compile(r"--?[A-Za-z]")
# What robots and obstacles come in: typed first, the command was forgotten.
_FILES = (".urdf", ".xacro", ".stl", ".obj", ".ply", ".dae")


def refuse_unknown_command(name: str, known: Iterable[str]) -> None:
    """Nothing, unless the first word is no command.

    Raises:
        UsageError: It is a file: the command is missing.
        UnknownNameError: It is none of the commands.
    """
    names = tuple(known)
    if name in names:
        return
    if name.lower().endswith(_FILES):
        file = Path(name).name
        raise UsageError(
            f"{name!r} is a file, not a command: write for example "
            f"'borecheck check {file} SCENE --q home' or 'borecheck validate {file}'"
        )
    raise UnknownNameError("command", name, names)


def refuse_unknown_options(
    parser: argparse.ArgumentParser, words: Sequence[str]
) -> None:
    """Nothing, unless a word looks like an option and is none of the command's.

    argparse would first tell what is missing, which a misspelt option often causes.

    Args:
        parser: The command's.
        words: Those behind the command.

    Raises:
        UsageError: Names the option and the nearest one that there is.
    """
    known = _options(parser)
    for word in words:
        if word == "--":
            return
        option = word.partition("=")[0]
        if _OPTION.match(word) and not _is_known(option, known):
            close = get_close_matches(option, sorted(known), 1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            raise UsageError(
                f"unknown option {option!r}{hint} ('{parser.prog} --help' lists all)"
            )


def _is_known(option: str, known: Iterable[str]) -> bool:
    """Whether argparse takes it: whole, by its beginning, or `-n5`."""
    if option.startswith("--"):
        return any(name.startswith(option) for name in known)
    return option[:2] in known


def _options(parser: argparse.ArgumentParser) -> set[str]:
    """All options of a command and of the commands below it."""
    found: set[str] = set()
    for action in parser._actions:
        found |= set(action.option_strings)
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                found |= _options(below)
    return found
