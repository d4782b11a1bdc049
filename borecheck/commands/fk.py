"""`borecheck fk`: closed form, Pinocchio and yourdfpy about every frame."""

import argparse

from borecheck.commands import common
from borecheck.commands.output import check_outputs, emit


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    common.add_robot(parser)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--q", metavar="Q", help="one configuration")
    what.add_argument("--random", type=int, metavar="N", help="N random ones")
    parser.add_argument("--seed", type=int, default=0, help="for --random")
    common.add_output(parser)


def run(args: argparse.Namespace) -> int:
    """Compares; 0 if all sources agree, 1 if not."""
    check_outputs(args)
    import numpy as np

    from borecheck.commands.exit_status import ExitStatus
    from borecheck.report.document import header, robot_block
    from borecheck.report.text import fk_text
    from borecheck.robots.kinematics.configurations import sample_configurations
    from borecheck.robots.kinematics.cross_check import cross_check, to_json

    robot = common.load(args)
    if args.q is not None:
        q = common.configuration(robot, args.q)
        qs = np.array([robot.model.check_limits(q)])
    else:
        count = common.random_count(args)
        rng = np.random.default_rng(args.seed)
        qs = sample_configurations(robot.model, rng, count)
    result = cross_check(robot, qs)
    document = {
        **header("fk", args.argv, args.date),
        **to_json(result),
        "robot": robot_block(robot),
        "seed": args.seed if args.random is not None else None,
    }
    emit(args, document, fk_text)
    return ExitStatus.FINDINGS if result.disagreements else ExitStatus.CLEAN
