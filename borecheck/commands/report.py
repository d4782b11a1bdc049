"""`borecheck report`: any result as one self-contained HTML page."""

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument("result", type=Path, help="a result (JSON), or a page of one")
    parser.add_argument("out", type=Path, help="the page to write")
    parser.add_argument("--date", default=None, help="date to print, as text")
    parser.add_argument("--title", default=None, help="title to print")
    parser.add_argument("--author", default=None, help="author to print")


def run(args: argparse.Namespace) -> int:
    """Writes the page."""
    from borecheck.commands.output import refuse_outputs
    from borecheck.core.result_file import read_result
    from borecheck.core.whole_files import write_whole
    from borecheck.report.page import page

    refuse_outputs(args, more={"the page": args.out})
    document = read_result(args.result)
    for name in ("date", "title", "author"):
        if getattr(args, name) is not None:
            document[name] = getattr(args, name)
    write_whole(args.out, page(document))
    return 0
