"""`borecheck report`: any result as one self-contained HTML page."""

import argparse
from pathlib import Path
from typing import Any

from borecheck.errors import UsageError

# Pixels of a picture's side.
LEAST_SIDE, MOST_SIDE = 100, 6000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument("result", type=Path, help="a result (JSON), or a page of one")
    parser.add_argument("out", type=Path, nargs="?", help="the page to write")
    parser.add_argument(
        "--picture",
        type=Path,
        metavar="FILE",
        help="write one view of the worst pose, or its curve, as .svg or .png",
    )
    parser.add_argument(
        "--view",
        choices=("cut", "bore", "side", "narrow", "curve"),
        default="cut",
        help="which one (default: cut)",
    )
    parser.add_argument(
        "--size",
        default="1200x800",
        metavar="WxH",
        help="in pixels (default: %(default)s)",
    )
    parser.add_argument("--date", default=None, help="date to print, as text")
    parser.add_argument("--title", default=None, help="title to print")
    parser.add_argument("--author", default=None, help="author to print")


def run(args: argparse.Namespace) -> int:
    """Writes the page, the picture, or both."""
    from borecheck.commands.output import refuse_outputs, refuse_suffix
    from borecheck.core.result_file import read_result
    from borecheck.core.whole_files import write_whole
    from borecheck.report.page import page

    if args.out is None and args.picture is None:
        raise UsageError("name the page to write, or --picture FILE")
    width, height = _size(args.size)
    refuse_suffix("--picture", args.picture, "it is SVG or PNG", ".svg", ".png")
    outputs = {} if args.out is None else {"the page": args.out}
    refuse_outputs(args, "picture", more=outputs)
    document = read_result(args.result)
    for name in ("date", "title", "author"):
        if getattr(args, name) is not None:
            document[name] = getattr(args, name)
    if args.picture is not None:
        write_whole(args.picture, _picture(document, args, width, height))
    if args.out is not None:
        write_whole(args.out, page(document))
    return 0


def _picture(
    document: dict[str, Any], args: argparse.Namespace, width: int, height: int
) -> str | bytes:
    from borecheck.report.picture_file import picture_png, picture_svg

    if args.picture.suffix.lower() == ".png":
        return picture_png(document, args.view, width, height)
    return picture_svg(document, args.view, width, height)


def _size(text: str) -> tuple[int, int]:
    """Width and height in pixels.

    Raises:
        UsageError: It is no size, or none that a picture can have.
    """
    words = text.lower().split("x")
    if len(words) != 2 or not all(word.isdecimal() for word in words):
        raise UsageError(f"--size {text!r}: give width and height, as 1200x800")
    width, height = map(int, words)
    if not all(LEAST_SIDE <= side <= MOST_SIDE for side in (width, height)):
        raise UsageError(
            f"--size {text!r}: {LEAST_SIDE} to {MOST_SIDE} pixels a side can be drawn"
        )
    return width, height
