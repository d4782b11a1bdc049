"""How far a shape sticks out of others, against what is known in closed form."""

import numpy as np
import pytest

from borecheck.core.se3 import axis_rotation
from borecheck.geometry.mesh.primitives import box, sphere
from borecheck.geometry.overhang import outline, overhang

# 200 directions are 9 deg apart, so a corner is seen to 1 - cos(9 deg / 2) and a little
SHARE = 0.01


def moved(mesh, x, R=None):
    T = np.eye(4)
    T[:3, 3] = x
    T[:3, :3] = np.eye(3) if R is None else R
    return mesh.moved(T)


@pytest.mark.parametrize("distance", [0.02, 0.3, 2.0])
def test_a_box_that_is_shifted_sticks_out_by_the_shift(distance, rng):
    solid = box("solid", (1.0, 1.0, 1.0))
    for axis in np.eye(3):
        found = overhang(outline(moved(solid, distance * axis)), [solid])
        assert found == pytest.approx(distance, rel=1e-5)
    axis = rng.normal(size=3)
    R = axis_rotation(axis / np.linalg.norm(axis), 1.0)
    points = outline(moved(solid, distance * R[:, 0], R))
    found = overhang(points, [moved(solid, np.zeros(3), R)])
    assert distance - SHARE * 2.0 < found < distance + 1e-5


def test_what_lies_within_sticks_out_by_nothing(rng):
    solid = box("solid", (1.0, 1.0, 1.0))
    for inner in (solid, box("inner", (0.5, 0.9, 0.9)), sphere("inner", 0.49)):
        # half-size and direction are float32
        assert overhang(outline(inner), [solid]) < 1e-6


def test_a_spike_sticks_out_by_its_length():
    solid, spike = box("solid", (0.1, 0.1, 0.1)), box("spike", (0.001, 0.001, 1.0))
    assert overhang(outline(spike), [solid]) == pytest.approx(0.45, rel=1e-5)


def test_a_rod_between_two_solids_is_seen_in_the_gap():
    left, right = (
        moved(box(n, (0.1,) * 3), (x, 0, 0)) for n, x in (("l", -1), ("r", 1))
    )
    rod = box("rod", (1.8, 0.02, 0.02))
    found = overhang(outline(rod), [left, right])
    # the middle is 0.95 from either box's face; samples and their spacing take a tenth
    assert 0.85 < found <= 0.96
    assert overhang(outline(rod), [left, right, box("bar", (2.0, 0.03, 0.03))]) < 1e-6
