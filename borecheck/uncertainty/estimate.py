"""To first order: an estimate of the probability of contact, of unknown error.

The distance to the obstacles is taken as the smallest of some linear functions of the
errors (see `linear`). That is quick, reaches small probabilities and tells which
clearance a risk needs; but corners, folds, solids, the robot itself and the needle's
corridor are not in it, and nothing bounds what it is off by. No risk is called kept by
it.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from borecheck.contact.clearance import to_obstacles
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.uncertainty import linear
from borecheck.uncertainty.covariance import Uncertainty
from borecheck.uncertainty.disturbed import Disturbed


@dataclass(frozen=True)
class FirstOrder:
    """What the linear model says of one pose.

    Attributes:
        probability: Of coming within the margin of an obstacle; None where the
            surfaces meet already.
        span: The likeliest single cut, and the sum of all of them.
        clearance_m: Nominal clearance of the surfaces, [m].
        sigma_m: Largest standard deviation of a near distance, [m].
        margin_for_risk_m: Nominal clearance that keeps the risk, [m].
    """

    probability: float | None
    span: tuple[float, float] | None
    clearance_m: float
    sigma_m: float | None
    margin_for_risk_m: float | None

    def to_json(self) -> dict[str, Any]:
        """Plain values for `json.dumps`."""
        return asdict(self)


def first_order(
    robot: Robot,
    scene: Scene,
    q: ArrayLike,
    uncertainty: Uncertainty,
    *,
    margin: float = 0.0,
    risk: float = 1e-3,
    corridor: Corridor | None = None,
) -> FirstOrder | None:
    """The estimate for one configuration; None where no obstacle is left to ask about.

    Args:
        robot: The robot.
        scene: What stands around it.
        q: Nominal configuration, (n,).
        uncertainty: What is not exact.
        margin: Required clearance, [m].
        risk: Accepted probability.
        corridor: Where the needle may be in the patient: the two are left out.
    """
    disturbed = Disturbed(robot, q, uncertainty)
    zero = np.zeros(len(uncertainty.names))
    found, _ = to_obstacles(robot, scene, disturbed.placements(zero), corridor)
    if found is None:
        return None
    cuts = linear.cuts(disturbed, scene, corridor) if found.distance > 0.0 else None
    if cuts is None:
        return FirstOrder(None, None, found.distance, None, None)
    return FirstOrder(
        cuts.probability(margin),
        cuts.span(margin),
        found.distance,
        float(cuts.sigma.max()),
        cuts.margin(risk),
    )
