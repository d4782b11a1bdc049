"""`borecheck init`: writes a case file to fill in."""

import argparse
from importlib.resources import files
from pathlib import Path

NAME = "case.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument(
        "where",
        type=Path,
        nargs="?",
        default=Path(),
        metavar="DIR|FILE.toml",
        help=f"a folder, for {NAME} in it (default: this one), or the file to write",
    )


def run(args: argparse.Namespace) -> int:
    """Writes the file; what is there already stays."""
    from borecheck.commands.progress import say
    from borecheck.core.whole_files import write_whole
    from borecheck.errors import UsageError

    file = args.where / NAME if args.where.is_dir() else args.where
    if file.suffix.lower() != ".toml":
        raise UsageError(f"{file}: there is no such folder, and a case ends in .toml")
    if file.exists():
        raise UsageError(f"{file}: is there already; it was left alone")
    write_whole(file, template())
    say(f"borecheck: wrote {file}; fill it in, then: borecheck check {file}")
    return 0


def template() -> str:
    """The case file as it is written: every key, explained; a case that can be run."""
    source = files("borecheck.commands.case") / "template.toml"
    return source.read_text(encoding="utf-8")
