"""`borecheck check`: will the robot touch anything, at a pose, on a path, on plans?"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands import common
from borecheck.commands.certificate_files import PATH, add_certificates, prepared
from borecheck.commands.output import check_outputs, emit, wants_display
from borecheck.commands.uncertainty_options import (
    add_options as add_uncertainty_options,
)
from borecheck.core.units import parse_length, parse_share
from borecheck.errors import PlanError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from borecheck.contact.check import Settings
    from borecheck.motion.least_clearance import Tolerance
    from borecheck.motion.samples import Proof
    from borecheck.plans.corridor import Corridor
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
        "--path", type=Path, metavar="CSV", help="joint waypoints, straight between"
    )
    what.add_argument(
        "--plan", type=Path, metavar="FILE", help="needle plans, CSV or JSON"
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
    add_uncertainty_options(parser)
    common.add_output(parser)


def run(args: argparse.Namespace) -> int:
    """Checks, prints, and returns 0 clear, 1 contact, 2 unknown."""
    check_outputs(args)
    plans = _plans_asked(args)
    files = prepared(args, plans)
    from borecheck.commands.warm_up import announce_compilation, warm_up

    announce_compilation()
    from borecheck.commands.exit_status import ExitStatus, of_verdict
    from borecheck.contact.check import settings
    from borecheck.contact.checked import checked
    from borecheck.report.document import header, robot_block, scene_block
    from borecheck.report.text import check_text

    chosen = settings(
        args.checker,
        args.pruning,
        parse_length(args.margin),
        args.margin_kind,
        link_clearance=wants_display(args),
    )
    robot, scene = common.load(args), common.load_surroundings(args)
    warm_up(chosen)
    weighed = _weigher(args, robot, scene)
    about = checked(robot, scene, chosen.margin, with_plan=bool(plans))
    document: dict[str, Any] = {
        **header("check", args.argv, args.date),
        "robot": robot_block(robot),
        "scene": scene_block(scene),
        "checked": about.to_json(),
        "warnings": [*robot.warnings, *scene.warnings, *about.warnings],
    }
    proofs: dict[str, Proof] = {}
    document |= _answer(args, robot, scene, chosen, plans, proofs)
    weighed(document)
    complete = not files or _certify(document, robot, scene, files, proofs)
    if wants_display(args):
        from borecheck.report.display import display_block

        document["display"] = display_block(robot, scene, document)
    emit(args, document, check_text)
    if document.get("interrupted"):
        return ExitStatus.INTERRUPTED
    status = of_verdict(document["verdict"])
    # clear, but not all that was asked for could be given
    return status if complete or status else ExitStatus.COULD_NOT


def _plans_asked(args: argparse.Namespace) -> tuple["NeedlePlan", ...]:
    if args.plan is None:
        return ()
    from borecheck.plans.plan_file import read_plans

    return read_plans(args.plan)


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
    from borecheck.commands.uncertainty import add_probabilities, prepared

    uncertainty = prepared(args, robot)

    def weigh(document: dict[str, Any]) -> None:
        add_probabilities(document, robot, scene, uncertainty, args)
        if "plans" in document:
            verdicts = [plan["verdict"] for plan in document["plans"]]
            total = len(verdicts) + len(document["not_checked"])
            document["reason"] = _counted(verdicts, total)
            if document["verdict"] == "clear":
                document["reason"] += f", the risk of {args.risk:g} kept"

    return weigh


def _answer(
    args: argparse.Namespace,
    robot: "Robot",
    scene: "Scene",
    chosen: "Settings",
    plans: Sequence["NeedlePlan"],
    proofs: dict[str, "Proof"],
) -> dict[str, Any]:
    """What was asked; the searches of motions are added to the proofs."""
    if args.q is not None:
        return _pose(args, robot, scene, chosen)
    if args.path is not None:
        return _path(args, robot, scene, chosen, proofs)
    return _plans(args, robot, scene, chosen, plans, proofs)


def _pose(
    args: argparse.Namespace, robot: "Robot", scene: "Scene", chosen: "Settings"
) -> dict[str, Any]:
    from borecheck.contact.check import check_with
    from borecheck.report.document import verdict_block

    q = common.configuration(robot, args.q)
    verdict = check_with(robot, scene, q, chosen)
    return verdict_block(verdict, robot.model.joint_names)


def _path(
    args: argparse.Namespace,
    robot: "Robot",
    scene: "Scene",
    chosen: "Settings",
    proofs: dict[str, "Proof"],
) -> dict[str, Any]:
    waypoints = common.waypoints(robot, args.path)
    if len(waypoints) == 1:
        raise PlanError(args.path, "has one waypoint; a path needs two (a pose: --q)")
    return _motion(args, robot, scene, chosen, waypoints, proofs)


def _motion(
    args: argparse.Namespace,
    robot: "Robot",
    scene: "Scene",
    chosen: "Settings",
    waypoints: "NDArray[np.float64]",
    proofs: dict[str, "Proof"],
    plan: "NeedlePlan | None" = None,
    corridor: "Corridor | None" = None,
) -> dict[str, Any]:
    """A path's or a plan's motion, sampled and searched."""
    from borecheck.commands.progress import Progress
    from borecheck.motion.check import check_motion
    from borecheck.report.document import motion_block

    answer = check_motion(
        robot,
        scene,
        waypoints,
        chosen,
        corridor=corridor,
        samples=args.samples,
        certify=not args.no_certificate,
        long_way=args.long_way,
        tolerance=_tolerance(args.clearance_tolerance),
        progress=Progress("poses" if plan is None else f"poses of plan {plan.name}"),
    )
    if answer.proof is not None:
        proofs[PATH if plan is None else plan.name] = answer.proof
    block = motion_block(answer, robot.model.joint_names)
    return {"not_covered": list(answer.not_covered), **block}


def _tolerance(text: str) -> "Tolerance":
    """From `5%`, `0.1mm` or both, by a comma.

    Raises:
        UsageError: Neither a share nor a length.
    """
    from borecheck.motion.least_clearance import Tolerance

    found = {"relative": 0.0, "absolute": 0.0}
    for part in text.split(","):
        if part.strip().endswith("%"):
            found["relative"] = parse_share(part)
        else:
            found["absolute"] = parse_length(part)
    return Tolerance(**found)


def _plans(
    args: argparse.Namespace,
    robot: "Robot",
    scene: "Scene",
    chosen: "Settings",
    plans: Sequence["NeedlePlan"],
    proofs: dict[str, "Proof"],
) -> dict[str, Any]:
    """All plans; what is finished stays when the user interrupts."""
    from borecheck.contact.verdict import worst_of
    from borecheck.plans.plan_motion import STANDOFF, check_mount

    for plan in plans:
        check_mount(robot, plan)
    results: list[dict[str, Any]] = []
    interrupted = False
    try:
        for plan in plans:
            results.append(_one_plan(args, robot, scene, chosen, proofs, plan))
    except KeyboardInterrupt:
        interrupted = True
    verdicts = [result["verdict"] for result in results]
    return {
        "verdict": worst_of(verdicts),
        "reason": _counted(verdicts, len(plans)),
        "interrupted": interrupted,
        "not_checked": [plan.name for plan in plans[len(results) :]],
        "each_plan": f"from {1e3 * STANDOFF:g} mm before its entry (0%), along its "
        "line, to its target (100%)",
        "checker": chosen.checker,
        "pruning": chosen.pruning,
        "margin_m": chosen.margin.size,
        "margin_kind": chosen.margin.kind,
        "not_modelled": [
            *robot.not_modelled,
            *scene.not_modelled,
            f"the way to where a plan begins, {1e3 * STANDOFF:g} mm before its entry",
            *dict.fromkeys(text for r in results for text in r.get("not_covered", ())),
        ],
        "plans": results,
    }


def _counted(verdicts: Sequence[str], total: int) -> str:
    """How many plans are in contact, unknown, clear: what is worst comes first."""
    words = {"contact": "in contact", "unknown": "unknown", "clear": "clear"}
    counts = {word: verdicts.count(name) for name, word in words.items()}
    counts["not checked"] = total - len(verdicts)
    found = [(count, word) for word, count in counts.items() if count]
    if len(found) == 1:
        plans = "the plan is" if total == 1 else f"all {total} plans are"
        return f"{plans} {found[0][1]}"
    return f"of {total} plans " + ", ".join(f"{count} {word}" for count, word in found)


def _one_plan(
    args: argparse.Namespace,
    robot: "Robot",
    scene: "Scene",
    chosen: "Settings",
    proofs: dict[str, "Proof"],
    plan: "NeedlePlan",
) -> dict[str, Any]:
    from borecheck.commands.progress import say
    from borecheck.plans.plan_motion import UnreachableError, plan_motion

    named: dict[str, Any] = {
        "name": plan.name,
        "entry": [float(x) for x in plan.entry],
        "target": [float(x) for x in plan.target],
        "notes": _notes(plan, scene),
    }
    for note in named["notes"]:
        say(f"borecheck: plan {plan.name}: {note}")
    try:
        motion = plan_motion(robot, plan)
    except UnreachableError as error:
        reason = f"{error}{_swapped(robot, plan)}"
        return {**named, "verdict": "unknown", "reason": reason, "reachable": False}
    block = _motion(
        args, robot, scene, chosen, motion.waypoints, proofs, plan, motion.corridor
    )
    return {**named, "reachable": True, **block}


def _swapped(robot: "Robot", plan: "NeedlePlan") -> str:
    """What to add to "out of reach" where the same needle would do the other way."""
    from borecheck.plans.plan_motion import UnreachableError, plan_motion

    try:
        plan_motion(robot, replace(plan, entry=plan.target, target=plan.entry))
    except UnreachableError:
        return ""
    return "; entry and target look swapped: the other way round the plan is reachable"


def _notes(plan: "NeedlePlan", scene: "Scene") -> list[str]:
    """How the plan was read, whether it meets the patient, and what joints decide."""
    from borecheck.plans.skin import skin_notes

    patients = (o.mesh for o in scene.obstacles if o.role == "patient")
    notes = [*plan.notes, *skin_notes(plan, patients)]
    if plan.roll is not None:
        notes.append("its roll is not followed: the joints decide it")
    return notes
