"""A plan's motion is held against the URDF: an inverse that is off is no plan."""

from dataclasses import replace

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.plans import plan_motion as module
from borecheck.plans.needle_line import TIP_TOLERANCE, TURN_TOLERANCE
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_file import read_plans
from borecheck.plans.plan_motion import plan_motion
from tests.places import PROJECT

PLAN = read_plans(PROJECT / "urdf" / "zerobot" / "examples" / "plans.csv")[0]


def off(monkeypatch, shift=0.0, aside=0.0, turned=0.0):
    """An inverse that brings the tip beyond the place asked, beside it, or turned."""
    real = module.hook

    def hook(reference):
        inverse = real(reference)

        def wrong(tip, direction, insertion, **arguments):
            other = np.cross(direction, (0.3, 0.5, 0.9))
            other /= np.linalg.norm(other)
            aim = direction + turned * other
            return inverse(
                tip + shift * direction + aside * other,
                aim / np.linalg.norm(aim),
                insertion,
                **arguments,
            )

        return wrong

    monkeypatch.setattr(module, "hook", hook)


@pytest.mark.parametrize(
    "wrong",
    [
        {"shift": -0.03},
        {"shift": 2.0 * TIP_TOLERANCE},
        {"aside": 0.3e-3},
        {"turned": 2.0 * TURN_TOLERANCE},
    ],
)
def test_an_inverse_that_is_off_is_refused(monkeypatch, zerobot, wrong):
    off(monkeypatch, **wrong)
    with pytest.raises(UsageError, match="not the plan's") as told:
        plan_motion(zerobot, PLAN)
    assert PLAN.name in str(told.value)
    shift = abs(sum(wrong.get(key, 0.0) for key in ("shift", "aside")))
    if shift > 1e-4:
        assert f"{1e3 * shift:.3f} mm" in str(told.value)


def test_what_rounding_is_off_by_is_not(monkeypatch, zerobot):
    off(monkeypatch, shift=0.5 * TIP_TOLERANCE, turned=0.3 * TURN_TOLERANCE)
    assert len(plan_motion(zerobot, PLAN).waypoints) == 3


def test_without_insertion_every_station_is_asked(monkeypatch):
    """Only beyond the first station the tip is off: the first alone would not tell."""
    robot = bc.load_robot("zerobot")
    arm = replace(robot, description=replace(robot.description, insertion_joint=None))
    short = NeedlePlan("short", PLAN.entry, tuple(np.add(PLAN.entry, (0, 0, -0.01))))
    assert len(plan_motion(arm, short).waypoints) > 20
    real, asked = module.hook, []

    def hook(reference):
        inverse = real(reference)

        def wrong(tip, direction, insertion, **arguments):
            asked.append(tip)
            late = 1e-3 if len(asked) == 20 else 0.0
            return inverse(tip + late * direction, direction, insertion, **arguments)

        return wrong

    monkeypatch.setattr(module, "hook", hook)
    with pytest.raises(UsageError, match=r"1\.000 mm"):
        plan_motion(arm, short)


@pytest.mark.parametrize("frame", [None, "nowhere"])
def test_a_description_without_a_frame_at_the_tip_has_no_plans(zerobot, frame):
    robot = replace(zerobot, description=replace(zerobot.description, tool_frame=frame))
    with pytest.raises(UsageError, match="tool_frame"):
        plan_motion(robot, PLAN)


def test_a_needle_that_is_driven_aside_is_refused(monkeypatch, zerobot):
    """Right at both ends; between them another joint leads the tip off the line."""
    real = module._Solver.add

    def add(self, tip, insertion):
        real(self, tip, insertion)
        if len(self.waypoints) == 3:
            q = self.waypoints[-1].copy()
            turns = [j.type != "prismatic" for j in self._robot.model.free_joints]
            q[np.flatnonzero(turns)[0]] += 2.0 * np.pi
            self.waypoints[-1] = q

    monkeypatch.setattr(module._Solver, "add", add)
    with pytest.raises(UsageError, match="not the plan's"):
        plan_motion(zerobot, PLAN)
