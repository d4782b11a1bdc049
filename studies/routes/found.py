"""Ways from home to clear goals: how many are found, how long they take.

Every way found is searched once more. Ten goals in contact must be named, with the pair
that touches, and a second run give the same bytes.
"""

import time
from collections.abc import Sequence

import numpy as np

import borecheck as bc
from borecheck.planning.route import END_TOUCHES, NONE_FOUND, route
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from studies.routes.goals import Array, drawn, progress, stands

GOALS = 100


def run(goals: int, seed: int) -> int:
    """Prints a row for each robot; how many answers are wrong."""
    print(
        f"{'robot':<8} {'goals':>5} {'found':>5} {'wrong':>5} {'median':>8} "
        f"{'95 %':>8} {'worst':>8} {'named':>8} {'same bytes':>10}"
    )
    return sum(row(robot, scene, goals, seed) for robot, scene in stands())


def row(robot: Robot, scene: Scene, goals: int, seed: int) -> int:
    """Prints a robot's row; how many of its answers are wrong."""
    rng = np.random.default_rng(seed)
    clear, touching = drawn(robot, scene, rng, goals)
    home = np.array(robot.home)
    route(robot, scene, home, clear[0])  # kernels are loaded
    seconds, found, wrong = [], 0, 0
    for k, goal in enumerate(clear):
        start = time.process_time()
        way = route(robot, scene, home, goal, seed=k)
        seconds.append(time.process_time() - start)
        found += way.found
        if way.found:
            again = bc.check_path(robot, scene, way.waypoints, clearance=False)
            wrong += not again.clear
        progress(f"{robot.name} {k + 1}/{goals}")
    not_named = sum(not named(robot, scene, home, goal) for goal in touching)
    same = same_bytes(robot, scene, home, clear[: max(1, goals // 10)])
    median, most, worst = np.quantile(seconds, [0.5, 0.95, 1.0])
    print(
        f"{robot.name:<8} {goals:>5} {found:>5} {wrong:>5} {median:>6.2f} s "
        f"{most:>6.2f} s {worst:>6.2f} s {len(touching) - not_named:>3} of "
        f"{len(touching):>2} {same:>10}"
    )
    return wrong + not_named


def named(robot: Robot, scene: Scene, home: Array, goal: Array) -> bool:
    """Whether a goal in contact is said to be, with a pair that does touch there."""
    found = route(robot, scene, home, goal)
    verdict = bc.check(robot, scene, goal)
    touching = (*verdict.contacts, *verdict.self_contacts, *verdict.contained)
    return (
        found.status == END_TOUCHES
        and found.reason.startswith("the goal touches: ")
        and any(c.link in found.reason and c.obstacle in found.reason for c in touching)
    )


def same_bytes(robot: Robot, scene: Scene, home: Array, goals: Sequence[Array]) -> str:
    """Whether a second run gives the same ways."""
    runs = [
        [route(robot, scene, home, goal, seed=k) for k, goal in enumerate(goals)]
        for _ in range(2)
    ]
    same = 0
    for a, b in zip(*runs, strict=True):
        if a.waypoints is None or b.waypoints is None:
            same += a.status == b.status == NONE_FOUND
        else:
            same += a.waypoints.tobytes() == b.waypoints.tobytes()
    return f"{same} of {len(goals)}"
