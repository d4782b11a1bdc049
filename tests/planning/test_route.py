"""Ways are proven edge by edge, the same for the same seed, or said not to be found."""

from itertools import pairwise

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import JointLimitError, UsageError
from borecheck.planning.connect import STEP, connect
from borecheck.planning.metric import Metric
from borecheck.planning.route import END_TOUCHES, FOUND, NONE_FOUND, route
from borecheck.planning.shorten import shorten


class Wall:
    """Edges in the plane that do not cross x = 0 but through a gap above y = 0.8."""

    def __init__(self, gap=0.8):
        self.gap, self.asked = gap, 0

    def clear(self, a, b):
        self.asked += 1
        if a[0] * b[0] > 0.0:
            return True
        if a[0] == b[0]:
            return min(a[1], b[1]) > self.gap
        share = -a[0] / (b[0] - a[0])
        return a[1] + share * (b[1] - a[1]) > self.gap


PLANE = Metric(np.eye(2))
START, GOAL = np.array([-0.5, 0.0]), np.array([0.5, 0.0])


def way_of(seed, edges=None, most=2000):
    rng = np.random.default_rng(seed)
    edges = Wall() if edges is None else edges
    return connect(START, GOAL, edges, PLANE, lambda: rng.uniform(-1.0, 1.0, 2), most)


def test_a_straight_way_is_one_edge():
    edges = Wall(gap=-2.0)
    np.testing.assert_array_equal(way_of(0, edges), [START, GOAL])
    assert edges.asked == 1


@pytest.mark.parametrize("seed", range(5))
def test_a_way_round_is_of_clear_edges_from_start_to_goal(seed):
    way = way_of(seed)
    np.testing.assert_array_equal(way[0], START)
    np.testing.assert_array_equal(way[-1], GOAL)
    edges = Wall()
    assert all(edges.clear(a, b) for a, b in pairwise(way))
    lengths = PLANE.between(way[:-1], way[1:])
    assert lengths.max() <= STEP * (1.0 + 1e-12)
    assert lengths.min() > 0.0


def test_what_cannot_be_joined_is_given_up_at_the_limit():
    edges = Wall(gap=2.0)
    assert way_of(1, edges, most=300) is None
    assert 300 <= edges.asked <= 301


@pytest.mark.parametrize("seed", range(3))
def test_a_shorter_way_is_of_clear_edges_still(seed):
    way = way_of(seed)
    edges = Wall()
    shorter = shorten(way, edges, PLANE, np.random.default_rng(seed))
    assert PLANE.length(shorter) < PLANE.length(way)
    assert all(edges.clear(a, b) for a, b in pairwise(shorter))
    np.testing.assert_array_equal(shorter[[0, -1]], [START, GOAL])
    assert PLANE.length(shorter) < 2.6  # 1.6 up and down, at most, and 1 across


@pytest.fixture(scope="module")
def stand():
    return bc.load_robot("zerobot"), bc.load_scene("ct_gantry")


def test_a_way_of_zerobot_is_certified_and_the_same_again(stand):
    robot, scene = stand
    rng = np.random.default_rng(3)
    free = [
        q
        for q in robot.model.random_configurations(rng, 60)
        if bc.check(robot, scene, q, margin=0.005).clear
    ]
    bent = 0
    for a, b in pairwise(free[:6]):
        found = route(robot, scene, a, b, 0.005, seed=7)
        assert found.status == FOUND
        np.testing.assert_array_equal(found.waypoints[[0, -1]], [a, b])
        assert bc.check_path(robot, scene, found.waypoints, 0.005).clear
        again = route(robot, scene, a, b, 0.005, seed=7)
        assert again.waypoints.tobytes() == found.waypoints.tobytes()
        assert again.edges == found.edges
        bent += len(found.waypoints) > 2
    assert bent  # not all of them are straight


def test_an_end_in_contact_is_named(stand):
    robot, scene = stand
    inside = robot.model.configuration({"q1": 0.25, "q3": 0.25})
    found = route(robot, scene, robot.home, inside)
    assert found.status == END_TOUCHES
    assert found.reason.startswith("the goal touches: arm with gantry")
    assert found.waypoints is None
    assert not found.found
    found = route(robot, scene, inside, robot.home)
    assert found.reason.startswith("the start touches")


def test_a_goal_in_its_own_room_is_not_found_and_not_said_to_be_impossible(stand):
    """A block that nothing can pass at the rate of a few edges: unknown, no more."""
    robot = bc.load_robot("mri_arm")
    scene = bc.load_scene("mri_open_magnet")
    goal = robot.model.configuration({"q1": 0.05})
    if not bc.check(robot, scene, goal).clear:
        goal = robot.model.configuration({"q1": -1.2})
    found = route(robot, scene, robot.home, goal, seed=1, most_edges=2)
    assert found.status == NONE_FOUND
    assert found.reason == f"no way found in {found.edges} edges; there may be one"
    assert found.edges <= 3


def test_what_is_no_question_is_refused(stand):
    robot, scene = stand
    with pytest.raises(JointLimitError):
        route(robot, scene, robot.home, robot.model.upper + 1.0)
    with pytest.raises(UsageError, match="at least one edge"):
        route(robot, scene, robot.home, robot.home, most_edges=0)
    with pytest.raises(UsageError):
        route(robot, scene, robot.home, robot.home, margin=-1.0)


def test_no_step_leaves_open_which_way_a_joint_turns(tmp_path):
    """Short tools may turn far within one edge; what was proven is what is driven."""
    urdf = (
        "<robot name='r'><link name='a'/><link name='b'><collision><geometry>"
        "<box size='0.01 0.01 0.01'/></geometry></collision></link>"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/>"
        "<axis xyz='0 0 1'/></joint></robot>"
    )
    (tmp_path / "r.urdf").write_text(urdf)
    robot = bc.load_robot(tmp_path / "r.urdf")
    scene = bc.load_scene("ct_gantry", patient="no", couch="no")
    for goal in (3.5, 6.0, -6.2):
        found = route(robot, scene, [0.0], [goal])
        assert found.status == FOUND
        assert np.abs(np.diff(found.waypoints[:, 0])).max() < np.pi
        np.testing.assert_array_equal(found.waypoints[[0, -1], 0], [0.0, goal])
        assert bc.check_path(robot, scene, found.waypoints).clear
