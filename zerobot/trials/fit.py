"""What would explain the published misses: fits to the table, kept apart from it.

Near a stop the model's clearance changes by n . shift, with n the unit vector from the
gantry's nearest point to the robot's. An error e = model's minus true distance makes a
miss at 15 mm when e > 5 mm and a false alarm at 25 mm when e < -5 mm. With normal
picking errors the likelihood of the table has a closed form. Everything here is fitted
to the published table and predicts nothing by itself.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zerobot.trials.errors import Sources
from zerobot.trials.published import PublishedApproach

Array = NDArray[np.float64]

FLIP_MM = 5.0  # 20 - 15 and 25 - 20
STRICTLY_MM = 0.01  # a miss needs e above 5 mm, by so much in the smallest disturbance


@dataclass(frozen=True, eq=False)
class Effects:
    """What the disturbances do to one approach at its 15 mm stop.

    Attributes:
        approach: The approach.
        normal: Unit vector from the gantry's to the robot's nearest point, (3,).
        bending_mm: Error by the arm's bending as calibrated, [mm].
        rods_mm: Error by rods placed with the whole of W_T_4, [mm].
    """

    approach: PublishedApproach
    normal: Array
    bending_mm: float
    rods_mm: float

    @property
    def missed(self) -> bool:
        """Whether the published table has a miss here."""
        return not self.approach.trial(15).published_ok


@dataclass(frozen=True)
class FamilyFit:
    """A family of disturbances fitted to the published table.

    Attributes:
        family: What is free.
        parameters: The fitted values, [mm] or factors.
        log_likelihood: Of the published table.
        expected_misses: Of 32 trials at 15 mm, with the fitted values.
        right_cells: How many of the 15 mm cells it calls as published.
    """

    family: str
    parameters: dict[str, float]
    log_likelihood: float
    expected_misses: float
    right_cells: int


@dataclass(frozen=True)
class Smallest:
    """The smallest disturbance of a family that gives exactly the published table.

    Attributes:
        family: What is free.
        size_mm: Length of the parameter vector, [mm]; None if there is none.
        parameters: The disturbance, [mm] or factors.
    """

    family: str
    size_mm: float | None
    parameters: dict[str, float]


FAMILIES = (
    "one offset",
    "one offset, bending",
    "one offset, bending, rods",
    "offset by sign of q5",
    "offset by posture",
    "offset by point",
    "offset by point and posture",
)


def columns(family: str, effects: Sequence[Effects]) -> tuple[Array, list[str]]:
    """Errors [mm] per unit of each free parameter, (approaches, parameters), names."""
    names: list[str] = []
    parts: list[Array] = []
    normals = np.array([e.normal for e in effects])
    for label, chosen in _groups(family, effects):
        parts.append(normals * np.array(chosen, dtype=float)[:, None])
        names += [f"{axis}{label} [mm]" for axis in "xyz"]
    if "bending" in family:
        parts.append(np.array([[e.bending_mm] for e in effects]))
        names.append("bending [times the assumed beam's]")
    if "rods" in family:
        parts.append(np.array([[e.rods_mm] for e in effects]))
        names.append("rods [times the whole of W_T_4]")
    return np.hstack(parts), names


def _groups(family: str, effects: Sequence[Effects]) -> list[tuple[str, list[bool]]]:
    if family not in FAMILIES:
        raise ValueError(f"no family {family!r} (known: {FAMILIES})")
    if family.startswith("one offset"):
        return [("", [True] * len(effects))]

    def key(e: Effects) -> str:
        a = e.approach
        posture = f"({a.q4_deg},{a.q5_deg})"
        by = {
            "offset by sign of q5": f"q5{'0+-'[(a.q5_deg > 0) + 2 * (a.q5_deg < 0)]}",
            "offset by posture": posture,
            "offset by point": a.point,
            "offset by point and posture": f"{a.point} {posture}",
        }
        return by[family]

    labels = list(dict.fromkeys(key(e) for e in effects))
    return [(f" {label}", [key(e) == label for e in effects]) for label in labels]


def spread_mm(effects: Effects, sources: Sources) -> float:
    """Standard deviation of the error from what is random, [mm]."""
    pick = np.array([sources.slice, sources.pick, sources.pick]) / math.sqrt(3.0)
    return 1e3 * math.hypot(
        *(pick * effects.normal), sources.stage, sources.caliper, 0.26 * sources.angle
    )


def log_likelihood(mean_mm: Array, spread: Array, missed: NDArray[np.bool_]) -> float:
    """Of the published table: each approach is missed at 15 mm, or right twice.

    Args:
        mean_mm: Mean errors, (n,), [mm].
        spread: Standard deviations, (n,), [mm].
        missed: Whether the table has a miss at 15 mm, (n,).
    """
    from scipy.stats import norm  # 0.3 s, and only studies need it

    beyond = norm.logsf((FLIP_MM - mean_mm) / spread)
    high = norm.cdf((FLIP_MM - mean_mm) / spread)
    low = norm.cdf((-FLIP_MM - mean_mm) / spread)
    between = np.log(np.maximum(high - low, 1e-300))
    return float(np.where(missed, beyond, between).sum())


def maximum_likelihood(
    family: str, effects: Sequence[Effects], sources: Sources
) -> FamilyFit:
    """The most likely parameters of a family, given the published table."""
    from scipy.optimize import minimize  # 0.5 s, and only studies need it
    from scipy.stats import norm

    A, names = columns(family, effects)
    spread = np.array([spread_mm(e, sources) for e in effects])
    missed = np.array([e.missed for e in effects])

    def cost(x: Array) -> float:
        # a broad prior (30 mm) keeps directions the table says nothing about finite
        return -log_likelihood(A @ x, spread, missed) + 0.5 * float(x @ x) / 30.0**2

    found = minimize(cost, np.zeros(A.shape[1]), method="L-BFGS-B")
    mean = A @ found.x
    chance = norm.sf((FLIP_MM - mean) / spread)
    return FamilyFit(
        family,
        dict(zip(names, (float(v) for v in found.x), strict=True)),
        log_likelihood(mean, spread, missed),
        float(chance.sum()),
        int(((chance > 0.5) == missed).sum()),
    )


def smallest_disturbance(family: str, effects: Sequence[Effects]) -> Smallest:
    """The shortest vector that turns the nominal table into the published one.

    A quadratic programme: e > 5 mm where a miss is published, |e| <= 5 mm elsewhere (a
    false alarm at 25 mm is as wrong as a miss).
    """
    from scipy.optimize import linprog, minimize

    A, names = columns(family, effects)
    missed = np.array([e.missed for e in effects])
    rows = np.vstack([-A[missed], A[~missed], -A[~missed]])
    least = FLIP_MM + STRICTLY_MM
    bound = np.concatenate(
        [
            np.full(missed.sum(), -least),
            np.full(2 * int((~missed).sum()), FLIP_MM - STRICTLY_MM),
        ]
    )
    start = linprog(np.zeros(A.shape[1]), A_ub=rows, b_ub=bound, bounds=(None, None))
    if not start.success:
        return Smallest(family, None, {})
    found = minimize(
        lambda x: 0.5 * float(x @ x),
        start.x,
        jac=lambda x: x,
        constraints=[
            {"type": "ineq", "fun": lambda x: bound - rows @ x, "jac": lambda x: -rows}
        ],
        method="SLSQP",
        options={"maxiter": 500},
    )
    x = found.x if found.success else start.x
    values = dict(zip(names, (float(v) for v in x), strict=True))
    return Smallest(family, float(np.linalg.norm(x)), values)


def needed_margin_mm(clear_mm: Array, risk: float = 1e-3) -> tuple[float, float]:
    """Margins that catch 15 mm and let 25 mm pass, with that risk of error each.

    Args:
        clear_mm: Model clearances of repetitions, (draws, approaches, 2), [mm]: at 25
            and at 15 mm.
        risk: Allowed share of wrong verdicts at each distance.

    Returns:
        Smallest margin that catches all but `risk` of the 15 mm stops, and the largest
        that raises false alarms at no more than `risk` of the 25 mm stops. A margin
        exists where the first is below the second.
    """
    lowest = float(np.quantile(clear_mm[..., 1], 1.0 - risk))
    highest = float(np.quantile(clear_mm[..., 0], risk))
    return lowest, highest


def first_order(
    effects: Sequence[Effects], sources: Sources, rng: np.random.Generator, count: int
) -> Array:
    """Errors at 15 mm by the linear model, (count, approaches), [mm]."""
    normals = np.array([e.normal for e in effects])
    mean = np.array([e.bending_mm for e in effects])
    if sources.level_parts == "frame4":
        mean = mean + np.array([e.rods_mm for e in effects])
    half = 1e3 * np.array([sources.slice, sources.pick, sources.pick])
    pick = rng.uniform(-1.0, 1.0, (count, len(effects), 3)) * half
    rest = 1e3 * math.hypot(sources.stage, sources.caliper, 0.26 * sources.angle)
    noise = rest * rng.standard_normal((count, len(effects)))
    return mean + (pick * normals).sum(axis=2) + noise
