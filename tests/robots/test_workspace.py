"""The bound on where parts can get to: never too small, and not much too large."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.core.se3 import transform
from borecheck.robots.workspace import Ball, workspace
from tests.places import ROBOTS

# Placements are exact to rounding; lengths of some 1 m.
ROUNDING = 1e-12
SLIDE_AND_TURN = """<robot name="r">
<link name="a"/>
<link name="b"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
</link>
<link name="c"><collision><origin xyz="0.3 0 0"/>
<geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
<joint name="s" type="prismatic"><parent link="a"/><child link="b"/>
<origin xyz="0 0 1"/><axis xyz="1 0 0"/>
<limit lower="-0.2" upper="0.5" effort="1" velocity="1"/></joint>
<joint name="t" type="continuous"><parent link="b"/><child link="c"/>
<origin xyz="0 0.4 0"/><axis xyz="0 0 1"/></joint>
</robot>"""


def robots(tmp_path):
    (tmp_path / "r.urdf").write_text(SLIDE_AND_TURN)
    base = transform([1.0, -2.0, 0.5], [0.3, -1.0, 2.0])
    yield bc.load_robot(tmp_path / "r.urdf", base=base)
    yield bc.load_robot(ROBOTS / "two_link.urdf", base=base)
    yield bc.load_robot("zerobot", mount="-90", base=base)
    yield bc.load_robot("mri_arm")


def test_nothing_of_a_robot_is_ever_outside(tmp_path, rng):
    for robot in robots(tmp_path):
        balls = workspace(robot)
        for q in robot.model.random_configurations(rng, 50):
            placed = robot.placements(q)
            for part, ball in zip(robot.parts, balls, strict=True):
                T = placed[part.link]
                points = part.mesh.vertices @ T[:3, :3].T + T[:3, 3]
                away = np.linalg.norm(points - ball.centre, axis=1).max()
                assert away <= ball.radius + ROUNDING


def test_lengths_by_hand(tmp_path):
    (tmp_path / "r.urdf").write_text(SLIDE_AND_TURN)
    slider, turned = workspace(bc.load_robot(tmp_path / "r.urdf"))
    half_diagonal = np.sqrt(3 * 0.05**2)
    np.testing.assert_allclose(slider.centre, [0.0, 0.0, 1.0])
    assert slider.radius == pytest.approx(0.5 + half_diagonal)
    np.testing.assert_allclose(turned.centre, [0.0, 0.4, 1.0])
    assert turned.radius == pytest.approx(0.5 + np.hypot(0.35, np.hypot(0.05, 0.05)))


def test_room_between_a_ball_and_a_box():
    ball = Ball(np.array([3.0, 4.0, 0.5]), 1.0)
    assert ball.room_to(-np.ones(3), np.zeros(3)) == pytest.approx(np.sqrt(25.25) - 1)
    assert ball.room_to(np.zeros(3), np.array([3.0, 4.0, 1.0])) == 0.0
    assert ball.room_to(np.zeros(3), np.array([2.0, 4.0, 1.0])) == 0.0
    assert Ball(ball.centre, np.inf).room_to(np.zeros(3), np.zeros(3)) == 0.0
