"""The 64 trials set up in the model: posture, approach, stops, verdicts.

As [Matsuno2020] section 4.1 says: needle tip at the isocentre, posture turned about the
tip (remote centre), then a motion along one axis of the gantry until the *true*
distance between robot and gantry is 25 mm, then 15 mm; at each stop every checker is
asked about the enlarged robot. The goal points are shown in a figure only, so before
the approach the operator may shift the robot across it, such that the place of the
gantry that comes nearest is, seen along the bore, as near as can be to the goal point.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.contact import clearance
from borecheck.contact.check import check
from borecheck.contact.verdict import Closest
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from zerobot.inverse import broken_limits, remote_centre
from zerobot.trials.published import DISTANCES_MM, MARGIN_MM, PublishedApproach, Trial
from zerobot.trials.stops import back_off, solve_stop

Array = NDArray[np.float64]

# Enlarged by 20 mm along each axis a part reaches at most sqrt(3) 20 mm farther.
REACH_SEARCH = 0.06
REACH_TOLERANCE = 2e-5

# Shifts across the approach that are tried, [m]; then finer ones around the best.
SHIFTS = np.linspace(-0.24, 0.24, 9)
FINER = (0.02, 0.0075, 0.0025)

# (checker, margin kind): the papers' enlarged volume in both readings, true distance.
QUESTIONS = (
    ("paper:robot", "enlarge-axes"),
    ("paper:scanner", "enlarge-axes"),
    ("two-sided", "enlarge-axes"),
    ("exact", "enlarge-axes"),
    ("coal", "enlarge-axes"),
    ("paper:robot", "enlarge-axes:world"),
    ("two-sided", "enlarge-axes:world"),
    ("exact", "enlarge-axes:world"),
    ("two-sided", "offset"),
    ("exact", "offset"),
    ("coal", "security"),
)

_INDEX = {"X": 1, "Y": 2, "Z": 0}  # the joint that moves along the axis,
_SIGN = {"X": -1.0, "Y": -1.0, "Z": 1.0}  # and which way: W_T_4 in the closed form
_ACROSS = {"X": "Z", "Y": "Z", "Z": "Y"}


@dataclass(frozen=True, eq=False)
class Stop:
    """The robot at one measured distance.

    Attributes:
        q: Joint positions, (6,), read-only.
        along: Travel from the start of the approach, [m].
        closest: Nearest points of robot and gantry there.
    """

    q: Array
    along: float
    closest: Closest


@dataclass(frozen=True, eq=False)
class Setup:
    """One approach in the model.

    Attributes:
        approach: Point, axis and posture.
        shift: Shift across the approach before it, [m].
        sign: The way along the axis, +1 or -1.
        stops: By measured distance [mm]; empty if one of them is out of reach.
        aim_error: Distance of the nearest place of the gantry to the goal point, seen
            along the bore (in y and z), [m].
        unreachable: Why there are no stops, or None.
    """

    approach: PublishedApproach
    shift: float
    sign: float
    stops: dict[int, Stop]
    aim_error: float
    unreachable: str | None = None


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the checkers say about one trial.

    Attributes:
        trial: The cell of the table.
        setup: The approach it is a stop of.
        verdicts: {(checker, margin kind): verdict}; empty if out of reach.
    """

    trial: Trial
    setup: Setup
    verdicts: dict[tuple[str, str], str]


class Bench:
    """Robot and gantry on which trials are run.

    Args:
        robot: Zerobot.
        scene: The gantry, without couch and patient.
    """

    def __init__(self, robot: Robot, scene: Scene) -> None:
        self.robot = robot
        self.scene = scene

    def closest(self, q: Array) -> Closest:
        """Nearest points of robot and gantry at q."""
        found, _ = clearance.to_obstacles(
            self.robot, self.scene, self.robot.placements(q)
        )
        assert found is not None  # there is a gantry
        return found


def posture(q4_deg: float, q5_deg: float, mount: str = "+90") -> Array:
    """The posture with the needle tip at the isocentre, (6,): sections 2.2 and 4.1."""
    turn = math.radians(q4_deg), math.radians(q5_deg)
    return remote_centre(np.zeros(6), *turn, mount=mount)


def set_up(bench: Bench, approach: PublishedApproach, *, aim: bool = True) -> Setup:
    """The stops of one approach, solved on the true distance to 0.1 um.

    Args:
        bench: Robot and gantry.
        approach: Point, axis and posture.
        aim: Whether to shift across the approach so that the goal point is met;
            otherwise the approach begins with the tip at the isocentre.
    """
    goal = bench.scene.points[approach.point][:3, 3]
    sign = 1.0 if approach.axis in "XZ" else math.copysign(1.0, goal[1])
    shift = _aimed(bench, approach, sign, goal) if aim else 0.0
    return _at_shift(bench, approach, shift, sign, goal, DISTANCES_MM)


def _aimed(
    bench: Bench, approach: PublishedApproach, sign: float, goal: Array
) -> float:
    """The shift across the approach that brings the goal point nearest."""
    last = DISTANCES_MM[-1:]
    best = _at_shift(bench, approach, 0.0, sign, goal, last)
    for spread in (
        SHIFTS,
        *(width * np.array([-2.0, -1.0, 1.0, 2.0]) for width in FINER),
    ):
        around = best.shift if spread is not SHIFTS else 0.0
        for shift in spread:
            found = _at_shift(bench, approach, around + float(shift), sign, goal, last)
            if _better(found, best):
                best = found
    return best.shift


def outcome(bench: Bench, setup: Setup, distance_mm: int) -> Outcome:
    """Every checker's own word on the enlarged robot at one stop."""
    trial = setup.approach.trial(distance_mm)
    if setup.unreachable is not None:
        return Outcome(trial, setup, {})
    q = setup.stops[distance_mm].q
    verdicts = {
        (checker, kind): own_verdict(bench, q, checker, kind)
        for checker, kind in QUESTIONS
    }
    return Outcome(trial, setup, verdicts)


def own_verdict(
    bench: Bench, q: Array, checker: str, kind: str, margin: float = 1e-3 * MARGIN_MM
) -> str:
    """What that checker alone says; one-sided ones are not asked again."""
    verdict = check(
        bench.robot, bench.scene, q, margin=margin, margin_kind=kind, checker=checker
    )
    return verdict.verdict if kind == "offset" else verdict.checker_verdict


def _at_shift(
    bench: Bench,
    approach: PublishedApproach,
    shift: float,
    sign: float,
    goal: Array,
    distances_mm: Sequence[int],
) -> Setup:
    moved, ends = _track(bench, approach, shift, sign)

    def failed(why: str) -> Setup:
        return Setup(approach, shift, sign, {}, math.inf, why)

    broken = broken_limits(moved(min(max(0.0, ends[0]), ends[1])))
    if broken:
        return failed("; ".join(broken))

    def distance(along: float) -> float:
        return bench.closest(moved(along)).distance

    at = back_off(distance, min(max(0.0, ends[0]), ends[1]), ends[0])
    if at is None:
        return failed("nearer than 25 mm wherever the approach begins")
    stops: dict[int, Stop] = {}
    for distance_mm in distances_mm:
        found = solve_stop(distance, at, ends[1], 1e-3 * distance_mm)
        if found is None:
            return failed(f"the joint limit comes before {distance_mm} mm")
        at = found
        reached = moved(at)
        reached.setflags(write=False)
        stops[distance_mm] = Stop(reached, at, bench.closest(reached))
    touched = np.array(stops[distances_mm[-1]].closest.points[1])
    return Setup(approach, shift, sign, stops, math.dist(touched[1:], goal[1:]))


def _track(
    bench: Bench, approach: PublishedApproach, shift: float, sign: float
) -> tuple[Callable[[float], Array], tuple[float, float]]:
    """The configuration by travel along the approach, and its joint's limits."""
    q = posture(approach.q4_deg, approach.q5_deg, bench.robot.arguments["mount"])
    across = _ACROSS[approach.axis]
    q[_INDEX[across]] += _SIGN[across] * shift
    joint, way = _INDEX[approach.axis], sign * _SIGN[approach.axis]
    lower = float(bench.robot.model.lower[joint])
    upper = float(bench.robot.model.upper[joint])
    first, last = sorted([way * (lower - q[joint]), way * (upper - q[joint])])

    def moved(along: float) -> Array:
        there = q.copy()
        there[joint] = min(max(q[joint] + way * along, lower), upper)
        return there

    return moved, (first, last)


def _better(one: Setup, other: Setup) -> bool:
    """Reached beats not reached; then the smaller aim error, then the smaller shift."""
    return (one.aim_error, abs(one.shift)) < (other.aim_error, abs(other.shift))


def reach(bench: Bench, setup: Setup, kind: str) -> float:
    """True distance at which the enlarged robot first meets the gantry, [m].

    For the true offset this is the margin itself. Found by bisection along the
    approach, to 0.02 mm.
    """
    if kind == "offset":
        return 1e-3 * MARGIN_MM
    moved, (first, _) = _track(bench, setup.approach, setup.shift, setup.sign)
    near = setup.stops[DISTANCES_MM[-1]].along
    far = max(first, near - REACH_SEARCH)
    if own_verdict(bench, moved(near), "exact", kind) != "contact":
        return 1e-3 * DISTANCES_MM[-1]
    while near - far > REACH_TOLERANCE:
        middle = 0.5 * (near + far)
        if own_verdict(bench, moved(middle), "exact", kind) == "contact":
            near = middle
        else:
            far = middle
    return bench.closest(moved(near)).distance
