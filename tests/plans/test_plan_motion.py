from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_file import read_plans
from borecheck.plans.plan_motion import (
    UnreachableError,
    _not_solutions,
    motion_of_plan,
    plan_motion,
)
from tests.places import PROJECT, ROBOTS

PLANS = PROJECT / "urdf" / "zerobot" / "examples" / "plans.csv"

# closed form against Pinocchio: rounding of a few dozen operations near 1 m
ROUNDING = 1e-12


def tip(robot, q):
    return robot.placements(q)[robot.description.tool_frame]


@pytest.mark.parametrize("mount", ["+90", "-90"])
def test_the_needle_goes_along_the_plan(mount):
    robot = bc.load_robot("zerobot", mount=mount)
    plans = read_plans(PLANS)
    assert len(plans) >= 6
    for plan in plans:
        motion = plan_motion(robot, plan)
        entry, target = np.array(plan.entry), np.array(plan.target)
        along = (target - entry) / np.linalg.norm(target - entry)
        places = [tip(robot, q) for q in motion.waypoints]
        expected = [entry - 0.05 * along, entry, target]  # from 50 mm before
        for T, point in zip(places, expected, strict=True):
            np.testing.assert_allclose(T[:3, 3], point, atol=ROUNDING)
            np.testing.assert_allclose(T[:3, 2], along, atol=ROUNDING)


def test_insertion_moves_only_the_needle(zerobot):
    motion = plan_motion(zerobot, read_plans(PLANS)[0])
    change = motion.waypoints[2] - motion.waypoints[1]
    np.testing.assert_allclose(change[:5], 0.0, atol=ROUNDING)
    assert change[5] > 0.05


def test_the_base_may_stand_elsewhere():
    plan = read_plans(PLANS)[0]
    moved = np.eye(4)
    moved[:3, 3] = (0.02, -0.01, 0.03)
    robot = bc.load_robot("zerobot", base=moved)
    motion = plan_motion(robot, plan)
    np.testing.assert_allclose(
        tip(robot, motion.waypoints[2])[:3, 3], plan.target, atol=ROUNDING
    )


def test_out_of_reach_names_the_limit(zerobot):
    plan = NeedlePlan("far", (0.0, 0.9, 0.1), (0.0, 0.9, 0.05))
    with pytest.raises(UnreachableError, match=r"q3 = .* its limit"):
        plan_motion(zerobot, plan)


def test_deeper_than_the_needle_drive(zerobot):
    plan = NeedlePlan("deep", (0.0, 0.0, 0.1), (0.0, 0.0, -0.2))
    with pytest.raises(UnreachableError, match="q6 drives it 150"):
        plan_motion(zerobot, plan)


def test_another_mount_is_refused(zerobot):
    plan = NeedlePlan("m", (0.0, 0.0, 0.0), (0.0, 0.0, -0.05), mount="-90")
    with pytest.raises(UsageError, match="mount"):
        plan_motion(zerobot, plan)


def test_a_motion_of_a_plan_for_another_mount_is_refused(zerobot):
    plan = read_plans(PLANS)[0]
    waypoints = plan_motion(zerobot, plan).waypoints
    assert motion_of_plan(zerobot, plan, waypoints).plan is plan
    other = "-90" if zerobot.arguments["mount"] == "+90" else "+90"
    with pytest.raises(UsageError, match=f"is for mount .{other[1:]}, the robot"):
        motion_of_plan(zerobot, replace(plan, mount=other), waypoints)


@pytest.mark.parametrize(
    ("configurations", "rejected", "said"),
    [
        (((1.0, 2.0),), (), None),
        ([], ["q1 is too long"], None),
        (((1.0, 2.0),), None, "it must be Solutions"),
        (None, (), "it must be Solutions"),
        (((1.0, 2.0), (1.0,)), (), r"shape (1,), not (2,)"),
        (((1.0, "far"),), (), "is not numbers"),
        (((1.0, np.inf),), (), "is not finite"),
    ],
)
def test_what_an_inverse_gives_is_looked_at(configurations, rejected, said):
    given = SimpleNamespace(configurations=configurations, rejected=rejected)
    found = _not_solutions(2, given)
    assert found is None if said is None else said in found
    assert "it must be Solutions" in _not_solutions(2, None)


def test_a_stranger_has_no_inverse():
    stranger = ROBOTS / "two_link.urdf"
    plan = NeedlePlan("m", (0.0, 0.0, 0.0), (0.0, 0.0, -0.05))
    with pytest.raises(UsageError, match="--path"):
        plan_motion(bc.load_robot(stranger), plan)
