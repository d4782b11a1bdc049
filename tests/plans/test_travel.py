"""How a plan is driven: travel of the needle's drive, steps, branch, mount."""

import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from borecheck.errors import UsageError
from borecheck.plans import plan_motion as module
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import (
    UnreachableError,
    check_mount,
    nearest_turn,
    plan_motion,
)

# Zerobot's needle drive: 150 mm (docs/zerobot.md), from 0.
TRAVEL = 0.15
# closed form against Pinocchio near 1 m
ROUNDING = 1e-12


def plan(depth, **given):
    return NeedlePlan("p", (0.0, 0.0, 0.06), (0.0, 0.0, 0.06 - depth), **given)


def tips(robot, motion):
    frame = robot.description.tool_frame
    return np.array([robot.placements(q)[frame][:3, 3] for q in motion.waypoints])


@pytest.mark.parametrize(("beyond", "driven"), [(-1e-6, True), (1e-6, False)])
def test_the_needle_goes_as_deep_as_it_is_driven(zerobot, beyond, driven):
    if not driven:
        with pytest.raises(UnreachableError, match=r"150\.0 mm deep, but q6 drives"):
            plan_motion(zerobot, plan(TRAVEL + beyond))
        return
    motion = plan_motion(zerobot, plan(TRAVEL + beyond))
    drive = zerobot.model.joint_names.index("q6")
    np.testing.assert_allclose(
        motion.waypoints[:, drive], [0.0, 0.0, TRAVEL + beyond], atol=ROUNDING
    )


def test_a_drive_that_does_not_begin_at_zero_has_the_travel_between_its_ends(zerobot):
    """Drawn in at 0.03, out at 0.1: 70 mm, whatever the numbers are."""
    model = zerobot.model
    drive = model.joint_names.index("q6")
    lower, upper = np.array(model.lower), np.array(model.upper)
    lower[drive], upper[drive] = 0.03, 0.1
    shifted = copy.copy(model)
    shifted.lower, shifted.upper = lower, upper
    robot = replace(zerobot, model=shifted)
    with pytest.raises(UnreachableError, match=r"q6 drives it 70\.0 mm"):
        plan_motion(robot, plan(0.0701))
    motion = plan_motion(robot, plan(0.0699))
    np.testing.assert_allclose(
        motion.waypoints[:, drive], [0.03, 0.03, 0.0999], atol=ROUNDING
    )


@pytest.mark.parametrize("standoff", [0.0, 0.02])
def test_the_approach_is_as_long_as_asked(zerobot, standoff):
    motion = plan_motion(zerobot, plan(0.05), standoff)
    expected = [[0, 0, 0.06 + standoff], [0, 0, 0.06], [0, 0, 0.01]]
    np.testing.assert_allclose(tips(zerobot, motion), expected, atol=ROUNDING)


def test_the_corridor_is_the_plans_and_as_wide_as_the_needle(zerobot):
    motion = plan_motion(zerobot, plan(0.05))
    corridor = motion.corridor
    np.testing.assert_array_equal(corridor.entry, [0.0, 0.0, 0.06])
    np.testing.assert_allclose(corridor.target, [0.0, 0.0, 0.01])
    assert corridor.radius == zerobot.description.needle_radius > 0.0
    assert motion.plan.name == "p"


def test_an_arm_that_drives_the_needle_itself_stays_on_the_line(zerobot):
    """No drive: a configuration every 2 mm at most, all on one branch."""
    undriven = replace(zerobot.description, insertion_joint=None)
    robot = replace(zerobot, description=undriven)
    entry = np.array([0.0, 0.0, 0.06])
    for depth in (0.0301, 0.0499):
        target = entry - [0.0, 0.0, depth]
        motion = plan_motion(robot, NeedlePlan("p", entry, target), 0.01)
        places = tips(robot, motion)
        np.testing.assert_allclose(places[0], entry + [0, 0, 0.01], atol=1e-9)
        np.testing.assert_allclose(places[-1], target, atol=1e-9)
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        assert steps.max() <= 0.002 + 1e-9
        assert len(places) == int(np.ceil((0.01 + depth) / 0.002)) + 1
        assert np.abs(np.diff(motion.waypoints, axis=0)).max() < 0.1


@pytest.mark.parametrize(
    ("asked", "stands", "fits"),
    [
        ("-90", "-90", True),
        ("+90", "-90", False),
        ("+90", "90", True),
        (None, "-90", True),
    ],
)
def test_mounts_are_compared_as_numbers(asked, stands, fits):
    robot = SimpleNamespace(arguments={"mount": stands})
    if fits:
        check_mount(robot, plan(0.05, mount=asked))
    else:
        with pytest.raises(
            UsageError, match=r"for mount \+90, the robot stands at -90"
        ):
            check_mount(robot, plan(0.05, mount=asked))
    check_mount(SimpleNamespace(arguments={}), plan(0.05, mount=asked))


def test_without_a_closed_form_the_same_ends_are_searched(zerobot):
    """Two roads without common code: a typed formula, and a search along the URDF."""
    robot = replace(zerobot, description=replace(zerobot.description, inverse=None))
    closed = plan_motion(zerobot, plan(0.05)).waypoints
    searched = plan_motion(robot, plan(0.05)).waypoints
    assert len(searched) > len(closed)
    np.testing.assert_allclose(searched[[0, -2, -1]], closed, atol=1e-8)


def test_without_needle_and_inverse_a_path_is_asked_for(zerobot):
    bare = replace(zerobot.description, inverse=None, needle_link=None, tool_frame=None)
    with pytest.raises(UsageError, match="asked with --path"):
        plan_motion(replace(zerobot, description=bare), plan(0.05))


def test_a_continuous_joint_goes_the_short_way():
    """Within half a turn of where it was, by whole turns; others stay as they are."""
    model = SimpleNamespace(
        free_joints=[SimpleNamespace(type=t) for t in ("continuous", "revolute")]
    )
    turn = 2.0 * np.pi
    for q, before, expected in (
        (-3.1, 3.1, turn - 3.1),
        (3.1, -3.1, 3.1 - turn),
        (0.5, 0.5 + 5.0 * turn, 0.5 + 5.0 * turn),
        (1.0, -20.0, 1.0 - 3.0 * turn),
        (1.0, 1.0 + 0.49 * turn, 1.0),
        (1.0, 1.0 + 0.51 * turn, 1.0 + turn),
    ):
        found = nearest_turn(model, np.array([q, q]), np.array([before, before]))
        np.testing.assert_allclose(found, [expected, q], atol=1e-12)


def answered(monkeypatch, answer):
    """Inverse kinematics whose answers are changed."""
    real = module.hook

    def hook(reference):
        inverse = real(reference)
        return lambda *given, **named: answer(inverse(*given, **named))

    monkeypatch.setattr(module, "hook", hook)


def test_of_several_configurations_the_nearest_is_taken(monkeypatch, zerobot):
    expected = plan_motion(zerobot, plan(0.05)).waypoints

    def more(found):
        q = np.asarray(found.configurations[0])
        far = q + np.eye(len(q))[0] * 3.0
        return SimpleNamespace(configurations=[far, q, far + 1.0], rejected=())

    answered(monkeypatch, more)
    np.testing.assert_array_equal(plan_motion(zerobot, plan(0.05)).waypoints, expected)


@pytest.mark.parametrize(
    ("rejected", "words"),
    [((), "no solution"), (("q1 is too long", "q2"), r"q1 is too long \| or: q2")],
)
def test_without_a_configuration_each_reason_is_told(
    monkeypatch, zerobot, rejected, words
):
    none = SimpleNamespace(configurations=[], rejected=rejected)
    answered(monkeypatch, lambda _found: none)
    with pytest.raises(UnreachableError, match=f"plan p is out of reach: {words}$"):
        plan_motion(zerobot, plan(0.05))
