"""`check --plan`: how far a plan may be off; `--tolerance` and `--repair`."""

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from borecheck.core.units import parse_angle, parse_length
from borecheck.errors import UsageError

if TYPE_CHECKING:
    from borecheck.contact.settings import Settings
    from borecheck.plans.needle_plan import NeedlePlan
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene


def add_tolerance(parser: argparse.ArgumentParser) -> None:
    """The options."""
    parser.add_argument(
        "--tolerance",
        metavar="LENGTH,ANGLE",
        help="every clear plan must stay so for every target and direction so near: "
        "2mm,1deg",
    )
    parser.add_argument(
        "--repair",
        action="store_true",
        help="of every plan that is not clear, propose the nearest direction that is",
    )


def refuse_stray_tolerance(args: argparse.Namespace) -> None:
    """Refuses the options where there is no plan, or what is demanded is none.

    Raises:
        UsageError: So.
    """
    if args.tolerance is None and not args.repair:
        return
    if args.plan is None:
        raise UsageError("--tolerance and --repair go with --plan")
    if args.tolerance is not None:
        demanded(args.tolerance)


def demanded(text: str) -> tuple[float, float]:
    """Target error [m] and angle [rad] of `2mm,1deg`.

    Raises:
        UsageError: It is not a length and an angle.
    """
    parts = text.split(",")
    if len(parts) != 2:
        raise UsageError(f"--tolerance {text!r}: give a length and an angle: 2mm,1deg")
    error, angle = parse_length(parts[0]), parse_angle(parts[1])
    if not (error >= 0.0 and 0.0 < angle < 1.5):
        raise UsageError(f"--tolerance {text!r}: a length from 0 on, an angle above 0")
    return error, angle


def add_tolerances(
    document: dict[str, Any],
    args: argparse.Namespace,
    robot: "Robot",
    scene: "Scene",
    chosen: "Settings",
    plans: Sequence["NeedlePlan"],
) -> bool:
    """Adds how far plans may be off, and repairs; False where a demand is not met."""
    from borecheck.directions.chart import Chart

    asked = args.tolerance is not None or args.repair
    can = _can_tell(args, scene, chosen) and Chart.is_of(robot)
    if not can and asked:
        raise UsageError(
            "--tolerance and --repair need a robot with a chart of directions "
            "(zerobot), a patient, an offset margin and certified motions"
        )
    if not can:
        return True
    met = True
    for plan, block in zip(plans, document["plans"], strict=False):
        if block["verdict"] == "clear":
            block["tolerance"] = _told(args, robot, scene, plan, chosen.margin.size)
            met = met and block["tolerance"].get("met") is not False
        elif args.repair:
            block["repair"] = _repaired(robot, scene, plan, chosen.margin.size)
    return met


def _can_tell(args: argparse.Namespace, scene: "Scene", chosen: "Settings") -> bool:
    from borecheck.contact.margin import OFFSET
    from borecheck.motion.check import CERTIFIABLE

    return (
        chosen.checker in CERTIFIABLE
        and chosen.margin.kind == OFFSET
        and not args.no_certificate
        and any(obstacle.role == "patient" for obstacle in scene.obstacles)
    )


def _told(
    args: argparse.Namespace,
    robot: "Robot",
    scene: "Scene",
    plan: "NeedlePlan",
    margin: float,
) -> dict[str, Any]:
    """The largest tolerance of a clear plan, or whether the one demanded holds."""
    import numpy as np

    from borecheck.directions.tolerance import largest_tolerance, tolerance

    if args.tolerance is None:
        found = largest_tolerance(robot, scene, plan, margin)
        if found is None:
            return {"angle_deg": None, "target_error_m": None, "reason": "not shown"}
        reason, met = "", {}
    else:
        error, angle = demanded(args.tolerance)
        found = tolerance(
            robot, scene, plan, angle=angle, target_error=error, margin=margin
        )
        reason, met = found.reason, {"met": found.clear}
    return {
        "angle_deg": float(np.degrees(found.angle)),
        "target_error_m": found.target_error,
        "reason": reason,
        **met,
    }


def _repaired(
    robot: "Robot", scene: "Scene", plan: "NeedlePlan", margin: float
) -> dict[str, Any]:
    """The nearest clear direction to the same target."""
    import numpy as np

    from borecheck.directions.ask import directions

    found = directions(robot, scene, plan.target, margin=margin)
    near = found.nearest_clear(plan.direction)

    def degrees(angle: float) -> float | None:
        return float(np.degrees(angle)) if np.isfinite(angle) else None

    return {
        "entry": None if near.plan is None else near.plan.entry.tolist(),
        "angle_deg": degrees(near.angle),
        "none_nearer_than_deg": degrees(near.none_nearer_than),
    }
