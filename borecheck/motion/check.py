"""Is a motion clear at every instant, and how near does it come: what users ask.

Samples find contact and give curves to look at; `clear` and the least clearance come
from the certified search alone (`motion.search`, `motion.least_clearance`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.margin import OFFSET
from borecheck.contact.settings import Settings
from borecheck.contact.verdict import CLEAR, CONTACT, UNKNOWN, Answer, Verdict
from borecheck.motion.halves import (
    about_itself,
    about_obstacles,
    answers_of,
    only_itself,
    searched,
    without_itself,
)
from borecheck.motion.least_clearance import Tolerance, least_clearance
from borecheck.motion.outcome import PathVerdict
from borecheck.motion.problem import PathProblem
from borecheck.motion.robot_problem import left_out, path_problem
from borecheck.motion.samples import (
    DEFAULT_SAMPLES,
    Interval,
    MotionVerdict,
    Progress,
    Proof,
    checked_waypoints,
    sample_motion,
)
from borecheck.motion.search import search
from borecheck.motion.turns import OpenTurns, held_back, open_turns
from borecheck.motion.unseen import without_unseen
from borecheck.plans.corridor import Corridor
from borecheck.robots.given import Given, configurations, length, refuse_others
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

# Only these ask for the true distance, which is what the certificate bounds.
CERTIFIABLE = ("exact", "two-sided")
TOLERANCE = Tolerance()


def check_path(
    robot: Robot,
    scene: Scene,
    waypoints: ArrayLike | Sequence[Given],
    margin: float | str = 0.0,
    *,
    corridor: Corridor | None = None,
    long_way: bool = False,
    clearance: bool = True,
    tolerance: Tolerance = TOLERANCE,
) -> PathVerdict:
    """The verdict for every instant of a motion, straight between waypoints.

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        waypoints: Configurations, (k, n), [m] and [rad]; or a list or table of them,
            each as `check` takes it.
        margin: Required clearance to obstacles, [m], or "20mm".
        corridor: Where the needle may be in the patient; see `corridor_along`.
        long_way: Whether continuous joints go as their numbers do where they turn by
            half a turn or more; else what happens there is unknown.
        clearance: Whether to certify the least clearance, too.
        tolerance: How far the bounds of the least clearance may be apart.

    Raises:
        JointLimitError: A waypoint beyond a joint limit.
        UsageError: No waypoint, or a margin that is none.
    """
    refuse_others(robot, scene)
    points = checked_waypoints(robot, configurations(robot, waypoints))
    problem = path_problem(robot, scene, length(margin, "margin"), corridor)
    found = search(problem, points)
    turns = None if long_way else open_turns(robot.model, points)
    if turns is not None:
        return held_back(found, turns, _touched(problem, points, turns, found))
    proof = Proof(problem, points, found, corridor)
    asked = tolerance if clearance else None
    return _answered(scene, proof, link_of(robot), asked)


def _answered(
    scene: Scene,
    proof: Proof,
    links: Mapping[str, str],
    tolerance: Tolerance | None,
    instants: Sequence[float] = (),
) -> PathVerdict:
    """What a search says of obstacles and robot, and the least clearance if asked."""
    problem, points, found = proof.problem, proof.waypoints, proof.outcome
    around, own = searched(problem, points, found)
    if tolerance is not None:
        asked = problem if own is None or own.clear else without_itself(problem)
        least = least_clearance(asked, points, around, tolerance, instants)
        around = replace(around, least=least)
    around = without_unseen(scene, problem, points, around)
    obstacles, itself = answers_of(problem, around, own, links)
    whole = around if own is None else replace(found, least=around.least)
    return replace(whole, obstacles=obstacles, itself=itself)


def link_of(robot: Robot) -> dict[str, str]:
    """The link of every part, by the part's name."""
    return {part.mesh.name: part.link for part in robot.parts}


def _touched(
    problem: PathProblem, points: Array, turns: OpenTurns, found: PathVerdict
) -> str | None:
    """What touches at an end of a step of which the way is not known, if anything."""
    if found.verdict != CONTACT:
        return None
    for k in sorted({end for step in turns.steps for end in (step, step + 1)}):
        at = search(problem, points[k : k + 1])
        if at.verdict == CONTACT:
            names = at.first_contact[2] if at.first_contact else None
            what = f"{' and '.join(names)} meet" if names else at.reason
            return f"waypoint {k + 1}: {what}"
    return None


def check_motion(
    robot: Robot,
    scene: Scene,
    waypoints: ArrayLike,
    chosen: Settings,
    *,
    corridor: Corridor | None = None,
    samples: int = DEFAULT_SAMPLES,
    certify: bool = True,
    long_way: bool = False,
    tolerance: Tolerance = TOLERANCE,
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
        certify: Whether to ask for what holds between the samples.
        long_way: See `check_path`.
        tolerance: How far the bounds of the least clearance may be apart.
        progress: Called with samples done and in all.

    Raises:
        UsageError, JointLimitError: No waypoint, or one that the robot cannot take.
    """
    points = checked_waypoints(robot, waypoints)
    turns = open_turns(robot.model, points)
    seen = sample_motion(
        robot,
        scene,
        points,
        chosen,
        corridor=corridor,
        samples=samples,
        turns=None if long_way else turns,
        progress=progress,
    )
    if turns is not None and long_way:
        seen = replace(seen, not_covered=(turns.taken,))
    certifiable = chosen.checker in CERTIFIABLE and chosen.margin.kind == OFFSET
    if not (certify and certifiable) or len(points) == 1:
        return seen
    problem = path_problem(robot, scene, chosen.margin.size, corridor)
    if seen.verdict == CONTACT and seen.obstacles.contact:
        met = _within_margin(problem, points, scene, seen, tolerance)
        known = turns is None or long_way
        return _own(problem, points, met, link_of(robot)) if known else met
    if seen.verdict == CONTACT and turns is not None and not long_way:
        return seen
    if seen.verdict == CONTACT:
        alone = _around(problem, points, scene, seen, tolerance, link_of(robot))
        return _nearest(scene, alone)
    proof = Proof(problem, points, search(problem, points), corridor)
    if turns is not None and not long_way:
        found = held_back(proof.outcome, turns, None)
        return _certified(replace(proof, outcome=found), seen)
    first = [seen.fractions[seen.worst]]
    found = _answered(scene, proof, link_of(robot), tolerance, first)
    return _nearest(scene, _certified(replace(proof, outcome=found), seen))


def _certified(proof: Proof, seen: MotionVerdict) -> MotionVerdict:
    """What the samples, without contact, said, with what is proven between them."""
    outcome = proof.outcome
    clear = outcome.verdict == CLEAR and all(p.verdict == CLEAR for p in seen.poses)
    verdict = outcome.verdict if outcome.verdict != CLEAR or clear else UNKNOWN
    reason = outcome.reason if verdict == outcome.verdict else seen.reason
    first = outcome.first_contact if verdict == CONTACT else None
    if verdict == CLEAR and outcome.least is not None:
        reason = f"{reason}; nearest: {' to '.join(outcome.least.names)}"
    return replace(
        seen,
        verdict=verdict,
        reason=reason,
        qualifiers=outcome.qualifiers,
        certified=clear,
        intervals=tuple(Interval(s.start, s.end, s.verdict) for s in outcome.intervals),
        first_contact=first[0] if first else None,
        begins=first[:2] if first else None,
        not_covered=(*seen.not_covered, *left_out(proof.problem)),
        least=outcome.least,
        proof=proof,
        obstacles=_both(seen.obstacles, outcome.obstacles, seen.poses, "obstacles"),
        itself=_both(seen.itself, outcome.itself, seen.poses, "itself"),
    )


def _both(
    sampled: Answer, proven: Answer | None, poses: Sequence[Verdict], name: str
) -> Answer:
    """What is proven, and clear only where no sample says otherwise."""
    if proven is None:
        return sampled
    clear = all(getattr(pose, name).clear for pose in poses)
    return proven if clear or not proven.clear else sampled


def _around(
    problem: PathProblem,
    points: Array,
    scene: Scene,
    seen: MotionVerdict,
    tolerance: Tolerance,
    link_of: Mapping[str, str],
) -> MotionVerdict:
    """Samples in which the robot touches only itself: the obstacles are asked alone."""
    around = without_itself(problem)
    found = search(around, points)
    first = [seen.fractions[seen.worst]]
    least = least_clearance(around, points, found, tolerance, first)
    found = without_unseen(scene, around, points, replace(found, least=least))
    proven = about_obstacles(found, link_of)
    obstacles = _both(seen.obstacles, proven, seen.poses, "obstacles")
    return replace(seen, least=least, obstacles=obstacles)


def _own(
    problem: PathProblem, points: Array, seen: MotionVerdict, links: Mapping[str, str]
) -> MotionVerdict:
    """Samples that touch an obstacle: the robot itself is asked alone."""
    if not seen.itself.unknown:
        return seen
    own = search(only_itself(problem), points) if problem.self_pairs else None
    proven = about_itself(problem, own, links)
    return replace(seen, itself=_both(seen.itself, proven, seen.poses, "itself"))


def _within_margin(
    problem: PathProblem,
    points: Array,
    scene: Scene,
    seen: MotionVerdict,
    tolerance: Tolerance,
) -> MotionVerdict:
    """Samples in contact; if only with the margin, there is a least clearance still."""
    touching = any(
        pose.contacts or pose.self_contacts or any(c.holds for c in pose.contained)
        for pose in seen.poses
    )
    if touching or problem.margin == 0.0:
        return seen
    bare = replace(problem, margin=0.0)
    least = least_clearance(
        bare, points, search(bare, points), tolerance, [seen.fractions[seen.worst]]
    )
    return _nearest(scene, replace(seen, least=least))


def _nearest(scene: Scene, motion: MotionVerdict) -> MotionVerdict:
    """The motion's verdict with the nearest points of its least clearance."""
    if motion.least is None:
        return motion
    role = scene.obstacles[motion.least.pair[1]].role
    return replace(motion, closest=motion.least.closest_to(role))
