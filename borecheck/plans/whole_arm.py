"""A needle plan driven by an arm without a closed form: along its line, on one branch.

The approach and, unless a joint of its own drives the needle, the insertion are
stations on the plan's line. Every configuration that puts the needle where the motion
begins is followed along it; of those that reach the target the one with most room is
taken. The stations are so dense that tip and direction stay on the line between them,
too, which `needle_line` proves of the motion itself.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import BorecheckError, UnknownNameError, UsageError
from borecheck.plans.needle_line import TIP_TOLERANCE, TURN_TOLERANCE, NeedleLine
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.robots.kinematics.needle_inverse import (
    MOST_STARTS,
    STARTS,
    NumericalInverse,
)
from borecheck.robots.kinematics.needle_task import NeedleTask
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]
# An arm that a drive leaves standing moves by rounding alone, [m] or [rad].
STANDS_STILL = 1e-9
# Of configurations (k, n) how much room there is, (k,): more is better.
Room = Callable[[Array], Array]

# One station for every so many metres to begin with; more where the needle would stray.
STEP = 0.01
HALVINGS = 6
# Starts from which beginnings are searched: more where none of the first goes through.
SEARCHES = (STARTS, MOST_STARTS)
# Beginnings that are followed, nearest to home first.
MOST_BEGINNINGS = 128
# Of those so many are tried, with most room first.
MOST_TRIED = 8
# Places on a motion whose room is asked.
ROOM_ASKED = 6
# A joint that moves farther between stations has jumped, [rad] or [m].
JUMP = 0.3
# What a descent leaves where it reaches its station, [m].
REACHED = 1e-11


class UnreachableError(BorecheckError):
    """No configuration within the limits reaches the plan; names the broken limit."""


@dataclass(frozen=True, eq=False)
class Stations:
    """What a motion goes through.

    Attributes:
        distances: Of the tip from the entry along the line, (k,), [m].
        insertion: Where the insertion joint stands meanwhile; None without one.
        driven: How far it drives the needle after the last of them, [m].
    """

    distances: Array
    insertion: float | None
    driven: float


def whole_arm_motion(
    robot: Robot, plan: NeedlePlan, standoff: float, room: Room | None = None
) -> Array:
    """Waypoints (k, n) of a plan, from its stand-off to its target.

    Args:
        robot: A robot whose needle has a tip.
        plan: Entry and target in the scanner's frame, [m].
        standoff: Length of the approach, [m].
        room: Asked which of several motions has most room; nearest to home without.

    Raises:
        UsageError: The robot has no needle with a tip.
        UnreachableError: No motion was found; what stands against it.
    """
    search = _Search(robot, plan, standoff, room)
    for starts in SEARCHES:
        waypoints = search.motion(starts)
        if waypoints is not None:
            return waypoints
    raise UnreachableError(f"plan {plan.name}: {search.reason}")


def hold_motion(
    robot: Robot, plan: NeedlePlan, standoff: float, waypoints: Array
) -> None:
    """Asks whether a motion is one of a plan: along its line, from end to end.

    It does not matter who found it, or which of several it is.

    Raises:
        UsageError: It leaves the line, goes back on it, or begins or ends elsewhere.
    """
    needle = robot.needle_with_tip()
    line = NeedleLine(robot, needle, plan.name, plan.entry, plan.direction)
    distances = np.array([line.distance(q) for q in waypoints])
    ends = np.abs(distances[[0, -1]] - (-standoff, plan.length)).max()
    if len(waypoints) < 2 or ends > TIP_TOLERANCE:
        raise UsageError("it does not go from the plan's stand-off to its target")
    # of the whole motion, not of each step: many small ones are a long way
    if (np.maximum.accumulate(distances) - distances > TIP_TOLERANCE).any():
        raise UsageError("its needle goes back on its line")
    if needle.insertion is not None:
        _hold_drive(robot, needle.insertion, waypoints, distances)
    off, turned = line.strays(waypoints, distances)
    if not (off <= TIP_TOLERANCE and turned <= TURN_TOLERANCE):
        raise UsageError(
            f"its needle is not shown to stay on the plan's line: up to "
            f"{1e3 * off:.4f} mm off it, turned by {turned:.2g}"
        )
    line.hold_some(waypoints, distances)


def _hold_drive(robot: Robot, name: str, waypoints: Array, distances: Array) -> None:
    """Asks whether the arm goes to the entry, and from there the drive alone goes on.

    Raises:
        UsageError: It does not.
    """
    index = robot.model.joint_names.index(name)
    drive, arm = waypoints[:, index], np.delete(waypoints, index, axis=1)
    before = distances <= TIP_TOLERANCE
    if not np.any(np.abs(distances) <= TIP_TOLERANCE):
        raise UsageError("it does not stop at the plan's entry")
    entry = int(np.flatnonzero(before)[-1])
    if np.abs(drive[before] - robot.model.lower[index]).max() > TIP_TOLERANCE:
        raise UsageError(f"{name} drives the needle before the plan's entry")
    if np.abs(arm[entry:] - arm[entry]).max() > STANDS_STILL:
        raise UsageError(f"the arm moves while {name} is to drive the needle")


def drives_from(robot: Robot, name: str, depth: float) -> float:
    """Where a joint stands before it drives the needle so deep, [m].

    Raises:
        UnknownNameError: No such joint.
        UnreachableError: It does not go so far.
    """
    if name not in robot.model.joint_names:
        raise UnknownNameError("joint", name, robot.model.joint_names)
    index = robot.model.joint_names.index(name)
    start = float(robot.model.lower[index])
    travel = float(robot.model.upper[index]) - start
    if depth > travel:
        raise UnreachableError(
            f"the needle goes {1e3 * depth:.1f} mm deep, but {name} drives it "
            f"{1e3 * travel:.1f} mm"
        )
    return start


def _stations(robot: Robot, plan: NeedlePlan, standoff: float) -> Stations:
    name = robot.needle.insertion if robot.needle is not None else None
    end, insertion, driven = plan.length, None, 0.0
    if name is not None:
        insertion = drives_from(robot, name, plan.length)
        end, driven = 0.0, plan.length
    count = int(np.ceil((standoff + end) / STEP)) + 1
    return Stations(np.linspace(-standoff, end, count), insertion, driven)


class _Search:
    """Motions of one plan, from the beginnings that a number of starts finds.

    Attributes:
        reason: Why the last ones that were searched do not reach the target.
    """

    def __init__(
        self, robot: Robot, plan: NeedlePlan, standoff: float, room: Room | None
    ) -> None:
        self._solver = NumericalInverse.of(robot)
        self._robot, self._plan, self._room = robot, plan, room
        self._standoff = standoff
        self._stations = _stations(robot, plan, standoff)
        self._line = NeedleLine(
            robot, self._solver.needle, plan.name, plan.entry, plan.direction
        )
        _, self._task = self._solver.standing(self._stations.insertion)
        self.reason = ""

    def motion(self, starts: int) -> Array | None:
        """The motion with most room that keeps to the line; None if none is found.

        Raises:
            UnreachableError: There is no way to begin.
        """
        followed = _Followed(self._task, self._plan, self._stations.distances)
        motions = followed.motions(self._beginnings(starts))
        for k in islice(_by_room(motions, self._room), MOST_TRIED):
            waypoints = self._on_the_line(motions[k][0])
            if waypoints is not None:
                return waypoints
        self.reason = "it strays from its line"
        if not len(motions):
            self.reason = followed.why(self._robot.model.joint_names)
        return None

    def _beginnings(self, starts: int) -> Array:
        plan, stations = self._plan, self._stations
        tip = plan.entry + stations.distances[0] * plan.direction
        found = self._solver.solutions(tip, plan.direction, stations.insertion, starts)
        if found.configurations:
            return np.array(found.configurations[:MOST_BEGINNINGS])
        raise UnreachableError(
            f"plan {plan.name}: no configuration was found where its approach begins, "
            f"{1e3 * self._standoff:g} mm before its entry: "
            + " | or: ".join(found.rejected)
        )

    def _on_the_line(self, q: Array) -> Array | None:
        """A motion from a beginning, as dense as must be; None if that is no help."""
        distances, driven = self._stations.distances, self._stations.driven
        for _ in range(HALVINGS):
            motions = _Followed(self._task, self._plan, distances).motions(q[None])
            if not len(motions):
                return None
            waypoints, along = _with_drive(
                self._robot, self._stations, motions[0], distances
            )
            off, turned = self._line.steps(waypoints, along)
            strays = (off > TIP_TOLERANCE) | (turned > TURN_TOLERANCE)
            if not strays.any():
                self._line.hold_some(waypoints, along)
                return waypoints
            if driven and strays[-1]:
                return None  # the drive leads aside: no more stations help
            strays = strays[: len(distances) - 1]
            middle = 0.5 * (distances[1:] + distances[:-1])[strays]
            distances = np.sort(np.concatenate([distances, middle]))
        return None


def _with_drive(
    robot: Robot, stations: Stations, waypoints: Array, distances: Array
) -> tuple[Array, Array]:
    """Waypoints and distances, with the one to which the needle is driven."""
    if not stations.driven or robot.needle is None:
        return waypoints, distances
    last = waypoints[-1].copy()
    last[robot.model.joint_names.index(robot.needle.insertion or "")] += stations.driven
    end = distances[-1] + stations.driven
    return np.vstack([waypoints, last]), np.append(distances, end)


class _Followed:
    """Motions along a line, all beginnings at once; and why those that ended ended."""

    def __init__(self, task: NeedleTask, plan: NeedlePlan, distances: Array) -> None:
        self._task, self._plan, self._distances = task, plan, distances
        self._farthest = (-np.inf, np.zeros(0))

    def motions(self, beginnings: Array) -> Array:
        """Those that reach the last station, (m, stations, n)."""
        task, plan = self._task, self._plan
        ways = beginnings[:, None]
        for distance in self._distances[1:]:
            tip = np.tile(plan.entry + distance * plan.direction, (len(ways), 1))
            aim = np.tile(plan.direction, (len(ways), 1))
            before = ways[:, -1]
            qs, rest = task.descend(before, tip, aim)
            stays = np.abs(qs - before).max(axis=1, initial=0.0) < JUMP
            ends = ~((rest < REACHED) & stays)
            if ends.any() and distance > self._farthest[0]:
                self._farthest = (float(distance), qs[ends][int(rest[ends].argmin())])
            ways = np.concatenate([ways, qs[:, None]], axis=1)[~ends]
            if not len(ways):
                break
        return ways

    def why(self, names: tuple[str, ...]) -> str:
        """How far the farthest came, and which joints stood at a limit there."""
        distance, q = self._farthest
        task = self._task
        stands = ", ".join(
            f"{names[i]} is at its limit {q[i]:.4g}"
            for i in task.active
            if q[i] <= task.lower[i] or q[i] >= task.upper[i]
        )
        short = 1e3 * (self._distances[-1] - distance)
        return (
            f"no way along its line was found; the farthest ends {short:.1f} mm before "
            f"the end: {stands or 'the arm is stretched or folded there'}"
        )


def _by_room(motions: Array, room: Room | None) -> Iterator[int]:
    """Numbers of motions, those with most room first."""
    count = len(motions)
    if room is None or count < 2:
        yield from range(count)
        return
    asked = np.linspace(0, motions.shape[1] - 1, ROOM_ASKED).round().astype(int)
    rooms = room(motions[:, asked].reshape(-1, motions.shape[2]))
    least = rooms.reshape(count, len(asked)).min(axis=1)
    # rounding must not decide between ways that have the same room
    yield from (int(k) for k in np.argsort(-least.round(6), kind="stable"))
