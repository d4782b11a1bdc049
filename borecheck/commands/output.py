"""Writes a result where the user asked for it: standard output, a file, a page."""

import argparse
import sys
from collections.abc import Callable, Mapping
from typing import Any

from borecheck.core.whole_files import check_writable, write_whole
from borecheck.errors import UsageError
from borecheck.report.document import dumps

Text = Callable[[Mapping[str, Any]], str]


def check_outputs(args: argparse.Namespace) -> None:
    """Refuses outputs that cannot be written, before any work is done."""
    if args.report is not None and args.report == args.out:
        raise UsageError("--out and --report name the same file")
    for path in (args.out, args.report):
        if path is not None:
            check_writable(path)


def emit(args: argparse.Namespace, document: Mapping[str, Any], text: Text) -> None:
    """Prints the result and writes the files that were asked for.

    Args:
        args: The options.
        document: The full result; its geometry, if any, stands under `display`.
        text: Renders it as plain text.
    """
    if args.out is not None:
        write_whole(args.out, dumps(document))
    if args.report is not None:
        from borecheck.report.page import page

        write_whole(args.report, page(document))
    if args.format == "json":
        bare = {key: value for key, value in document.items() if key != "display"}
        sys.stdout.write(dumps(bare))
    elif sys.stdout.isatty():
        from borecheck.report.terminal import show

        show(text(document))
    else:
        sys.stdout.write(text(document))


def wants_display(args: argparse.Namespace) -> bool:
    """Whether the result must carry geometry for a page."""
    return args.out is not None or args.report is not None
