"""Base places: outside 2 mT, both sides alike, and what counts as served."""

import numpy as np
import pytest

import borecheck as bc
from borecheck_models.scanners.head import EntryPoints, entry_points
from mri_arm.kinematics import forward
from mri_arm.studies.workspace import (
    AZIMUTHS,
    NEAREST_BASE,
    STANDOFF,
    BasePlace,
    directions,
    is_regular,
    places,
    reach,
)


@pytest.fixture(scope="module")
def scene():
    return bc.load_scene("mri_open_magnet")


def test_places_are_outside_the_2_mT_line_and_face_the_centre():
    found = places([-0.3, 0.0, 0.6], [-1.15, -0.5, 1.15])
    assert len(found) == 6
    for place in found:
        assert place.distance >= NEAREST_BASE
        ahead = np.array([-np.sin(place.yaw), np.cos(place.yaw)])
        towards = -np.array([place.x, place.y]) / place.distance
        np.testing.assert_allclose(ahead, towards, atol=1e-12)


def test_directions_lie_in_the_cone():
    normal = np.array([0.6, 0.0, 0.8])
    cone = np.radians(30.0)
    found = directions(normal, cone)
    assert len(found) == 1 + 2 * AZIMUTHS
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    assert (-found @ normal >= np.cos(cone) - 1e-12).all()
    np.testing.assert_allclose(found[0], -normal)
    assert len(directions(normal, 0.0)) == 1


def test_both_sides_of_the_patient_serve(scene):
    """[Heikkila2010] section 3: "a feasible location is on either side"."""
    entries = entry_points(30)
    for y in (-1.15, 1.15):
        (place,) = places([0.0], [y])
        result = reach(place, entries, scene, cone=np.radians(30.0))
        assert result.entries >= result.reachable >= result.regular >= result.clear
        assert result.share > 0.2


def test_far_away_nothing_is_served(scene):
    result = reach(BasePlace(0.0, -3.0, 0.0), entry_points(10), scene)
    assert result.reachable == 0


def test_conditions_cut_what_they_should(scene):
    """The top of the head has no room for a needle under the pole."""
    top = EntryPoints(np.array([[0.0, 0.0, 0.0975]]), np.array([[0.0, 0.0, 1.0]]))
    side = EntryPoints(np.array([[0.0, -0.0765, 0.0]]), np.array([[0.0, -1.0, 0.0]]))
    (place,) = places([0.3], [-1.15])
    assert reach(place, side, scene).clear == 1
    assert reach(place, top, scene).clear == 0


def test_singular_poses_are_left_out():
    assert is_regular(np.array([0, 0, 0, 0, 0.5, 0, 0.0]))
    assert not is_regular(np.zeros(7))  # wrist straight
    assert forward(np.zeros(7))["E"].shape == (4, 4)
    assert STANDOFF == 0.010
