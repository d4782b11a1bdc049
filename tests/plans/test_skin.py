"""A plan that does not meet its patient says so."""

import numpy as np
import pytest

from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.skin import distance_to, skin_notes

AT_SKIN = 0.005  # so far off it is still said to be there, [m]
TORSO = box("torso", (0.4, 0.3, 0.2))  # the skin above is at z = 0.1


def notes(entry, target, patients=(TORSO,)):
    return list(skin_notes(NeedlePlan("p", entry, target), patients))


def test_a_plan_from_the_skin_into_the_body_has_none():
    assert notes([0, 0, 0.1], [0, 0, 0.02]) == []
    assert notes([0, 0, 0.1 + 0.9 * AT_SKIN], [0, 0, 0.02]) == []


@pytest.mark.parametrize("above", [1.1 * AT_SKIN, 0.081])
def test_an_entry_off_the_skin_is_told_with_its_distance(above):
    (note,) = notes([0, 0, 0.1 + above], [0, 0, 0.02])
    assert f"{1e3 * above:.1f} mm off the skin of torso, outside it: " in note


def test_an_entry_inside_is_off_the_skin_too():
    (note,) = notes([0, 0, 0.04], [0, 0, 0.0])
    assert "60.0 mm off the skin of torso, inside it: " in note


def test_of_an_open_skin_no_side_is_told():
    opened = TriangleMesh("torso", TORSO.vertices, TORSO.triangles[1:])
    (note,) = notes([0, 0, 0.04], [0, 0, 0.0], [opened])
    assert "off the skin of torso: " in note


def test_a_target_outside_is_told():
    found = notes([0, 0, 0.1], [0, 0, 0.12])
    assert len(found) == 1
    assert "target is not in the patient" in found[0]


def test_any_body_of_the_patient_will_do():
    moved = TORSO.vertices + np.array([1.0, 0.0, 0.0])
    other = TriangleMesh("other", moved, TORSO.triangles)
    assert notes([1, 0, 0.1], [1, 0, 0.02], (TORSO, other)) == []
    assert notes([1, 0, 0.1], [1, 0, 0.02], ()) == []


def test_of_an_open_skin_the_inside_is_not_asked():
    opened = TriangleMesh("opened", TORSO.vertices, TORSO.triangles[:-1])
    assert notes([0, 0, 0.1], [0, 0, 0.12], (opened,)) == []


def test_distance_of_a_point_from_a_box():
    assert distance_to(TORSO, np.array([0.3, 0.0, 0.0])) == pytest.approx(0.1)
    assert distance_to(TORSO, np.array([0.23, 0.19, 0.0])) == pytest.approx(0.05)
