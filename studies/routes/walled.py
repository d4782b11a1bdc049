"""Goals that no way reaches: they must be unknown in the stated time, never a path.

A small block stands where the link that the first joint alone moves would pass. Home is
on one side of it and the goal, between block and joint limit, on the other: at the
position in between this link touches the block whatever the other joints do, and every
way passes that position. That is asked of 20 configurations there, as the premise.

A second kind has no joint limits to lean on: a tool on three slides whose goal is in a
closed box. Half of the goals of either kind are given up by edges and half by seconds.
"""

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import borecheck as bc
from borecheck.contact.queries import queries
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.planning.route import NONE_FOUND, Route, route
from borecheck.robots.obstacle_files import Obstacle
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from studies.routes.goals import Array, progress, stands

GOALS = 10
MOST_EDGES = 300
SECONDS = 2.0
# The steps that the trees are at are ended first: so long on a busy machine.
LATE = 2.0
BLOCK = 0.02
# Poses at the position in between that must touch.
PREMISE = 20

TOOL = """<robot name='tool'><link name='base'/><link name='x'/><link name='y'/>
<link name='tool'><collision><geometry><box size='0.1 0.1 0.1'/></geometry></collision>
</link>{}</robot>"""
SLIDE = """<joint name='{child}_slide' type='prismatic'><parent link='{parent}'/>
<child link='{child}'/><axis xyz='{axis}'/>
<limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"""


@dataclass(frozen=True, eq=False)
class Walled:
    """A goal that cannot be reached, and a robot and scene in which that is so."""

    robot: Robot
    scene: Scene
    goal: Array


def run(goals: int, seed: int) -> int:
    """Prints a row for each robot; how many answers are wrong."""
    print("robot    goals unknown paths  late    worst")
    wrong = 0
    for name, cases in kinds(goals, seed):
        unknown, paths, late, worst = 0, 0, 0, 0.0
        for k, case in enumerate(cases):
            if k == 0:
                answer(case, k, 20)  # kernels are loaded
            seconds = SECONDS if k % 2 else None
            before = time.monotonic()
            found = answer(case, k, MOST_EDGES, seconds)
            took = time.monotonic() - before
            unknown += found.status == NONE_FOUND and found.verdict == "unknown"
            paths += found.found
            late += seconds is not None and took > seconds + LATE
            worst = max(worst, took)
            progress(f"{name} {k + 1}/{goals}")
        print(f"{name:<8} {goals:>5} {unknown:>7} {paths:>5} {late:>5} {worst:>6.2f} s")
        wrong += goals - unknown + late
    return wrong


def answer(
    case: Walled, seed: int, most_edges: int, seconds: float | None = None
) -> Route:
    """What `route` says of the way from home."""
    home = np.array(case.robot.home)
    return route(
        *(case.robot, case.scene, home, case.goal),
        seed=seed,
        most_edges=most_edges,
        most_seconds=seconds,
    )


def kinds(goals: int, seed: int) -> Iterator[tuple[str, Iterator[Walled]]]:
    """The installed robots behind their blocks, then the tool in its box."""
    rng = np.random.default_rng(seed)
    for robot, scene in stands():
        yield robot.name, (behind_block(robot, scene, rng) for _ in range(goals))
    yield "tool", (in_a_box(rng) for _ in range(goals))


def behind_block(robot: Robot, scene: Scene, rng: np.random.Generator) -> Walled:
    """A goal that the first joint cannot get to."""
    home, model = np.array(robot.home), robot.model
    part = next(p for p in robot.parts if moved_by(robot, p.link) == [0])
    while True:
        between, goal = rng.uniform(model.lower, model.upper, (2, len(home)))
        if not (home[0] - between[0]) * (goal[0] - between[0]) < 0.0:
            continue
        T = robot.placements(between)[part.link]
        corner = part.mesh.vertices[rng.integers(len(part.mesh.vertices))]
        at = T[:3, :3] @ corner + T[:3, 3]
        alone = queries(robot, with_block(nothing(), at), itself=False)
        if alone.touches([home, goal]).any():
            continue
        if bc.check(robot, scene, goal).clear:
            # the premise: whatever the other joints do, the block is touched there
            others = rng.uniform(model.lower, model.upper, (PREMISE, len(home)))
            others[:, 0] = between[0]
            assert alone.touches(others).all(), f"the block is passed at {others}"
            return Walled(robot, with_block(scene, at), goal)


def moved_by(robot: Robot, link: str) -> list[int]:
    """Which joints move a link."""
    home = np.array(robot.home)
    steps = home + 1e-3 * np.eye(len(home))
    T = robot.placements(home)[link]
    return [j for j, q in enumerate(steps) if (robot.placements(q)[link] != T).any()]


def with_block(scene: Scene, at: Array) -> Scene:
    """The scene with a block in it."""
    T = np.eye(4)
    T[:3, 3] = at
    mesh = place_mesh(T, box("block", [BLOCK] * 3))
    return scene.with_obstacles([Obstacle("block", "other", mesh, "the study")])


def nothing() -> Scene:
    """A scene without obstacles."""
    return replace(bc.load_scene("ct_gantry"), obstacles=())


def in_a_box(rng: np.random.Generator) -> Walled:
    """A tool on three slides whose goal is inside a closed hollow box."""
    links = ["base", "x", "y", "tool"]
    axes = ["1 0 0", "0 1 0", "0 0 1"]
    joints = [
        SLIDE.format(parent=a, child=b, axis=axis)
        for a, b, axis in zip(links, links[1:], axes, strict=False)
    ]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "tool.urdf"
        file.write_text(TOOL.format("".join(joints)))
        robot = bc.load_robot(file)
    goal = rng.uniform(0.4, 0.7, 3) * rng.choice([-1.0, 1.0], 3)
    return Walled(robot, closed_box(goal), goal)


def closed_box(about: Array) -> Scene:
    """Six plates about a place, 210 mm apart inside: the tool has room, and no door."""
    obstacles = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            size, T = np.full(3, 0.25), np.eye(4)
            size[axis] = 0.02
            T[:3, 3] = about
            T[axis, 3] += side * 0.115
            mesh = place_mesh(T, box("plate", size))
            obstacles.append(Obstacle("plate", "other", mesh, "the study"))
    return nothing().with_obstacles(obstacles)
