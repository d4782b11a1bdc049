"""Is a motion clear at every instant: robots and scenes handed to the certified search.

`motion.search` knows frames and surfaces only. Here a robot's joints become its chain,
its parts and the scene's obstacles become bodies, and needle and patient become a
passage: they may touch within the plan's corridor, and nowhere else.
"""

from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.check import Settings
from borecheck.contact.margin import OFFSET
from borecheck.contact.verdict import CLEAR, CONTACT, UNKNOWN
from borecheck.errors import UsageError
from borecheck.motion.bounds import FIXED, SLIDES, TURNS, WORLD, Chain
from borecheck.motion.outcome import PathVerdict
from borecheck.motion.problem import Body, Passage, PathProblem
from borecheck.motion.samples import (
    DEFAULT_SAMPLES,
    Interval,
    MotionVerdict,
    Progress,
    checked_waypoints,
    sample_motion,
)
from borecheck.motion.search import search
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

# Only these ask for the true distance, which is what the certificate bounds.
CERTIFIABLE = ("exact", "two-sided")


def check_path(
    robot: Robot, scene: Scene, waypoints: ArrayLike, margin: float = 0.0
) -> PathVerdict:
    """The verdict for every instant of a motion, straight between waypoints.

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        waypoints: Configurations, (k, n), [m] and [rad].
        margin: Required clearance to obstacles, [m].

    Raises:
        JointLimitError: A waypoint beyond a joint limit.
        UsageError: No waypoint, or a margin that is none.
    """
    points = checked_waypoints(robot, waypoints)
    return search(path_problem(robot, scene, margin), points)


def path_problem(
    robot: Robot,
    scene: Scene,
    margin: float = 0.0,
    corridor: Corridor | None = None,
) -> PathProblem:
    """Robot and scene as the certified search sees them.

    With a corridor, needle and patient are a passage: they may touch in it alone.
    """
    frame_of, chain = chain_of(robot)
    parts = tuple(
        Body(part.mesh.name, part.mesh, frame_of[part.link]) for part in robot.parts
    )
    obstacles = tuple(Body(o.name, o.mesh, role=o.role) for o in scene.obstacles)
    passages = tuple(
        Passage(i, j, corridor)
        for i, part in enumerate(robot.parts)
        for j, obstacle in enumerate(scene.obstacles)
        if corridor is not None and robot.may_enter(part.link, obstacle.role)
    )
    return PathProblem(
        chain,
        parts,
        obstacles,
        robot.self_pairs,
        margin,
        passages=passages,
        allowed=_allowed(robot),
        doubt=scene.doubt,
    )


def _allowed(robot: Robot) -> tuple[tuple[int, int, str], ...]:
    """Pairs of parts whose links may touch by the robot's description."""
    reasons = {frozenset((a, b)): reason for a, b, reason in robot.allowed_contacts}
    links = [part.link for part in robot.parts]
    return tuple(
        (i, j, reasons[frozenset((links[i], links[j]))])
        for j in range(len(links))
        for i in range(j)
        if frozenset((links[i], links[j])) in reasons
    )


def chain_of(robot: Robot) -> tuple[dict[str, int], Chain]:
    """Frame number of every link, and the chain; the root stands fixed in the scene."""
    model = robot.model
    below: dict[str, list[int]] = {}
    for index, joint in enumerate(model.tree.joints):
        below.setdefault(joint.parent, []).append(index)
    root = model.tree.root.name
    frame_of = {root: 0}
    rows: list[tuple[int, Array, int, Array, int, float, float]] = [
        (WORLD, robot.T_scene_root, FIXED, np.array([1.0, 0.0, 0.0]), -1, 1.0, 0.0)
    ]
    waiting = [root]
    while waiting:
        link = waiting.pop(0)
        for index in below.get(link, ()):
            joint = model.tree.joints[index]
            frame_of[joint.child] = len(rows)
            source, factor, offset = model.driver(joint.name, joint.type)
            kind = {"fixed": FIXED, "prismatic": SLIDES}.get(joint.type, TURNS)
            row = (frame_of[link], joint.origin, kind, joint.axis)
            rows.append((*row, source, factor, offset))
            waiting.append(joint.child)
    parent, origin, kinds, axis, source_, factors, offsets = zip(*rows, strict=True)
    return frame_of, Chain(
        np.array(parent),
        np.array(origin),
        np.array(kinds),
        np.array(axis),
        np.array(source_),
        np.array(factors),
        np.array(offsets),
    )


def check_motion(
    robot: Robot,
    scene: Scene,
    waypoints: ArrayLike,
    chosen: Settings,
    *,
    corridor: Corridor | None = None,
    samples: int = DEFAULT_SAMPLES,
    certify: bool = True,
    progress: Progress | None = None,
) -> MotionVerdict:
    """The verdict for a motion: samples first, then every instant between them.

    Args:
        robot: The robot.
        scene: What stands around it.
        waypoints: Configurations, (k, n), [m] and [rad]; straight in each joint.
        chosen: Checker, pruning, margin.
        corridor: Where the needle may be in the patient.
        samples: How many configurations are looked at, waypoints included.
        certify: Whether to ask for a certificate between the samples.
        progress: Called with samples done and in all.

    Raises:
        UsageError: No waypoint, or one of the wrong length.
        JointLimitError: A waypoint beyond a joint limit.
    """
    points = checked_waypoints(robot, waypoints)
    sampled = sample_motion(
        robot,
        scene,
        points,
        chosen,
        corridor=corridor,
        samples=samples,
        progress=progress,
    )
    if not certify or sampled.verdict == CONTACT or len(points) == 1:
        return sampled
    return certified(robot, scene, points, chosen, corridor, sampled)


def certified(
    robot: Robot,
    scene: Scene,
    points: Array,
    chosen: Settings,
    corridor: Corridor | None,
    sampled: MotionVerdict,
) -> MotionVerdict:
    """What the samples said, with what can be certified between them.

    Args:
        robot: The robot.
        scene: What stands around it.
        points: Waypoints, checked, (k, n).
        chosen: Checker and margin; others than exact and two-sided with a true
            distance stay sampled.
        corridor: Where the needle may be in the patient.
        sampled: The verdict of the samples, without contact.
    """
    if chosen.checker not in CERTIFIABLE or chosen.margin.kind != OFFSET:
        return sampled
    problem = path_problem(robot, scene, chosen.margin.size, corridor)
    outcome = search(problem, points)
    first = outcome.first_contact
    clear = outcome.verdict == CLEAR and all(p.verdict == CLEAR for p in sampled.poses)
    verdict = outcome.verdict if outcome.verdict != CLEAR or clear else UNKNOWN
    reason = outcome.reason if verdict == outcome.verdict else sampled.reason
    if verdict == CLEAR:
        reason = f"{outcome.reason}; {sampled.poses[sampled.worst].reason}"
    return replace(
        sampled,
        verdict=verdict,
        reason=reason,
        qualifiers=outcome.qualifiers,
        certified=clear,
        intervals=tuple(Interval(s.start, s.end, s.verdict) for s in outcome.intervals),
        first_contact=first[0] if first and verdict == CONTACT else None,
        not_covered=_left_out(problem),
    )


def write_path_certificate(
    robot: Robot,
    scene: Scene,
    waypoints: ArrayLike,
    margin: float,
    file: Path,
    corridor: Corridor | None = None,
    plan: str = "",
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
        corridor: Of a needle plan: where the needle may be in the patient.
        plan: What that plan is called.

    Raises:
        UsageError: The motion is not proven clear, or has no certificate of a size
            that anybody would check.
    """
    from borecheck.motion.certificate import certificate, write_certificate

    points = checked_waypoints(robot, waypoints)
    problem = path_problem(robot, scene, margin, corridor)
    outcome = search(problem, points)
    if outcome.verdict != CLEAR:
        raise UsageError(f"there is no certificate to write: {outcome.reason}")
    about = about_what(robot, scene, corridor, plan)
    document = certificate(problem, points, outcome, about)
    if document is None:
        raise UsageError(
            "there is no certificate to write: a surface is open, or the motion passes "
            "so near that thousands of intervals would be needed"
        )
    write_certificate(file, document, problem)


def about_what(
    robot: Robot, scene: Scene, corridor: Corridor | None, plan: str
) -> dict[str, Any]:
    """What a certificate is called: names of robot, scene and plan."""
    from borecheck.motion.certificate import corridor_record

    about: dict[str, Any] = {
        "robot": {
            "name": robot.name,
            "arguments": dict(robot.arguments),
            "urdf_sha256": sha256(robot.urdf_text.encode()).hexdigest(),
        },
        "scene": {"name": scene.name, "arguments": dict(scene.arguments)},
    }
    if corridor is not None:
        about["plan"] = {"name": plan, **corridor_record(corridor)}
    return about


def _left_out(problem: PathProblem) -> tuple[str, ...]:
    """The pairs that nothing was asked about."""
    return tuple(
        f"{problem.parts[i].name} and {problem.obstacles[j].name}: not examined"
        for i, j in sorted(problem.excluded)
    )
