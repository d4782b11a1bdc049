"""The task by non-collision steps: certified, on its line, slow enough."""

from itertools import pairwise

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from mri_arm.kinematics import forward
from mri_arm.studies.task import STANDOFF, TIP_SPEED, plan_task, tip_speeds

ENTRY = np.array([-0.03, -0.0675, 0.0353])
TARGET = np.array([-0.02, -0.02, 0.01])


@pytest.fixture(scope="module")
def robot():
    return bc.load_robot("mri_arm")


@pytest.fixture(scope="module")
def task(robot):
    return plan_task(robot, bc.load_scene("mri_open_magnet"), ENTRY, TARGET)


def test_every_instant_of_every_step_is_clear(task):
    assert task.verdict == "clear", task.reason
    names = [step.name for step in task.steps]
    assert names == ["gross motion", "approach", "insertion"]


def test_steps_follow_each_other_from_home_to_the_target(robot, task):
    gross, approach, insertion = task.steps
    np.testing.assert_array_equal(gross.waypoints[0], robot.home)
    np.testing.assert_array_equal(gross.waypoints[-1], approach.waypoints[0])
    np.testing.assert_array_equal(approach.waypoints[-1], insertion.waypoints[0])
    before = forward(insertion.waypoints[0])["E"]
    assert np.linalg.norm(before[:3, 3] - ENTRY) == pytest.approx(STANDOFF, abs=1e-9)
    at_target = forward(insertion.waypoints[-1])["E"]
    np.testing.assert_allclose(at_target[:3, 3], TARGET, atol=1e-9)


def test_approach_keeps_to_the_line(task):
    direction = (TARGET - ENTRY) / np.linalg.norm(TARGET - ENTRY)
    waypoints = task.steps[1].waypoints
    for start, end in pairwise(waypoints):
        for s in (0.0, 0.5):
            T = forward(start + s * (end - start))["E"]
            off = np.cross(T[:3, 3] - ENTRY, direction)
            assert np.linalg.norm(off) < 5e-4
            assert T[:3, 2] @ direction > 1.0 - 1e-5


def test_speeds_are_kept(robot, task):
    joints = {joint.name: joint for joint in robot.model.tree.joints}
    fastest = [joints[name].limits.velocity for name in robot.model.joint_names]
    peak = 0.0
    for step in task.steps:
        speeds = tip_speeds(robot, step)
        peak = max(peak, speeds.max())
        rates = np.abs(np.diff(step.waypoints, axis=0)) / step.seconds[:, None]
        assert (15.0 / 8.0 * rates <= np.array(fastest) + 1e-12).all()
    # the fastest moment is looked for at 60 places of a stretch
    assert 0.9 * TIP_SPEED < peak < 1.01 * TIP_SPEED
    assert task.seconds < 300.0


def test_a_target_too_deep_is_refused(robot):
    scene = bc.load_scene("mri_open_magnet")
    with pytest.raises(UsageError, match=r"the insertion axis reaches 90\.0 mm"):
        plan_task(robot, scene, [0, -0.0765, 0], [0, 0.05, 0])


def test_no_way_is_said_and_not_driven(robot):
    scene = bc.load_scene("mri_open_magnet")
    task = plan_task(robot, scene, [0, 0, 0.0975], [0, 0, 0.05])
    assert task.verdict == "unknown"
    assert not task.steps
    assert "no clear way" in task.reason
