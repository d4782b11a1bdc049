"""The corridor of a stranger's needle: as wide as the needle, along its way in."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.plans.needle_corridor import corridor_along, last_leg, needle_radius
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import plan_motion
from tests.places import ROBOTS

ARM = ROBOTS / "needle_arm.urdf"
PLAN = NeedlePlan("steep", (0.5, 0.0, 0.1), (0.5, 0.0, 0.03))
RADIUS = 0.0006  # of the shaft, in the file
# the polyhedron round it, which is what is examined, is larger by
EXCESS = 5e-6


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ARM, needle="needle_link", tip="needle_tip")


@pytest.fixture(scope="module")
def waypoints(arm):
    return plan_motion(arm, PLAN).waypoints


def test_it_is_as_wide_as_the_needle(arm, waypoints):
    found = corridor_along(arm, waypoints, PLAN.entry, PLAN.target)
    assert RADIUS <= found.radius <= RADIUS + EXCESS
    assert needle_radius(arm) == pytest.approx(found.radius, abs=EXCESS)


def test_a_description_states_how_wide_its_needle_is(zerobot):
    found = corridor_along(zerobot, zerobot.home[None], PLAN.entry, PLAN.target)
    assert found.radius == zerobot.description.needle_radius


def test_an_arm_is_no_needle(waypoints):
    thick = bc.load_robot(ARM, needle="flange")
    with pytest.raises(UsageError, match="mm thick where it would enter"):
        corridor_along(thick, waypoints, PLAN.entry, PLAN.target)


@pytest.mark.parametrize(
    ("entry", "target"),
    [
        ((0, 0, 0), (0, 0, 0)),
        ((0, 0, np.nan), (0, 0, 0.1)),
        ((0, 0, 80.0), (0, 0, 20.0)),
        ((0, 0, 0), (0, 0, 2.0)),
    ],
)
def test_points_that_make_no_needle_path_are_refused(arm, waypoints, entry, target):
    with pytest.raises(UsageError, match="corridor"):
        corridor_along(arm, waypoints, np.array(entry), np.array(target))


def test_the_last_leg_is_the_whole_way_straight_in(arm, waypoints):
    """However many waypoints it has; what comes before it does not count."""
    aside = waypoints[:1] + [0.3, 0.0, 0.0, 0.0, 0.0, 0.0]
    found = last_leg(arm, np.vstack([aside, waypoints]))
    np.testing.assert_allclose(found.target, PLAN.target, atol=1e-9)
    np.testing.assert_allclose(found.entry, (0.5, 0.0, 0.15), atol=1e-9)


def test_a_path_that_ends_otherwise_has_no_such_leg(arm, waypoints):
    swung = np.array([waypoints[0], waypoints[0] + [0.2, 0.0, 0.0, 0.0, 0.0, 0.0]])
    for path in (swung, waypoints[::-1], waypoints[:1]):
        with pytest.raises(UsageError, match="does not go along itself"):
            last_leg(arm, path)


def test_without_a_tip_there_is_no_last_leg(waypoints):
    robot = bc.load_robot(ARM, needle="needle_link")
    with pytest.raises(UsageError, match="no frame at its needle's tip"):
        last_leg(robot, waypoints)
