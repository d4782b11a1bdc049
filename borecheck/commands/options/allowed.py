"""`--srdf`, `--allow` and `--trust-never`: which links may touch each other."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from borecheck.robots.allowed import Allowances


def add_allowed(parser: argparse.ArgumentParser) -> None:
    """The options; for every command that gives a verdict."""
    group = parser.add_argument_group(
        "links that may touch each other",
        "Every pair is listed in the result; an obstacle may never be touched.",
    )
    group.add_argument(
        "--srdf",
        type=Path,
        metavar="FILE",
        help="take the pairs whose reason there is Adjacent, Default or Always",
    )
    group.add_argument(
        "--trust-never",
        action="store_true",
        help="take its other pairs, too: Never is statistics, not proof",
    )
    group.add_argument(
        "--allow",
        action="append",
        default=[],
        metavar="LINK:LINK",
        help="two links of the robot that may touch (repeatable)",
    )


def add_explain(parser: argparse.ArgumentParser) -> None:
    """Whether the text lists what it else sums up."""
    parser.add_argument(
        "--explain",
        action="store_true",
        help="list all pairs of links that may touch, with reason and source",
    )


def allowances(args: argparse.Namespace) -> "Allowances":
    """What the options say; nothing for a command without them."""
    from borecheck.robots.allowed import NONE, allowances_of

    if not hasattr(args, "srdf"):
        return NONE
    return allowances_of(args.srdf, args.allow, args.trust_never)
