"""Goals that nothing reaches are unknown; ways stay clear where others look finer."""

from dataclasses import replace

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.planning import route as routes
from borecheck.planning.route import FOUND, NONE_FOUND, route
from studies.resampled_motions import ROUNDING
from studies.routes.resampled import judged
from studies.routes.walled import answer, behind_block, in_a_box


@pytest.fixture(scope="module")
def stand():
    return bc.load_robot("mri_arm"), bc.load_scene("mri_open_magnet")


@pytest.mark.parametrize("seconds", [None, 0.2])
def test_a_goal_behind_a_block_is_unknown(stand, seconds):
    """The study asserts its premise: the block cannot be passed."""
    walled = behind_block(*stand, np.random.default_rng(0))
    found = answer(walled, 0, 200 if seconds is None else 10**9, seconds)
    assert (found.status, found.verdict) == (NONE_FOUND, "unknown")
    late = "" if seconds is None else " and 0.2 s"
    said = f"no way found in {found.edges} edges{late}; there may be one"
    assert found.reason == said
    assert not walled.scene.doubt


def test_a_goal_in_a_closed_box_is_unknown_and_found_without_the_box():
    walled = in_a_box(np.random.default_rng(0))
    assert answer(walled, 0, 200).status == NONE_FOUND
    door = walled.scene.obstacles[:-1]
    opened = bc.load_scene("ct_gantry", patient="no", couch="no")
    opened = replace(opened, obstacles=door)
    found = route(walled.robot, opened, walled.robot.home, walled.goal, seed=1)
    assert found.status == FOUND


def test_a_limit_of_time_does_not_change_a_way(stand):
    robot, scene = stand
    goal = robot.model.configuration({"q1": 0.9, "q4": 0.3})
    found = [
        route(robot, scene, robot.home, goal, seed=2, most_seconds=seconds)
        for seconds in (None, 1e3)
    ]
    assert found[0].found
    assert found[0].waypoints.tobytes() == found[1].waypoints.tobytes()
    for seconds in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(UsageError, match="no time to search for"):
            route(robot, scene, robot.home, goal, most_seconds=seconds)


def test_a_planner_that_is_wrong_is_not_believed(stand, monkeypatch):
    """Whatever joined the ends, the way is searched once more as a whole."""
    robot, scene = stand
    goal = robot.model.configuration({"q1": 0.9})
    touching = np.array([0.802, -0.226, 0.532, 0.145, -0.629, -0.202, 0.003])
    assert bc.check(robot, scene, touching).verdict == "contact"
    home = np.array(robot.home)
    bad = np.array([home, touching, goal])
    monkeypatch.setattr(routes, "connect", lambda *words: bad)
    monkeypatch.setattr(routes, "shorten", lambda way, *words: way)
    found = route(robot, scene, home, goal)
    assert (found.status, found.waypoints) == (NONE_FOUND, None)
    assert "not proven clear" in found.reason


def test_a_way_resampled_by_other_libraries_is_clear(stand):
    robot, scene = stand
    goal = robot.model.configuration({"q1": 0.9, "q2": -0.1, "q4": 0.3})
    found = route(robot, scene, robot.home, goal, seed=2)
    certified, oracle = judged(robot, scene, found.waypoints)
    least = oracle.least()
    assert oracle.instants >= 1000
    assert not oracle.touching
    assert not oracle.self_contact()
    assert 0.0 < certified <= least + ROUNDING
    assert certified > 0.5 * least
