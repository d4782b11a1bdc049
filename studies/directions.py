"""Maps of needle directions: how long, how much is undecided, and is all of it true.

    python -m studies.directions --samples 2000 --plans 200 --seed 1

Five targets in the CT gantry's torso, zerobot at mount +90. Three tables:

* time of a map and share that is undecided, by resolution and level of detail;
* directions drawn in the cells, a third at corners, held against 24 poses each by
  another road (own rays, the plan's own waypoints, exact contact with containment of
  all but needle and torso), ten a target by Pinocchio and Coal; and displacement
  bounds against points of the meshes;
* random plans: what `at` says against the certified path of `check --plan`.
"""

import argparse
import sys
import time

import numpy as np

import borecheck as bc
from borecheck.contact.check import check_with
from borecheck.contact.pose_batch import PoseBatch
from borecheck.contact.pose_book import FREE
from borecheck.contact.queries import queries
from borecheck.contact.settings import Settings
from borecheck.contact.skipped import pairs_without
from borecheck.directions.ask import directions, maps
from borecheck.directions.chart import Chart
from borecheck.directions.direction_map import DirectionMap
from borecheck.directions.leaves import IS_CLEAR, IS_CONTACT, IS_OUT
from borecheck.motion.joint_box import pairs_that_may_meet
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import UnreachableError, plan_motion
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

TARGETS = {
    "A": (0.0, 0.0, -0.05),
    "B": (0.05, 0.06, -0.08),
    "C": (-0.08, -0.05, -0.04),
    "D": (0.15, 0.0, -0.06),
    "E": (0.0, 0.1, -0.1),
}
RESOLUTIONS = (2.0, 1.0, 0.5, 0.25)
POSES = 8  # of the insertion; twice as many of the approach
Array = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=2000, help="of every state")
    parser.add_argument("--plans", type=int, default=200, help="for every target")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    times()
    rng = np.random.default_rng(options.seed)
    wrong = samples(options.samples, rng)
    wrong += bounds(max(options.samples // 20, 1), rng)
    wrong += plans(options.plans, rng)
    return 1 if wrong else 0


def times() -> None:
    """Prints the first table."""
    print("time of a map, CPU of one core, kernels warm; and undecided share")
    print(f"{'level':<7} {'target':<6}" + "".join(f"{r:>16g} deg" for r in RESOLUTIONS))
    for level in ("coarse", "middle"):
        robot = bc.load_robot("zerobot", mount="+90", level=level)
        scene = bc.load_scene("ct_gantry", level=level)
        start = time.process_time()
        left = pairs_that_may_meet(robot)
        itself = time.process_time() - start
        directions(robot, scene, TARGETS["B"], resolution="4deg")  # trees, kernels
        for name, target in TARGETS.items():
            cells = []
            for resolution in RESOLUTIONS:
                start = time.process_time()
                found = directions(robot, scene, target, resolution=f"{resolution}deg")
                spent = time.process_time() - start
                share = 100.0 * found.shares["undecided"]
                cells.append(f"{spent:>8.2f} s {share:>5.1f} %   ")
            print(f"{level:<7} {name:<6}" + "".join(cells), flush=True)
        start = time.process_time()
        next(iter(maps(robot, scene, TARGETS["B"], resolution="2deg")))
        first = time.process_time() - start
        print(
            f"{level}: first whole map of B {first:.2f} s; of {len(robot.self_pairs)} "
            f"own pairs {len(left)} not proven apart, {itself:.2f} s, once"
        )


def samples(count: int, rng: np.random.Generator) -> int:
    """Prints the second table; how many directions contradict their cell."""
    robot, scene = bc.load_robot("zerobot", mount="+90"), bc.load_scene("ct_gantry")
    asked = queries(robot, scene, skip=[("needle", "torso")])
    print(f"\ndirections in the cells of maps at 1 deg, {count} of each state")
    print("target      clear     contact         out     depth  oblique    by Coal")
    total = 0
    for name, target in TARGETS.items():
        found = directions(robot, scene, target, resolution="1deg")
        clear, cells = drawn(found, IS_CLEAR, count, rng)
        depth, oblique = rays(scene, found, clear)
        low, high = found.leaves.depth[cells].T
        off = ((depth < low) | (depth > high)).sum()
        flat, steep = found.leaves.obliquity[cells].T
        tilted = ((oblique < flat - 1e-9) | (oblique > steep + 1e-9)).sum()
        motions = [motion(found, n, d) for n, d in zip(clear, depth, strict=True)]
        bad = int(sum(asked.touches(poses(m)).any() for m in motions))
        slow = motions[:: max(1, len(motions) // 10)]
        coal = sum(touches_by_coal(robot, scene, poses(m)) for m in slow)
        met, cells = drawn(found, IS_CONTACT, count, rng)
        apart = len(met) - int(touching(found, met, cells))
        out, _ = drawn(found, IS_OUT, min(count, 500), rng)
        reached = sum(
            motion(found, n, d) is not None
            for n, d in zip(out, rays(scene, found, out)[0], strict=True)
        )
        print(
            f"{name:<6} {bad:>4} of {len(clear):<6}{apart:>4} of {len(met):<6}"
            f"{reached:>4} of {len(out):<5}{off:>6}{tilted:>9}{coal:>8} of {len(slow)}",
            flush=True,
        )
        total += bad + apart + reached + int(off) + int(tilted) + coal
    print(f"contradictions: {total}")
    return total


def drawn(
    found: DirectionMap, state: int, count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Directions in cells of a state by solid angle, a third at a corner; cells."""
    rows = np.flatnonzero(found.leaves.state == state)
    if not len(rows):
        return np.zeros((0, 3)), rows
    weight = found.solid_angle[rows] / found.solid_angle[rows].sum()
    cells = rng.choice(rows, count, p=weight)
    share = rng.uniform(0.0, 1.0, (count, 2))
    share[::3] = rng.integers(0, 2, (len(share[::3]), 2))
    low, high = found.leaves.low[cells], found.leaves.high[cells]
    return found.setup.chart.directions(low + share * (high - low)), cells


def rays(scene: Scene, found: DirectionMap, n: Array) -> tuple[Array, Array]:
    """Depth and obliquity where rays leave the torso, all triangles one by one."""
    (torso,) = [o.mesh for o in scene.obstacles if o.role == "patient"]
    a, b, c = (torso.corners[:, k] - found.target for k in range(3))
    normal = np.cross(b - a, c - a)
    unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    depth, oblique = np.zeros(len(n)), np.zeros(len(n))
    for k, ray in enumerate(-n):
        at = np.einsum("td,td->t", a, normal) / (normal @ ray)
        p = at[:, None] * ray
        sides = [
            np.einsum("td,td->t", np.cross(v - u, p - u), normal)
            for u, v in ((a, b), (b, c), (c, a))
        ]
        hit = np.flatnonzero((np.array(sides) >= -1e-18).all(axis=0) & (at > 0.0))
        last = hit[at[hit].argmax()]
        depth[k], oblique[k] = at[last], np.arccos(np.clip(unit[last] @ ray, -1, 1))
    return depth, oblique


def motion(found: DirectionMap, n: Array, depth: float) -> Array | None:
    """Waypoints of the plan along a direction; None out of reach."""
    plan = NeedlePlan("p", found.target - depth * n, found.target)
    try:
        return plan_motion(found.setup.robot, plan).waypoints
    except UnreachableError:
        return None


def poses(waypoints: Array | None) -> Array:
    """Poses of approach and insertion, (24, joints)."""
    assert waypoints is not None, "a clear direction is out of reach"
    first, second, third = waypoints
    approach = np.linspace(0.0, 1.0, 2 * POSES)[:, None]
    insertion = np.linspace(0.0, 1.0, POSES)[:, None]
    return np.concatenate(
        [first + approach * (second - first), second + insertion * (third - second)]
    )


def touching(found: DirectionMap, n: Array, cells: Array) -> int:
    """How many directions touch at the station of their cell's witness.

    Of a pose beyond limits, too: a map says contact and may leave reach open.
    """
    robot, scene = found.setup.robot, found.setup.scene
    pairs = pairs_without(robot, scene, (("needle", "torso"),), False)
    batch = PoseBatch(robot, scene, *pairs)
    chart = found.setup.chart
    q = chart.in_urdf(chart.own(chart.angles(n), found.leaves.station[cells]))
    placements = batch.placements(q)
    meets = batch.obstacles.first_contacts(placements)
    apart = np.flatnonzero(~meets)
    meets[apart] = (batch.held(placements[apart]) != FREE).any(axis=1)
    return int(meets.sum())


def touches_by_coal(robot: Robot, scene: Scene, qs: Array) -> bool:
    """Whether Coal, at Pinocchio's placements, sees contact or containment."""
    chosen = Settings(checker="coal", pair_by_pair=True)
    for q in qs[::6]:
        verdict = check_with(
            robot, scene, np.clip(q, robot.model.lower, robot.model.upper), chosen
        )
        others = [
            c for c in verdict.contacts if (c.link, c.obstacle) != ("needle", "torso")
        ]
        held = [
            c for c in verdict.contained if (c.link, c.obstacle) != ("needle", "torso")
        ]
        if others or held or verdict.self_contacts:
            return True
    return False


def bounds(cells: int, rng: np.random.Generator) -> int:
    """Prints how displacement bounds compare with points; how many are too small."""
    robot = bc.load_robot("zerobot", mount="+90")
    chart = Chart.of(robot, np.array(TARGETS["B"]))
    ratios: dict[str, list[Array]] = {}
    for _ in range(cells):
        half = np.radians(rng.uniform(0.2, 8.0, 2))
        centre = rng.uniform(chart.limits[0] + half, chart.limits[1] - half)
        offsets = np.vstack([[0, 0], [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)]])
        own = chart.own(
            centre + offsets * half, np.full(len(offsets), rng.uniform(0.0, 0.2))
        )
        q = chart.in_urdf(own)
        for k, part in enumerate(robot.parts):
            T = chart.place(k, q)
            at = part.mesh.vertices @ T[:, :3, :3].transpose(0, 2, 1)
            at = at + T[:, None, :3, 3]
            moved = np.linalg.norm(at - at[0], axis=2).max(axis=0)
            bound = chart.displacements(part.link, at[:1], own[:1], half[None])[0]
            if part.link != "base":
                ratios.setdefault(part.link, []).append(moved / bound)
    each = {link: np.concatenate(found) for link, found in ratios.items()}
    every = np.concatenate(list(each.values()))
    print(
        f"\ndisplacement bounds, {len(every):,} pairs of cell and point (9 places each)"
    )
    for link, found in each.items():
        print(f"  {link:<9} median {np.median(found):.2f} most {found.max():.3f}")
    above = int((every > 1.0 + 1e-9).sum())
    print(f"below the truth: {above}; bound/truth median {1.0 / np.median(every):.2f}")
    return above


def plans(count: int, rng: np.random.Generator) -> int:
    """Prints the third table; how many plans contradict the map."""
    robot, scene = bc.load_robot("zerobot", mount="+90"), bc.load_scene("ct_gantry")
    print(f"\nrandom plans, {count} a target: map at 0.5 deg against check --plan")
    seen: dict[tuple[str, str], int] = {}
    for target in TARGETS.values():
        found = directions(robot, scene, target, resolution="0.5deg")
        limits = found.setup.chart.limits
        n = found.setup.chart.directions(rng.uniform(*limits, (count, 2)))
        for direction, depth in zip(n, rays(scene, found, n)[0], strict=True):
            said = found.at(direction).state
            verdict = certified(robot, scene, found.target, direction, depth)
            seen[said, verdict] = seen.get((said, verdict), 0) + 1
        print(f"{sum(seen.values())} plans", end="\r", file=sys.stderr, flush=True)
    for (said, verdict), number in sorted(seen.items()):
        print(f"  map {said:<9} plan {verdict:<12} {number:>5}")
    agreeing = {
        ("clear", "clear"),
        ("contact", "contact"),
        ("contact", "unreachable"),
        ("out", "unreachable"),
    }
    wrong = sum(
        number
        for key, number in seen.items()
        if key not in agreeing and key[0] != "undecided"
    )
    reachable = sum(k for (_, v), k in seen.items() if v != "unreachable")
    unknown = sum(k for (_, v), k in seen.items() if v == "unknown")
    print(f"contradictions: {wrong}; unknown: {unknown} of {reachable} reachable plans")
    return wrong


def certified(
    robot: Robot,
    scene: Scene,
    target: Array,
    direction: Array,
    depth: float,
) -> str:
    """The verdict of the plan's motion at every instant."""
    plan = NeedlePlan("p", target - depth * direction, target)
    try:
        found = plan_motion(robot, plan)
    except UnreachableError:
        return "unreachable"
    return str(
        bc.check_path(
            robot, scene, found.waypoints, corridor=found.corridor, clearance=False
        ).verdict
    )


if __name__ == "__main__":
    sys.exit(main())
