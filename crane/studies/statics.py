"""How stiff is the arm, what do idlers allow, and what does 5 N do?

python -m crane.studies.statics
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from borecheck_models.closed_form import sources, values
from crane.description import DESCRIPTION
from crane.dimensions import LIMITS
from crane.statics import (
    IDLERS,
    Mechanics,
    compliance,
    joint_stiffness,
    load_test,
    rating,
    ratings,
)

HOME = tuple(DESCRIPTION.home.values())
DIRECTIONS = {"down": (0.0, 0.0, -1.0), "across": (0.0, 1.0, 0.0), "along": (1.0, 0, 0)}


def study(poses: int, seed: int) -> dict[str, Any]:
    """Stiffness at home and over the limits, ratings, the load test."""
    m = Mechanics()
    named = values(m)
    return {
        "numbers": [
            {"name": name, "value": named[name], "source": source}
            for name, source in sources(Mechanics).items()
        ],
        "joint_stiffness": joint_stiffness(m),
        "tests": [tested(name, v) for name, v in DIRECTIONS.items()],
        "idlers": [idler_row(i) for i in range(len(IDLERS))],
        "ratings": ratings(m),
        "over_the_limits": spread(poses, seed),
    }


def tested(name: str, direction: Any) -> dict[str, Any]:
    """The 5 N test at home in one direction."""
    found = load_test(HOME, direction)
    return {
        "force": name,
        "with_controller_mm": 1e3 * found.link,
        "without_mm": 1e3 * found.both,
        "reading_mm": 1e3 * found.reading,
        "with_controller_N_per_mm": 1e-3 * found.stiffness_with,
        "without_N_per_mm": 1e-3 * found.stiffness_without,
    }


def idler_row(i: int) -> dict[str, Any]:
    """Eq. (5) for one idler."""
    found = rating(IDLERS[i], Mechanics().idler_rating)
    return {
        "joint": found.idler.joint,
        "cable_of": found.idler.carries,
        "wrap_deg": float(np.degrees(found.idler.wrap)),
        "sign": found.idler.sign,
        "tension_N": found.tension,
        "at_deg": float(np.degrees(found.at)),
        "inside": found.inside,
        "ends_alone_N": found.ends,
    }


def spread(poses: int, seed: int) -> dict[str, float]:
    """Softest direction of frame 8 over random configurations, [N/mm]."""
    low, high = np.array(list(LIMITS.values())).T
    qs = np.random.default_rng(seed).uniform(low, high, (poses, 8))
    soft = []
    for q in qs:
        tube, cables = compliance(q)
        soft.append(1e-3 / np.linalg.eigvalsh((tube + cables)[:3, :3])[-1])
    return {
        "poses": poses,
        "least": float(min(soft)),
        "median": float(np.median(soft)),
        "most": float(max(soft)),
    }


def lines(found: dict[str, Any]) -> Iterator[str]:
    """What the study prints."""
    k = found["joint_stiffness"]
    yield "cables, motors held: " + ", ".join(
        f"{j} {1e-3 * v:.0f} N/mm" if j == "q8" else f"{j} {v:.1f} Nm/rad"
        for j, v in k.items()
    )
    yield "5 N at frame 8, home: with joint controller (tube), without (and cables)"
    for r in found["tests"]:
        yield (
            f"  {r['force']:7s}{r['with_controller_mm']:7.3f} mm "
            f"{r['without_mm']:7.3f} mm, +- {r['reading_mm']:.3f} by the dial;"
            f"{r['with_controller_N_per_mm']:8.2f} {r['without_N_per_mm']:8.2f} N/mm"
        )
    s = found["over_the_limits"]
    yield (
        f"softest direction over {s['poses']} configurations: {s['least']:.2f} to "
        f"{s['most']:.2f} N/mm, median {s['median']:.2f}"
    )
    yield "idlers: joint, cable of, wrap; tension allowed, where, by the ends alone"
    for r in found["idlers"]:
        yield (
            f"  {r['joint']} {r['cable_of']} {r['wrap_deg']:4.0f} {r['sign']:+.0f} deg:"
            f" {r['tension_N']:6.1f} N at {r['at_deg']:6.1f} deg"
            f"{' (inside)' if r['inside'] else ''}; ends {r['ends_alone_N']:.1f} N"
        )
    yield "transmission rated for " + ", ".join(
        f"{j} {v:.1f} N" if j == "q8" else f"{j} {v:.2f} Nm"
        for j, v in found["ratings"].items()
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    for line in lines(study(args.poses, args.seed)):
        print(line)


if __name__ == "__main__":
    main()
