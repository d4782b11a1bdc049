"""Are first-order probabilities of contact calibrated? A reliability table over plans.

Random needle plans for Zerobot whose nominal pose comes near the gantry; for each the
probability of contact with it is estimated to first order, and one world is drawn in
which contact happens or not (by exact clearance, with joints, dimensions and
registration off by the drawn errors). Of all plans called 20 to 30 %, about a quarter
must end in contact.

    python -m studies.uncertainty --plans 1000 --plot reliability.svg
"""

import argparse
import json
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from borecheck.contact.clearance import to_obstacles
from borecheck.robots.robot import Robot, load_robot
from borecheck.robots.scene import Scene, load_scene
from borecheck.uncertainty.contact_probability import contact_probability
from borecheck.uncertainty.covariance import Uncertainty, from_document
from borecheck.uncertainty.disturbed import Disturbed
from borecheck.uncertainty.linear import cuts
from zerobot.kinematics import inverse

Array = NDArray[np.float64]

# As large as a careless registration: 2 mm and a third of a degree.
UNCERTAINTY = {
    "joints": {"q1": "0.2mm", "q2": "0.2mm", "q3": "0.2mm", "q4": "0.1deg"},
    "dimensions": {
        "tip_offset_x": "0.5mm",
        "q4_offset": "0.2deg",
        "q5_offset": "0.2deg",
    },
    "registration": {
        **{axis: "2mm" for axis in "xyz"},
        **{f"r{axis}": "0.3deg" for axis in "xyz"},
    },
}

BINS = np.array([0.0, 0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0])
NEAR = 0.012  # nominal clearance below which contact has a chance, [m]


def random_plans(rng: np.random.Generator) -> Iterator[Array]:
    """Configurations that carry out random plans, without end."""
    while True:
        target = rng.uniform([-0.15, -0.25, -0.20], [0.15, 0.25, 0.20])
        tilt = np.radians(rng.uniform([-45.0, -30.0], [45.0, 30.0]))
        direction = [
            -np.sin(tilt[1]),
            np.sin(tilt[0]) * np.cos(tilt[1]),
            -np.cos(tilt[0]) * np.cos(tilt[1]),
        ]
        found = inverse(target, direction, rng.uniform(0.0, 0.15))
        if found.configurations:
            yield found.configurations[0]


def near_plans(
    robot: Robot, scene: Scene, rng: np.random.Generator, count: int
) -> list[Array]:
    """Those of them whose nominal clearance is small and not zero."""
    kept: list[Array] = []
    tried = 0
    for q in random_plans(rng):
        tried += 1
        closest, _ = to_obstacles(robot, scene, robot.placements(q))
        if closest is not None and 0.0 < closest.distance < NEAR:
            kept.append(q)
        if len(kept) == count:
            break
    say(f"{count} of {tried} random plans come within {1e3 * NEAR:g} mm")
    return kept


def happens(robot: Robot, scene: Scene, disturbed: Disturbed, x: Array) -> bool:
    """Whether the robot touches the gantry in the world with errors x."""
    closest, _ = to_obstacles(robot, scene, disturbed.placements(x))
    return closest is not None and closest.distance <= 0.0


def table(stated: Array, happened: NDArray[np.bool_]) -> list[dict[str, float]]:
    """A row per bin of stated probabilities, with the exact interval of the share."""
    rows = []
    for low, high in pairwise(BINS):
        inside = (stated >= low) & ((stated < high) | (high == 1.0))
        n, k = int(inside.sum()), int(happened[inside].sum())
        if n == 0:
            continue
        rows.append(
            {
                "from": float(low),
                "to": float(high),
                "plans": n,
                "stated": float(stated[inside].mean()),
                "happened": k / n,
                "low": float(beta.ppf(0.025, k, n - k + 1)) if k else 0.0,
                "high": float(beta.ppf(0.975, k + 1, n - k)) if k < n else 1.0,
            }
        )
    return rows


def draw_plot(rows: list[dict[str, float]], path: Path) -> None:
    """The reliability diagram."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    stated = [row["stated"] for row in rows]
    share = [row["happened"] for row in rows]
    spans = np.abs(
        [
            [row["happened"] - row["low"] for row in rows],
            [row["high"] - row["happened"] for row in rows],
        ]
    )
    figure, axes = pyplot.subplots(figsize=(5, 5))
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1)
    axes.errorbar(stated, share, yerr=spans, fmt="o", capsize=3)
    axes.set(xlabel="stated probability of contact", ylabel="share in contact")
    figure.savefig(path)


def study(plans: int, seed: int, against: int) -> dict[str, object]:
    """The whole study as values."""
    robot = load_robot("zerobot")
    scene = load_scene("ct_gantry", couch="no", patient="no")
    uncertainty: Uncertainty = from_document(UNCERTAINTY, robot)
    root = uncertainty.root
    rng = np.random.default_rng(seed)
    stated, happened = np.zeros(plans), np.zeros(plans, dtype=bool)
    differ = []
    for i, q in enumerate(near_plans(robot, scene, rng, plans)):
        disturbed = Disturbed(robot, q, uncertainty)
        found = cuts(disturbed, scene)
        assert found is not None  # the nominal pose is clear
        stated[i] = found.probability(0.0)
        happened[i] = happens(
            robot, scene, disturbed, root @ rng.standard_normal(root.shape[1])
        )
        if i < against:
            drawn = contact_probability(
                robot, scene, q, uncertainty, samples=200, seed=i
            )
            assert drawn.probability is not None  # 400 draws were asked for
            inside = drawn.interval[0] <= stated[i] <= drawn.interval[1]
            differ.append((float(stated[i]), drawn.probability, bool(inside)))
        if (i + 1) % 100 == 0:
            say(f"{i + 1} plans")
    spread = float(np.sqrt((stated * (1.0 - stated)).sum()))
    return {
        "plans": plans,
        "seed": seed,
        "uncertainty": UNCERTAINTY,
        "rows": table(stated, happened),
        "expected_contacts": float(stated.sum()),
        "contacts": int(happened.sum()),
        "deviation_in_sigma": (float(happened.sum()) - float(stated.sum())) / spread,
        "brier": float(((stated - happened) ** 2).mean()),
        "first_order_within_interval_of_draws": sum(d[2] for d in differ),
        "compared_with_draws": len(differ),
    }


def say(text: str) -> None:
    """Progress."""
    print(text, file=sys.stderr, flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plans", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--against-draws", type=int, default=50, metavar="N")
    parser.add_argument("--out", type=Path, help="write the result there (JSON)")
    parser.add_argument("--plot", type=Path, help="write the reliability diagram there")
    args = parser.parse_args()
    result = study(args.plans, args.seed, args.against_draws)
    rows = result["rows"]
    assert isinstance(rows, list)
    print("stated      plans  mean stated  happened  95 % interval")
    for row in rows:
        span = f"{row['low']:.3f} to {row['high']:.3f}"
        print(
            f"{row['from']:.2f}-{row['to']:.2f}  {row['plans']:6d}  "
            f"{row['stated']:11.3f}  {row['happened']:8.3f}  {span}"
        )
    print(
        f"{result['contacts']} contacts, {result['expected_contacts']:.1f} expected "
        f"({result['deviation_in_sigma']:+.1f} sigma), Brier {result['brier']:.4f}; "
        f"first order within the draws' 95 % interval in "
        f"{result['first_order_within_interval_of_draws']} of "
        f"{result['compared_with_draws']} plans"
    )
    if args.out:
        args.out.write_text(json.dumps(result, indent=1))
    if args.plot:
        draw_plot(rows, args.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
