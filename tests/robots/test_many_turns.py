"""Continuous joints have no limits that degrees taken for radians would break."""

import json

import pytest

from borecheck.cli import main
from tests.places import ROBOTS


@pytest.fixture
def words(tmp_path):
    from trimesh.creation import box

    text = (ROBOTS / "two_link.urdf").read_text()
    robot = tmp_path / "turning.urdf"
    robot.write_text(text.replace('type="revolute"', 'type="continuous"'))
    box((0.1, 0.1, 0.1)).apply_translation((3, 0, 0)).export(tmp_path / "far.stl")
    return ["check", str(robot), f"{tmp_path / 'far.stl'}:m"]


@pytest.mark.parametrize(
    ("q", "told"), [("90", True), ("-90", True), ("6.2", False), ("90deg", False)]
)
def test_beyond_a_turn_the_degrees_are_told(words, q, told, capsys):
    main([*words, f"--q=j={q}"])
    text = capsys.readouterr().out
    assert ("are these degrees? Numbers are radians: " in text) == told
    assert ("1.5708, or '" in text) == told


def test_of_a_path_the_farthest_is_told_and_no_verdict_changes(words, tmp_path, capsys):
    path = tmp_path / "path.csv"
    path.write_text("j\n0\n1\n45\n")
    main([*words, "--path", str(path), "--samples", "3", "--format", "json"])
    document = json.loads(capsys.readouterr().out)
    assert any("45 rad" in warning for warning in document["warnings"])
    assert document["verdict"] == "unknown"  # a step of many turns needs --long-way
