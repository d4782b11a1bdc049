"""CRANE's set-ups, seeded: the grid's beside branch and bound's, and its soundness.

    python -m studies.setup --targets 6 --seed 1

Targets are places of the torso's skin that face up, needles square to it and tilted
by up to 30 deg, in a bore of 70 cm. For each the grid's cost and time, then the proven
bound, gap, boxes and time; CPU seconds of one core. Then random configurations within
random boxes are held against what was said of the boxes. Solver `paper` (SHGO) is not
among them.
"""

import argparse
import time

import numpy as np
from numpy.typing import NDArray

import borecheck as bc
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.robots.scene import Scene
from borecheck.setup.answer import Setup
from borecheck.setup.boxes import Boxes
from borecheck.setup.family import family_of, rotated
from borecheck.setup.requirements import Requirements
from borecheck.setup.solve import Effort, one_setup
from borecheck.setup.terms import CONE, NOTHING, Terms

Array = NDArray[np.float64]
MOST_TILT = np.radians(30.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--targets", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--gap", type=float, default=0.2)
    parser.add_argument("--boxes", type=int, default=20_000)
    parser.add_argument("--points", type=int, default=4000, help="in random boxes")
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    scene = bc.load_scene("ct_gantry", bore="0.70", level="middle")
    terms = Terms(bc.load_robot("crane"), scene, Requirements())
    plans = targets(scene, args.targets, rng)
    one_setup(terms, plans[0])  # kernels and trees are there
    effort = Effort(args.gap, args.boxes)
    one_setup(terms, plans[0], "proven", Effort(10.0, 1))  # fields, witnesses
    print("target   grid f   CPU s   proven f  bound    gap    boxes  CPU s  status")
    below = 0
    for plan in plans:
        fast, fast_s = timed(terms, plan, "grid", effort)
        best, best_s = timed(terms, plan, "proven", effort)
        if fast.cost is not None and best.status == "unreachable":
            below += 1
        if fast.cost is not None and best.lower_bound is not None:
            below += fast.cost < best.lower_bound
        cells = [_told(v) for v in (best.cost, best.lower_bound, best.gap)]
        print(
            f"{plan.name:8} {_told(fast.cost)} {fast_s:7.2f}  {' '.join(cells)} "
            f"{best.boxes:7} {best_s:6.2f}  {best.status}",
            flush=True,
        )
    print(f"answers of the grid below the proven bound, or where none is: {below}")
    wrong, asked = violations(terms, plans, args.points, rng)
    print(f"configurations in random boxes that contradict them: {wrong} of {asked}")


def targets(scene: Scene, count: int, rng: np.random.Generator) -> list[NeedlePlan]:
    """Needles at random places of the patient that face up."""
    torso = next(o.mesh for o in scene.obstacles if o.role == "patient")
    corners = torso.corners
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    middles = corners.mean(axis=1)
    up = np.flatnonzero((normals[:, 2] > 0.7) & (np.abs(middles[:, 0]) < 0.15))
    found = []
    for k, face in enumerate(rng.choice(up, count, replace=False)):
        n = -normals[face]
        side = np.cross(n, rng.normal(size=3))
        turn = rng.uniform(0.0, MOST_TILT) * side / np.linalg.norm(side)
        aim = rotated(turn[None], n)[0]
        entry = middles[face] - 1e-3 * n
        found.append(NeedlePlan(f"t{k}", entry, entry + 0.03 * aim))
    return found


def timed(
    terms: Terms, plan: NeedlePlan, solver: str, effort: Effort
) -> tuple[Setup, float]:
    start = time.process_time()
    answer = one_setup(terms, plan, solver, effort)
    return answer, time.process_time() - start


def violations(
    terms: Terms, plans: list[NeedlePlan], count: int, rng: np.random.Generator
) -> tuple[int, int]:
    """Configurations that keep all in a box closed, or cost less than its bound."""
    wrong = asked = 0
    for plan in plans:
        family = family_of(terms.robot, plan.length)
        x = rng.uniform(family.lower, family.upper, (count, 3))
        qs = family.configurations(plan.entry, plan.direction, x)
        good = terms.broken(qs) == NOTHING
        x, qs = x[good], qs[good]
        half = 10.0 ** rng.uniform(-3.0, -0.5, (len(x), 3)) * (1.0, 1.0, 0.05)
        middles = x + rng.uniform(-1.0, 1.0, x.shape) * half
        said = Boxes(terms, family, plan).judge(middles, half, np.inf)
        costs = terms.costs(qs, 0.0).total
        closed = (said.against != NOTHING) & (said.against != CONE)
        wrong += int((closed | (said.least > costs)).sum())
        asked += len(x)
    return wrong, asked


def _told(value: float | None) -> str:
    return f"{value:8.3f}" if value is not None else "       -"


if __name__ == "__main__":
    main()
