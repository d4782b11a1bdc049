"""Certificates held against the files they are about: robot, scene, and path or plan.

The verifier by itself knows a certificate and nothing else. Here robot, scene and
motion are rebuilt from their files, as `check` does, and what a certificate of them
must state is handed to it: `verify.binding` compares.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import BorecheckError, UsageError
from borecheck.motion.certificate import bodies_of, statement
from borecheck.motion.certify import about_what
from borecheck.motion.needle_motion import needle_motion
from borecheck.motion.problem import PathProblem, path_motion
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.samples import checked_waypoints
from borecheck.motion.search import search
from borecheck.motion.turns import open_turns
from borecheck.motion.unseen import without_unseen
from borecheck.plans.corridor import Corridor
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_file import given_plans
from borecheck.plans.plan_motion import PlanMotion, has_closed_form, motion_of_plan
from borecheck.robots.given import length
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.verify.binding import Expected
from borecheck.verify.check import Expect
from borecheck.verify.check import verify as verify_alone
from borecheck.verify.fields import Rejected
from borecheck.verify.reading import Meshes
from borecheck.verify.verification import Verification

Array = NDArray[np.float64]

# The chain and Pinocchio place the links alike up to this, [m] and per unit of a row.
SAME_PLACEMENT = 1e-9
# Waypoints at which that is asked, at most.
MOST_ASKED = 200

NOT_KNOWN = (
    "whether the files are those of the robot, scanner and patient that are there",
)


def verify(
    certificate: str | Path | Mapping[str, Any],
    robot: Robot | None = None,
    scene: Scene | None = None,
    *,
    waypoints: ArrayLike | None = None,
    plans: NeedlePlan | Sequence[NeedlePlan] | str | Path | None = None,
    corridor: Corridor | None = None,
    margin: float | str = 0.0,
    meshes: Meshes | None = None,
) -> Verification:
    """Checks a path certificate again, by code that shares nothing with the search.

    With robot, scene and a motion it is bound to them: every mesh, joint, pair, margin
    and waypoint must be theirs. Without them it is checked by itself, and
    `Verification.not_known` says what cannot be known then.

    Args:
        certificate: A file, or its content.
        robot: From `load_robot`.
        scene: From `load_scene`.
        waypoints: The path it should be of, (k, n), [m] and [rad].
        plans: The needle plans of which it should be one, or their file; it is told by
            its name.
        corridor: Of a path: where its needle may be in the patient.
        margin: The clearance it should show, [m] or "5mm". Asked for only when bound.
        meshes: The `.npz` file with its meshes, or arrays (vertices, triangles); by
            default the file beside the certificate.

    Returns:
        Whether it holds, and if not, why not. Nothing of a certificate is raised.

    Raises:
        UsageError: Some of robot, scene and motion are missing, path and plans are
            both given, or a corridor without a path.
        JointLimitError: A waypoint beyond a joint limit.
    """
    if corridor is not None and waypoints is None:
        raise UsageError("a corridor goes with waypoints; a plan has its own")
    margin = length(margin, "margin")
    if all(one is None for one in (robot, scene, waypoints, plans)):
        return verify_alone(certificate, meshes)
    expect: Expect
    if robot is not None and scene is not None and waypoints is None and plans:
        some = given_plans(plans)
        expect = partial(_of_plan, robot, scene, some, margin)
    elif robot is not None and scene is not None and waypoints is not None:
        if plans is not None:
            raise UsageError("a certificate is of a path or of a plan: give one")
        points = checked_waypoints(robot, waypoints)
        expect = partial(_of_path, robot, scene, points, margin, corridor)
    else:
        raise UsageError(
            "to bind a certificate give robot, scene, and either waypoints or plans"
        )
    return verify_alone(certificate, meshes, expect)


def _of_path(
    robot: Robot,
    scene: Scene,
    points: Array,
    margin: float,
    corridor: Corridor | None,
    stated: Mapping[str, Any],
) -> Expected:
    about = stated.get("about", {})
    if "plan" in about:
        raise Rejected("is of a needle plan, not of a path: give --plan")
    if "corridor" in about and corridor is None:
        raise Rejected("lets a needle enter a patient: give --needle and --corridor")
    return expected(robot, scene, points, margin, corridor)


def _of_plan(
    robot: Robot,
    scene: Scene,
    plans: Sequence[NeedlePlan],
    margin: float,
    stated: Mapping[str, Any],
) -> Expected:
    """What the plan of the certificate's own name asks for."""
    named = stated.get("about", {}).get("plan")
    if named is None:
        raise Rejected("is of a path, not of a needle plan: give --path")
    chosen = [plan for plan in plans if plan.name == named["name"]]
    if len(chosen) != 1:
        raise Rejected(f"its plan {named['name']} is not one of those given")
    try:
        motion = _motion_of(robot, scene, chosen[0], stated)
    except BorecheckError as error:
        raise Rejected(f"its plan cannot be driven: {error}") from error
    points, corridor = motion.waypoints, motion.corridor
    return expected(robot, scene, points, margin, corridor, chosen[0].name)


def _motion_of(
    robot: Robot, scene: Scene, plan: NeedlePlan, stated: Mapping[str, Any]
) -> PlanMotion:
    """The plan's motion: rebuilt by a closed form, else the stated one, held to it.

    What a search finds differs by the last digits from machine to machine, and of many
    ways along the line any is the plan's. So the stated waypoints are asked themselves:
    by the URDF the needle must follow the plan's line at every instant, within limits.
    """
    if has_closed_form(robot):
        return needle_motion(robot, scene, plan)
    points = checked_waypoints(robot, stated["waypoints"])
    try:
        return motion_of_plan(robot, plan, points)
    except UsageError as error:
        raise Rejected(f"its motion is not that of plan {plan.name}: {error}") from None


def expected(
    robot: Robot,
    scene: Scene,
    points: Array,
    margin: float,
    corridor: Corridor | None = None,
    plan: str = "",
) -> Expected:
    """What a certificate of a motion must state, rebuilt from robot and scene.

    Args:
        robot: The robot.
        scene: What stands around it.
        points: Waypoints, checked, (k, n).
        margin: Required clearance to obstacles, [m].
        corridor: Where the needle may be in the patient, by a plan or for a path.
        plan: What the plan is called; empty for a path.
    """
    problem = path_problem(robot, scene, margin, corridor)
    about = about_what(robot, scene, corridor, plan)
    motion = f"plan {plan}" if plan else f"path of {len(points)}"
    motion += " with a corridor" if corridor is not None and not plan else ""
    meshes = {
        body.mesh.sha256: (body.mesh.vertices, body.mesh.triangles)
        for body in bodies_of(problem)
    }
    turns = open_turns(robot.model, points)
    taken = () if turns is None else (turns.taken,)
    return Expected(
        f"{robot.name} in {scene.name}, {motion}, margin {1e3 * margin:g} mm",
        statement(problem, points, about),
        meshes,
        problem.doubt
        or _unseen(scene, problem, points)
        or _other_kinematics(robot, problem, points),
        (*NOT_KNOWN, *taken),
    )


def _unseen(scene: Scene, problem: PathProblem, points: Array) -> str | None:
    """Why the motion is not clear where part of a patient was not seen, if it is not.

    A certificate speaks of surfaces as they are: which of them were assumed beyond a
    scan, only the scene knows.
    """
    if not scene.unseen:
        return None
    found = without_unseen(scene, problem, points, search(problem, points))
    return None if found.clear else found.reason


def _other_kinematics(robot: Robot, problem: PathProblem, points: Array) -> str | None:
    """Whether the chain places a link elsewhere than Pinocchio does; which."""
    motion = path_motion(problem, points)
    asked = np.linspace(0, len(points) - 1, min(len(points), MOST_ASKED))
    for k in asked.astype(int):
        placed = motion.place(problem.chain, float(k))
        others = robot.placements(points[k])
        for part, body in zip(robot.parts, problem.parts, strict=True):
            off = float(np.abs(placed[body.frame] - others[part.link]).max())
            if not off <= SAME_PLACEMENT:
                return f"{part.link}: chain and Pinocchio place it {off:.1e} apart"
    return None
