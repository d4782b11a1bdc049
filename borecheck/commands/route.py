"""`borecheck route`: a certified way from where the robot stands to where it is wanted.

The way is written as a path file, and then checked as `borecheck check --path` checks
any: what is printed, certified and drawn is what holds for the file that was written.
A way to a plan ends where the plan's own motion begins, before the skin; `check --plan`
speaks of what follows.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands import check, common
from borecheck.commands.options.allowed import add_allowed, add_explain
from borecheck.commands.options.needle import add_needle, names_plans, plan_named
from borecheck.commands.options.patient_place import add_patient_place
from borecheck.commands.output import emit, refuse_outputs, refuse_suffix
from borecheck.core.units import parse_length
from borecheck.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from borecheck.planning.route import Route
    from borecheck.report.blocks import Block
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene

# What `check` asks of its options besides those that both have.
_AS_CHECKED = {
    **{"q": None, "plan": None, "checker": "exact", "pruning": "bvh"},
    **{"margin_kind": None, "uncertainty": None, "long_way": False},
    **{"no_certificate": False, "tolerance": None, "repair": False},
    **{"slicer": None, "dicom": None, "dicom_from": None},
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    common.add_robot(parser)
    common.add_scene(parser)
    parser.add_argument(
        "--to",
        required=True,
        metavar="PLAN|Q",
        help="a needle plan, FILE[:NAME]: where its own motion begins; or a "
        "configuration: home, name=value,..., or values",
    )
    parser.add_argument(
        "--from", dest="start", default="home", metavar="Q", help="default: home"
    )
    parser.add_argument(
        "--margin", default="0", help="clearance kept from obstacles, e.g. 10mm"
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="of the search; the same seed, the same way"
    )
    parser.add_argument(
        "--planner",
        default="connect",
        metavar="NAME",
        help="connect (default), or ompl:NAME over the same certified edges, e.g. "
        "ompl:BITstar (extra `planning`)",
    )
    parser.add_argument(
        "--edges",
        type=int,
        default=None,
        metavar="N",
        help="edges asked for before it is given up (default: 20000)",
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=None,
        metavar="S",
        help="give up after so long, too (default: never; 60 for OMPL)",
    )
    parser.add_argument(
        "--samples", type=int, default=41, help="poses for curves and pictures"
    )
    parser.add_argument(
        "--clearance-tolerance", default="5%,0.1mm", help=argparse.SUPPRESS
    )
    add_needle(parser)
    add_patient_place(parser)
    add_allowed(parser)
    add_explain(parser)
    _add_files(parser)


def _add_files(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out", type=Path, metavar="PATH.csv", help="write the way there: waypoints"
    )
    parser.add_argument(
        "--certificate",
        type=Path,
        metavar="FILE",
        help="write its certificate there (and FILE's .npz)",
    )
    common.add_result(parser)
    common.add_report(parser)


def run(args: argparse.Namespace) -> int:
    """Finds, writes and checks a way; 0 clear, 1 an end in contact, 2 none found."""
    if args.certificate is not None and args.out is None:
        raise UsageError("--certificate needs --out: it is of the path written there")
    refuse_suffix("--out", args.out, "a way is written as CSV", ".csv")
    refuse_outputs(args, "out", "certificate", "result", "report")
    from borecheck.commands.compiling import tell_of_compiling

    tell_of_compiling()
    import numpy as np

    from borecheck.commands.progress import Progress
    from borecheck.planning.route import MOST_EDGES, route

    robot, scene = common.load(args), common.load_surroundings(args)
    start = np.array(common.configuration(robot, args.start))
    found = route(
        robot,
        scene,
        start,
        _goal(robot, scene, args),
        parse_length(args.margin),
        planner=args.planner,
        seed=args.seed,
        most_edges=MOST_EDGES if args.edges is None else args.edges,
        most_seconds=args.seconds,
        progress=Progress("edges"),
    )
    if found.waypoints is None:
        return _no_way(args, robot, scene, found)
    return _checked(args, robot, found, found.waypoints)


def _goal(
    robot: "Robot", scene: "Scene", args: argparse.Namespace
) -> "NDArray[np.float64]":
    """The configuration that `--to` names, (joints,).

    Raises:
        UsageError, UnknownNameError, PlanError, UnreachableError: Nothing to go to.
    """
    import numpy as np

    text = args.to
    if not names_plans(text):
        return np.array(common.configuration(robot, text, "--to"))
    from borecheck.motion.needle_motion import needle_motion

    # the motion that `check --plan` takes: of several ways the one with most room
    plan = plan_named(text, "--to", args)
    return needle_motion(robot, scene, plan).waypoints[0]


def _checked(
    args: argparse.Namespace,
    robot: "Robot",
    found: "Route",
    way: "NDArray[np.float64]",
) -> int:
    """The path as it was written, checked as any path file is."""
    from tempfile import TemporaryDirectory

    from borecheck.plans.path_file import write_path

    block = {
        "route": {
            **_block(args, found),
            "joints": list(robot.model.joint_names),
            "waypoints": way.tolist(),
            "path": None if args.out is None else str(args.out),
        }
    }
    with TemporaryDirectory(prefix="borecheck-") as folder:
        file = Path(folder) / "route.csv" if args.out is None else args.out
        write_path(file, robot.model.joint_names, way)
        asked = argparse.Namespace(
            **{**vars(args), **_AS_CHECKED, "out": args.result},
            path=file,
            corridor=None,
        )
        return check.run(asked, block)


def _no_way(
    args: argparse.Namespace, robot: "Robot", scene: Any, found: "Route"
) -> int:
    from borecheck.commands.exit_status import of_verdict
    from borecheck.report.document import about_block, header

    document = {
        **header("route", args.argv, args.date),
        **about_block(robot, scene),
        "verdict": found.verdict,
        "reason": found.reason,
        "route": _block(args, found),
    }
    emit(args, document, _text)
    return of_verdict(document["verdict"])


def _block(args: argparse.Namespace, found: "Route") -> dict[str, Any]:
    return {
        "status": found.status,
        "reason": found.reason,
        "from": args.start,
        "to": args.to,
        "planner": args.planner,
        "seed": found.seed,
        "edges": found.edges,
        "length_m": found.length,
    }


def _text(document: Mapping[str, Any]) -> "Sequence[Block]":
    from borecheck.report.allowed_words import MARKS

    return [f"{MARKS[document['verdict']]}: no way: {document['reason']}"]
