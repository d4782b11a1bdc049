"""The command line: parses, calls one subcommand, turns errors into one line."""

import argparse
import ast
import atexit
import gc
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from importlib.metadata import EntryPoint
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from borecheck.commands.words import refuse_unknown_command, refuse_unknown_options
from borecheck.core.entries import entries
from borecheck.core.streams import finish, log_in_lines, prepare_streams
from borecheck.core.text import one_line
from borecheck.core.version import __version__
from borecheck.errors import BorecheckError, UnknownNameError, UsageError

if TYPE_CHECKING:
    from borecheck.commands.case.words import CaseUse

COMMANDS = {
    "robots": ("borecheck.commands.robots", "robots and scanners installed"),
    "validate": ("borecheck.commands.validate", "is a URDF or xacro file sound?"),
    "explain": ("borecheck.commands.explain", "what a finding's code means"),
    "fk": ("borecheck.commands.fk", "kinematics three ways: do they agree?"),
    "init": ("borecheck.commands.init", "writes a case file to fill in"),
    "examples": ("borecheck.commands.examples", "writes files to try it with"),
    "check": ("borecheck.commands.check", "will the robot touch anything?"),
    "setup": ("borecheck.commands.setup", "the best configuration for a needle"),
    "route": ("borecheck.commands.route", "a certified way to a plan or pose"),
    "directions": ("borecheck.commands.directions", "which way in is clear, proven"),
    "compare": ("borecheck.commands.compare", "where do contact checkers differ, why?"),
    "calibrate": ("borecheck.commands.calibrate", "identify a serial arm's axes"),
    "report": ("borecheck.commands.report", "a result as one HTML page"),
    "verify": ("borecheck.commands.verify", "re-check a path certificate"),
    "patient": ("borecheck.commands.patient", "an obstacle that contains the patient"),
    "body": ("borecheck.commands.body", "a patient's body by sex, height and BMI"),
    "cache": ("borecheck.commands.cache", "results kept on disk"),
    "view": ("borecheck.commands.view", "live view in the browser"),
}

COULD_NOT, INTERRUPTED = 2, 130
_OBJECTS_BETWEEN_COLLECTIONS = 500_000

# An option's value may start with a sign: `--q -0.1,0,0`, `--mount -90`.
_SIGNED = re.compile(r"[-+][0-9.]")


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status.

    Args:
        argv: The words after `borecheck`; those of the process by default.
    """
    if argv is None:
        _prepare_process()
    try:
        return _guarded(list(sys.argv[1:] if argv is None else argv))
    finally:
        for stream in (sys.stdout, sys.stderr):
            finish(stream)


def _guarded(words: list[str]) -> int:
    """The exit status; whatever goes wrong is told in one line."""
    try:
        status = _run(join_signed(words))
        sys.stdout.flush()  # what the reader did not get is no success
        return status
    except BrokenPipeError:
        return COULD_NOT  # the reader of our output has gone: nobody to tell it to
    except KeyboardInterrupt:
        _tell("interrupted")
        return INTERRUPTED
    except BorecheckError as error:
        for line in error.lines:
            _tell(f"error: {line}")
    except OSError as error:
        _tell(f"error: {error}")
    except MemoryError:
        _tell("error: not enough memory")
    except Exception as error:  # noqa: BLE001 - Python's status 1 would say "contact"
        _tell_defect(error)
    return COULD_NOT


def _run(words: list[str]) -> int:
    commands = _all_commands()
    name = next((word for word in words if not word.startswith("-")), None)
    if not words:
        _parser(commands, None)[0].print_help()
        return 0
    if name is not None and words[0] == name:
        refuse_unknown_command(name, commands)
    given, case = _with_case(words, commands)
    parser, command = _parser(commands, name)
    if name is not None and command is not None:
        refuse_unknown_options(command, given[given.index(name) + 1 :])
    args = parser.parse_args(given)
    args.argv, args.case = words, case
    try:
        return int(args.run(args))
    except UnknownNameError as error:
        raise (error if case is None else case.placed(error)) from None


def _with_case(
    words: list[str], commands: dict[str, tuple[str, str]]
) -> "tuple[list[str], CaseUse | None]":
    """The words with those of a case file, if one is named: `check case.toml`."""
    if not any(word.lower().endswith(".toml") for word in words):
        return words, None
    from borecheck.commands.case.words import COMMANDS as TAKING_CASES
    from borecheck.commands.case.words import with_case

    if words[0] not in TAKING_CASES or not {"-h", "--help"}.isdisjoint(words):
        return words, None
    loaded: Any = import_module(commands[words[0]][0])
    bare = _Parser(prog=f"borecheck {words[0]}")
    return with_case(words, bare, loaded.add_arguments)


def _tell(text: str) -> None:
    with suppress(OSError):  # standard error, where it would be told, is closed
        print(f"borecheck: {one_line(text)}", file=sys.stderr)


def _tell_defect(error: Exception) -> None:
    """Where it happened; the message may hold names from files, and is one line."""
    places = "".join(traceback.format_tb(error.__traceback__))
    with suppress(OSError):
        sys.stderr.write(f"Traceback (most recent call last):\n{places}")
    _tell(f"error: a defect of borecheck, see above: {type(error).__name__}: {error}")


def _prepare_process() -> None:
    """What holds for a process that is ours alone."""
    # Imports make no garbage, but looking for it takes a tenth of a start; and
    # nothing needs to be looked for when the process ends.
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS, 10, 10)
    atexit.register(gc.freeze)
    prepare_streams()
    log_in_lines()


def join_signed(words: list[str]) -> list[str]:
    """`--q -0.1,0` as `--q=-0.1,0`, which argparse would take for an option."""
    joined: list[str] = []
    for word in words:
        option = joined[-1] if joined else ""
        if _SIGNED.match(word) and re.fullmatch(r"--[a-z][a-z-]*", option):
            joined[-1] = f"{option}={word}"
        else:
            joined.append(word)
    return joined


def _all_commands() -> dict[str, tuple[str, str]]:
    """Built-in commands and those that installed robots bring."""
    commands = dict(COMMANDS)
    for entry in _plugged_in():
        commands[entry.name] = (entry.value, _purpose(entry))
    return commands


def _plugged_in() -> list[EntryPoint]:
    return entries("borecheck.commands")


def _purpose(entry: EntryPoint) -> str:
    """The first line of a command's module, which is read, not imported.

    Written as "`borecheck NAME`: what it does."
    """
    package = entry.value.partition(".")[0].partition(":")[0]
    try:
        found = find_spec(entry.value.partition(":")[0])
        text = Path(found.origin or "").read_text(encoding="utf-8") if found else ""
        summary = (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]
    except (Exception, SystemExit):  # noqa: BLE001 - a package may raise anything
        summary = ""  # whoever runs it is told what is wrong with it
    purpose = summary.partition("`: ")[2].rstrip(".")
    return f"{purpose} ({package})" if purpose else f"from {package}"


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, of words which shells expand."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{one_line(message)} (see '{self.prog} --help')")


def _parser(
    commands: dict[str, tuple[str, str]], chosen: str | None
) -> tuple[argparse.ArgumentParser, argparse.ArgumentParser | None]:
    """The parser and the chosen command's; only that one's module is imported."""
    parser = _Parser(
        prog="borecheck",
        description="Tells, with proof, whether an image-guided needle robot will "
        "touch the scanner it works in.",
        epilog="Exit status: 0 clear or clean, 1 contact or findings, 2 unknown or "
        "could not run, 130 interrupted. No medical device.",
    )
    parser.add_argument(
        "--version", action="version", version=f"borecheck {__version__}"
    )
    below = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    filled = None
    for name, (module, summary) in commands.items():
        command = below.add_parser(name, help=summary, description=summary)
        if name == chosen:
            _fill(command, module)
            filled = command
    return parser, filled


def _fill(command: argparse.ArgumentParser, module: str) -> None:
    loaded: Any = import_module(module)
    loaded.add_arguments(command)
    run: Callable[[argparse.Namespace], int] = loaded.run
    command.set_defaults(run=run)


if __name__ == "__main__":
    sys.exit(main())
