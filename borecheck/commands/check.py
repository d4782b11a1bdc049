"""`borecheck check`: will the robot touch anything, at a pose, on a path, on plans?"""

import argparse
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands import common
from borecheck.commands.certificate_files import add_certificates, prepared
from borecheck.commands.options.allowed import add_allowed, add_explain
from borecheck.commands.options.needle import (
    add_corridor,
    corridor_of,
    refuse_stray_corridor,
)
from borecheck.commands.options.patient_place import (
    add_patient_place,
    place_block,
    plans_of,
)
from borecheck.commands.options.uncertainty import (
    add_options as add_uncertainty_options,
)
from borecheck.commands.output import emit, refuse_outputs, wants_display
from borecheck.commands.plan_tolerance import (
    add_tolerance,
    add_tolerances,
    refuse_stray_tolerance,
)
from borecheck.commands.slicer_files import add_slicer, refuse_folder, show_in_slicer
from borecheck.core.units import parse_length

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from borecheck.motion.samples import Proof
    from borecheck.plans.needle_plan import NeedlePlan
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    common.add_robot(parser)
    common.add_scene(parser)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument(
        "--q", metavar="Q", help="one configuration: home, name=value,..., or values"
    )
    what.add_argument(
        "--path",
        type=Path,
        metavar="FILE",
        help="joint waypoints, straight between: CSV, or a JointTrajectory of ROS "
        "(YAML, JSON)",
    )
    what.add_argument(
        "--plan",
        type=Path,
        metavar="FILE",
        help="needle plans, CSV, JSON, or markups of 3D Slicer (.mrk.json, .fcsv)",
    )
    parser.add_argument(
        "--margin", default="0", help="required clearance to obstacles, e.g. 20mm"
    )
    parser.add_argument(
        "--margin-kind",
        default=None,
        help="offset, enlarge-axes, enlarge-axes:world or security",
    )
    parser.add_argument(
        "--checker",
        default="exact",
        help="exact (default), two-sided, paper, paper:robot, paper:scanner, coal",
    )
    parser.add_argument(
        "--pruning", default="bvh", help="bvh (default), coal or none: same pairs"
    )
    _add_motion(parser)
    add_corridor(parser)
    add_tolerance(parser)
    add_patient_place(parser)
    add_allowed(parser)
    add_uncertainty_options(parser)
    add_explain(parser)
    common.add_output(parser)
    add_slicer(parser)


def _add_motion(parser: argparse.ArgumentParser) -> None:
    """Options for what moves."""
    parser.add_argument(
        "--samples", type=int, default=41, help="poses looked at on a motion"
    )
    parser.add_argument(
        "--long-way",
        action="store_true",
        help="continuous joints go as written where they turn by half a turn or more",
    )
    parser.add_argument(
        "--clearance-tolerance",
        default="5%,0.1mm",
        metavar="SHARE,LENGTH",
        help="how far below the least clearance that a motion reaches the proven one "
        "may be; the larger of both counts (default: 5%%,0.1mm)",
    )
    parser.add_argument(
        "--no-certificate",
        action="store_true",
        help="samples only: a motion without contact stays unknown",
    )
    parser.add_argument(
        "--certificate",
        type=Path,
        metavar="FILE",
        help="write the certificate of a clear --path or --plan there (and FILE's "
        ".npz); of several plans each has its own, FILE_<plan>",
    )


def run(args: argparse.Namespace, more: Mapping[str, Any] | None = None) -> int:
    """Checks, prints, and returns 0 clear, 1 contact, 2 unknown.

    Args:
        args: The options.
        more: What else belongs to the result: how its path was found.
    """
    refuse_outputs(args, "out", "report", "certificate")
    refuse_folder(args)
    refuse_stray_corridor(args)
    refuse_stray_tolerance(args)
    plans = _plans_asked(args)
    files = prepared(args, plans)
    from borecheck.commands.compiling import tell_of_compiling
    from borecheck.commands.warm_up import warm_up

    tell_of_compiling()
    from borecheck.commands.answers import Asked, add_times
    from borecheck.commands.exit_status import ExitStatus, of_verdict
    from borecheck.contact.checked import checked
    from borecheck.contact.settings import settings
    from borecheck.report.document import about_block, header
    from borecheck.report.text import check_text

    chosen = settings(
        args.checker,
        args.pruning,
        parse_length(args.margin),
        args.margin_kind,
        link_clearance=wants_display(args),
    )
    robot, scene = common.load(args), common.load_surroundings(args)
    path = None if args.path is None else common.path_to_follow(robot, args.path)
    waypoints = None if path is None else path.waypoints
    corridor = None if waypoints is None else corridor_of(args, robot, waypoints)
    warm_up(chosen)
    weighed = _weigher(args, robot, scene)
    about = checked(
        robot, scene, chosen.margin, with_plan=bool(plans), corridor=corridor
    )
    turned = _many_turns(args, robot, waypoints)
    about = replace(about, warnings=(*about.warnings, *turned))
    document: dict[str, Any] = {
        **header("check", args.argv, args.date),
        **about_block(robot, scene, about),
        **(more or {}),
        **place_block(args),
    }
    asked = Asked(args, robot, scene, chosen, plans, waypoints, corridor)
    document |= asked.answer()
    met = not plans or add_tolerances(document, args, robot, scene, chosen, plans)
    if path is not None:
        add_times(document, path)
    weighed(document)
    _add_touching(document, robot, scene)
    complete = not files or _certify(document, robot, scene, files, asked.proofs)
    show_in_slicer(args, document, robot, scene)
    if wants_display(args):
        from borecheck.report.display import display_block

        document["display"] = display_block(robot, scene, document)
    emit(args, document, partial(check_text, explain=args.explain))
    if document.get("interrupted"):
        return ExitStatus.INTERRUPTED
    status = of_verdict(document["verdict"])
    # clear, but not all that was asked for could be given
    return status if (complete and met) or status else ExitStatus.COULD_NOT


def _add_touching(document: dict[str, Any], robot: "Robot", scene: "Scene") -> None:
    """Adds where links touch, and which of them may."""
    from borecheck.report.document import allowed_block
    from borecheck.report.touching import touching

    for block in document.get("plans", [document]):
        if "contacts" in block:  # else it is out of reach
            block["touching"] = touching(robot, scene, block)
    document |= allowed_block(robot, document["itself"])


def _many_turns(
    args: argparse.Namespace,
    robot: "Robot",
    waypoints: "NDArray[np.float64] | None",
) -> tuple[str, ...]:
    """What is odd about where a pose or a path puts continuous joints."""
    import numpy as np

    if args.q is not None:
        q = np.array([common.configuration(robot, args.q)])
        return robot.model.many_turns(q)
    return () if waypoints is None else robot.model.many_turns(waypoints)


def _plans_asked(args: argparse.Namespace) -> tuple["NeedlePlan", ...]:
    if args.plan is None:
        return ()
    return plans_of(args, args.plan)


def _certify(
    document: dict[str, Any],
    robot: "Robot",
    scene: "Scene",
    files: Mapping[str, Path],
    proofs: Mapping[str, "Proof"],
) -> bool:
    """Writes what is certified; says so where a path, or a clear plan, is not."""
    from borecheck.commands.progress import say

    complete = add_certificates(document, robot, scene, files, proofs)
    for block in document.get("plans", [document]):
        reason = block["certificate"]["reason"]
        whose = f"plan {block['name']}" if "plans" in document else "the path"
        if reason == block["verdict"] and "plans" not in document:
            say(f"borecheck: no certificate written: {whose} is {reason}")
        elif reason is not None and reason != block["verdict"]:
            say(f"borecheck: no certificate written for {whose}: {reason}")
    return complete


def _weigher(
    args: argparse.Namespace, robot: "Robot", scene: "Scene"
) -> Callable[[dict[str, Any]], None]:
    """What adds the probability of contact to a result, if it is asked for."""
    if args.uncertainty is None:
        return lambda document: None
    from borecheck.commands.answers import counted, reason_code
    from borecheck.commands.uncertainty import add_probabilities, prepared

    uncertainty = prepared(args, robot)

    def weigh(document: dict[str, Any]) -> None:
        add_probabilities(document, robot, scene, uncertainty, args)
        if "plans" in document:
            verdicts = [plan["verdict"] for plan in document["plans"]]
            total = len(verdicts) + len(document["not_checked"])
            beyond = sum(not plan["reachable"] for plan in document["plans"])
            for plan in document["plans"]:
                plan["reason_code"] = reason_code(plan)
            document["reason"] = counted(verdicts, total, beyond)
            if document["verdict"] == "clear":
                document["reason"] += f", the risk of {args.risk:g} kept"

    return weigh
