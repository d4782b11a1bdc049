"""Certified ways placed a thousand times finer by Pinocchio, their distances by Coal.

Ways from home to seeded goals, of each robot in its scanner. A thousand instants of
every edge, and around the least ones a thousand times finer again, as in the study of
resampled motions: nothing may touch, and nothing come nearer than the certified least
clearance.
"""

import numpy as np

from borecheck.motion.least_clearance import least_clearance
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.search import search
from borecheck.planning.route import route
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from studies.resampled_motions import ROUNDING, Case, Oracle
from studies.routes.goals import Array, drawn, progress, stands

GOALS = 12


def run(goals: int, seed: int) -> int:
    """Prints a row for each robot; how many of its ways are wrong."""
    print(
        f"{'robot':<8} {'ways':>5} {'edges':>5} {'instants':>9} {'contacts':>8} "
        f"{'nearer':>6} {'certified below resampled':>25}"
    )
    return sum(row(robot, scene, goals, seed) for robot, scene in stands())


def row(robot: Robot, scene: Scene, goals: int, seed: int) -> int:
    """Prints a robot's row; how many of its ways are wrong."""
    rng = np.random.default_rng(seed)
    clear, _ = drawn(robot, scene, rng, goals)
    ways, edges, instants, contacts, nearer = 0, 0, 0, 0, 0
    below: list[float] = []
    for k, goal in enumerate(clear):
        found = route(robot, scene, np.array(robot.home), goal, seed=k)
        progress(f"{robot.name} {k + 1}/{goals}")
        if found.waypoints is None:
            continue
        certified, oracle = judged(robot, scene, found.waypoints)
        least = oracle.least()
        ways, edges = ways + 1, edges + len(found.waypoints) - 1
        contacts += oracle.touching or oracle.self_contact()
        nearer += certified > least + ROUNDING
        instants += oracle.instants
        if least > 0.0:
            below.append(1.0 - certified / least)
    share = f"{np.median(below):.1%} median, {max(below):.1%}" if below else "none"
    print(
        f"{robot.name:<8} {ways:>5} {edges:>5} {instants:>9} {contacts:>8} "
        f"{nearer:>6} {share:>25}",
        flush=True,
    )
    return contacts + nearer


def judged(robot: Robot, scene: Scene, way: Array) -> tuple[float, Oracle]:
    """The certified least clearance of a way, [m], and what resamples it."""

    def place(qs: Array) -> Array:
        every = (robot.placements(q) for q in qs)
        return np.array([[T[part.link] for part in robot.parts] for T in every])

    problem = path_problem(robot, scene)
    outcome = search(problem, way)
    assert outcome.certified, outcome.reason
    least = least_clearance(problem, way, outcome)
    certified = 0.0 if least is None else least.lower
    return certified, Oracle(Case(robot.name, problem, way, place))
