"""The probability that the robot touches something, in two ways.

To first order the distance is the smallest of some linear functions of the errors (see
`linear`). By Monte Carlo the clearance is worked out anew for every draw. The first is
fast and reaches small probabilities, the second assumes nothing about shapes; where
they differ by more than the interval, trust the second. Where nominally a solid holds
another there is contact, however far apart the surfaces are.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact import clearance, containment
from borecheck.contact.verdict import UNKNOWN, Containment
from borecheck.errors import UsageError
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.uncertainty import linear
from borecheck.uncertainty.covariance import Uncertainty
from borecheck.uncertainty.disturbed import Disturbed

Array = NDArray[np.float64]

LEVEL = 0.95


@dataclass(frozen=True)
class ContactProbability:
    """How likely the clearance is at or below what is required.

    Attributes:
        probability: Share of the draws; None if nothing was drawn.
        interval: Exact 95 % interval of it.
        first_order: By the linear model; None where the nominal robot is in contact.
        first_order_bounds: The likeliest single cut, and the sum of all.
        clearance_m: Nominal clearance, [m]; 0 if a solid holds another.
        sigma_m: Largest standard deviation of a near distance, [m].
        margin_m: Required clearance that was asked about, [m].
        risk: The chosen risk.
        margin_for_risk_m: Nominal clearance that keeps the risk, to first order, [m].
        drawn_margin_for_risk_m: The same from the draws; None where they are too few
            or where the draws it rests on are in contact.
        within_risk: Whether the risk is kept; None where the draws leave it open, an
            obstacle's unit was guessed, or an open surface may hold something.
        samples: Draws.
        seed: Of the draws.
        names: The quantities that are uncertain.
    """

    probability: float | None
    interval: tuple[float, float]
    first_order: float | None
    first_order_bounds: tuple[float, float] | None
    clearance_m: float
    sigma_m: float | None
    margin_m: float
    risk: float
    margin_for_risk_m: float | None
    drawn_margin_for_risk_m: float | None
    within_risk: bool | None
    samples: int
    seed: int
    names: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain values for `json.dumps`."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in values.items()
        }


def contact_probability(
    robot: Robot,
    scene: Scene,
    q: ArrayLike,
    uncertainty: Uncertainty,
    *,
    margin: float = 0.0,
    risk: float = 1e-3,
    samples: int = 1000,
    seed: int = 0,
    corridor: Corridor | None = None,
) -> ContactProbability:
    """Probability that the clearance to the obstacles is at or below the margin.

    Args:
        robot: The robot.
        scene: What stands around it.
        q: Nominal configuration, (n,), within the limits.
        uncertainty: What is not exact.
        margin: Required clearance, [m]; 0 asks for contact.
        risk: Accepted probability.
        samples: Draws; 0 for the first order alone.
        seed: Of the draws.
        corridor: Where the needle may be in the patient.

    Raises:
        JointLimitError: q is beyond a limit.
        UsageError: A risk that is no probability, a negative number of samples.
    """
    check_request(risk, samples)
    disturbed = Disturbed(robot, robot.model.check_limits(q), uncertainty)
    placements = disturbed.placements(_zero(uncertainty))
    inside = _contained(robot, scene, placements, corridor)
    held = any(pair.holds for pair in inside)
    nominal = 0.0 if held else _clearance(robot, scene, placements, corridor)
    cuts = linear.cuts(disturbed, scene, corridor) if nominal > 0.0 else None
    drawn = _draws(disturbed, scene, uncertainty, samples, seed, corridor, solids=held)
    hits = int((drawn <= margin).sum())
    interval = _interval(hits, samples)
    bounds = cuts.bounds(margin) if cuts else None
    kept = _within(interval, bounds, risk)
    open_question = scene.doubt is not None or any(
        pair.state == UNKNOWN for pair in inside
    )
    return ContactProbability(
        probability=hits / samples if samples else None,
        interval=interval,
        first_order=cuts.probability(margin) if cuts else None,
        first_order_bounds=bounds,
        clearance_m=nominal,
        sigma_m=float(cuts.sigma.max()) if cuts else None,
        margin_m=margin,
        risk=risk,
        margin_for_risk_m=cuts.margin(risk) if cuts else None,
        drawn_margin_for_risk_m=_drawn_margin(nominal, drawn, risk),
        within_risk=None if kept and open_question else kept,
        samples=samples,
        seed=seed,
        names=uncertainty.names,
    )


def check_request(risk: float, samples: int) -> None:
    """Refuses a risk that is no probability, and a negative number of draws."""
    if not 0.0 < risk < 1.0:
        raise UsageError(f"risk {risk!r} is no probability between 0 and 1")
    if samples < 0:
        raise UsageError(f"{samples} draws: it must be 0 or more")


def _drawn_margin(nominal: float, drawn: Array, risk: float) -> float | None:
    """How much the clearance may be short of the nominal one, from the draws, [m]."""
    if len(drawn) * risk < 10.0:
        return None  # fewer than ten draws beyond the quantile say too little
    low = float(np.quantile(drawn, risk))
    return None if low <= 0.0 else nominal - low


def _within(
    interval: tuple[float, float], bounds: tuple[float, float] | None, risk: float
) -> bool | None:
    """Kept or broken for sure by the draws; else by the first order if it agrees."""
    if interval[0] > risk:
        return False
    if interval[1] <= risk:
        return True
    if bounds is None or not interval[0] <= bounds[1]:
        return None
    return True if bounds[1] <= 0.1 * risk else None


def _draws(
    disturbed: Disturbed,
    scene: Scene,
    uncertainty: Uncertainty,
    samples: int,
    seed: int,
    corridor: Corridor | None,
    *,
    solids: bool,
) -> Array:
    """Clearances of the draws, (samples,), [m]; `solids`: also ask who holds whom."""
    rng = np.random.default_rng(seed)
    root = linear.square_root(uncertainty.covariance)
    xs = rng.standard_normal((samples, len(root))) @ root.T
    robot, found = disturbed.robot, np.zeros(samples)
    for k, x in enumerate(xs):
        placements = disturbed.placements(x)
        inside = _contained(robot, scene, placements, corridor) if solids else []
        if not any(pair.holds for pair in inside):
            found[k] = _clearance(robot, scene, placements, corridor)
    return found


def _clearance(
    robot: Robot, scene: Scene, placements: dict[str, Array], corridor: Corridor | None
) -> float:
    found, _ = clearance.to_obstacles(robot, scene, placements, corridor)
    if found is None:
        raise UsageError("there is no obstacle to be clear of")
    return found.distance


def _contained(
    robot: Robot, scene: Scene, placements: dict[str, Array], corridor: Corridor | None
) -> list[Containment]:
    """Solids that hold others; needle and patient apart where a plan leads in."""
    meant = [
        (part.mesh.name, obstacle.name)
        for part in robot.parts
        for obstacle in scene.obstacles
        if corridor is not None and robot.may_enter(part.link, obstacle.role)
    ]
    return containment.all_contained(robot, scene, placements, meant)


def _interval(hits: int, samples: int) -> tuple[float, float]:
    """Exact (Clopper-Pearson) interval at LEVEL; everything without draws."""
    if samples == 0:
        return 0.0, 1.0
    from scipy.stats import beta  # 0.3 s

    tail = 0.5 * (1.0 - LEVEL)
    low = float(beta.ppf(tail, hits, samples - hits + 1)) if hits else 0.0
    rest = samples - hits
    return low, float(beta.ppf(1.0 - tail, hits + 1, rest)) if rest else 1.0


def _zero(uncertainty: Uncertainty) -> Array:
    return np.zeros(len(uncertainty.names))
