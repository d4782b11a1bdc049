"""Configurations that put a needle somewhere: inverse kinematics for any chain.

Numerical, from starts spread evenly over the joints' limits and always the same. What
is found is held against Pinocchio's own placement of the tip; where nothing is found,
what stands against it is told. "Not found" is no proof that there is nothing.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.once import once_per_record
from borecheck.errors import UsageError
from borecheck.robots.description import Solutions
from borecheck.robots.kinematics.needle_task import NeedleTask
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.kinematics.starts import spread
from borecheck.robots.kinematics.whole_turns import nearest_turns, single_turning
from borecheck.robots.needle import Needle
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]

# By Pinocchio the tip is as near to where it should be, [m], and the unit vector along
# the needle as near to the direction asked.
TIP_TOLERANCE = 1e-10
TURN_TOLERANCE = 1e-10
# Starts of the first round; where it finds nothing, rounds twice as large follow, and
# the last has so many.
STARTS, MOST_STARTS = 32, 512
# Solutions as near as this are one, [rad] and [m]; of a family one in so much.
SAME, APART = 1e-5, 0.2
# Where nothing was found, so many of the nearest, as near as this [m], go on so long.
MOST_LED_ON, _PROMISING, STEPS_LED_ON = 8, 2e-3, 150
# What a chain and Pinocchio place apart by rounding, with room, [m].
_LEFT = 1e-11
# Broken limits that are told, of so many ways to reach the needle without them.
_TOLD = 3


def needle_inverse(
    robot: Robot,
    tip: ArrayLike,
    direction: ArrayLike,
    insertion: float | None = None,
) -> Solutions:
    """Configurations that put the needle's tip there, pointing that way.

    Args:
        robot: A robot with a needle and a frame at its tip.
        tip: Scanner's frame, (3,), [m].
        direction: The way the needle points, (3,), of any length but 0.
        insertion: Where the insertion joint stands, [m]; it is not moved then.

    Returns:
        Those found, nearest to home first, each (joints,) and within all limits; of an
        arm with more joints than the task needs, several out of every family. If there
        is none, one line for everything that stands against it.

    Raises:
        UsageError: The robot has no needle with a tip, or numbers make no needle.
    """
    T, d = _asked(tip, direction)
    return NumericalInverse.of(robot).solutions(T, d, insertion)


@dataclass(frozen=True, eq=False)
class NumericalInverse:
    """Inverse kinematics of one robot; see `needle_inverse`."""

    robot: Robot
    needle: Needle

    @staticmethod
    def of(robot: Robot) -> "NumericalInverse":
        """Of a robot whose needle has a tip.

        Raises:
            UsageError: It has none.
        """
        return NumericalInverse(robot, robot.needle_with_tip())

    def solutions(
        self,
        tip: Array,
        direction: Array,
        insertion: float | None = None,
        first_round: int = STARTS,
    ) -> Solutions:
        """As `needle_inverse`, for a unit vector, from at least so many starts."""
        home, task = self.standing(insertion)
        total, count = 0, first_round
        while count <= MOST_STARTS:
            starts = spread(home, task.active, task.lower, task.upper, total, count)
            total, count = total + count, 2 * count
            found = self._found(task, starts, home, tip, direction)
            if found:
                return Solutions(tuple(found), ())
        return Solutions((), tuple(self._reasons(task, starts, home, tip, direction)))

    def near(self, q: Array, tip: Array, direction: Array) -> Array | None:
        """The solution that a configuration leads to, for a unit vector, or None."""
        found = self._found(self.task, q[None], q, tip, direction)
        return found[0] if found else None

    def standing(self, insertion: float | None = None) -> tuple[Array, NeedleTask]:
        """Home with the needle inserted so far, and the task with that joint held."""
        home = self.robot.home.copy()
        if insertion is None or self.needle.insertion is None:
            return home, self.task
        index = self.robot.model.joint_names.index(self.needle.insertion)
        home[index] = insertion
        return home, self._held[index]

    @cached_property
    def task(self) -> NeedleTask:
        """With every joint free to move."""
        return _task(self.robot, self.needle, ())

    @cached_property
    def _held(self) -> dict[int, NeedleTask]:
        index = self.robot.model.joint_names.index(self.needle.insertion or "")
        return {index: _task(self.robot, self.needle, (index,))}

    def reached(self, q: Array, tip: Array, direction: Array) -> bool:
        """Whether by Pinocchio the needle is there, and q within all limits."""
        T = self.robot.placements(q)[self.needle.tip or ""]
        off = np.linalg.norm(T[:3, 3] - tip)
        turned = np.linalg.norm(T[:3, :3] @ self.needle.axis - direction)
        beyond = self.robot.model.beyond_limits(q[None])[0]
        return bool(off <= TIP_TOLERANCE and turned <= TURN_TOLERANCE and not beyond)

    def _found(
        self, task: NeedleTask, starts: Array, home: Array, tip: Array, way: Array
    ) -> list[Array]:
        """Different solutions, nearest to home first."""
        qs, rest = _descended(task, starts, tip, way)
        if not (rest < _LEFT).any():
            qs, rest = _near_singular(task, qs, rest, tip, way)
        near = nearest_turns(self._turning, qs[rest < _LEFT], home, task)
        apart = APART if task.is_redundant else SAME
        order = np.argsort(np.abs(near - home).sum(axis=1), kind="stable")
        kept: list[Array] = []
        for q in near[order]:
            other = all(np.abs(q - one).max() > apart for one in kept)
            if other and self.reached(q, tip, way):
                kept.append(q)
        return kept

    @cached_property
    def _turning(self) -> NDArray[np.int64]:
        return single_turning(self.robot.model)

    def _reasons(
        self, task: NeedleTask, starts: Array, home: Array, tip: Array, way: Array
    ) -> Iterator[str]:
        """What stands against it: limits, reach, or the direction."""
        free, rest = _descended(task.without_limits(), starts, tip, way)
        solved = free[rest < _LEFT]
        if len(solved):
            yield from self._broken(solved, task, home)
            return
        _, short = _descended(task.of_tip_alone(), starts, tip, way)
        if short.min() > 1e-6:
            yield f"the nearest tip found is {1e3 * short.min():.1f} mm short"
            return
        qs, rest = _descended(task, starts, tip, way)
        q = qs[int(rest.argmin())]
        tips, axes = task.needles(q[None])
        off = 1e3 * float(np.linalg.norm(tips[0] - tip))
        turned = np.degrees(np.arccos(np.clip(axes[0] @ way, -1.0, 1.0)))
        yield (
            "the tip gets there, but not pointing that way: nearest is "
            f"{off:.1f} mm off and turned by {turned:.1f} deg"
        )

    def _broken(self, solved: Array, task: NeedleTask, home: Array) -> Iterator[str]:
        """Limits that those break which break least."""
        low, high = task.lower, task.upper
        near = nearest_turns(self._turning, solved, np.clip(home, low, high), task)
        beyond = np.maximum(low - near, near - high).clip(min=0.0)
        told: set[str] = set()
        for row in np.argsort(beyond.sum(axis=1), kind="stable"):
            line = ", ".join(
                f"{joint.name} would need {near[row, i]:.4g} "
                f"{'rad' if joint.is_angle else 'm'}, its limit is "
                f"{(low if near[row, i] < low[i] else high)[i]:.4g}"
                for i, joint in enumerate(self.robot.model.free_joints)
                if beyond[row, i] > 0.0
            )
            if line and line not in told and len(told) < _TOLD:
                told.add(line)
                yield line


@once_per_record
def _limits(robot: Robot) -> tuple[Array, Array]:
    """Bounds of every entry of q, limits of mimic joints included."""
    model = robot.model
    lower, upper = model.lower.copy(), model.upper.copy()
    for joint, (low, high) in model.moving_limits():
        source, factor, offset = model.driver(joint.name, joint.type)
        if factor != 0.0:
            ends = sorted(((low - offset) / factor, (high - offset) / factor))
            lower[source] = max(lower[source], ends[0])
            upper[source] = min(upper[source], ends[1])
    return lower, upper


def _task(robot: Robot, needle: Needle, held: tuple[int, ...]) -> NeedleTask:
    frame_of, chain = chain_of(robot)
    return NeedleTask(
        chain, frame_of[needle.tip or ""], needle.axis, *_limits(robot), held
    )


def _descended(
    task: NeedleTask, starts: Array, tip: Array, direction: Array
) -> tuple[Array, Array]:
    many = (len(starts), 1)
    return task.descend(starts, np.tile(tip, many), np.tile(direction, many))


def _near_singular(
    task: NeedleTask, qs: Array, rest: Array, tip: Array, way: Array
) -> tuple[Array, Array]:
    """The nearest of them, led on: where an arm is singular the last steps halve."""
    order = np.argsort(rest, kind="stable")[:MOST_LED_ON]
    led = qs[order[rest[order] < _PROMISING]]
    if not len(led):
        return qs, rest
    many = (len(led), 1)
    needles = np.tile(tip, many), np.tile(way, many)
    return task.for_singular().descend(led, *needles, STEPS_LED_ON)


def _asked(tip: ArrayLike, direction: ArrayLike) -> tuple[Array, Array]:
    """Both as arrays, the direction of length 1.

    Raises:
        UsageError: They are no three finite numbers, or the direction has no length.
    """
    both = []
    for name, given in (("tip", tip), ("direction", direction)):
        try:
            found = np.array(given, dtype=np.float64)
        except (TypeError, ValueError):
            raise UsageError(f"{name} is no list of three numbers") from None
        if found.shape != (3,) or not np.isfinite(found).all():
            raise UsageError(f"{name} is no list of three finite numbers")
        both.append(found)
    length = float(np.linalg.norm(both[1]))
    if not 1e-9 < length < 1e9:
        raise UsageError("direction has no length that tells a direction")
    return both[0], both[1] / length
