"""`borecheck compare`: all checkers over poses, and the cause of each disagreement."""

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from borecheck.commands import common
from borecheck.commands.options.allowed import add_allowed, add_explain
from borecheck.commands.options.needle import add_needle
from borecheck.commands.options.patient_place import add_patient_place, plans_of
from borecheck.commands.output import check_outputs, emit, wants_display

if TYPE_CHECKING:
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    common.add_robot(parser)
    common.add_scene(parser)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--q", metavar="Q", help="one configuration")
    what.add_argument("--path", type=Path, metavar="CSV", help="joint waypoints")
    what.add_argument("--plan", type=Path, metavar="FILE", help="needle plans")
    what.add_argument("--random", type=int, metavar="N", help="N random poses")
    what.add_argument(
        "--replay", type=Path, metavar="FILE", help="the disputed pairs of a result"
    )
    parser.add_argument("--seed", type=int, default=0, help="for --random")
    parser.add_argument(
        "--checkers",
        default=None,
        help="names, separated by commas (default: all); exact is the judge",
    )
    parser.add_argument("--pruning", default="bvh", help="bvh (default), coal or none")
    parser.add_argument(
        "--samples", type=int, default=11, help="poses on a path or plan"
    )
    add_needle(parser)
    add_patient_place(parser)
    add_allowed(parser)
    add_explain(parser)
    common.add_output(parser)


def run(args: argparse.Namespace) -> int:
    """Compares; 0 if every disagreement has a named cause, else 1."""
    check_outputs(args)
    from borecheck.commands.compiling import tell_of_compiling

    tell_of_compiling()
    from borecheck.commands.exit_status import ExitStatus
    from borecheck.commands.progress import say
    from borecheck.report.document import header
    from borecheck.report.text import compare_text

    document = header("compare", args.argv, args.date)
    if args.replay is not None:
        from borecheck.contact.replay import replay

        document |= replay(args.replay)
    else:
        document |= _compared(args)
    emit(args, document, partial(compare_text, explain=args.explain))
    if document.get("interrupted"):
        say(f"borecheck: interrupted after {len(document['poses'])} poses")
        return ExitStatus.INTERRUPTED
    unexplained = [d for d in document["disagreements"] if d["cause"] is None]
    return ExitStatus.FINDINGS if unexplained else ExitStatus.CLEAN


def _compared(args: argparse.Namespace) -> dict[str, Any]:
    from borecheck.commands.progress import Progress
    from borecheck.contact.compare import compare
    from borecheck.contact.comparison import to_json
    from borecheck.geometry.surfaces import CHECKERS
    from borecheck.report.document import allowed_block, robot_block, scene_block

    robot, scene = common.load(args), common.load_surroundings(args)
    checkers = args.checkers.split(",") if args.checkers else CHECKERS
    result = compare(
        robot,
        scene,
        _configurations(args, robot, scene),
        checkers=checkers,
        pruning=args.pruning,
        progress=Progress("poses"),
        keep_finished=True,
    )
    document: dict[str, Any] = {
        "robot": robot_block(robot),
        "scene": scene_block(scene),
        "seed": args.seed if args.random is not None else None,
        "not_modelled": [*robot.not_modelled, *scene.not_modelled],
        **allowed_block(robot, {"pairs": result.touching_itself}),
        **to_json(result),
    }
    if wants_display(args):
        from borecheck.report.display import display_block

        document["display"] = display_block(robot, scene, document)
    return document


def _configurations(
    args: argparse.Namespace, robot: "Robot", scene: "Scene"
) -> NDArray[np.float64]:
    from borecheck.motion.samples import configurations_at, sample_fractions

    if args.q is not None:
        return np.array([common.configuration(robot, args.q)])
    if args.random is not None:
        count = common.random_count(args)
        rng = np.random.default_rng(args.seed)
        return robot.model.random_configurations(rng, count)
    if args.path is not None:
        motions = [common.waypoints(robot, args.path)]
    else:
        from borecheck.motion.needle_motion import needle_motion

        plans = plans_of(args, args.plan)
        motions = [needle_motion(robot, scene, plan).waypoints for plan in plans]
    sampled = [
        configurations_at(points, sample_fractions(points, args.samples))
        for points in motions
    ]
    return np.concatenate(sampled)
