"""Certificates of motions of a robot in a scene, written from what the search said."""

from hashlib import sha256
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from borecheck.contact.verdict import CLEAR
from borecheck.errors import UsageError
from borecheck.motion.certificate import (
    certificate,
    corridor_record,
    write_certificate,
)
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.samples import Proof, checked_waypoints
from borecheck.motion.search import search
from borecheck.motion.turns import held_back, open_turns
from borecheck.motion.unseen import without_unseen
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene


def write_path_certificate(
    robot: Robot,
    scene: Scene,
    waypoints: ArrayLike,
    margin: float,
    file: Path,
    corridor: Corridor | None = None,
    plan: str = "",
    *,
    long_way: bool = False,
) -> None:
    """Writes what anyone needs to check again that a motion is clear.

    The file is JSON; beside it `<name>.npz` holds the meshes it speaks of.
    `borecheck verify` checks both, sharing no code with the search.

    Args:
        robot: The robot.
        scene: What stands around it.
        waypoints: Configurations, (k, n), [m] and [rad]; straight in each joint.
        margin: Required clearance to obstacles, [m].
        file: Where to write it.
        corridor: Where the needle may be in the patient, by a plan or for a path.
        plan: What the plan is called; empty for a path.
        long_way: See `check_path`.

    Raises:
        UsageError: The motion is not proven clear, or has no certificate of a size
            that anybody would check.
    """
    points = checked_waypoints(robot, waypoints)
    turns = None if long_way else open_turns(robot.model, points)
    problem = path_problem(robot, scene, margin, corridor)
    outcome = search(problem, points)
    if turns is not None:
        outcome = held_back(outcome, turns, None)
    outcome = without_unseen(scene, problem, points, outcome)
    proof = Proof(problem, points, outcome, corridor)
    write_certificate_of(proof, robot, scene, file, plan)


def write_certificate_of(
    proof: Proof, robot: Robot, scene: Scene, file: Path, plan: str = ""
) -> None:
    """Writes the certificate of a motion that was searched already.

    Args:
        proof: Of a `MotionVerdict`.
        robot: The robot it is about.
        scene: What stands around it.
        file: Where to write it.
        plan: Of a needle plan: what it is called.

    Raises:
        UsageError: As in `write_path_certificate`.
    """
    if proof.outcome.verdict != CLEAR:
        raise UsageError(f"there is no certificate to write: {proof.outcome.reason}")
    about = about_what(robot, scene, proof.corridor, plan)
    document = certificate(proof.problem, proof.waypoints, proof.outcome, about)
    if document is None:
        raise UsageError(
            "there is no certificate to write: a surface is open, or the motion passes "
            "so near that thousands of intervals would be needed"
        )
    write_certificate(file, document, proof.problem)


def about_what(
    robot: Robot, scene: Scene, corridor: Corridor | None, plan: str
) -> dict[str, Any]:
    """What a certificate is called: names of robot, scene and plan.

    A corridor without a plan's name is a path's.
    """
    about: dict[str, Any] = {
        "robot": {
            "name": robot.name,
            "arguments": dict(robot.arguments),
            "urdf_sha256": sha256(robot.urdf_text.encode()).hexdigest(),
        },
        "scene": {"name": scene.name, "arguments": dict(scene.arguments)},
    }
    if corridor is not None and plan:
        about["plan"] = {"name": plan, **corridor_record(corridor)}
    elif corridor is not None:
        about["corridor"] = corridor_record(corridor)
    return about
