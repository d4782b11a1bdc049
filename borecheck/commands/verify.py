"""`borecheck verify`: checks path certificates again, by code of its own."""

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands import common
from borecheck.commands.options.allowed import add_allowed
from borecheck.commands.options.needle import (
    add_corridor,
    corridor_of,
    refuse_stray_corridor,
)
from borecheck.commands.options.patient_place import add_patient_place
from borecheck.commands.output import check_outputs, emit
from borecheck.core.units import parse_length
from borecheck.errors import UsageError

if TYPE_CHECKING:
    from borecheck.plans.needle_plan import NeedlePlan
    from borecheck.verify.verification import Verification

Verify = Callable[[Path], "Verification"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument(
        "certificates",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="a certificate, JSON (several: all of them are checked); a case file "
        "(.toml) binds them to what it names",
    )
    parser.add_argument(
        "--meshes",
        type=Path,
        default=None,
        metavar="FILE",
        help="the meshes it speaks of (default: the .npz file beside it)",
    )
    bound = parser.add_argument_group(
        "to bind it to files",
        "Robot, scene and motion are rebuilt as `check` does; every mesh, joint, pair, "
        "margin and waypoint must be theirs.",
    )
    bound.add_argument("--robot", help="as in check: installed robot, URDF or xacro")
    bound.add_argument(
        "--scene", nargs="+", action="extend", help="as in check: scanner, or files"
    )
    what = bound.add_mutually_exclusive_group()
    what.add_argument("--path", type=Path, metavar="CSV", help="the path it is of")
    what.add_argument(
        "--plan", type=Path, metavar="FILE", help="the plans it is one of, by name"
    )
    bound.add_argument("--margin", default=None, help="the clearance it shows (0)")
    common.add_robot_options(parser)
    common.add_scene_options(parser)
    add_corridor(parser)
    add_patient_place(parser)
    add_allowed(parser)
    common.add_output(parser)


def run(args: argparse.Namespace) -> int:
    """0 if all are accepted, 1 if one is not, 2 if one cannot be read."""
    from borecheck.commands.exit_status import ExitStatus
    from borecheck.report.document import header
    from borecheck.report.verification import (
        verification_block,
        verification_document,
        verification_text,
    )

    if args.meshes is not None and len(args.certificates) > 1:
        raise UsageError("--meshes goes with one certificate; each has its own")
    check_outputs(args)
    verify, plans = _bound(args) if _asks_binding(args) else (_alone(args), ())
    answers = [(str(file), verify(file)) for file in args.certificates]
    document: dict[str, Any] = {
        **header("verify", args.argv, args.date),
        **verification_document([verification_block(*one) for one in answers]),
        "plans_without": _without(plans, [answer for _, answer in answers]),
    }
    emit(args, document, verification_text)
    if any(not one.accepted and not one.could_not_run for _, one in answers):
        return ExitStatus.FINDINGS
    return ExitStatus.CLEAN if document["accepted"] else ExitStatus.COULD_NOT


def _asks_binding(args: argparse.Namespace) -> bool:
    """Whether files were given to bind to.

    Raises:
        UsageError: Some of them, but not all that it takes.
    """
    motion = args.path or args.plan
    given = [args.robot, args.scene, motion]
    if all(given):
        return True
    shaped = [args.margin, args.mount, args.base, args.arg, args.scene_arg]
    shaped += [args.isocentre, args.position, args.transform]
    shaped += [args.needle, args.tip, args.insertion, args.corridor]
    more = [
        args.obstacle,
        args.patient,
        args.patient_ct,
        args.package_path,
        args.srdf,
        args.allow,
    ]
    if any(given) or any([*shaped, *more, args.trust_never]):
        raise UsageError(
            "to bind a certificate give --robot, --scene, and --path or --plan"
        )
    return False


def _alone(args: argparse.Namespace) -> Verify:
    from borecheck.verify.check import verify

    return lambda file: verify(file, args.meshes)


def _bound(args: argparse.Namespace) -> tuple[Verify, Sequence["NeedlePlan"]]:
    """The verification against robot, scene and motion; and the plans, if any."""
    from borecheck.commands.options.patient_place import plans_of
    from borecheck.motion.binding import verify

    refuse_stray_corridor(args)
    margin = parse_length(args.margin) if args.margin is not None else 0.0
    if margin < 0.0:
        raise UsageError(f"--margin {args.margin}: a clearance is not negative")
    robot, scene = common.load(args), common.load_surroundings(args)
    verify_one = partial(
        verify, robot=robot, scene=scene, margin=margin, meshes=args.meshes
    )
    if args.plan is not None:
        plans = plans_of(args, args.plan)
        return partial(verify_one, plans=plans), plans
    points = common.waypoints(robot, args.path)
    corridor = corridor_of(args, robot, points)
    return partial(verify_one, waypoints=points, corridor=corridor), ()


def _without(
    plans: Sequence["NeedlePlan"], answers: Sequence["Verification"]
) -> list[str]:
    """Plans that none of the accepted certificates is about."""
    held = {
        answer.stated["about"]["plan"]["name"]
        for answer in answers
        if answer.accepted and plans
    }
    return [plan.name for plan in plans if plan.name not in held]
