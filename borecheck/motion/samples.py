"""A motion through waypoints: what is seen at samples, and what is certified between.

Samples give the clearance curve and find contact; they never make a motion `clear`,
because a thin obstacle fits between two of them. Only `motion.check` can do that.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.check import check_with
from borecheck.contact.settings import Settings
from borecheck.contact.verdict import (
    CLEAR,
    CONTACT,
    UNKNOWN,
    Answer,
    AnyVerdict,
    Closest,
    Verdict,
)
from borecheck.errors import JointLimitError, UsageError
from borecheck.motion.halves import of_samples
from borecheck.motion.outcome import LeastClearance, PathVerdict
from borecheck.motion.problem import PathProblem
from borecheck.motion.turns import OpenTurns
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

DEFAULT_SAMPLES = 41


@dataclass(frozen=True)
class Interval:
    """A stretch of the motion, as fractions of it, with what is known of it."""

    start: float
    end: float
    verdict: str

    def to_json(self) -> dict[str, Any]:
        """As the contract names it: from, to, verdict."""
        return {"from": self.start, "to": self.end, "verdict": self.verdict}


@dataclass(frozen=True, eq=False)
class Proof:
    """The certified search of a motion: what a certificate is written from.

    Attributes:
        problem: Who must not touch whom.
        waypoints: The motion, (k, n).
        outcome: What the search said.
        corridor: Where the needle may be in the patient.
    """

    problem: PathProblem
    waypoints: Array
    outcome: PathVerdict
    corridor: Corridor | None


@dataclass(frozen=True, eq=False, repr=False)
class MotionVerdict(AnyVerdict):
    """The answer for a motion.

    Attributes:
        verdict: clear (only if certified), contact or unknown.
        reason: One sentence.
        qualifiers: Those of the pose that decides.
        fractions: Where the samples lie on the motion, (n,), 0 to 1.
        poses: The verdict at every sample.
        sampled_clear: How many samples are clear.
        certified: Whether every instant is covered by a certificate.
        intervals: Stretches with their verdict.
        first_contact: Fraction where contact begins or, of samples alone, where it is
            first seen; None without contact.
        begins: Between which fractions contact is proven to begin; None where samples
            alone show it.
        worst: Index of the sample with contact or the smallest clearance.
        waypoints: The configurations the motion goes through, (k, n).
        not_covered: What neither samples nor certificate cover.
        least: The certified least clearance of the whole motion; None in contact, and
            where none could be shown or was asked for. What samples say has no such
            name.
        closest: Robot and obstacle at the instant `least.at`.
        proof: What the certified search was asked and said; None if it was not asked.
        obstacles: Whether the robot touches what stands around it.
        itself: Whether it touches itself.
    """

    verdict: str
    reason: str
    qualifiers: tuple[str, ...]
    fractions: tuple[float, ...]
    poses: tuple[Verdict, ...]
    sampled_clear: int
    certified: bool
    intervals: tuple[Interval, ...]
    first_contact: float | None
    worst: int
    waypoints: tuple[tuple[float, ...], ...]
    obstacles: Answer
    itself: Answer
    not_covered: tuple[str, ...] = ()
    least: LeastClearance | None = None
    closest: Closest | None = None
    proof: Proof | None = None
    begins: tuple[float, float] | None = None


def sample_motion(
    robot: Robot,
    scene: Scene,
    waypoints: ArrayLike,
    chosen: Settings,
    *,
    corridor: Corridor | None = None,
    samples: int = DEFAULT_SAMPLES,
    turns: OpenTurns | None = None,
    progress: Progress | None = None,
) -> MotionVerdict:
    """What samples say of the motion that goes straight from waypoint to waypoint.

    Without contact the verdict is `unknown`: see `motion.check.check_motion`.

    Args:
        robot: The robot.
        scene: What stands around it.
        waypoints: Configurations, (k, n), [m] and [rad]; straight in each joint.
        chosen: Checker, pruning, margin.
        corridor: Where the needle may be in the patient.
        samples: How many configurations are looked at, waypoints included.
        turns: Steps of which the way is not known: contact within one counts only if
            that is the way.
        progress: Called with samples done and in all.

    Raises:
        UsageError: No waypoint, or one of the wrong length.
        JointLimitError: A waypoint beyond a joint limit.
    """
    points = checked_waypoints(robot, waypoints)
    fractions = sample_fractions(points, samples)
    poses = []
    for done, q in enumerate(configurations_at(points, fractions)):
        poses.append(check_with(robot, scene, q, chosen, corridor))
        if progress is not None:
            progress(done + 1, len(fractions))
    return _sampled(points, fractions, tuple(poses), scene.doubt, turns)


def checked_waypoints(robot: Robot, waypoints: ArrayLike) -> Array:
    """A copy of the waypoints (k, n), each within the limits.

    Between two configurations within the limits every configuration is, so it is
    enough to look at the waypoints.
    """
    try:
        points = np.array(waypoints, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise UsageError(f"waypoints are no numbers of shape (k, n): {error}") from None
    if points.ndim != 2 or len(points) == 0:
        raise UsageError(f"waypoints have shape {points.shape}, not (k, n)")
    return np.array([_checked(robot, number, q) for number, q in enumerate(points, 1)])


def _checked(robot: Robot, number: int, q: Array) -> Array:
    try:
        return robot.model.check_limits(q)
    except (JointLimitError, UsageError) as error:
        raise type(error)(f"waypoint {number}: {error}") from error


def sample_fractions(points: Array, samples: int) -> Array:
    """Fractions of the motion to look at: evenly spread, and every waypoint.

    The fraction of a waypoint is its number over the number of segments.
    """
    if samples < 1:
        raise UsageError(f"{samples} samples are too few")
    if len(points) == 1:
        return np.zeros(1)
    at_waypoints = np.linspace(0.0, 1.0, len(points))
    return np.unique(np.concatenate([np.linspace(0.0, 1.0, samples), at_waypoints]))


def configurations_at(points: Array, fractions: Array) -> Array:
    """Configurations of the motion at these fractions, (m, n)."""
    if len(points) == 1:
        return np.repeat(points, len(fractions), axis=0)
    place = fractions * (len(points) - 1)
    segment = np.minimum(place.astype(int), len(points) - 2)
    along = (place - segment)[:, None]
    start, end = points[segment], points[segment + 1]
    # the form start + along * (end - start) may miss the waypoint's last bit
    return np.where(along == 1.0, end, start + along * (end - start))


def _sampled(
    points: Array,
    fractions: Array,
    poses: tuple[Verdict, ...],
    doubt: str | None,
    turns: OpenTurns | None,
) -> MotionVerdict:
    verdicts = [
        UNKNOWN if turns is not None and turns.hold(fraction) else pose.verdict
        for fraction, pose in zip(fractions, poses, strict=True)
    ]
    worst = _worst(poses)
    in_contact = [k for k, verdict in enumerate(verdicts) if verdict == CONTACT]
    clear = [pose.verdict for pose in poses].count(CLEAR)
    if in_contact:
        first = in_contact[0]
        verdict, reason = CONTACT, _placed(fractions[first], poses[first])
        qualifiers = poses[first].qualifiers
    elif turns is not None:
        verdict, reason, qualifiers = UNKNOWN, turns.reason, ()
    elif clear == len(poses) and len(points) == 1:
        verdict, reason = CLEAR, poses[0].reason
        qualifiers = poses[0].qualifiers
    elif clear == len(poses):
        verdict = UNKNOWN
        reason = f"clear at {clear} samples, not certified between them"
        qualifiers = ()
    else:
        undecided = [k for k, verdict in enumerate(verdicts) if verdict == UNKNOWN]
        # what holds of the whole scene has no place on the motion
        own = [k for k in undecided if not (doubt and doubt in poses[k].reason)]
        open_pose = (own or undecided)[0]
        verdict = UNKNOWN
        reason = _placed(fractions[open_pose], poses[open_pose])
        if doubt is not None and not own:
            reason = doubt
        qualifiers = poses[open_pose].qualifiers
    way = [
        turns.reason if turns is not None and turns.hold(fraction) else ""
        for fraction in fractions
    ]
    obstacles, itself = of_samples(fractions.tolist(), poses, way)
    return MotionVerdict(
        verdict=verdict,
        reason=reason,
        qualifiers=qualifiers,
        fractions=tuple(float(f) for f in fractions),
        poses=poses,
        sampled_clear=clear,
        certified=False,
        intervals=_intervals(fractions, verdicts),
        first_contact=float(fractions[in_contact[0]]) if in_contact else None,
        worst=worst,
        waypoints=tuple(tuple(float(v) for v in q) for q in points),
        obstacles=obstacles,
        itself=itself,
    )


def _placed(fraction: float, pose: Verdict) -> str:
    return f"at {fraction:.1%} of the motion: {pose.reason}"


def _worst(poses: tuple[Verdict, ...]) -> int:
    """The sample in contact, else the undecided one, else the one with least room."""
    order = {CONTACT: 0, UNKNOWN: 1, CLEAR: 2}

    def badness(k: int) -> tuple[int, float, int]:
        pose, room = poses[k], poses[k].clearance_m
        if pose.verdict == CONTACT and (room is None or pose.self_contacts):
            room = -np.inf  # surfaces meet: worse than coming within the margin
        return order[pose.verdict], np.inf if room is None else room, k

    return min(range(len(poses)), key=badness)


def _intervals(fractions: Array, verdicts: list[str]) -> tuple[Interval, ...]:
    """Stretches between samples: contact where an end is, unknown everywhere else."""
    if len(fractions) == 1:
        return (Interval(0.0, 1.0, verdicts[0]),)
    found: list[Interval] = []
    for k in range(len(fractions) - 1):
        ends = (verdicts[k], verdicts[k + 1])
        verdict = CONTACT if CONTACT in ends else UNKNOWN
        if found and found[-1].verdict == verdict:
            found[-1] = Interval(found[-1].start, float(fractions[k + 1]), verdict)
        else:
            start, end = float(fractions[k]), float(fractions[k + 1])
            found.append(Interval(start, end, verdict))
    return tuple(found)
