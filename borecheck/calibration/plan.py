"""What joint values would show if one measured at them, and a list worth measuring."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.observability import design, observe
from borecheck.calibration.serial_arm import SerialArm
from borecheck.calibration.setup import CalibrationSetup, target_at_zero
from borecheck.core.result_file import SCHEMA_VERSION
from borecheck.core.text import in_lines, printable

Array = NDArray[np.float64]

POSES = 50  # at which the tip matters, evenly within the limits


@dataclass(frozen=True, eq=False)
class Plan:
    """Chosen joint values.

    Attributes:
        q: (n, k), [rad].
        summary: What they would show, against as many random ones.
    """

    q: Array
    summary: str


def plan(
    arm: SerialArm,
    setup: CalibrationSetup,
    samples: int,
    candidates: int,
    sigma: float,
    seed: int,
) -> Plan:
    """The samples that leave the target least uncertain.

    Args:
        arm: The arm as drawn.
        setup: Target.
        samples: How many to choose.
        candidates: How many random configurations to choose from.
        sigma: Standard deviation of a measured coordinate, [m].
        seed: Of the candidates.
    """
    rng = np.random.default_rng(seed)
    target = target_at_zero(arm, setup.target)
    pool, poses = arm.random(rng, candidates), arm.random(rng, POSES)
    chosen = pool[design(arm, pool, samples, target, poses)]
    after = observe(arm, chosen, target, sigma, poses)
    random = observe(arm, pool[:samples], target, sigma, poses)
    summary = (
        f"{samples} of {candidates}: target uncertain by "
        f"{1e3 * after.tip_sigma:.4f} mm (condition {after.condition:.0f}); "
        f"{samples} random ones: "
        f"{1e3 * random.tip_sigma:.4f} mm (condition {random.condition:.0f}); weakest: "
        + ", ".join(after.weakest[:4])
    )
    return Plan(chosen, summary)


def judged(
    arm: SerialArm, setup: CalibrationSetup, q: Array, sigma: float
) -> dict[str, Any]:
    """What samples show, as JSON.

    Args:
        arm: The arm as drawn.
        setup: Target.
        q: Joint values, (n, k), [rad].
        sigma: Standard deviation of a measured coordinate, [m].
    """
    poses = arm.random(np.random.default_rng(0), POSES)
    found = observe(arm, q, target_at_zero(arm, setup.target), sigma, poses)
    seen = not found.unseen
    return {
        "schema_version": SCHEMA_VERSION,
        "command": "calibrate observe",
        "samples": len(q),
        "parameters": len(arm.forms.names),
        "condition": found.condition if seen else None,
        "unseen": list(found.unseen),
        "weakest": list(found.weakest),
        "sigma_m": sigma,
        "target_sigma_m": found.tip_sigma if seen else None,
    }


def observation_text(seen: Mapping[str, Any]) -> str:
    """The same for people."""
    head = f"{seen['samples']} samples, {seen['parameters']} parameters and the target"
    if seen["unseen"]:
        return in_lines([head, f"not seen at all: {', '.join(seen['unseen'])}"])
    return in_lines(
        [
            head,
            f"all seen, condition number {seen['condition']:.1f} (1 is best)",
            f"weakest: {', '.join(seen['weakest'])}",
            f"errors of {1e3 * seen['sigma_m']:.4g} mm leave the target uncertain by "
            f"{1e3 * seen['target_sigma_m']:.4f} mm all over the joint ranges",
        ]
    )


def as_csv(arm: SerialArm, q: Array) -> str:
    """Joint values with a header, [rad]."""
    rows = [",".join(map(printable, arm.joint_names))]
    rows += [",".join(repr(float(x)) for x in row) for row in q]
    return "\n".join(rows) + "\n"
