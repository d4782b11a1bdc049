"""What the robot does to itself hides nothing of what stands around it, nor the other.

Blocks that slide: what touches what is known from where they are.
"""

from dataclasses import replace

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.comparison import to_json
from borecheck.contact.settings import settings
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.doubt import FileDoubt
from borecheck.motion.check import check_motion
from borecheck.robots.scene import Obstacle, Scene
from tests.sliders import BALL, sliders, spread

CHECKERS = ("exact", "two-sided", "paper:robot", "paper:scanner", "coal")
WALL = 8.0  # where the wall begins


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    file = tmp_path_factory.mktemp("robot") / "sliders.urdf"
    file.write_text(sliders())
    return bc.load_robot(file)


def wall_at(x, name="wall", size=(1.0, 1.0, 1.0)):
    block = box(name, size)
    vertices = block.vertices + [x + size[0] / 2.0, 0.003, 0.004]
    mesh = TriangleMesh(name, vertices, block.triangles)
    return Scene("s", None, {}, "t", (Obstacle(name, "scanner", mesh, ""),), {}, (), ())


# where blocks are, and what is said: obstacles, itself
POSES = {
    "apart": ({}, "clear", "clear"),
    "two meet": ({"b": 0.07}, "clear", "contact"),
    "one in the wall": ({"d": WALL}, "contact", "clear"),
    "both": ({"b": 0.07, "d": WALL}, "contact", "contact"),
    "two meet in the wall": ({"c": WALL, "d": WALL + 0.04}, "contact", "contact"),
}


@pytest.mark.parametrize("checker", CHECKERS)
@pytest.mark.parametrize("name", POSES)
def test_both_questions_are_answered_by_every_checker(robot, name, checker):
    at, obstacles, itself = POSES[name]
    verdict = bc.check(robot, wall_at(WALL), spread(**at), checker=checker)
    said = (verdict.obstacles.verdict, verdict.itself.verdict)
    if checker.startswith("paper"):  # blind to some; where it is, nothing is clear
        expected = zip(said, (obstacles, itself), strict=True)
        assert all(s == e or (s, e) == ("unknown", "contact") for s, e in expected)
    else:
        assert said == (obstacles, itself)
    order = ("contact", "unknown", "clear")
    assert verdict.verdict == min(said, key=order.index)
    if obstacles == "clear":
        assert verdict.clearance_m == pytest.approx(WALL - 3.05)


def test_pairs_are_those_that_touch_by_link(robot):
    verdict = bc.check(robot, wall_at(WALL), spread(b=0.07, d=WALL))
    assert verdict.obstacles.pairs == (("d", "wall"),)
    assert verdict.itself.pairs == (("a", "b"),)
    assert "a meets b" in verdict.reason
    assert "d meets wall" in verdict.reason


def test_an_obstacle_may_be_called_like_a_link(robot):
    verdict = bc.check(robot, wall_at(WALL, "a"), spread(b=WALL))
    assert verdict.obstacles.pairs == (("b", "a"),)
    assert verdict.itself.clear


def test_held_by_an_obstacle_while_the_robot_touches_itself(robot):
    """A solid that holds the robot is seen although other parts of it meet."""
    room = wall_at(-20.0, "room", (40.0, 40.0, 40.0))
    verdict = bc.check(robot, room, spread(b=0.07))
    assert (verdict.obstacles.verdict, verdict.itself.verdict) == ("contact", "contact")
    assert verdict.obstacles.qualifiers == ("contained",)
    assert verdict.closest is None


def test_a_guessed_unit_is_a_doubt_of_the_obstacles_alone(robot):
    (wall,) = wall_at(WALL).obstacles
    guessed = FileDoubt("wall.stl", "m", None, False, "wall.stl:m")
    wall = replace(wall, doubt=guessed)
    scene = replace(wall_at(WALL), obstacles=(wall,))
    verdict = bc.check(robot, scene, spread())
    assert (verdict.obstacles.verdict, verdict.itself.verdict) == ("unknown", "clear")
    path = bc.check_path(robot, scene, [spread(), spread(d=4.0)])
    assert (path.obstacles.verdict, path.itself.verdict) == ("unknown", "clear")


def test_within_the_margin_of_an_obstacle_only(robot):
    q = spread(d=WALL - 0.06, b=0.11)  # a and b 10 mm apart, d and the wall too
    verdict = bc.check(robot, wall_at(WALL), q, margin=0.02)
    assert (verdict.obstacles.verdict, verdict.itself.verdict) == ("contact", "clear")


@pytest.mark.parametrize("own", [False, True])
def test_a_sure_contact_makes_no_other_sure(tmp_path, own):
    """A ball in the band of its polyhedra is unknown, whatever blocks do."""
    file = tmp_path / "round.urdf"
    file.write_text(sliders(shapes={"d": BALL}))
    robot = bc.load_robot(file)
    ball = next(part for part in robot.parts if part.link == "d")
    band = 0.5 * ball.mesh.excess
    if own:  # ball at c, block a in the wall
        q = spread(c=3.0, d=3.1 + band, a=WALL)
        sure, unsure = "obstacles", "itself"
    else:  # ball at the wall, a and b meet
        q = spread(b=0.07, d=WALL - 0.05 - band)
        sure, unsure = "itself", "obstacles"
    verdict = bc.check(robot, wall_at(WALL), q)
    assert getattr(verdict, sure).contact
    assert getattr(verdict, unsure).unknown
    assert verdict.contact
    assert len(verdict.contacts) == 0 or own
    assert len(verdict.self_contacts) == 0 or not own


MOTIONS = {
    # from, to, obstacles, itself
    "apart": ({"d": 5.0}, {"d": 6.0}, "clear", "clear"),
    "always meet": ({"b": 0.07, "d": 5.0}, {"b": 0.07, "d": 6.0}, "clear", "contact"),
    "into the wall": ({"d": 5.0}, {"d": WALL}, "contact", "clear"),
    "both": ({"b": 0.07, "d": 5.0}, {"b": 0.07, "d": WALL}, "contact", "contact"),
    # between samples only
    "past each other": ({"a": 0.0}, {"a": 2.2}, "clear", "contact"),
    "one goes through": ({"a": -9.0}, {"a": 9.0}, "contact", "contact"),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_are_answered_apart_at_every_instant(robot, name):
    start, end, obstacles, itself = MOTIONS[name]
    points = np.array([spread(**start), spread(**end)])
    for samples in (2, 41):
        found = check_motion(robot, wall_at(WALL), points, settings(), samples=samples)
        said = (found.obstacles.verdict, found.itself.verdict)
        if name == "into the wall" and said[1] == "unknown":  # not asked in contact
            said = (said[0], "clear")
        if name == "one goes through" and said[1] == "unknown":
            said = (said[0], "contact")
        assert said == (obstacles, itself), samples
        if obstacles == "clear":
            least = WALL - max(points[:, 3].max(), points.max()) - 0.05
            assert found.least.lower <= least + 1e-9
            assert found.least.upper >= least - 1e-9
    path = bc.check_path(robot, wall_at(WALL), points)
    assert (path.obstacles.verdict, path.itself.verdict) == (obstacles, itself)
    assert (path.clearance_m is None) == (obstacles == "contact")


def test_samples_alone_certify_neither(robot):
    points = [spread(d=5.0), spread(d=6.0)]
    found = check_motion(robot, wall_at(WALL), points, settings(), certify=False)
    assert found.obstacles.unknown
    assert found.itself.unknown


def test_compare_counts_obstacles_apart(robot):
    qs = [spread(), spread(b=0.07), spread(d=WALL), spread(b=0.07, d=WALL)]
    found = bc.compare(robot, wall_at(WALL), qs, checkers=["exact", "coal"])
    for summary in found.checkers.values():
        assert summary.contact_poses == (1, 2, 3)
        assert summary.obstacle_poses == (2, 3)
    assert found.touching_itself == (("a", "b"),)
    document = to_json(found)
    assert [pose["obstacles"]["coal"] for pose in document["poses"]] == [
        *(False, False, True, True)
    ]
