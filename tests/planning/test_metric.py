"""The metric bounds what any point of the robot does, and is no wild guess."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.motion.robot_problem import path_problem
from borecheck.planning.metric import metric_of, sampled_box


@pytest.fixture(scope="module", params=["zerobot", "mri_arm", "crane"])
def robot(request):
    return bc.load_robot(request.param)


def test_no_point_goes_farther(robot):
    scene = bc.load_scene(robot.description.scanner)
    metric = metric_of(path_problem(robot, scene), robot.model)
    rng = np.random.default_rng(0)
    share = []
    for _ in range(30):
        a, b = rng.uniform(robot.model.lower, robot.model.upper, (2, len(robot.home)))
        bound = float(metric.between(a, b))
        gone = 0.0
        before, after = robot.placements(a), robot.placements(b)
        for part in robot.parts:
            corners = np.c_[part.mesh.vertices, np.ones(len(part.mesh.vertices))]
            move = corners @ (after[part.link] - before[part.link]).T
            gone = max(gone, float(np.linalg.norm(move[:, :3], axis=1).max()))
        assert gone <= bound * (1.0 + 1e-9)
        share.append(gone / bound)
    assert np.median(share) > 0.15  # joints that undo each other; no empty bound


def test_it_is_a_metric(robot):
    scene = bc.load_scene(robot.description.scanner)
    metric = metric_of(path_problem(robot, scene), robot.model)
    rng = np.random.default_rng(1)
    a, b, c = rng.uniform(robot.model.lower, robot.model.upper, (3, len(robot.home)))
    assert metric.between(a, a) == 0.0
    assert metric.between(a, b) == metric.between(b, a) > 0.0
    assert metric.between(a, c) <= metric.between(a, b) + metric.between(b, c) + 1e-12
    way = np.array([a, b, c])
    length = float(metric.between(a, b) + metric.between(b, c))
    assert metric.length(way) == pytest.approx(length, rel=1e-12)


def test_a_slide_counts_its_metres_and_a_hinge_its_reach():
    robot = bc.load_robot("zerobot")
    scene = bc.load_scene("ct_gantry")
    metric = metric_of(path_problem(robot, scene), robot.model)
    step = 0.01 * np.eye(6)
    np.testing.assert_allclose(metric.between(np.zeros(6), step[:3]), 0.01, rtol=1e-12)
    hinge = float(metric.between(np.zeros(6), step[4]))
    assert 0.01 * 0.2 < hinge < 0.01 * 2.0  # its lever, and all of the links behind


def test_what_turns_on_is_sampled_one_turn_about(tmp_path):
    urdf = (
        "<robot name='r'><link name='a'/><link name='b'/>"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/>"
        "<axis xyz='0 0 1'/></joint></robot>"
    )
    from borecheck.robots.model import RobotModel

    low, high = sampled_box(RobotModel(urdf, "r"), np.array([7.0]))
    np.testing.assert_allclose([low[0], high[0]], [7.0 - np.pi, 7.0 + np.pi])
