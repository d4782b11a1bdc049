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
        "probability of contact",
    )
    group.add_argument(
        "--risk", type=float, default=1e-3, help="accepted probability (default: 1e-3)"
    )
    group.add_argument(
        "--draws", type=int, default=1000, help="draws for it (default: 1000)"
    )
    group.add_argument("--seed", type=int, default=0, help="of the draws")
