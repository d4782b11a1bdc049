"""Where robot and surroundings touch, by figures that can be read off the boxes."""

import json

import numpy as np
import pytest

from borecheck.cli import main
from borecheck.report.touching import place
from tests.places import ROBOTS

ROBOT = str(ROBOTS / "two_link.urdf")


def test_the_place_of_two_triangles_that_cross_is_common_to_them():
    flat = np.array([[-1.0, -1, 0], [3, -1, 0], [-1, 3, 0]])
    upright = np.array([[0.0, 0, -1], [0.4, 0, -1], [0.2, 0, 1]])
    for corners in ([flat, upright], [upright, flat]):
        x, y, z = place(np.array([corners]))
        assert 0.1 - 1e-12 <= x <= 0.3 + 1e-12
        assert abs(y) < 1e-12
        assert abs(z) < 1e-12


def test_of_many_pairs_it_is_a_common_point_not_the_middle_of_a_hole():
    """A rod through a ring touches at the ring, nowhere in its hole."""
    turns = np.linspace(0.0, 2.0 * np.pi, 7)[:-1]
    flat = np.array([[-0.1, -0.1, 0], [0.2, -0.1, 0], [-0.1, 0.2, 0]])
    upright = np.array([[0.0, 0, -1], [0.02, 0, -1], [0.01, 0, 1]])
    around = [np.array([np.cos(t), np.sin(t), 0.0]) for t in turns]
    found = place(np.array([[flat + c, upright + c] for c in around]))
    assert np.linalg.norm(found) > 0.9


@pytest.mark.parametrize("gap", [0.0, 0.02])
def test_flat_on_each_other_or_within_a_margin_it_is_between_both(gap):
    low = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    high = np.array([[0.6, 0.1, gap], [2, 0.1, gap], [2, 2, gap]])
    x, y, z = place(np.array([[low, high]]))
    assert z == pytest.approx(gap / 2, abs=1e-12)
    assert x + y <= 1.0 + 1e-9
    assert x >= 0.6 - 1e-9
    assert y >= 0.1 - 1e-9


def _check(capsys, *words):
    main(["check", ROBOT, *words, "--q", "0"])
    return capsys.readouterr().out


@pytest.fixture
def wall(tmp_path):
    """A plate, 2 mm thick, across the arm, a cylinder of 50 mm, at z = 700 mm."""
    from trimesh.creation import box

    file = tmp_path / "wall.stl"
    box((0.4, 0.4, 0.002)).apply_translation((0, 0, 0.7)).export(file)
    return f"{file}:m"


def test_the_text_is_a_row_for_each_pair_of_parts(capsys, wall):
    text = _check(capsys, wall)
    assert "#" not in text
    told = json.loads(_check(capsys, wall, "--format", "json"))
    (row,) = told["touching"]
    assert row["pairs"] == len(told["contacts"]) > 1
    x, y, z = row["place_m"]
    assert abs(z - 0.7) <= 0.0011
    assert 0.045 < np.hypot(x, y) < 0.051  # at the arm's side, not within it
    (line,) = [li for li in text.splitlines() if li.startswith(f"{row['link']} ")]
    assert f"{row['obstacle']} " in line
    assert f"{1e3 * x:.1f}" in line
    assert "none found within 50 mm" in line  # the plate is 0.4 m wide


def test_what_is_moved_by_the_way_out_is_clear(capsys, wall):
    """Asked again by the command: the plate goes back by what the link would go."""
    at = (0.247, 0.0, 0.0)
    place = ",".join(str(x) for x in at)
    told = json.loads(_check(capsys, f"{wall}@{place}", "--format", "json"))
    (row,) = told["touching"]
    shift = np.array(row["way_out_m"])
    assert 0.002 < np.linalg.norm(shift) < 0.004  # 3 mm deep into the cylinder
    place = ",".join(f"{x:.4f}" for x in at - shift)
    again = json.loads(_check(capsys, f"{wall}@{place}", "--format", "json"))
    assert again["verdict"] == "clear"
    words = f"by ({', '.join(f'{1e3 * x + 0.0:.1f}' for x in shift)})"
    assert words in _check(capsys, f"{wall}@{','.join(map(str, at))}")
