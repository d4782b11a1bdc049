"""`--needle`, `--tip`, `--insertion` and `--corridor`: what may enter the patient."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from borecheck.commands.options.patient_place import plans_of
from borecheck.core.units import parse_length
from borecheck.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from borecheck.plans.corridor import Corridor
    from borecheck.plans.needle_plan import NeedlePlan
    from borecheck.robots.robot import Robot

PLAN_FILES = (".csv", ".json", ".fcsv")


def add_needle(parser: argparse.ArgumentParser) -> "argparse._ArgumentGroup":
    """What states the needle; for every command that follows plans."""
    group = parser.add_argument_group(
        "needle",
        "Installed robots name theirs. Of another one nothing is guessed: without "
        "these options a plan's error proposes them.",
    )
    group.add_argument(
        "--needle", metavar="LINK", help="the link that may enter the patient"
    )
    group.add_argument(
        "--tip",
        metavar="FRAME[:AXIS]",
        help="the link whose frame is at its tip, and which axis of it points forward: "
        "x, y, z (default), -x, -y or -z",
    )
    group.add_argument(
        "--insertion",
        metavar="JOINT",
        help="the sliding joint that drives the needle; without one the arm does",
    )
    return group


def add_corridor(parser: argparse.ArgumentParser) -> None:
    """The needle, and where a path may bring it into the patient."""
    add_needle(parser).add_argument(
        "--corridor",
        metavar="X,Y,Z:X,Y,Z",
        help="with --path: entry and target between which the needle may be in the "
        "patient; or FILE[:PLAN], a plan's; or last-leg, the needle's way straight in "
        "at the path's end",
    )


def with_needle(args: argparse.Namespace, robot: "Robot") -> "Robot":
    """The robot with the needle that the options state, if they do."""
    if not hasattr(args, "needle"):
        return robot
    return robot.with_needle(args.needle, args.tip, args.insertion)


def corridor_of(
    args: argparse.Namespace, robot: "Robot", waypoints: "NDArray[np.float64]"
) -> "Corridor | None":
    """The corridor that a path is given, if it is.

    Raises:
        UsageError: The text is none of the forms, or the robot has no needle.
        PlanError: A file of plans that cannot be used.
    """
    text = args.corridor
    if text is None:
        return None
    from borecheck.plans.needle_corridor import LAST_LEG, corridor_along, last_leg

    if text == LAST_LEG:
        return last_leg(robot, waypoints)
    entry, target = _from_plan(text, args) if names_plans(text) else _points(text)
    return corridor_along(robot, waypoints, entry, target)


def refuse_stray_corridor(args: argparse.Namespace) -> None:
    """Refuses `--corridor` where nothing would use it.

    Raises:
        UsageError: It is given without `--path`.
    """
    if args.corridor is not None and args.path is None:
        raise UsageError("--corridor goes with --path; plans have their own corridors")


def names_plans(text: str) -> bool:
    """Whether FILE or FILE:NAME is of a file of plans, by its ending."""
    return any(suffix in text.lower() for suffix in PLAN_FILES)


def _points(text: str) -> "list[NDArray[np.float64]]":
    import numpy as np

    points = [
        [parse_length(part.strip()) for part in point.split(",")]
        for point in text.split(":")
        if text.count(":") == 1
    ]
    if [len(point) for point in points] != [3, 3]:
        raise UsageError(
            f"--corridor {text!r} is not X,Y,Z:X,Y,Z (entry, then target), a file of "
            "plans, or last-leg"
        )
    return [np.array(point) for point in points]


def _from_plan(
    text: str, args: argparse.Namespace
) -> "tuple[NDArray[np.float64], NDArray[np.float64]]":
    plan = plan_named(text, "--corridor", args)
    return plan.entry, plan.target


def plan_named(text: str, option: str, args: argparse.Namespace) -> "NeedlePlan":
    """The plan of FILE:NAME, or the only one of FILE.

    Args:
        text: What was given.
        option: To which option, for the message.
        args: All options; they may state where the patient lies.

    Raises:
        UsageError, UnknownNameError, PlanError: There is no such plan, or several.
    """
    from borecheck.errors import UnknownNameError

    file, name = text, ""
    if not Path(text).exists() and ":" in text:
        file, _, name = text.rpartition(":")
    plans = {plan.name: plan for plan in plans_of(args, file)}
    if not name and len(plans) > 1:
        raise UsageError(
            f"{option} {text}: it holds {len(plans)} plans; say which: {file}:"
            f"{next(iter(plans))}"
        )
    if name and name not in plans:
        raise UnknownNameError("plan", name, plans)
    return plans[name] if name else next(iter(plans.values()))
