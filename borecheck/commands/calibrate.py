"""`borecheck calibrate`: simulate, fit, observe, plan, report."""

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from borecheck.commands.common import roots_of
from borecheck.commands.options.outside import add_allow_outside
from borecheck.commands.output import refuse_outputs
from borecheck.commands.progress import say
from borecheck.core.result_file import SCHEMA_VERSION
from borecheck.core.units import parse_angle, parse_length, parse_pair
from borecheck.core.whole_files import write_whole
from borecheck.errors import InputError, UsageError

if TYPE_CHECKING:
    from borecheck.calibration.arm_source import Subject
    from borecheck.calibration.fit import Fit

NOISES = "none, cameras, laser, or a device of the robot's own set-up"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `borecheck calibrate simulate|fit|observe|plan|report`."""
    below = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    _add_simulate(below.add_parser("simulate", help="data of an arm that is a bit off"))
    _add_fit(below.add_parser("fit", help="parameters of an arm from measured points"))
    _add_observe(below.add_parser("observe", help="what samples can show of an arm"))
    _add_plan(below.add_parser("plan", help="joint values worth measuring at"))
    report = below.add_parser("report", help="a fit's result as one HTML page")
    report.add_argument("result", type=Path, help="what `fit --out` wrote")
    report.add_argument("page", type=Path, metavar="OUT.html", help="the page")


def run(args: argparse.Namespace) -> int:
    """Does it; 0 when done, 1 if a fit is odd. Errors become one line and status 2."""
    actions: dict[str, Callable[[argparse.Namespace], int | None]] = {
        "simulate": _simulate,
        "fit": _fit,
        "observe": _observe,
        "plan": _plan,
        "report": _report,
    }
    return actions[args.action](args) or 0


def _add_robot(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("robot", help="installed robot, or a URDF or xacro file")
    add(
        "--arg",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="xacro argument",
    )
    add("--package-path", action="append", default=[], type=Path, metavar="DIR")
    add_allow_outside(add)
    add("--world", metavar="LINK", help="link in whose frame points are measured")
    add("--tip", metavar="LINK", help="link that carries the target")
    add("--target", metavar="X,Y,Z", help="the target in the tip link's frame")


def _add_simulate(parser: argparse.ArgumentParser) -> None:
    _add_robot(parser)
    add = parser.add_argument
    add("--samples", type=int, default=42, metavar="N", help="for each joint (42)")
    add("--noise", default="none", help=f"{NOISES} (none)")
    add("--seed", type=int, default=0, metavar="K", help="of everything random (0)")
    add("--variation", default="4deg", help="half width about the base points (4deg)")
    add("--pulse", help="encoder resolution of all joints (default: the set-up's)")
    add("--out", type=Path, required=True, metavar="DATA.csv", help="measurements")
    add("--truth", type=Path, metavar="TRUTH.json", help="the true parameters")


def _add_fit(parser: argparse.ArgumentParser) -> None:
    _add_robot(parser)
    add = parser.add_argument
    add("data", type=Path, help="CSV: joint values and x, y, z in named columns")
    add("--refine", action="store_true", help="then all parameters at once")
    add("--start", choices=("points", "nominal"), default="points", help="(points)")
    add("--robust", action="store_true", help="leave out or trust less what is far off")
    add("--format", choices=("text", "json"), default="text", help="of the result")
    add("--out", type=Path, metavar="RESULT.json", help="the full result, for `report`")
    add("--urdf", type=Path, metavar="OUT.urdf", help="the corrected robot")


def _add_observe(parser: argparse.ArgumentParser) -> None:
    _add_robot(parser)
    add = parser.add_argument
    add("data", type=Path, help="CSV of joint values; x, y, z may be missing")
    add("--sigma", default="0.1mm", help="of a measured coordinate (0.1mm)")
    add("--format", choices=("text", "json"), default="text", help="of the result")


def _add_plan(parser: argparse.ArgumentParser) -> None:
    _add_robot(parser)
    add = parser.add_argument
    add("--samples", type=int, default=40, metavar="N", help="how many (40)")
    add("--candidates", type=int, default=400, metavar="M", help="to choose from (400)")
    add("--sigma", default="0.1mm", help="of a measured coordinate (0.1mm)")
    add("--seed", type=int, default=0, metavar="K", help="of the candidates (0)")
    add("--out", type=Path, metavar="PLAN.csv", help="the joint values")


def _subject(args: argparse.Namespace) -> "Subject":
    from borecheck.calibration.arm_source import read_subject

    target = None
    if args.target is not None:
        parts = args.target.split(",")
        if len(parts) != 3:
            raise UsageError(f"--target {args.target!r} is not X,Y,Z")
        target = tuple(map(parse_length, parts))
    given = dict(parse_pair(text, "--arg") for text in args.arg)
    return read_subject(args.robot, given, roots_of(args), args.world, args.tip, target)


def _tell_of_held(subject: "Subject") -> None:
    """Which joints no calibration here is about, each in a line."""
    for joint, stand in subject.arm.held.items():
        say(f"borecheck: prismatic joint {joint} is not identified: held at {stand} m")


def _simulate(args: argparse.Namespace) -> None:
    import numpy as np

    from borecheck.calibration.measurements import write_measurements
    from borecheck.calibration.simulate import simulate

    refuse_outputs(args, "out", "truth")
    if args.samples < 3:
        raise UsageError(
            f"--samples {args.samples}: it takes at least 3 for each joint"
        )
    subject = _subject(args)
    rng = np.random.default_rng(args.seed)
    variation = parse_angle(args.variation)
    setup = subject.setup
    if args.pulse is not None:
        pulse = parse_angle(args.pulse)
        setup = replace(setup, pulses=dict.fromkeys(subject.arm.joint_names, pulse))
    data, true = simulate(subject.arm, setup, args.samples, args.noise, rng, variation)
    write_measurements(args.out, subject.arm, data)
    say(f"{args.out}: {len(data)} samples of {len(subject.arm.lines)} joints")
    if args.truth is not None:
        truth = {
            "schema_version": SCHEMA_VERSION,
            "robot": args.robot,
            "seed": args.seed,
            "noise": args.noise,
            "parameters": dict(true.parameters),
            "target_at_zero_m": true.target.tolist(),
        }
        write_whole(args.truth, json.dumps(truth, indent=2) + "\n")
        say(f"{args.truth}: {len(true.parameters)} true parameters")


def _fit(args: argparse.Namespace) -> int:
    from borecheck.calibration.fit import as_document, as_text, fit
    from borecheck.calibration.measurements import read_measurements
    from borecheck.calibration.plausible import oddities
    from borecheck.commands.exit_status import ExitStatus

    refuse_outputs(args, "out", "urdf")
    subject = _subject(args)
    data = read_measurements(args.data, subject.arm)
    _tell_of_held(subject)
    found = fit(
        subject.arm, data, refined=args.refine, start=args.start, robust=args.robust
    )
    odd = oddities(found, data)
    if args.urdf is not None and odd:
        say(f"{args.urdf}: not written, because the fit is odd")
    elif args.urdf is not None:
        text = _corrected(subject, found, args.urdf.parent)
        write_whole(args.urdf, text)
        say(f"{args.urdf}: joint origins corrected")
    document = as_document(found, data, args.robot, getattr(args, "argv", []), odd)
    if args.out is not None:
        write_whole(args.out, json.dumps(document, indent=2) + "\n")
    if args.format == "json":
        sys.stdout.write(json.dumps(document, indent=2) + "\n")
    else:
        sys.stdout.write(as_text(document))
    return ExitStatus.FINDINGS if odd else ExitStatus.CLEAN


def _corrected(subject: "Subject", found: "Fit", folder: Path) -> str:
    from borecheck.calibration.corrected_urdf import corrected_urdf

    mesh_folders = (subject.folder, folder)
    return corrected_urdf(
        subject.text, subject.tree, subject.arm, found.lines, mesh_folders
    )


def _observe(args: argparse.Namespace) -> None:
    from borecheck.calibration.measurements import read_joint_values
    from borecheck.calibration.plan import judged, observation_text

    subject = _subject(args)
    _tell_of_held(subject)
    q = read_joint_values(args.data, subject.arm)
    seen = judged(subject.arm, subject.setup, q, parse_length(args.sigma))
    seen["not_identified"] = dict(subject.arm.held)
    if args.format == "json":
        sys.stdout.write(json.dumps(seen, indent=2) + "\n")
    else:
        sys.stdout.write(observation_text(seen))


def _plan(args: argparse.Namespace) -> None:
    from borecheck.calibration.plan import as_csv, plan

    refuse_outputs(args, "out")
    subject = _subject(args)
    _tell_of_held(subject)
    if not 10 <= args.samples <= args.candidates:
        raise UsageError("--samples must lie between 10 and --candidates")
    chosen = plan(
        subject.arm,
        subject.setup,
        args.samples,
        args.candidates,
        parse_length(args.sigma),
        args.seed,
    )
    text = as_csv(subject.arm, chosen.q)
    if args.out is not None:
        write_whole(args.out, text)
    else:
        sys.stdout.write(text)
    say(chosen.summary)


def _report(args: argparse.Namespace) -> None:
    from borecheck.calibration.residual_page import page

    refuse_outputs(args, more={"the page": args.page})
    try:
        document = json.loads(args.result.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(args.result, "there is no such file") from error
    except (OSError, ValueError) as error:
        raise InputError(args.result, f"is no JSON: {error}") from error
    if not isinstance(document, dict) or document.get("command") != "calibrate fit":
        raise InputError(args.result, "is no result of `borecheck calibrate fit --out`")
    write_whole(args.page, page(document))
    say(f"{args.page}: residuals of {len(document['samples'])} samples")
