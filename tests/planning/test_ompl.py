"""OMPL's planners over certified edges: another search, the same proof."""

import sys
from itertools import pairwise

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UnknownNameError, UsageError
from borecheck.planning.edges import Edges
from borecheck.planning.ompl import PLANNERS, plan
from borecheck.planning.route import FOUND, NONE_FOUND, route
from studies.routes.walled import in_a_box
from tests.planning.test_route import GOAL, START, Wall


@pytest.fixture(scope="module")
def stand():
    return bc.load_robot("mri_arm"), bc.load_scene("mri_open_magnet")


class Plane(Wall):
    """The wall with a gap, which OMPL asks about single points too."""

    def free(self, q):
        return abs(q[0]) > 1e-3 or q[1] > self.gap


def way_of(name, edges, most=400):
    ends, box = np.array([START, GOAL]), (np.full(2, -1.0), np.full(2, 1.0))
    scale = np.array([1.0, 0.5])
    return plan(name, ends, edges, scale, box, lambda: edges.asked >= most)


@pytest.mark.parametrize("name", PLANNERS)
def test_every_planner_takes_clear_edges_alone(name):
    pytest.importorskip("ompl")
    way = way_of(name, Plane(), most=3000)
    np.testing.assert_array_equal(way[[0, -1]], [START, GOAL])
    edges = Wall()
    assert np.abs(way).max() <= 1.0 + 1e-9
    assert all(edges.clear(a, b) for a, b in pairwise(way))


@pytest.mark.parametrize("name", ["RRTConnect", "RRT", "BITstar", "KPIECE1"])
def test_a_way_that_only_comes_near_is_none(name):
    pytest.importorskip("ompl")
    assert way_of(name, Plane(gap=2.0)) is None


def test_both_searches_find_ways_that_are_clear(stand):
    """The oracle: what one of OMPL's planners solves ours solves, by no long way."""
    pytest.importorskip("ompl")
    robot, scene = stand
    rng = np.random.default_rng(5)
    goals = [
        q
        for q in robot.model.random_configurations(rng, 40)
        if bc.check(robot, scene, q).clear
    ][:2]
    solved = 0
    for k, goal in enumerate(goals):
        theirs = route(
            *(robot, scene, robot.home, goal),
            planner="ompl:RRTConnect",
            most_seconds=10.0,
        )
        if not theirs.found:
            continue
        solved += 1
        np.testing.assert_array_equal(theirs.waypoints[[0, -1]], [robot.home, goal])
        assert bc.check_path(robot, scene, theirs.waypoints).clear
        ours = route(robot, scene, robot.home, goal, seed=k)
        assert ours.status == FOUND
        assert ours.length <= 2.0 * theirs.length  # one of many ways, both shortened
    assert solved


def test_a_closed_box_is_unknown_to_both():
    pytest.importorskip("ompl")
    walled = in_a_box(np.random.default_rng(0))
    found = route(
        *(walled.robot, walled.scene, walled.robot.home, walled.goal),
        planner="ompl:RRTConnect",
        most_edges=100,
    )
    assert (found.status, found.verdict) == (NONE_FOUND, "unknown")


def test_a_planner_that_is_not_there_is_named(stand, monkeypatch):
    robot, scene = stand
    ends = robot, scene, robot.home, robot.home
    with pytest.raises(UnknownNameError, match="BITstar"):
        route(*ends, planner="ompl:BITsta")
    with pytest.raises(UnknownNameError, match="unknown planner 'rrt'"):
        route(*ends, planner="rrt")
    monkeypatch.setitem(sys.modules, "ompl", None)
    with pytest.raises(UsageError, match=r"pip install 'borecheck\[planning\]'"):
        route(*ends, planner="ompl:RRTConnect")


def test_a_look_at_a_pose_is_no_edge(stand):
    from borecheck.contact.queries import queries
    from borecheck.motion.robot_problem import path_problem

    robot, scene = stand
    edges = Edges(path_problem(robot, scene), queries(robot, scene))
    touching = np.array([0.802, -0.226, 0.532, 0.145, -0.629, -0.202, 0.003])
    assert edges.free(np.array(robot.home))
    assert not edges.free(touching)
    assert edges.asked == 0
