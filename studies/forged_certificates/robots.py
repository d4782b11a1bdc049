"""Certificates of the published robots: needle plans and paths, moved at random."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import borecheck as bc
from borecheck.errors import BorecheckError
from borecheck.motion.binding import expected
from borecheck.motion.certificate import bodies_of, certificate
from borecheck.motion.certify import about_what
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.search import search
from borecheck.plans.corridor import Corridor
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_file import read_plans
from borecheck.plans.plan_motion import plan_motion
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.verify.check import Expect

Array = NDArray[np.float64]
Found = tuple[dict[str, Any], list[Any], Expect]

PLANS = (
    ("zerobot", "ct_gantry", Path("urdf/zerobot/examples/plans.csv")),
    ("mri_arm", "mri_open_magnet", Path("urdf/mri_arm/examples/plans.csv")),
)


def robots_certificates(rng: np.random.Generator, count: int) -> Iterator[Found]:
    """So many certificates: plans with their targets moved, and paths beside home."""
    found = 0
    while found < count:
        for name, scanner, file in PLANS:
            robot, scene = bc.load_robot(name), bc.load_scene(scanner)
            plans = read_plans(file)
            plan = plans[int(rng.integers(len(plans)))]
            made = _of_plan(rng, robot, scene, plan) or _of_path(rng, robot, scene)
            if made is not None and found < count:
                found += 1
                yield made


def _of_plan(
    rng: np.random.Generator, robot: Robot, scene: Scene, plan: NeedlePlan
) -> Found | None:
    moved = replace(plan, target=plan.target + rng.normal(0.0, 2e-3, 3))
    try:
        motion = plan_motion(robot, moved)
    except BorecheckError:
        return None
    return _certified(robot, scene, motion.waypoints, motion.corridor, plan.name)


def _of_path(rng: np.random.Generator, robot: Robot, scene: Scene) -> Found | None:
    steps = rng.normal(0.0, 0.02, (2, len(robot.home)))
    points = np.clip(robot.home + steps, robot.model.lower, robot.model.upper)
    return _certified(robot, scene, np.stack([robot.home, *points]), None, "")


def _certified(
    robot: Robot, scene: Scene, points: Array, corridor: Corridor | None, plan: str
) -> Found | None:
    problem = path_problem(robot, scene, 0.0, corridor)
    outcome = search(problem, points)
    about = about_what(robot, scene, corridor, plan)
    document = certificate(problem, points, outcome, about)
    if document is None:
        return None
    meshes = [(b.mesh.vertices, b.mesh.triangles) for b in bodies_of(problem)]
    rebuilt = expected(robot, scene, points, 0.0, corridor, plan)
    return document, meshes, lambda stated: rebuilt
