"""Is a motion clear at every instant, and how near does it come: what users ask.

Samples find contact and give curves to look at; `clear` and the least clearance come
from the certified search alone (`motion.search`, `motion.least_clearance`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.check import why_assumed
from borecheck.contact.margin import OFFSET
from borecheck.contact.settings import Settings
from borecheck.contact.verdict import CLEAR, CONTACT, UNKNOWN, Answer, Closest, Verdict
from borecheck.motion.halves import (
    about_itself,
    about_obstacles,
    answers_of,
    only_itself,
    searched,
    without_itself,
)
from borecheck.motion.least_clearance import Tolerance, least_clearance
from borecheck.motion.outcome import PathVerdict, in_doubt
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
from borecheck.plans.corridor import Corridor
from borecheck.robots.given import Given, configurations, length, refuse_others
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

_NO_NEAREST = "where a patient is nearest, and whether it was seen there, is not known"

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
    around, own = searched(problem, points, found)
    obstacles, itself = answers_of(problem, around, own, link_of(robot))
    found = replace(found, obstacles=obstacles, itself=itself)
    if not clearance and not any(o.assumed for o in scene.obstacles):
        return found
    asked = problem if own is None or own.clear else without_itself(problem)
    least = least_clearance(asked, points, around, tolerance)
    found = _unless_assumed(scene, replace(found, least=least))
    for alone in scene.with_assumed_alone if len(scene.obstacles) > 1 else ():
        # that something else is nearer does not show where a patient ends
        if found.clear:
            near = check_path(
                robot, alone, points, margin, corridor=corridor, long_way=long_way
            )
            found = found if near.clear else in_doubt(found, near.reason)
    return found


def _unless_assumed(scene: Scene, found: PathVerdict) -> PathVerdict:
    """The same without `clear` where the nearest obstacle was not seen."""
    if not found.clear:
        return found
    if found.least is None:
        guessed = scene.with_assumed_alone
        return in_doubt(found, _NO_NEAREST) if guessed else found
    name, triangle = found.least.names[1], int(found.least.closest.triangle_other)
    reason = scene.assumed_at(name, triangle)
    return found if reason is None else in_doubt(found, reason)


def why_not_seen(
    robot: Robot, scene: Scene, points: Array, margin: float, corridor: Corridor | None
) -> str | None:
    """Why a motion is not clear where part of a patient was not seen; None if it is.

    A certificate speaks of surfaces as they are: which of them were assumed beyond a
    scan, only the scene knows.
    """
    if not scene.with_assumed_alone:
        return None
    found = check_path(robot, scene, points, margin, corridor=corridor, long_way=True)
    return None if found.clear else found.reason


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
        alone = _around(problem, points, seen, tolerance, link_of(robot))
        return _nearest(scene, alone)
    proof = Proof(problem, points, search(problem, points), corridor)
    if turns is not None and not long_way:
        found = held_back(proof.outcome, turns, None)
        return _certified(replace(proof, outcome=found), seen)
    return _nearest(scene, _measured(proof, seen, tolerance, link_of(robot)))


def _measured(
    proof: Proof, seen: MotionVerdict, tolerance: Tolerance, links: dict[str, str]
) -> MotionVerdict:
    """What a proof says of obstacles and robot, with the certified least clearance."""
    problem, points = proof.problem, proof.waypoints
    around, own = searched(problem, points, proof.outcome)
    obstacles, itself = answers_of(problem, around, own, links)
    asked = problem if own is None or own.clear else without_itself(problem)
    least = least_clearance(
        asked, points, around, tolerance, [seen.fractions[seen.worst]]
    )
    found = replace(proof.outcome, least=least, obstacles=obstacles, itself=itself)
    return _certified(replace(proof, outcome=found), seen)


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
    seen: MotionVerdict,
    tolerance: Tolerance,
    link_of: Mapping[str, str],
) -> MotionVerdict:
    """Samples in which the robot touches only itself: the obstacles are asked alone."""
    around = without_itself(problem)
    found = search(around, points)
    first = [seen.fractions[seen.worst]]
    least = least_clearance(around, points, found, tolerance, first)
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
    found, (link, name) = motion.least.closest, motion.least.names
    closest = Closest(
        link=link,
        obstacle=name,
        role=scene.obstacles[motion.least.pair[1]].role,
        distance=found.lower,
        upper=motion.least.upper,
        points=(_point(found.point_self), _point(found.point_other)),
        triangles=(found.triangle_self, found.triangle_other),
    )
    motion = replace(motion, closest=closest)
    reason = why_assumed(scene, closest)
    if reason is None or motion.verdict != CLEAR:
        return motion
    obstacles = replace(motion.obstacles, verdict=UNKNOWN, reason=reason)
    return replace(
        motion, verdict=UNKNOWN, reason=reason, certified=False, obstacles=obstacles
    )


def _point(values: Array) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
