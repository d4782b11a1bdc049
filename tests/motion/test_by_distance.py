import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion import search as path_search
from borecheck.motion.check import check_path
from borecheck.robots.scene import Obstacle, Scene
from tests.places import ROBOTS

ROBOT = ROBOTS / "two_link.urdf"


def plate():
    """A thin plate beside the long, slender arm of two_link.urdf."""
    mesh = box("plate", (0.001, 0.2, 0.02))
    moved = TriangleMesh("plate", mesh.vertices + [0.35, 0, 0.65], mesh.triangles)
    obstacle = Obstacle("plate", "other", moved, "test")
    return Scene("s", None, {}, "t", (obstacle,), {}, (), ())


def sampled_contact(robot, scene, count):
    """Fractions at which dense samples of q from -1 to 1 see contact."""
    fractions = np.linspace(0.0, 1.0, count)
    qs = (-1.0 + 2.0 * fractions)[:, None]
    return fractions[bc.first_contacts(robot, scene, qs, containment=False)]


def test_long_triangles_passing_at_a_slant_are_decided():
    robot, scene = bc.load_robot(ROBOT), plate()
    touched = sampled_contact(robot, scene, 4001)
    assert len(touched) > 100
    found = check_path(robot, scene, [[-1.0], [1.0]])
    assert found.verdict == "contact"
    start, end, names = found.first_contact
    assert names == ("arm", "plate")
    assert start <= touched[0] <= end + 1.0 / 4000
    assert end - start < 1e-4


def test_beside_it_the_same_arm_is_clear():
    robot, scene = bc.load_robot(ROBOT), plate()
    touched = sampled_contact(robot, scene, 4001)
    last_clear = -1.0 + 2.0 * (touched[0] - 0.002)
    found = check_path(robot, scene, [[-1.0], [last_clear]])
    assert found.verdict == "clear"


def test_nothing_clear_where_samples_touch(monkeypatch):
    """By distances alone: every sampled contact lies in a stretch that is not clear."""
    monkeypatch.setattr(path_search, "QUICK_LIMIT", 0)
    robot, scene = bc.load_robot(ROBOT), plate()
    found = check_path(robot, scene, [[-1.0], [1.0]])
    clear = [(s.start, s.end) for s in found.intervals if s.verdict == "clear"]
    assert clear
    for fraction in sampled_contact(robot, scene, 2001):
        assert not any(start < fraction < end for start, end in clear)


def test_a_limit_too_small_is_unknown_and_says_so():
    robot, scene = bc.load_robot(ROBOT), plate()
    problem = bc_problem(robot, scene)
    found = path_search.search(problem, [[-1.0], [1.0]], piece_limit=20)
    assert found.verdict == "unknown"
    assert "gave up" in found.reason


def bc_problem(robot, scene):
    from borecheck.motion.robot_problem import path_problem

    return path_problem(robot, scene)


@pytest.mark.parametrize("margin", [0.0, 0.01])
def test_margin_moves_the_first_contact_forward(margin):
    robot, scene = bc.load_robot(ROBOT), plate()
    with_margin = check_path(robot, scene, [[-1.0], [1.0]], margin=margin)
    without = check_path(robot, scene, [[-1.0], [1.0]])
    assert with_margin.verdict == without.verdict == "contact"
    assert with_margin.first_contact[0] <= without.first_contact[0]
    if margin:
        assert with_margin.first_contact[1] < without.first_contact[0]


def test_parts_at_rest_beside_each_other_are_decided():
    """2.5 mm apart for every q5, and no plane that is tried separates them."""
    robot, scene = bc.load_robot("zerobot", mount="+90"), bc.load_scene("ct_gantry")
    q = robot.home.copy()
    for angle in (-0.47618670341370706, *np.linspace(-0.5, 0.5, 12)):
        q[4] = angle
        assert bc.check(robot, scene, q).clear
        assert check_path(robot, scene, [q], clearance=False).clear
