"""The arm against the magnet: the checkers of every robot, nothing special."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.cli import main
from mri_arm.description import DESCRIPTION

PLANS = DESCRIPTION.xacro.parent / "examples" / "plans.csv"


def test_every_dispute_between_checkers_has_a_cause():
    robot, scene = bc.load_robot("mri_arm"), bc.load_scene("mri_open_magnet")
    qs = robot.model.random_configurations(np.random.default_rng(1), 12)
    comparison = bc.compare(robot, scene, qs)
    touching = bc.first_contacts(robot, scene, qs)
    assert 0 < touching.sum() < len(qs)  # there was something to compare
    assert comparison.disagreements
    assert all(d.cause for d in comparison.disagreements)


def test_example_plans_are_clear_for_every_instant(capsys):
    words = ["check", "mri_arm", "mri_open_magnet", "--plan", str(PLANS)]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert out.count("every instant is proven clear") == 3


@pytest.mark.parametrize("mount", ["along", "square"])
def test_home_is_clear_from_both_sides(mount):
    scene = bc.load_scene("mri_open_magnet")
    for y, yaw in (("-1.30", "0"), ("1.30", repr(np.pi))):
        robot = bc.load_robot("mri_arm", base_y=y, base_yaw=yaw, needle_mount=mount)
        assert bc.check(robot, scene, robot.home).verdict == "clear"
