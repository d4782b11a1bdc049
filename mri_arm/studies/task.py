"""The task of [Heikkila2010] section 5: by non-collision steps to 10 mm from the entry.

The arm goes from its home to a place on the needle's line away from the head, along
that line to 10 mm from the surface, and then only the needle moves. Every step is
certified for every instant; no step is taken that is not. Speeds: the tip at most 5
cm/s (section 6), the joints at most as the URDF says.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

import borecheck as bc
from borecheck.contact.settings import settings
from borecheck.errors import UsageError
from borecheck.motion.check import check_motion
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from mri_arm.description import DESCRIPTION
from mri_arm.kinematics import inverse, jacobian

Array = NDArray[np.float64]

STANDOFF = 0.010  # section 5: "to a distance 10 mm from the surface"
TIP_SPEED = 0.05  # section 6: "ca. 5 cm / sec"

# Distances from the entry at which the arm comes onto the needle's line, assumed.
RETREATS = (0.30, 0.20, 0.12, 0.06, 0.03)

STEP = 0.02  # along the line [m]: the tip leaves it by micrometres in between
VIA_TRIED = 40  # random configurations drawn between home and the line
VIA_CERTIFIED = 8  # of which so many, the first that are free, are looked at
SAMPLES = 60  # of a stretch, to find the fastest moment

# A smooth start and stop: position 10 s^3 - 15 s^4 + 6 s^5, whose rate peaks at 15/8.
PEAK = 15.0 / 8.0


@dataclass(frozen=True, eq=False)
class Step:
    """A part of the task.

    Attributes:
        name: What it does.
        waypoints: Configurations, (k, 7), straight in between.
        seconds: Duration of every stretch, (k - 1,).
        verdict: clear, contact or unknown, for every instant.
        reason: One sentence.
    """

    name: str
    waypoints: Array
    seconds: Array
    verdict: str
    reason: str


@dataclass(frozen=True, eq=False)
class Task:
    """The whole task, or why there is none.

    Attributes:
        steps: Gross motion, approach, insertion; empty if no way was found.
        reason: One sentence.
        tried: How many ways were looked at.
    """

    steps: tuple[Step, ...]
    reason: str
    tried: int

    @property
    def verdict(self) -> str:
        """Clear if every step is."""
        if self.steps and all(step.verdict == "clear" for step in self.steps):
            return "clear"
        return "unknown"

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return float(sum(step.seconds.sum() for step in self.steps))


def plan_task(
    robot: Robot,
    scene: Scene,
    entry: ArrayLike,
    target: ArrayLike,
    *,
    margin: float = 0.0,
    seed: int = 0,
) -> Task:
    """Non-collision steps that bring the needle to its target.

    Args:
        robot: `load_robot("mri_arm", ...)`.
        scene: The magnet.
        entry: On the skin, scanner's frame, (3,), [m].
        target: Tip of the needle at the end, (3,), [m].
        margin: Clearance that the gross motion keeps, [m].
        seed: Of the configurations tried in between.

    Raises:
        UsageError: The insertion axis is too short for the depth.
    """
    entry, target = np.asarray(entry, dtype=float), np.asarray(target, dtype=float)
    depth = float(np.linalg.norm(target - entry))
    travel = float(robot.model.upper[-1])
    if STANDOFF + depth > travel:
        raise UsageError(
            f"the target is {1e3 * depth:.1f} mm deep; with {1e3 * STANDOFF:.0f} mm "
            f"stand-off the insertion axis reaches {1e3 * (travel - STANDOFF):.1f} mm"
        )
    direction = (target - entry) / depth
    rng = np.random.default_rng(seed)
    tried = 0
    for line in _lines(robot, entry, direction):
        tried += 1
        if not _free_at_samples(robot, scene, line):
            continue
        approach = _checked("approach", robot, scene, line, margin)
        if approach.verdict != "clear":
            continue
        gross = _gross_motion(robot, scene, line[0], margin, rng)
        if gross is None:
            continue
        insertion = _insertion(robot, scene, line[-1], entry, target)
        if insertion.verdict == "clear":
            return Task((gross, approach, insertion), "every instant is clear", tried)
    reason = f"no clear way among {tried} lines of approach"
    return Task((), reason, tried)


def durations(robot: Robot, waypoints: Array) -> Array:
    """Seconds for every stretch between waypoints, (k - 1,).

    The shortest with a smooth start and stop at each waypoint that keeps the tip below
    5 cm/s and every joint below its speed in the URDF.
    """
    joints = {joint.name: joint for joint in robot.model.tree.joints}
    fastest = np.array(
        [_speed_limit(joints[name].limits) for name in robot.model.joint_names]
    )
    seconds = []
    for start, end in pairwise(waypoints):
        step = end - start
        by_joints = float((np.abs(step) / fastest).max())
        by_tip = max(
            float(np.linalg.norm(_tip_jacobian(robot, start + s * step) @ step))
            for s in np.linspace(0.0, 1.0, SAMPLES)
        )
        seconds.append(PEAK * max(by_joints, by_tip / TIP_SPEED))
    return np.array(seconds)


def tip_speeds(robot: Robot, step: Step, samples: int = 200) -> Array:
    """Speed of the tip at instants of a step, (stretches, samples), [m/s]."""
    s = np.linspace(0.0, 1.0, samples)
    rate = 30.0 * s**2 * (1.0 - s) ** 2
    place = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    speeds = []
    stretches = zip(step.waypoints[:-1], step.waypoints[1:], step.seconds, strict=True)
    for start, end, seconds in stretches:
        speeds.append(
            [
                r
                * np.linalg.norm(
                    _tip_jacobian(robot, start + p * (end - start)) @ (end - start)
                )
                / seconds
                for r, p in zip(rate, place, strict=True)
            ]
        )
    return np.array(speeds)


def _speed_limit(limits: object) -> float:
    velocity = getattr(limits, "velocity", None)
    return float("inf") if velocity is None else float(velocity)


def _tip_jacobian(robot: Robot, q: Array) -> Array:
    return jacobian(q, needle_mount=robot.arguments["needle_mount"])[:3]


def _arguments(robot: Robot) -> dict[str, str]:
    names = ("base_x", "base_y", "base_yaw", "needle_mount", "needle_length")
    return {name: robot.arguments[name] for name in names}


def _lines(robot: Robot, entry: Array, direction: Array) -> Iterator[Array]:
    """Ways along the needle's line to 10 mm from the entry, one branch each, (k, 7)."""
    end = _solutions(robot, entry - STANDOFF * direction, direction)
    for q_end in sorted(end, key=lambda q: float(np.abs(q).max())):
        for retreat in RETREATS:
            line = [q_end]
            count = int(np.ceil((retreat - STANDOFF) / STEP))
            for distance in np.linspace(STANDOFF, retreat, count + 1)[1:]:
                found = _solutions(robot, entry - distance * direction, direction)
                near = [q for q in found if np.abs(q - line[-1]).max() < 0.5]
                if not near:
                    break
                line.append(min(near, key=lambda q: float(np.abs(q - line[-1]).max())))
            else:
                yield np.array(line[::-1])


def _solutions(robot: Robot, tip: Array, direction: Array) -> Sequence[Array]:
    found = inverse(tip, direction, 0.0, **_arguments(robot))  # type: ignore[arg-type]
    return found.configurations


def _gross_motion(
    robot: Robot, scene: Scene, goal: Array, margin: float, rng: np.random.Generator
) -> Step | None:
    """From home to the line: straight, or over one configuration in between.

    The first in between is the goal with the turret where it is at home: the arm takes
    its attitude outside the magnet and swings in level.
    """
    swing = goal.copy()
    swing[0] = robot.home[0]
    drawn = robot.model.random_configurations(rng, VIA_TRIED)
    drawn[:, -1] = 0.0
    via = np.vstack([swing, drawn])
    free = via[~bc.first_contacts(robot, scene, via)]
    for between in ([], *([q] for q in free[:VIA_CERTIFIED])):
        way = np.array([robot.home, *between, goal])
        if not _free_at_samples(robot, scene, way):
            continue
        step = _checked("gross motion", robot, scene, way, margin)
        if step.verdict == "clear":
            return step
    return None


def _free_at_samples(robot: Robot, scene: Scene, waypoints: Array) -> bool:
    """Whether samples show no contact: says nothing for certain, but saves work."""
    share = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    qs = np.vstack([a + share * (b - a) for a, b in pairwise(waypoints)])
    return not bc.first_contacts(robot, scene, qs, containment=False).any()


def _checked(
    name: str, robot: Robot, scene: Scene, waypoints: Array, margin: float
) -> Step:
    found = bc.check_path(robot, scene, waypoints, margin=margin)
    seconds = durations(robot, waypoints)
    return Step(name, waypoints, seconds, found.verdict, found.reason)


def _insertion(
    robot: Robot, scene: Scene, start: Array, entry: Array, target: Array
) -> Step:
    """Only the needle moves, through the skin along its line to the target."""
    end = start.copy()
    end[-1] = STANDOFF + float(np.linalg.norm(target - entry))
    waypoints = np.array([start, end])
    corridor = Corridor(entry, target, DESCRIPTION.needle_radius)
    found = check_motion(robot, scene, waypoints, settings(), corridor=corridor)
    seconds = durations(robot, waypoints)
    return Step("insertion", waypoints, seconds, found.verdict, found.reason)
