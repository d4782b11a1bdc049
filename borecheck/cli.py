"""The command line: parses, calls one subcommand, turns errors into one line."""

import argparse
import ast
import atexit
import gc
import os
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from borecheck.core.version import __version__
from borecheck.errors import BorecheckError

COMMANDS = {
    "robots": ("borecheck.commands.robots", "robots and scanners installed"),
    "validate": ("borecheck.commands.validate", "is a URDF or xacro file sound?"),
    "explain": ("borecheck.commands.explain", "what a finding's code means"),
    "fk": ("borecheck.commands.fk", "kinematics three ways: do they agree?"),
    "check": ("borecheck.commands.check", "will the robot touch anything?"),
    "compare": ("borecheck.commands.compare", "where do contact checkers differ, why?"),
    "calibrate": ("borecheck.commands.calibrate", "identify a serial arm's axes"),
    "report": ("borecheck.commands.report", "a result as one HTML page"),
    "verify": ("borecheck.commands.verify", "re-check a path certificate"),
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
        # Imports make no garbage, but looking for it takes a tenth of a start; and
        # nothing needs to be looked for when the process ends.
        gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS, 10, 10)
        atexit.register(gc.freeze)
    words = join_signed(list(sys.argv[1:] if argv is None else argv))
    commands = _all_commands()
    name = next((word for word in words if not word.startswith("-")), None)
    parser = _parser(commands, name)
    try:
        args = parser.parse_args(words)
        args.argv = words
        return int(args.run(args))
    except BorecheckError as error:
        print(f"borecheck: error: {_one_line(error)}", file=sys.stderr)
        return COULD_NOT
    except KeyboardInterrupt:
        print("borecheck: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # the reader of our output has gone; nothing more can be said to it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return COULD_NOT
    except OSError as error:
        print(f"borecheck: error: {_one_line(error)}", file=sys.stderr)
        return COULD_NOT
    except MemoryError:
        print("borecheck: error: not enough memory", file=sys.stderr)
        return COULD_NOT
    except Exception:  # noqa: BLE001 - Python's own status 1 would say "contact"
        traceback.print_exc()
        print("borecheck: error: a defect of borecheck, see above", file=sys.stderr)
        return COULD_NOT


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


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())


def _all_commands() -> dict[str, tuple[str, str]]:
    """Built-in commands and those that installed robots bring."""
    commands = dict(COMMANDS)
    for entry in _plugged_in():
        commands[entry.name] = (entry.value, _purpose(entry))
    return commands


def _plugged_in() -> list[EntryPoint]:
    return sorted(entry_points(group="borecheck.commands"), key=lambda e: e.name)


def _purpose(entry: EntryPoint) -> str:
    """The first line of a command's module, which is read, not imported.

    Written as "`borecheck NAME`: what it does."
    """
    package = entry.value.partition(".")[0].partition(":")[0]
    try:
        found = find_spec(entry.value.partition(":")[0])
        text = Path(found.origin or "").read_text(encoding="utf-8") if found else ""
        told = (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]
    except (ImportError, OSError, ValueError, SyntaxError):
        told = ""  # whoever runs it is told what is wrong with it
    purpose = told.partition("`: ")[2].rstrip(".")
    return f"{purpose} ({package})" if purpose else f"from {package}"


def _parser(
    commands: dict[str, tuple[str, str]], chosen: str | None
) -> argparse.ArgumentParser:
    """The parser; only the chosen command's module is imported."""
    parser = argparse.ArgumentParser(
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
    for name, (module, summary) in commands.items():
        command = below.add_parser(name, help=summary, description=summary)
        if name == chosen:
            _fill(command, module)
    return parser


def _fill(command: argparse.ArgumentParser, module: str) -> None:
    loaded: Any = import_module(module)
    loaded.add_arguments(command)
    run: Callable[[argparse.Namespace], int] = loaded.run
    command.set_defaults(run=run)


if __name__ == "__main__":
    sys.exit(main())
