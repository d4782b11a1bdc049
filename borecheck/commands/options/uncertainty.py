"""The options of `check --uncertainty`; no heavy imports, for they are parsed first."""

import argparse
from pathlib import Path


def add_options(parser: argparse.ArgumentParser) -> None:
    """`--uncertainty`, `--risk`, `--draws` and `--seed`."""
    group = parser.add_argument_group("uncertainty")
    group.add_argument(
        "--uncertainty",
        type=Path,
        metavar="FILE",
        help="how inexact joints, dimensions and registration are (JSON): adds the "
        "probability of contact; clear only if the risk is shown to be kept",
    )
    group.add_argument(
        "--risk", type=float, default=1e-3, help="accepted probability (default: 1e-3)"
    )
    group.add_argument(
        "--draws",
        type=int,
        default=None,
        help="draws for it (default: as many as show the risk to be kept if none is in "
        "contact, 2,995 for 1e-3; fewer where they need not be made)",
    )
    group.add_argument("--seed", type=int, default=0, help="of the draws")
