"""Ways of the installed robots between seeded goals: how many, how long they take.

    python -m studies.routes --goals 100 --seed 1

Goals are drawn within the limits until they are clear in the robot's own scanner with
its patient; the way goes from home to each. Every way found is searched once more, with
its margin. Ten goals in contact must be named, and a second run give the same bytes.
"""

import argparse
import sys
import time

import numpy as np

import borecheck as bc
from borecheck.planning.route import END_TOUCHES, NONE_FOUND, route

ROBOTS = ("zerobot", "mri_arm", "crane")
MOST_EDGES = 20_000


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--goals", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    wrong = 0
    print(
        f"{'robot':<8} {'goals':>5} {'found':>5} {'wrong':>5} {'median':>8} "
        f"{'95 %':>8} {'worst':>8} {'named':>8} {'same bytes':>10}"
    )
    for name in ROBOTS:
        wrong += row(name, options.goals, options.seed)
    return 1 if wrong else 0


def row(name: str, goals: int, seed: int) -> int:
    """Prints a robot's row; how many of its answers are wrong."""
    robot = bc.load_robot(name)
    scene = bc.load_scene(robot.description.scanner)
    rng = np.random.default_rng(seed)
    clear, touching = drawn(robot, scene, rng, goals)
    home = np.array(robot.home)
    route(robot, scene, home, clear[0])  # kernels are loaded
    seconds, found, wrong = [], 0, 0
    for k, goal in enumerate(clear):
        start = time.process_time()
        way = route(robot, scene, home, goal, seed=k, most_edges=MOST_EDGES)
        seconds.append(time.process_time() - start)
        found += way.found
        if way.found:
            again = bc.check_path(robot, scene, way.waypoints, clearance=False)
            wrong += not again.clear
        print(f"{name} {k + 1}/{goals}", end="\r", file=sys.stderr, flush=True)
    named = sum(
        route(robot, scene, home, goal).status == END_TOUCHES for goal in touching
    )
    same = same_bytes(robot, scene, home, clear[: max(1, goals // 10)])
    median, most, worst = np.quantile(seconds, [0.5, 0.95, 1.0])
    print(
        f"{name:<8} {goals:>5} {found:>5} {wrong:>5} {median:>6.2f} s {most:>6.2f} s "
        f"{worst:>6.2f} s {named:>3} of {len(touching):>2} {same:>10}"
    )
    return wrong + (len(touching) - named)


def drawn(robot, scene, rng, goals):  # type: ignore[no-untyped-def]
    """Goals that are clear, and ten that are not."""
    clear: list[np.ndarray] = []
    touching: list[np.ndarray] = []
    while len(clear) < goals or len(touching) < 10:
        for q in robot.model.random_configurations(rng, 50):
            (clear if bc.check(robot, scene, q).clear else touching).append(q)
    return clear[:goals], touching[:10]


def same_bytes(robot, scene, home, goals) -> str:  # type: ignore[no-untyped-def]
    """Whether a second run gives the same ways."""
    runs = [
        [route(robot, scene, home, goal, seed=k) for k, goal in enumerate(goals)]
        for _ in range(2)
    ]
    pairs = zip(*runs, strict=True)
    same = sum(
        (a.status == b.status == NONE_FOUND)
        or (a.found and b.found and a.waypoints.tobytes() == b.waypoints.tobytes())
        for a, b in pairs
    )
    return f"{same} of {len(goals)}"


if __name__ == "__main__":
    sys.exit(main())
