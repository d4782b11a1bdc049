"""How far may a plan be off: directions and targets about it that stay clear, proven.

All directions in a cone about the plan's, to every target in a ball about its target,
are asked as one cell of the map, which is halved a few times where that is needed.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from borecheck.core.units import parse_angle
from borecheck.directions.chart import Chart
from borecheck.directions.leaves import (
    CLEAR,
    CONTACT,
    IS_CLEAR,
    IS_CONTACT,
    IS_OUT,
    OUT,
    UNDECIDED,
    Leaves,
)
from borecheck.directions.refine import Refinement
from borecheck.directions.settle import settled
from borecheck.directions.setup import MapSetup, Requirements
from borecheck.errors import UsageError
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import STANDOFF
from borecheck.robots.given import length, refuse_others
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

# A cone's cell is halved so often before it is given up.
HALVINGS = 4
# Angles that are told besides the largest target error, [rad].
ANGLES = tuple(np.radians((1.0, 0.5, 0.25, 0.1)))
# Target errors that are told, [m].
ERRORS = tuple(
    1e-3 * e for e in (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0, 15.0, 20.0)
)


@dataclass(frozen=True)
class Held:
    """Whether a plan stays clear when it is off.

    Attributes:
        state: "clear"; "contact" or "out" where some directions surely are; else
            "undecided".
        reason: Why it is not clear; empty if it is.
        angle: For every direction so near, [rad].
        target_error: And every target so near, [m].
    """

    state: str
    reason: str
    angle: float
    target_error: float

    @property
    def clear(self) -> bool:
        """Whether it stays clear, proven."""
        return self.state == CLEAR


def tolerance(
    robot: Robot,
    scene: Scene,
    plan: NeedlePlan,
    *,
    angle: float | str = "1deg",
    target_error: float | str = 0.0,
    margin: float | str = 0.0,
) -> Held:
    """Whether a plan stays clear for every direction and target near its own.

    Args:
        robot: From `load_robot`, with a chart of directions (zerobot).
        scene: From `load_scene`, with a patient.
        plan: The plan; its entry gives the direction, the skin is the patient's.
        angle: Every direction so near, [rad] or "1deg".
        target_error: Every target so near, [m] or "2mm".
        margin: Required clearance to obstacles, [m] or "5mm".

    Raises:
        UsageError: No chart, no patient, or a number that makes no sense.
    """
    refuse_others(robot, scene)
    cone = parse_angle(angle) if isinstance(angle, str) else length(angle, "angle")
    error = length(target_error, "target_error")
    if not (0.0 < cone < 0.5 * np.pi and error >= 0.0):
        raise UsageError("a tolerance is an angle above 0, and a length of 0 or more")
    return _Question.of(robot, scene, plan, length(margin, "margin")).held(cone, error)


def largest_tolerance(
    robot: Robot, scene: Scene, plan: NeedlePlan, margin: float = 0.0
) -> Held | None:
    """How far a plan may be off: an angle, and a target error together with it.

    Of `ANGLES` the largest that can be proven of the target itself; then the largest of
    `ERRORS` that can be with it. None if not even the smallest angle can.

    Raises:
        UsageError: As in `tolerance`.
    """
    question = _Question.of(robot, scene, plan, margin)
    for angle in ANGLES:
        best = question.held(angle, 0.0)
        if best.clear:
            break
    else:
        return None
    low, high = -1, len(ERRORS)
    while high - low > 1:
        middle = (low + high) // 2
        # solids in one another were asked for: these cells hang together with those
        found = question.held(best.angle, ERRORS[middle], solids=False)
        low, high = (middle, high) if found.clear else (low, middle)
        best = found if found.clear else best
    return best


@dataclass(frozen=True, eq=False)
class _Question:
    """A plan about which cones are asked."""

    chart: Chart
    scene: Scene
    angles: Array
    margin: float

    @classmethod
    def of(
        cls, robot: Robot, scene: Scene, plan: NeedlePlan, margin: float
    ) -> "_Question":
        if not any(obstacle.role == "patient" for obstacle in scene.obstacles):
            raise UsageError("a tolerance needs a patient: add --patient")
        chart = Chart.of(robot, plan.target)
        return cls(chart, scene, chart.angles(plan.direction[None])[0], margin)

    def held(self, angle: float, error: float, *, solids: bool = True) -> Held:
        """Whether all directions and targets so near are clear.

        Args:
            angle: So near, [rad].
            error: And so near, [m].
            solids: Whether to ask also if a solid holds another.
        """
        half = self.chart.about.halves(self.angles, angle)
        box = np.array([self.angles - half, self.angles + half])
        limits = self.chart.limits
        if not ((box[0] >= limits[0]) & (box[1] <= limits[1])).all():
            text = "a direction so near is beyond the limits of its joints"
            return Held(OUT, text, angle, error)
        smallest = float((2.0 * half).max()) / 2**HALVINGS
        asked = Requirements(self.margin, error, STANDOFF, resolution=smallest)
        setup = MapSetup(self.chart, self.scene, asked, box)
        if setup.skin.trouble is not None:
            return Held(UNDECIDED, setup.skin.trouble, angle, error)
        return replace(_judged(setup, solids), angle=angle, target_error=error)


def _judged(setup: MapSetup, solids: bool) -> Held:
    """What the cells of a box say together; the first that is not clear ends it."""
    refinement = Refinement(setup)
    leaves: Leaves | None = None
    for leaves in refinement.rounds():
        if (leaves.state == IS_CONTACT).any() or (leaves.state == IS_OUT).any():
            break
    assert leaves is not None  # there is a first round
    found = settled(setup, leaves, refinement.causes) if solids else leaves
    for state, name in ((IS_CONTACT, CONTACT), (IS_OUT, OUT)):
        rows = np.flatnonzero(found.state == state)
        if len(rows):
            why = refinement.causes.listed[int(found.cause[rows[0]])].text
            return Held(name, why, 0.0, 0.0)
    rows = np.flatnonzero(found.state != IS_CLEAR)
    if len(rows):
        why = refinement.causes.listed[int(found.cause[rows[0]])].text
        return Held(UNDECIDED, why, 0.0, 0.0)
    return Held(CLEAR, "", 0.0, 0.0)
