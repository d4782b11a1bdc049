"""`borecheck check`: will the robot touch anything, at a pose, on a path, on plans?"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands import common
from borecheck.commands.output import check_outputs, emit, wants_display
from borecheck.errors import PlanError, UsageError
from borecheck.report.document import check_writable
from borecheck.uncertainty.options import add_options as add_uncertainty_options
from borecheck.units import parse_length

if TYPE_CHECKING:
    from borecheck.contact_check import Settings
    from borecheck.needle_plan import NeedlePlan
    from borecheck.robot import Robot
    from borecheck.scene import Scene


# Stands in every certificate (`borecheck.certificate.FORMAT`, not imported for speed).
CERTIFICATE_MARK = "borecheck path certificate"


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
        "--no-certificate",
        action="store_true",
        help="samples only: a motion without contact stays unknown",
    )
    parser.add_argument(
        "--certificate",
        type=Path,
        metavar="FILE",
        help="write the certificate of a clear --path there (and FILE's .npz)",
    )
    add_uncertainty_options(parser)
    common.add_output(parser)


def run(args: argparse.Namespace) -> int:
    """Checks, prints, and returns 0 clear, 1 contact, 2 unknown."""
    check_outputs(args)
    _check_certificate(args)
    from borecheck.compiled import announce_compilation, warm_up

    announce_compilation()
    from borecheck.contact_check import settings
    from borecheck.exit_status import ExitStatus, of_verdict
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
    document: dict[str, Any] = {
        **header("check", args.argv, args.date),
        "robot": robot_block(robot),
        "scene": scene_block(scene),
        "warnings": [*robot.warnings, *scene.warnings],
    }
    document |= _answer(args, robot, scene, chosen)
    weighed(document)
    if wants_display(args):
        from borecheck.report.display import display_block

        document["display"] = display_block(robot, scene, document)
    emit(args, document, check_text)
    if args.certificate is not None:
        _write_certificate(args, robot, scene, chosen, document)
    if document.get("interrupted"):
        return ExitStatus.INTERRUPTED
    return of_verdict(document["verdict"])


def _weigher(
    args: argparse.Namespace, robot: "Robot", scene: "Scene"
) -> Callable[[dict[str, Any]], None]:
    """What adds the probability of contact to a result, if it is asked for."""
    if args.uncertainty is None:
        return lambda document: None
    from borecheck.uncertainty.asked import add_probabilities, prepared

    uncertainty = prepared(args, robot)

    def weigh(document: dict[str, Any]) -> None:
        add_probabilities(document, robot, scene, uncertainty, args)
        if "plans" in document:
            verdicts = [plan["verdict"] for plan in document["plans"]]
            document["reason"] = _counted(verdicts, len(verdicts))

    return weigh


def _check_certificate(args: argparse.Namespace) -> None:
    """Refuses a certificate that cannot be written, before any work is done."""
    file = args.certificate
    if file is None:
        return
    if args.path is None:
        raise UsageError("--certificate goes with --path")
    if args.no_certificate:
        raise UsageError("--certificate and --no-certificate exclude each other")
    if file.suffix == ".npz":
        raise UsageError(f"--certificate {file}: .npz is for the meshes beside it")
    for path in (file, file.with_suffix(".npz")):
        if path in (args.out, args.report):
            raise UsageError(f"--certificate and another option both write {path}")
        check_writable(path)
    _remove_earlier(file)


def _remove_earlier(file: Path) -> None:
    """Takes away an earlier certificate of that name: it would pass for this run's.

    Raises:
        UsageError: What stands there is no certificate, or meshes of none, and is left
            alone.
    """
    meshes = file.with_suffix(".npz")
    if file.exists() and not _is_certificate(file):
        raise UsageError(f"--certificate {file}: is there already and no certificate")
    if meshes.exists():
        from borecheck.certificate import holds_certified_meshes

        if not holds_certified_meshes(meshes):
            raise UsageError(
                f"--certificate {file}: {meshes} is there already and holds no meshes "
                "of a certificate"
            )
    file.unlink(missing_ok=True)
    meshes.unlink(missing_ok=True)


def _is_certificate(file: Path) -> bool:
    try:
        return CERTIFICATE_MARK in file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False


def _write_certificate(
    args: argparse.Namespace,
    robot: "Robot",
    scene: "Scene",
    chosen: "Settings",
    document: dict[str, Any],
) -> None:
    """Writes what a clear path is certified by; any other verdict has nothing."""
    from borecheck.path_check import write_path_certificate
    from borecheck.progress import say

    if not document["path"]["certified"]:
        say(f"borecheck: no certificate written: the path is {document['verdict']}")
        return
    waypoints = common.waypoints(robot, args.path)
    margin = chosen.margin.size
    write_path_certificate(robot, scene, waypoints, margin, args.certificate)


def _answer(
    args: argparse.Namespace, robot: "Robot", scene: "Scene", chosen: "Settings"
) -> dict[str, Any]:
    if args.q is not None:
        return _pose(args, robot, scene, chosen)
    if args.path is not None:
        return _path(args, robot, scene, chosen)
    return _plans(args, robot, scene, chosen)


def _pose(
    args: argparse.Namespace, robot: "Robot", scene: "Scene", chosen: "Settings"
) -> dict[str, Any]:
    from borecheck.contact_check import check_with
    from borecheck.report.document import verdict_block

    q = common.configuration(robot, args.q)
    verdict = check_with(robot, scene, q, chosen)
    return verdict_block(verdict, robot.model.joint_names)


def _path(
    args: argparse.Namespace, robot: "Robot", scene: "Scene", chosen: "Settings"
) -> dict[str, Any]:
    from borecheck.path_check import check_motion
    from borecheck.progress import Progress
    from borecheck.report.document import motion_block

    waypoints = common.waypoints(robot, args.path)
    if len(waypoints) == 1:
        raise PlanError(args.path, "has one waypoint; a path needs two (a pose: --q)")
    motion = check_motion(
        robot,
        scene,
        waypoints,
        chosen,
        samples=args.samples,
        certify=not args.no_certificate,
        progress=Progress("poses"),
    )
    return motion_block(motion, robot.model.joint_names)


def _plans(
    args: argparse.Namespace, robot: "Robot", scene: "Scene", chosen: "Settings"
) -> dict[str, Any]:
    """All plans; what is finished stays when the user interrupts."""
    from borecheck.plan_file import read_plans
    from borecheck.plan_motion import STANDOFF, check_mount
    from borecheck.verdict import worst_of

    plans = read_plans(args.plan)
    for plan in plans:
        check_mount(robot, plan)
    results: list[dict[str, Any]] = []
    interrupted = False
    try:
        for plan in plans:
            results.append(_one_plan(args, robot, scene, chosen, plan))
    except KeyboardInterrupt:
        interrupted = True
    verdicts = [result["verdict"] for result in results]
    return {
        "verdict": worst_of(verdicts),
        "reason": _counted(verdicts, len(plans)),
        "interrupted": interrupted,
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
    counts = {name: verdicts.count(name) for name in ("clear", "contact", "unknown")}
    text = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
    missing = total - len(verdicts)
    more = f", {missing} not checked" if missing else ""
    return f"{total} plan{'s' if total != 1 else ''}: {text or 'none checked'}{more}"


def _one_plan(
    args: argparse.Namespace,
    robot: "Robot",
    scene: "Scene",
    chosen: "Settings",
    plan: "NeedlePlan",
) -> dict[str, Any]:
    from borecheck.path_check import check_motion
    from borecheck.plan_motion import UnreachableError, plan_motion
    from borecheck.progress import Progress, say
    from borecheck.report.document import motion_block

    named: dict[str, Any] = {
        "name": plan.name,
        "entry": [float(x) for x in plan.entry],
        "target": [float(x) for x in plan.target],
        "notes": _notes(plan),
    }
    for note in named["notes"]:
        say(f"borecheck: plan {plan.name}: {note}")
    try:
        motion = plan_motion(robot, plan)
    except UnreachableError as error:
        reason = f"{error}{_swapped(robot, plan)}"
        return {**named, "verdict": "unknown", "reason": reason, "reachable": False}
    answer = check_motion(
        robot,
        scene,
        motion.waypoints,
        chosen,
        corridor=motion.corridor,
        samples=args.samples,
        certify=not args.no_certificate,
        progress=Progress(f"poses of plan {plan.name}"),
    )
    return {
        **named,
        "reachable": True,
        "not_covered": list(answer.not_covered),
        **motion_block(answer, robot.model.joint_names),
    }


def _swapped(robot: "Robot", plan: "NeedlePlan") -> str:
    """What to add to "out of reach" where the same needle would do the other way."""
    from borecheck.plan_motion import UnreachableError, plan_motion

    try:
        plan_motion(robot, replace(plan, entry=plan.target, target=plan.entry))
    except UnreachableError:
        return ""
    return "; entry and target look swapped: the other way round the plan is reachable"


def _notes(plan: "NeedlePlan") -> list[str]:
    """How the plan was read, and what of it the robot's own joints decide."""
    notes = list(plan.notes)
    if plan.roll is not None:
        notes.append("its roll is not followed: the joints decide it")
    return notes
