"""`borecheck trials`: the 64 published trials in the model: what is missed, and why?

The experiment is that of [Matsuno2020] section 4.
"""

import argparse
from pathlib import Path
from typing import Any

from borecheck.commands import common
from borecheck.commands.output import check_outputs, emit, wants_display
from borecheck.core.whole_files import check_writable
from borecheck.robots.description import LEVELS


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
    if args.state is not None:
        check_writable(args.state, stream=False)
    from borecheck.commands.compiling import tell_of_compiling
    from borecheck.commands.exit_status import ExitStatus
    from borecheck.commands.progress import Progress, say
    from borecheck.errors import UsageError
    from borecheck.report.document import header
    from zerobot.trials.document import document
    from zerobot.trials.errors import ALUMINIUM, CARBON, Sources
    from zerobot.trials.run import StudyOptions
    from zerobot.trials.run import run as study
    from zerobot.trials.text import begins, ends_early, trials_text

    if args.samples < 0 or args.jobs < 0 or args.seed < 0:
        raise UsageError("--samples, --jobs and --seed are 0 or more")
    tell_of_compiling()
    options = StudyOptions(
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
    say(f"borecheck: {begins(options)}")
    try:
        done = study(options, sources, Progress)
    except KeyboardInterrupt:
        say(f"borecheck: {ends_early(options)}")
        raise
    found = {**header("trials", args.argv, args.date), **document(done)}
    if wants_display(args):
        found["display"] = _display(args, found)
    emit(args, found, trials_text)
    return ExitStatus.CLEAN


def _display(args: argparse.Namespace, found: dict[str, Any]) -> dict[str, Any]:
    """Meshes and placements at every stop, for the page."""
    from borecheck.report.display import display_block
    from borecheck.robots.robot import load_robot
    from borecheck.robots.scene import load_scene

    robot = load_robot("zerobot", mount=args.mount, level=args.level)
    scene = load_scene("ct_gantry", couch="no", patient="no", level=args.level)
    return display_block(robot, scene, found)
