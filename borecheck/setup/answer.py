"""What is said of a set-up: reachable, unreachable, or undecided."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.plans.needle_plan import NeedlePlan

Array = NDArray[np.float64]

REACHABLE, UNREACHABLE, UNDECIDED = "reachable", "unreachable", "undecided"


@dataclass(frozen=True, eq=False)
class Setup:
    """The answer for one needle.

    Attributes:
        plan: The needle.
        status: "reachable": `q` keeps every constraint by the exact checker;
            "unreachable": no configuration does, proven; or "undecided".
        reason: One sentence.
        solver: Which one was asked.
        joints: The joints in the order of q.
        q: The configuration, (joints,), or None.
        cost: f of [CRANE] eq. (25) at q, or None.
        lower_bound: No configuration that keeps the constraints costs less, proven;
            None where nothing is proven.
        clearance: Least distance to an obstacle at q, lower bound, [m]; or None.
        constraints: What each constraint says, see docs/setup.md.
        boxes: How many configurations or boxes of them were looked at.
        seconds: Time it took.
        motion: Waypoints (k, joints) from before the skin through q to the target.
    """

    plan: NeedlePlan
    status: str
    reason: str
    solver: str
    joints: tuple[str, ...]
    q: Array | None = None
    cost: float | None = None
    lower_bound: float | None = None
    clearance: float | None = None
    constraints: Mapping[str, Any] = field(default_factory=dict)
    boxes: int = 0
    seconds: float = 0.0
    motion: Array | None = None

    @property
    def reachable(self) -> bool:
        """Whether there is a configuration."""
        return self.status == REACHABLE

    @property
    def gap(self) -> float | None:
        """How much better than `cost` another configuration can be, proven; or None."""
        if self.cost is None or self.lower_bound is None:
            return None
        return max(0.0, self.cost - self.lower_bound)

    def __repr__(self) -> str:
        return f"<setup {self.plan.name}: {self.status}, {self.reason}>"

    def to_json(self) -> dict[str, Any]:
        """Plain values for `json.dumps`."""
        plan, q, motion = self.plan, self.q, self.motion
        named = None
        if q is not None:
            named = dict(zip(self.joints, map(float, q), strict=True))
        return {
            "name": plan.name,
            "status": self.status,
            "reason": self.reason,
            "entry": plan.entry.tolist(),
            "target": plan.target.tolist(),
            "solver": self.solver,
            "q": named,
            "cost": self.cost,
            "lower_bound": self.lower_bound,
            "gap": self.gap,
            "clearance_m": self.clearance,
            "constraints": dict(self.constraints),
            "boxes": self.boxes,
            "seconds": self.seconds,
            "motion": None if motion is None else motion.tolist(),
        }
