"""Every configuration that is given is asked of the exact checker, by itself."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.check import check_with
from borecheck.contact.settings import settings
from borecheck.contact.verdict import Verdict
from borecheck.plans.needle_corridor import corridor_along
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.setup.cone import ConeProof
from borecheck.setup.terms import Terms

Array = NDArray[np.float64]


def verified(terms: Terms, plan: NeedlePlan, q: Array) -> tuple[Verdict, str | None]:
    """The exact verdict of a set-up, and what stands against it by that; None: nothing.

    Contact, the padding, and where Pinocchio places the needle are asked.
    """
    robot, asked = terms.robot, terms.asked
    corridor = corridor_along(robot, q[None], plan.entry, plan.target)
    margin = 0.0 if asked.excluded else asked.padding
    chosen = settings(margin=margin)
    verdict = check_with(robot, terms.scene, q, chosen, corridor)
    if not verdict.clear:
        return verdict, f"the exact checker says: {verdict.reason}"
    if asked.excluded and not terms.keeps_padding(q):
        return verdict, "the padding is not shown to be kept"
    off, turned = needle_off(terms, plan, q)
    if off > asked.position or turned > asked.direction:
        return verdict, f"the needle is {1e3 * off:.3f} mm off, {turned:.2g} rad turned"
    return verdict, None


def needle_off(terms: Terms, plan: NeedlePlan, q: Array) -> tuple[float, float]:
    """How far the needle is off, [m] and [rad], by Pinocchio; eqs. (18), (19)."""
    needle = terms.needle
    T = terms.robot.placements(q)[needle.tip or ""]
    n = T[:3, :3] @ needle.axis
    across = float(np.linalg.norm(np.cross(n, plan.direction)))
    turned = float(np.arctan2(across, float(n @ plan.direction)))
    return float(np.linalg.norm(T[:3, 3] - plan.entry)), turned


def said_of(
    terms: Terms, plan: NeedlePlan, q: Array, cone: ConeProof
) -> dict[str, Any]:
    """What each constraint says at a configuration, as JSON-ready values."""
    model, names = terms.robot.model, terms.robot.model.joint_names
    off, turned = needle_off(terms, plan, q)
    costs = terms.costs(q[None], within=0.0)
    needed = terms.torques(q[None])[0]
    room = np.minimum(q - model.lower, model.upper - q)
    effort = [float(v) if np.isfinite(v) else None for v in terms.efforts]
    return {
        "pose": {"off_m": off, "turned_rad": turned},
        "joint_limits": {
            name: float(v)
            for name, v in zip(names, room, strict=True)
            if np.isfinite(v)
        },
        "torque": {
            name: {"needed": float(t), "effort": e}
            for name, t, e in zip(names, needed, effort, strict=True)
        },
        "clearance": {
            "padding_m": terms.asked.padding,
            "scanner_m": float(costs.scanner[0]),
            "patient_m": float(costs.patient[0]),
        },
        "manipulability": float(costs.manipulability[0]),
        "from_home": float(costs.motion[0]),
        "cone": {
            "zenith_rad": cone.zenith,
            "certified": cone.certified,
            "triangles": cone.triangles,
            "tip_off_m": cone.off,
        },
    }
