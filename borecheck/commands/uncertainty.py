"""`check --uncertainty FILE`: what it adds to a result.

The probability is asked about the nominal pose, or about the pose of a motion that
comes nearest; for a whole motion it is therefore a lower bound. Where the accepted risk
is not known to be kept, `clear` becomes `unknown`.
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from borecheck.contact.verdict import CLEAR, CONTACT, UNKNOWN, worst_of
from borecheck.errors import UsageError
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.uncertainty.contact_probability import (
    ContactProbability,
    check_request,
    contact_probability,
)
from borecheck.uncertainty.covariance import Uncertainty, read_uncertainty

NOTE = (
    "the probability is that of the pose that comes nearest: "
    "for the whole motion it is a lower bound"
)


def prepared(args: argparse.Namespace, robot: Robot) -> Uncertainty:
    """The uncertainties that the options name, refused before any work is done.

    Raises:
        InputError: The file cannot be used.
        UsageError: A risk, a number of draws or a seed that makes no sense.
    """
    check_request(args.risk, args.draws)
    if args.seed < 0:
        raise UsageError(f"--seed {args.seed} is not 0 or more")
    return read_uncertainty(args.uncertainty, robot)


def add_probabilities(
    document: dict[str, Any],
    robot: Robot,
    scene: Scene,
    uncertainty: Uncertainty,
    args: argparse.Namespace,
) -> None:
    """Adds `uncertainty` to every judged pose of a `check` result, and judges by it.

    Args:
        document: The result of `check`; changed in place.
        robot: The robot that was checked.
        scene: The scene.
        uncertainty: From `prepared`.
        args: The options, for risk, draws and seed.
    """
    for block in _judged(document):
        found = _probability(block, robot, scene, uncertainty, args)
        block["uncertainty"] = found.to_json()
        if "path" in block:
            block["uncertainty"]["note"] = NOTE
        _judge(block, found)
    if "plans" in document:
        document["verdict"] = worst_of([p["verdict"] for p in document["plans"]])


def _judged(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    blocks = document.get("plans", [document])
    return (block for block in blocks if "q" in block)


def _probability(
    block: dict[str, Any],
    robot: Robot,
    scene: Scene,
    uncertainty: Uncertainty,
    args: argparse.Namespace,
) -> ContactProbability:
    corridor = None
    if "entry" in block:
        entry, target = np.array(block["entry"]), np.array(block["target"])
        radius = robot.description.needle_radius if robot.description else 0.0
        corridor = Corridor(entry, target, radius)
    return contact_probability(
        robot,
        scene,
        robot.model.configuration(block["q"]),
        uncertainty,
        margin=block.get("margin_m", 0.0),
        risk=args.risk,
        samples=args.draws,
        seed=args.seed,
        corridor=corridor,
    )


def _judge(block: dict[str, Any], found: ContactProbability) -> None:
    """A nominal `clear` stays one only if the risk is known to be kept."""
    if block["verdict"] != CLEAR or found.within_risk is True:
        return
    likely = found.probability if found.probability is not None else found.first_order
    known = "exceeds" if found.within_risk is False else "is not known to be within"
    required = CONTACT if found.margin_m == 0.0 else "coming within the margin"
    block["verdict"] = UNKNOWN
    block["reason"] += (
        f"; but the probability of {required} ({likely:.2g}) {known} "
        f"the accepted {found.risk:g}"
    )
