"""`check --uncertainty FILE`: the options, and what they add to a result.

The probability is asked about the nominal pose, or about the pose of a motion that
comes nearest; for a whole motion it is therefore a lower bound. Where the accepted risk
is not known to be kept, `clear` becomes `unknown`.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.corridor import Corridor
from borecheck.plan_motion import NEEDLE_RADIUS
from borecheck.robot import Robot
from borecheck.scene import Scene
from borecheck.uncertainty.contact_probability import (
    ContactProbability,
    contact_probability,
)
from borecheck.uncertainty.covariance import Uncertainty, read_uncertainty
from borecheck.verdict import CLEAR, CONTACT, UNKNOWN, worst_of

NOTE = (
    "the probability is that of the pose that comes nearest: "
    "for the whole motion it is a lower bound"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """`--uncertainty`, `--risk`, `--draws` and `--seed`."""
    group = parser.add_argument_group("uncertainty")
    group.add_argument(
        "--uncertainty",
        type=Path,
        metavar="FILE",
        help="how inexact joints, dimensions and registration are (JSON): adds the "
        "probability of contact",
    )
    group.add_argument(
        "--risk", type=float, default=1e-3, help="accepted probability (default: 1e-3)"
    )
    group.add_argument(
        "--draws", type=int, default=1000, help="draws for it (default: 1000)"
    )
    group.add_argument("--seed", type=int, default=0, help="of the draws")


def add_probabilities(
    document: dict[str, Any], robot: Robot, scene: Scene, args: argparse.Namespace
) -> None:
    """Adds `uncertainty` to every judged pose of a `check` result, and judges by it.

    Args:
        document: The result of `check`; changed in place.
        robot: The robot that was checked.
        scene: The scene.
        args: The options of `add_options`.

    Raises:
        InputError: The file cannot be used.
        UsageError: A risk or a number of draws that makes no sense.
    """
    uncertainty = read_uncertainty(args.uncertainty, robot)
    for block in _judged(document):
        found = _probability(block, robot, scene, uncertainty, args)
        block["uncertainty"] = found.to_json()
        if "path" in block:
            block["uncertainty"]["note"] = NOTE
        _judge(block, found)
    if "plans" in document:
        document["verdict"] = worst_of([p["verdict"] for p in document["plans"]])


def lines(block: dict[str, Any]) -> list[str]:
    """The probability in words, for the text of a result."""
    found = block.get("uncertainty")
    if found is None:
        return []
    parts = []
    if found["probability"] is not None:
        low, high = found["interval"]
        parts.append(
            f"{found['probability']:.2g} from {found['samples']} draws "
            f"(95 %: {low:.2g} to {high:.2g})"
        )
    if found["first_order"] is not None:
        low, high = found["first_order_bounds"]
        parts.append(
            f"{found['first_order']:.2g} to first order ({low:.2g} to {high:.2g})"
        )
    told = ["probability of contact: " + ", ".join(parts)]
    margin = found["margin_for_risk_m"]
    if margin is not None:
        told.append(
            f"for a risk of {found['risk']:g} a clearance of {1e3 * margin:.2f} mm is "
            f"needed, nominal {1e3 * found['clearance_m']:.2f} mm"
        )
    return told


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
        corridor = Corridor(entry, target, NEEDLE_RADIUS)
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
