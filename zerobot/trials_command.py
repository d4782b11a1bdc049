"""`borecheck trials`: the 64 trials of [Matsuno2020] in the model, and their misses."""

import argparse
import sys
from pathlib import Path

from borecheck.commands import common
from borecheck.commands.output import check_outputs, emit
from borecheck.description import LEVELS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument(
        "--mount", choices=("+90", "-90"), default="+90", help="mounting side (degrees)"
    )
    parser.add_argument(
        "--level", choices=LEVELS, default="coarse", help="level of detail of meshes"
    )
    parser.add_argument(
        "--literal",
        action="store_true",
        help="begin every approach with the tip at the isocentre, without aiming",
    )
    parser.add_argument(
        "--samples", type=int, default=200, metavar="N", help="repetitions (0: none)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of all random numbers")
    parser.add_argument("--jobs", type=int, default=0, help="processes; 0: all cores")
    parser.add_argument(
        "--state",
        type=Path,
        metavar="FILE",
        help="keeps finished repetitions there, to go on after an interruption",
    )
    parser.add_argument(
        "--beam",
        choices=("carbon", "aluminium"),
        default="carbon",
        help="material of the assumed arm",
    )
    parser.add_argument(
        "--rods",
        choices=("parallelogram", "frame4"),
        default="parallelogram",
        help="how the model places the level rods; frame4: whole W_T_4",
    )
    common.add_output(parser)


def run(args: argparse.Namespace) -> int:
    """Runs the study; 0 when it is done."""
    check_outputs(args)
    from borecheck.errors import UsageError
    from borecheck.exit_status import ExitStatus
    from borecheck.report.document import header
    from zerobot.trial_document import document
    from zerobot.trial_errors import ALUMINIUM, CARBON, Sources
    from zerobot.trial_run import Options
    from zerobot.trial_run import run as study
    from zerobot.trial_text import trials_text

    if args.samples < 0 or args.jobs < 0 or args.seed < 0:
        raise UsageError("--samples, --jobs and --seed are 0 or more")
    options = Options(
        mount=args.mount,
        level=args.level,
        aim=not args.literal,
        samples=args.samples,
        seed=args.seed,
        jobs=args.jobs,
        state=args.state,
    )
    beam = {"carbon": CARBON, "aluminium": ALUMINIUM}[args.beam]
    sources = Sources(beam=beam, level_parts=args.rods)
    found = document(study(options, sources, _progress))
    emit(args, {**header("trials", args.argv, args.date), **found}, trials_text)
    return ExitStatus.CLEAN


def _progress(text: str) -> None:
    """A line on standard error; on a terminal it replaces the one before."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\x1b[K{text}")
    else:
        sys.stderr.write(text + "\n")
    sys.stderr.flush()
