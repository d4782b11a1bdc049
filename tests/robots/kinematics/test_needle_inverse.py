"""Inverse kinematics for any chain: what is found is there, the rest has reasons."""

import re
from pathlib import Path

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.robots.description import hook
from borecheck.robots.kinematics.needle_inverse import (
    NumericalInverse,
    needle_inverse,
)
from borecheck.robots.kinematics.starts import spread
from borecheck.robots.model import RobotModel
from borecheck.robots.needle import Needle
from borecheck.robots.robot import Robot
from tests.places import ROBOTS

# A tip within this is there: a hundredth of a wavelength, and far above rounding.
THERE = 1e-9


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(
        ROBOTS / "needle_arm.urdf", needle="needle_link", tip="needle_tip"
    )


def needle_at(robot, q):
    """By Pinocchio: tip and direction."""
    T = robot.placements(q)[robot.needle.tip]
    return T[:3, 3], T[:3, :3] @ robot.needle.axis


@pytest.mark.parametrize("name", ["arm", "zerobot", "mri_arm"])
def test_reachable_needles_are_found_and_truly_there(name, arm, rng):
    robot = arm if name == "arm" else bc.load_robot(name)
    for q in robot.model.random_configurations(rng, 12):
        tip, direction = needle_at(robot, q)
        found = needle_inverse(robot, tip, direction)
        assert found.configurations, (q, found.rejected)
        assert not found.rejected
        for other in found.configurations:
            at, way = needle_at(robot, other)
            assert np.linalg.norm(at - tip) < THERE
            assert np.linalg.norm(way - direction) < THERE
            robot.model.check_limits(other)


@pytest.mark.parametrize("name", ["zerobot", "mri_arm"])
def test_the_closed_form_is_among_what_is_found(name, rng):
    """Two roads without common code: every branch of the closed form is found."""
    robot = bc.load_robot(name)
    description = robot.description
    inverse = hook(description.inverse)
    arguments = {k: robot.arguments[k] for k in description.closed_form_arguments}
    index = robot.model.joint_names.index(description.insertion_joint)
    compared = 0
    for q in robot.model.random_configurations(rng, 20):
        tip, direction = needle_at(robot, q)
        closed = inverse(tip, direction, q[index], **arguments)
        found = needle_inverse(robot, tip, direction, q[index]).configurations
        for one in closed.configurations:
            values = {
                joint.name: joint.sign * float(value) + joint.offset
                for joint, value in zip(description.joints, one, strict=True)
            }
            wanted = robot.model.configuration(values)
            moves = [i for i in range(len(q)) if not is_roll(robot, q, i)]
            nearest = min(np.abs((wanted - other)[moves]).max() for other in found)
            assert nearest < 1e-6
            compared += 1
    assert compared >= 20


def is_roll(robot, q, i):
    """Whether a joint only turns the needle about itself: the task leaves that open."""
    step = np.zeros(len(q))
    step[i] = 0.1
    at = np.concatenate(needle_at(robot, q)) - np.concatenate(
        needle_at(robot, q + step)
    )
    return np.abs(at).max() < 1e-9


def test_the_same_question_has_the_same_answer_bit_by_bit(arm):
    asked = (0.45, 0.1, 0.15), (0.1, 0.2, -1.0)
    first = needle_inverse(arm, *asked).configurations
    again = needle_inverse(
        bc.load_robot(arm.file, needle="needle_link", tip="needle_tip"), *asked
    ).configurations
    assert len(first) > 1
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert len(first) == len(again)


def test_solutions_differ(arm):
    found = np.array(
        needle_inverse(arm, (0.45, 0.1, 0.15), (0.0, 0.0, -1.0)).configurations
    )
    apart = np.abs(found[:, None] - found[None]).max(axis=2)
    assert apart[~np.eye(len(found), dtype=bool)].min() > 0.1


@pytest.mark.parametrize(
    ("tip", "direction", "says"),
    [
        ((2.0, 0.0, 0.25), (1.0, 0.0, 0.0), r"nearest tip found is \d+\.\d mm short"),
        ((0.5, 0.0, 0.1), (0.0, 0.0, 1.0), r"would need .* rad, its limit is"),
        ((0.87, 0.0, 0.2), (0.0, 0.0, -1.0), "not pointing that way"),
    ],
)
def test_what_is_not_found_has_a_reason(arm, tip, direction, says):
    found = needle_inverse(arm, tip, direction)
    assert found.configurations == ()
    assert any(re.search(says, line) for line in found.rejected)


def test_the_missing_reach_is_what_geometry_says(arm):
    """Straight out: 0.4 + 0.34 + 0.05 + 0.06 + 0.025 + 0.18 m from the shoulder."""
    found = needle_inverse(arm, (2.0, 0.0, 0.25), (1.0, 0.0, 0.0))
    short = float(found.rejected[0].split()[-3])
    assert short == pytest.approx(1e3 * (2.0 - 1.055), abs=0.2)


def test_a_limit_is_kept_in_the_search_not_after_it(arm):
    """On a limit is within it; a bit beyond there is nothing of that branch."""
    q = np.array([0.3, -1.0, 1.2, 0.4, 2.1, 0.0])
    found = needle_inverse(arm, *needle_at(arm, q)).configurations
    assert found
    assert not arm.model.beyond_limits(np.array(found)).any()


@pytest.mark.parametrize(
    ("tip", "direction"),
    [
        ((np.nan, 0.0, 0.0), (0.0, 0.0, 1.0)),
        ((0.0, 0.0), (0.0, 0.0, 1.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (np.inf, 0.0, 0.0)),
        ("abc", (0.0, 0.0, 1.0)),
    ],
)
def test_numbers_that_are_no_needle_are_refused(arm, tip, direction):
    with pytest.raises(UsageError):
        needle_inverse(arm, tip, direction)


def test_the_jacobian_is_the_derivative(arm, rng):
    task = NumericalInverse.of(arm).task
    qs = arm.model.random_configurations(rng, 3)
    tips, ways = np.zeros((3, 3)), np.tile([0.0, 0.0, 1.0], (3, 1))
    _, J = task._linear(qs, tips, ways)
    h = 1e-6
    for k, i in enumerate(task.active):
        step = np.zeros(6)
        step[i] = h
        ahead, _ = task._linear(qs + step, tips, ways)
        behind, _ = task._linear(qs - step, tips, ways)
        np.testing.assert_allclose((ahead - behind) / (2.0 * h), J[:, :, k], atol=1e-8)


def test_starts_fill_the_limits_evenly():
    home, low, high = (
        np.zeros(3),
        np.array([-1.0, -np.inf, 0.0]),
        np.array([1, np.inf, 0.2]),
    )
    qs = spread(home, np.array([0, 2]), low, high, 0, 256)
    assert np.array_equal(qs[0], home)
    assert (qs[:, 1] == 0.0).all()
    counts, _, _ = np.histogram2d(qs[:, 0], qs[:, 2], bins=4, range=[[-1, 1], [0, 0.2]])
    assert counts.min() >= 12  # 16 on average
    assert np.array_equal(qs[32:64], spread(home, np.array([0, 2]), low, high, 32, 32))


def test_an_arm_that_is_all_but_singular_everywhere_is_found():
    """Right angles typed with five digits: its fifth direction is 1e-7 of the others.

    Damping that suits other arms never gets there.
    """
    origins = (
        ("0 0 0", "1.5708 1.5708 0"),
        ("0.132 0 0", "0 0 0"),
        ("0.075 0 0", "0 0 0"),
        ("0 0 -0.011925", "1.5708 0 0"),
        ("0.034 0 -0.00025", "1.5708 0 1.5708"),
    )
    lines = ['<robot name="typed"><link name="l0"/>']
    for k, (xyz, rpy) in enumerate(origins):
        lines.append(
            f'<link name="l{k + 1}"/><joint name="j{k + 1}" type="revolute">'
            f'<parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="0 0 1"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/>'
            '<limit lower="-1.67" upper="1.67" effort="1" velocity="1"/></joint>'
        )
    model = RobotModel("".join([*lines, "</robot>"]))
    robot = Robot(
        *("typed", None, {}, "", Path("typed.urdf"), "", model, (), np.eye(4), (), ()),
        stated_needle=Needle("l5", "l5", np.array([1.0, 0.0, 0.0])),
    )
    for q in model.random_configurations(np.random.default_rng(3), 8):
        found = needle_inverse(robot, *needle_at(robot, q))
        assert found.configurations, found.rejected
