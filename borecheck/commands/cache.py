"""`borecheck cache`: what is kept on disk, and taking it away."""

import argparse
import json
import sys
from pathlib import Path

from borecheck.core.cache import cache_folder
from borecheck.core.kept import Entry, entries, limit, take_away
from borecheck.core.result_file import SCHEMA_VERSION
from borecheck.core.text import in_lines


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `borecheck cache info|clear`."""
    below = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    info = below.add_parser("info", help="where it is, what is in it, the limit")
    info.add_argument("--format", choices=("text", "json"), default="text")
    below.add_parser("clear", help="take everything away; it is made again when needed")


def run(args: argparse.Namespace) -> int:
    """Prints what is kept, or takes it away."""
    folder = cache_folder()
    kept = entries(folder)
    if args.action == "clear":
        for entry in kept:
            take_away(entry)
        lines = [f"{folder}: {len(kept)} results taken away, {_size(_total(kept))}"]
        sys.stdout.write(in_lines(lines))
    elif args.format == "json":
        sys.stdout.write(json.dumps(_document(folder, kept), indent=1) + "\n")
    else:
        sys.stdout.write(in_lines(_lines(folder, kept)))
    return 0


def _document(folder: Path, kept: list[Entry]) -> dict[str, object]:
    kinds = sorted({entry.kind for entry in kept})
    of = {kind: [e for e in kept if e.kind == kind] for kind in kinds}
    return {
        "schema_version": SCHEMA_VERSION,
        "command": "cache",
        "folder": str(folder),
        "limit_bytes": limit(),
        "bytes": _total(kept),
        "kinds": {k: {"count": len(v), "bytes": _total(v)} for k, v in of.items()},
    }


def _lines(folder: Path, kept: list[Entry]) -> list[str]:
    lines = [f"{folder}: {_size(_total(kept))} of at most {_size(limit())}"]
    for kind in sorted({entry.kind for entry in kept}):
        of = [entry for entry in kept if entry.kind == kind]
        lines.append(f"  {kind}: {len(of)}, {_size(_total(of))}")
    return lines


def _total(kept: list[Entry]) -> int:
    return sum(entry.size for entry in kept)


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB"
