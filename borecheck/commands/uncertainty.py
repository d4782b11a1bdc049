"""`check --uncertainty FILE`: what it adds to a result.

Every pose, path and plan is judged anew with errors drawn for it, each draw as a whole:
`uncertainty.contact_probability`. A nominal `clear` stays one only where the accepted
risk is shown to be kept; where it is exceeded or not shown, it becomes `unknown`.
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from borecheck.commands.progress import Progress
from borecheck.contact.margin import margin_for
from borecheck.contact.verdict import CLEAR, CONTACT, UNKNOWN, worst_of
from borecheck.core.units import parse_length
from borecheck.errors import UsageError
from borecheck.geometry.surfaces import checker_name
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.uncertainty.contact_probability import (
    EXCEEDED,
    KEPT,
    ContactProbability,
    check_request,
    contact_probability,
)
from borecheck.uncertainty.covariance import Uncertainty, read_uncertainty
from borecheck.uncertainty.estimate import first_order

INTERRUPTED = "; but its risk was not asked about: interrupted"


def prepared(args: argparse.Namespace, robot: Robot) -> Uncertainty:
    """The uncertainties that the options name, refused before any work is done.

    Raises:
        InputError: The file cannot be used.
        UsageError: A risk, a number of draws, a seed or a margin that makes no sense.
    """
    check_request(args.risk, args.draws)
    if args.seed < 0:
        raise UsageError(f"--seed {args.seed} is not 0 or more")
    size, checker = parse_length(args.margin), checker_name(args.checker)
    if margin_for(checker, size, args.margin_kind).enlarges:
        raise UsageError(
            "--uncertainty asks for the true distance in every draw: give a margin of "
            "kind offset (--checker exact --margin-kind offset)"
        )
    return read_uncertainty(args.uncertainty, robot)


def add_probabilities(
    document: dict[str, Any],
    robot: Robot,
    scene: Scene,
    uncertainty: Uncertainty,
    args: argparse.Namespace,
) -> None:
    """Adds `uncertainty` to every judged pose of a `check` result, and judges by it.

    What is finished stays when the user interrupts; the rest is `unknown`.

    Args:
        document: The result of `check`; changed in place.
        robot: The robot that was checked.
        scene: The scene.
        uncertainty: From `prepared`.
        args: The options, for risk, draws and seed.
    """
    waiting = list(_judged(document))
    try:
        while waiting:
            _add(waiting[0], robot, scene, uncertainty, args)
            waiting.pop(0)
    except KeyboardInterrupt:
        document["interrupted"] = True
        for block in waiting:
            if block["verdict"] == CLEAR:
                block["verdict"] = UNKNOWN
                block["reason"] += INTERRUPTED
    for block in _judged(document):
        _demote(block)
    if "plans" in document:
        document["verdict"] = worst_of([p["verdict"] for p in document["plans"]])


def _demote(block: dict[str, Any]) -> None:
    """Takes `clear` from what is said of the obstacles where the risk is not kept."""
    obstacles = block.get("obstacles")
    if obstacles is not None and obstacles["verdict"] == CLEAR != block["verdict"]:
        obstacles["verdict"] = UNKNOWN
        obstacles["reason"] += "; but that the risk is kept is not shown"


def _judged(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    blocks = document.get("plans", [document])
    return (block for block in blocks if "q" in block)


def _add(
    block: dict[str, Any],
    robot: Robot,
    scene: Scene,
    uncertainty: Uncertainty,
    args: argparse.Namespace,
) -> None:
    margin, corridor = block.get("margin_m", 0.0), _corridor(block)
    name = f" of plan {block['name']}" if "name" in block else ""
    found = contact_probability(
        robot,
        scene,
        _motion(block, robot),
        uncertainty,
        margin=margin,
        risk=args.risk,
        samples=args.draws,
        seed=args.seed,
        corridor=corridor,
        progress=Progress(f"draws{name}"),
    )
    estimate = first_order(
        robot,
        scene,
        robot.model.configuration(block["q"]),
        uncertainty,
        margin=margin,
        risk=args.risk,
        corridor=corridor,
    )
    block["uncertainty"] = found.to_json()
    block["uncertainty"]["first_order"] = estimate.to_json() if estimate else None
    _judge(block, found)


def _motion(block: dict[str, Any], robot: Robot) -> list[Any]:
    """The waypoints of a motion; of a pose the pose alone."""
    points = block["path"]["waypoints"] if "path" in block else [block["q"]]
    return [robot.model.configuration(q) for q in points]


def _corridor(block: dict[str, Any]) -> Corridor | None:
    stated = block.get("corridor")
    if stated is None:
        return None
    entry, target = np.array(stated["entry"]), np.array(stated["target"])
    return Corridor(entry, target, stated["radius_m"], stated["slack_m"])


def _judge(block: dict[str, Any], found: ContactProbability) -> None:
    """A nominal `clear` stays one only if the risk is shown to be kept."""
    if block["verdict"] != CLEAR:
        return
    required = CONTACT if found.margin_m == 0.0 else "coming within the margin"
    if found.answer == KEPT:
        at_most = f"at most {found.upper:.2g} at 95 %"
        block["reason"] += f"; risk of {found.risk:g} kept: {required} {at_most}"
        return
    block["verdict"] = UNKNOWN
    if found.answer == EXCEEDED:
        block["reason"] += (
            f"; but the probability of {required} ({found.probability:.2g}) exceeds "
            f"the accepted {found.risk:g}"
        )
        return
    block["reason"] += (
        f"; but that the risk of {found.risk:g} is kept is not shown: {found.why}"
    )
