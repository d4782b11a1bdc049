"""From a needle plan to a motion of the robot: stand-off, entry, target."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import inverse
from borecheck.errors import UsageError
from borecheck.plans.corridor import Corridor
from borecheck.plans.needle_corridor import corridor_along
from borecheck.plans.needle_line import NeedleLine
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.whole_arm import Room, drives_from, hold_motion, whole_arm_motion
from borecheck.plans.whole_arm import UnreachableError as UnreachableError
from borecheck.robots.description import RobotDescription, hook, plugin_hook
from borecheck.robots.model import RobotModel
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]

# Where the approach along the needle's line begins, before the skin. Assumed: longer
# than any drape or marker, short enough for the stages' travel.
STANDOFF = 0.05

# Without an insertion joint the arm itself drives the needle: one configuration for
# every so many metres, so that the tip stays within micrometres of the line.
STEP = 0.002


@dataclass(frozen=True, eq=False)
class PlanMotion:
    """A plan as the robot drives it.

    Attributes:
        plan: The plan.
        waypoints: Configurations in the order of the URDF's joints, (k, n).
        corridor: Where the needle may be in the patient.
    """

    plan: NeedlePlan
    waypoints: Array
    corridor: Corridor


def plan_motion(
    robot: Robot,
    plan: NeedlePlan,
    standoff: float = STANDOFF,
    room: Room | None = None,
) -> PlanMotion:
    """The motion that carries out a plan: approach along its line, then insertion.

    With an insertion joint the stages carry the needle to the entry point and stand
    still while it is driven; otherwise the whole arm follows the line. A description's
    closed form is used where it is of the needle asked for; else configurations are
    searched (`whole_arm`).

    Args:
        robot: A robot with a needle and a frame at its tip.
        plan: Entry and target in the scanner's frame, [m].
        standoff: Length of the approach, [m].
        room: Of configurations (k, n) how much room there is: of several motions the
            one with most is taken, else the one nearest to home.

    Raises:
        UsageError: The robot has no needle, or inverse kinematics that brings the
            needle elsewhere than the URDF says; or the plan has another mount.
        UnreachableError: The plan is out of reach.
    """
    check_mount(robot, plan)
    if has_closed_form(robot):
        waypoints = _closed_form_motion(robot, plan, standoff)
    else:
        waypoints = whole_arm_motion(robot, plan, standoff, room)
    corridor = corridor_along(robot, waypoints, plan.entry, plan.target)
    return PlanMotion(plan, waypoints, corridor)


def has_closed_form(robot: Robot) -> bool:
    """Whether a description's inverse kinematics is of the robot's needle."""
    described = robot.description is not None and robot.description.inverse is not None
    return described and robot.stated_needle is None


def motion_of_plan(
    robot: Robot, plan: NeedlePlan, waypoints: Array, standoff: float = STANDOFF
) -> PlanMotion:
    """A plan with the motion that somebody found for it, if it is one.

    Raises:
        UsageError: It is none; see `whole_arm.hold_motion`.
    """
    check_mount(robot, plan)
    hold_motion(robot, plan, standoff, waypoints)
    corridor = corridor_along(robot, waypoints, plan.entry, plan.target)
    return PlanMotion(plan, waypoints, corridor)


def _closed_form_motion(robot: Robot, plan: NeedlePlan, standoff: float) -> Array:
    description = robot.description
    assert description is not None  # `has_closed_form`
    entry, depth, direction = plan.entry, plan.length, plan.direction
    if description.insertion_joint is not None:
        start = drives_from(robot, description.insertion_joint, depth)
        stations = [(-standoff, start), (0.0, start), (depth, start + depth)]
    else:
        count = int(np.ceil((standoff + depth) / STEP)) + 1
        stations = [(d, 0.0) for d in np.linspace(-standoff, depth, count)]
    solver = _Solver(robot, description, plan, direction)
    line = NeedleLine(robot, robot.needle, plan.name, entry, direction)
    for distance, insertion in stations:
        solver.add(entry + distance * direction, insertion)
        line.hold(solver.waypoints[-1], distance)
    if description.insertion_joint is not None:
        line.hold(0.5 * (solver.waypoints[-2] + solver.waypoints[-1]), 0.5 * depth)
    return np.array(solver.waypoints)


def check_mount(robot: Robot, plan: NeedlePlan) -> None:
    """Refuses a plan for the other mounting side.

    Raises:
        UsageError: The robot stands at another mount.
    """
    mount = robot.arguments.get("mount")
    if plan.mount is None or mount is None:
        return
    if float(plan.mount) != float(mount):
        raise UsageError(
            f"plan {plan.name} is for mount {plan.mount}, the robot stands at {mount}"
        )


def nearest_turn(model: RobotModel, q: Array, before: Array) -> Array:
    """The same configuration, continuous joints within half a turn of where they were.

    Inverse kinematics gives angles within one turn; from 3.1 to -3.1 rad the joint is
    meant to go the short way.
    """
    turns = np.array([joint.type == "continuous" for joint in model.free_joints])
    whole = 2.0 * np.pi * np.round((before - q) / (2.0 * np.pi))
    return np.where(turns, q + whole, q)


def inverse_of(description: RobotDescription) -> Callable[..., Any]:
    """The inverse kinematics of a description that has one.

    Raises:
        UsageError: No such function; when called: its own exception, or a result that
            is not `Solutions`.
    """
    wrong = partial(_not_solutions, len(description.joints))
    return plugin_hook(description, "inverse", hook, wrong)


def _not_solutions(count: int, result: Any) -> str | None:
    """What is wrong with what the inverse hook returned."""
    found = getattr(result, "configurations", None)
    rejected = getattr(result, "rejected", None)
    if not all(isinstance(given, tuple | list) for given in (found, rejected)):
        return "it must be Solutions((q, ...), (line, ...))"
    for q in found or ():
        try:
            q = np.asarray(q, dtype=np.float64)
        except (TypeError, ValueError):
            return f"configuration {q!r} is not numbers"
        if q.shape != (count,):
            return f"a configuration has shape {q.shape}, not ({count},) as `joints`"
        if not np.isfinite(q).all():
            return f"configuration {q.tolist()} is not finite"
    return None


class _Solver:
    """Inverse kinematics along a line, staying on one branch."""

    def __init__(
        self,
        robot: Robot,
        description: RobotDescription,
        plan: NeedlePlan,
        direction: Array,
    ) -> None:
        self._robot = robot
        self._description = description
        self._plan = plan
        self._inverse = inverse_of(description)
        self._T_base_scene = inverse(robot.T_scene_base)
        self._direction = self._T_base_scene[:3, :3] @ direction
        self._arguments = {
            name: robot.arguments[name] for name in description.closed_form_arguments
        }
        self.waypoints: list[Array] = []

    def add(self, tip: Array, insertion: float) -> None:
        """Adds the configuration that puts the tip there."""
        tip_base = self._T_base_scene[:3, :3] @ tip + self._T_base_scene[:3, 3]
        found: Any = self._inverse(
            tip_base, self._direction, insertion, **self._arguments
        )
        if not found.configurations:
            reasons = " | or: ".join(found.rejected) or "no solution"
            raise UnreachableError(f"plan {self._plan.name} is out of reach: {reasons}")
        before = self.waypoints[-1] if self.waypoints else self._robot.home
        options = [
            nearest_turn(self._robot.model, self._in_urdf(np.asarray(q)), before)
            for q in found.configurations
        ]
        self.waypoints.append(
            min(options, key=lambda q: float(np.linalg.norm(q - before)))
        )

    def _in_urdf(self, q_paper: Array) -> Array:
        """The configuration in the URDF's joints, by the description's bridge."""
        values = {
            joint.name: joint.sign * float(value) + joint.offset
            for joint, value in zip(self._description.joints, q_paper, strict=True)
        }
        return self._robot.model.configuration(values)
