"""Needle plans of arms without a closed form: on the line at every instant."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.plans.needle_line import TIP_TOLERANCE, TURN_TOLERANCE, NeedleLine
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import (
    STANDOFF,
    UnreachableError,
    motion_of_plan,
    plan_motion,
)
from borecheck.plans.whole_arm import JUMP, _Followed
from tests.places import ROBOTS

PLAN = NeedlePlan("steep", (0.5, 0.0, 0.1), (0.49, 0.02, 0.03))
SLANTED = NeedlePlan("slanted", (0.42, 0.1, 0.2), (0.37, 0.15, 0.14))


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(
        ROBOTS / "needle_arm.urdf", needle="needle_link", tip="needle_tip"
    )


@pytest.fixture(scope="module")
def driven():
    return bc.load_robot(
        ROBOTS / "driven_arm.urdf",
        needle="needle_link",
        tip="needle_tip:z",
        insertion="drive",
    )


@pytest.fixture(scope="module")
def waypoints(arm):
    return plan_motion(arm, PLAN).waypoints


def needles(robot, waypoints, parts=7):
    """By Pinocchio, at instants that the proof does not look at: tips, directions."""
    places = np.linspace(0.0, len(waypoints) - 1.0, parts * (len(waypoints) - 1) + 1)
    at = np.arange(len(waypoints))
    T = [
        robot.placements([np.interp(p, at, joint) for joint in waypoints.T])
        for p in places
    ]
    T = np.array([one[robot.needle.tip] for one in T])
    return T[:, :3, 3], T[:, :3, :3] @ robot.needle.axis


@pytest.mark.parametrize("plan", [PLAN, SLANTED], ids=lambda plan: plan.name)
@pytest.mark.parametrize("name", ["arm", "driven"])
def test_the_needle_stays_on_its_line_between_stations_too(name, plan, request):
    robot = request.getfixturevalue(name)
    found = plan_motion(robot, plan).waypoints
    tips, ways = needles(robot, found)
    along = (tips - plan.entry) @ plan.direction
    aside = tips - plan.entry - np.outer(along, plan.direction)
    assert np.linalg.norm(aside, axis=1).max() <= TIP_TOLERANCE
    assert np.linalg.norm(ways - plan.direction, axis=1).max() <= TURN_TOLERANCE
    assert along[0] == pytest.approx(-STANDOFF, abs=1e-9)
    assert along[-1] == pytest.approx(plan.length, abs=1e-9)
    assert (np.diff(along) > 0.0).all()
    assert not robot.model.beyond_limits(found).any()


def test_a_driven_needle_moves_alone_in_the_patient(driven):
    change = np.diff(plan_motion(driven, PLAN).waypoints[-2:], axis=0)[0]
    assert change[-1] == pytest.approx(PLAN.length)
    assert (change[:-1] == 0.0).all()


def test_a_drive_that_is_too_short_is_told(driven):
    deep = NeedlePlan("deep", (0.5, 0.0, 0.2), (0.5, 0.0, 0.05))
    with pytest.raises(UnreachableError, match=r"150\.0 mm deep, but drive .* 100\.0"):
        plan_motion(driven, deep)


def test_a_joint_that_drives_aside_is_no_insertion(driven):
    """The same joint, said to drive a needle that points elsewhere than it slides."""
    crooked = bc.load_robot(driven.file, needle="needle_link", tip="needle_tip")
    turned = crooked.needle.axis + (0.02, 0.0, 0.0)
    needle = replace(
        crooked.needle, axis=turned / np.linalg.norm(turned), insertion="drive"
    )
    crooked = replace(crooked, stated_needle=needle)
    with pytest.raises(UnreachableError, match="strays"):
        plan_motion(crooked, PLAN)


@pytest.mark.parametrize(
    ("entry", "target", "says"),
    [
        ((0.5, 0.0, -0.9), (0.5, 0.0, -0.95), r"no configuration was found .* short"),
        ((0.5, 0.0, 0.1), (0.5, 0.0, 0.2), "its limit is"),
        ((0.9, 0.0, 0.3), (1.0, 0.0, 0.2), r"farthest ends \d+\.\d mm before the end"),
    ],
)
def test_what_is_not_found_has_a_reason(arm, entry, target, says):
    with pytest.raises(UnreachableError, match=says) as told:
        plan_motion(arm, NeedlePlan("far", entry, target))
    assert "plan far" in str(told.value)


def test_a_beginning_that_jumps_ends_no_other():
    """Three ways of two joints; the second jumps at the last station."""
    steps = {0.01: [0.1, 0.1, 0.2], 0.02: [0.1, -2.0 * JUMP, 0.9 * JUMP]}

    def descend(before, tip, _aim):
        change = np.array(steps[round(float(tip[0, 2]), 6)])
        return before + np.outer(change, [0.0, 1.0]), np.zeros(len(before))

    task = SimpleNamespace(
        descend=descend, active=[0, 1], lower=[-1.0, -1.0], upper=[1.0, 1.0]
    )
    plan = NeedlePlan("up", (0.0, 0.0, 0.0), (0.0, 0.0, 0.02))
    followed = _Followed(task, plan, np.array([0.0, 0.01, 0.02]))
    begins = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    ways = followed.motions(begins)
    assert ways[:, 0].tolist() == [[0.0, 0.0], [2.0, 0.0]]
    np.testing.assert_allclose(ways[:, -1, 1], [0.2, 0.2 + 0.9 * JUMP])
    # what ended is told: where it was, and which joint stood at its limit
    said = followed.why(("turn", "lift"))
    assert "the farthest ends 0.0 mm before the end: turn is at its limit 1" in said
    assert "lift" not in said


def test_of_several_ways_the_one_with_most_room_is_taken(arm):
    """Whatever room is said to be: the wrist bent this way, or that way."""
    joint = arm.model.joint_names.index("joint_5")
    ends = [
        plan_motion(arm, PLAN, room=lambda qs, s=sign: s * qs[:, joint]).waypoints
        for sign in (1.0, -1.0)
    ]
    assert ends[0][:, joint].min() > ends[1][:, joint].max()


def test_the_same_plan_gives_the_same_motion_bit_by_bit(arm, waypoints):
    again = bc.load_robot(arm.file, needle="needle_link", tip="needle_tip")
    assert np.array_equal(plan_motion(again, PLAN).waypoints, waypoints)


def test_the_bound_on_straying_holds_and_is_not_idle(arm, waypoints):
    """Of a motion with few stations: above what dense samples see, and not by much."""
    few = waypoints[::2]
    line = NeedleLine(arm, arm.needle, "few", PLAN.entry, PLAN.direction)
    distances = np.array([line.distance(q) for q in few])
    off, turned = line.strays(few, distances)
    tips, ways = needles(arm, few, parts=31)
    shares = np.linspace(0.0, len(few) - 1.0, len(tips))
    wanted = np.interp(shares, np.arange(len(few)), distances)
    seen = np.linalg.norm(
        tips - PLAN.entry - np.outer(wanted, PLAN.direction), axis=1
    ).max()
    seen_turned = np.linalg.norm(ways - PLAN.direction, axis=1).max()
    assert seen > 2.0 * TIP_TOLERANCE  # the premise: it does stray
    assert seen <= off <= 2.0 * seen
    assert seen_turned <= turned <= 2.0 * seen_turned


def test_a_plans_own_motion_is_taken_for_it(arm, waypoints):
    found = motion_of_plan(arm, PLAN, waypoints)
    assert np.array_equal(found.waypoints, waypoints)
    np.testing.assert_array_equal(found.corridor.target, PLAN.target)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda q: q[:-1], "target"),
        (lambda q: q[3:], "stand-off"),
        (lambda q: q[:1], "stand-off"),
        (lambda q: np.vstack([q[:5], q[3:]]), "goes back"),
        (lambda q: q[[0, 5, -1]], "not shown to stay"),
        (lambda q: q + [0.0, 0.0, 0.0, 0.0, 2e-4, 0.0], "stand-off|stay"),
        (lambda q: q[::-1], "stand-off"),
    ],
)
def test_a_motion_that_is_not_the_plans_is_refused(arm, waypoints, spoil, says):
    with pytest.raises(UsageError, match=says):
        motion_of_plan(arm, PLAN, spoil(waypoints))


def test_another_plans_motion_is_refused(arm):
    with pytest.raises(UsageError):
        motion_of_plan(arm, PLAN, plan_motion(arm, SLANTED).waypoints)


def test_many_steps_back_are_a_way_back(arm, waypoints):
    """Each of them within the tolerance of a step; together a retraction of 1.5 mm."""
    line = NeedleLine(arm, arm.needle_with_tip(), PLAN.name, PLAN.entry, PLAN.direction)
    last, before = waypoints[-1], waypoints[-2]
    length = line.distance(last) - line.distance(before)
    back = [last + k * 9e-6 / length * (before - last) for k in range(1, 160)]
    with pytest.raises(UsageError, match="goes back"):
        motion_of_plan(arm, PLAN, np.vstack([waypoints, back, last]))


def test_what_a_drive_is_to_do_the_arm_may_not(driven):
    waypoints = plan_motion(driven, PLAN).waypoints
    motion_of_plan(driven, PLAN, waypoints)  # its own is taken
    bare = bc.load_robot(driven.file, needle="needle_link", tip="needle_tip:z")
    whole = plan_motion(bare, PLAN).waypoints  # every joint takes part
    motion_of_plan(bare, PLAN, whole)
    with pytest.raises(UsageError, match=r"arm moves|needle before|not stop"):
        motion_of_plan(driven, PLAN, whole)
    with pytest.raises(UsageError, match="does not stop at the plan's entry"):
        motion_of_plan(driven, PLAN, np.delete(waypoints, -2, axis=0))
