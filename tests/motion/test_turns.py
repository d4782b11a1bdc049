"""Continuous joints that turn by half a turn or more between two waypoints."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.settings import settings
from borecheck.core.se3 import transform
from borecheck.errors import UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.motion.certify import write_path_certificate
from borecheck.motion.check import check_motion, check_path
from borecheck.motion.outcome import PathVerdict, Stretch
from borecheck.motion.turns import OpenTurns, _overlap, held_back, open_turns
from borecheck.plans.plan_motion import nearest_turn
from borecheck.robots.scene import Obstacle, Scene
from tests.test_cli import run

BAR = (
    "<collision><origin xyz='0.25 0 0'/><geometry><box size='0.5 0.02 0.02'/>"
    "</geometry></collision>"
)


def joint(name, parent, child, kind="continuous", more=""):
    limit = "<limit lower='-7' upper='7' effort='1' velocity='1'/>"
    return (
        f"<link name='{child}'>{BAR}</link><joint name='{name}' type='{kind}'>"
        f"<parent link='{parent}'/><child link='{child}'/><axis xyz='0 0 1'/>"
        f"<origin xyz='0 0 0.1'/>{limit if kind == 'revolute' else ''}{more}</joint>"
    )


def robot_of(tmp_path, *joints):
    file = tmp_path / "turn.urdf"
    file.write_text(f"<robot name='turn'><link name='base'/>{''.join(joints)}</robot>")
    return bc.load_robot(file)


def pin(angle, z=0.1):
    """A pin on the bar's way at an angle."""
    place = transform([0.45 * np.cos(angle), 0.45 * np.sin(angle), z])
    mesh = box("pin", [0.02, 0.02, 0.02]).moved(place)
    return Scene("s", None, {}, "t", (Obstacle("pin", "other", mesh, "t"),), {}, (), ())


@pytest.fixture
def turn(tmp_path):
    return robot_of(tmp_path, joint("spin", "base", "bar"))


def both(robot, scene, waypoints, **more):
    """The verdict of both functions, which must be the same."""
    path = check_path(robot, scene, waypoints, **more)
    motion = check_motion(robot, scene, waypoints, settings(), **more)
    assert path.verdict == motion.verdict
    return path, motion


def test_from_3_to_minus_3_is_unknown_until_the_way_is_said(turn):
    behind = pin(np.pi)
    for found in both(turn, behind, [[3.0], [-3.0]]):
        assert found.unknown
        assert not found.certified
        assert found.least is None
        assert "spin" in found.reason
        assert "0.2832" in found.reason
        assert "--long-way" in found.reason
    path, motion = both(turn, behind, [[3.0], [-3.0]], long_way=True)
    assert path.clear
    assert any("spin" in text for text in motion.not_covered)
    assert both(turn, behind, [[3.0], [1.0], [-1.0], [-3.0]])[0].clear
    assert both(turn, behind, [[3.0], [2 * np.pi - 3.0]])[0].contact


@pytest.mark.parametrize(
    ("step", "is_open"),
    [
        (np.pi, True),
        (-np.pi, True),
        (np.pi - 1e-9, True),
        (np.pi - 1e-3, False),
        (2 * np.pi, True),
        (20.0, True),
    ],
)
def test_from_half_a_turn_on(turn, step, is_open):
    found = check_path(turn, pin(0.0, z=9.0), [[0.4], [0.4 + step]])
    assert found.unknown if is_open else found.clear


def test_a_joint_with_limits_goes_as_written(tmp_path):
    robot = robot_of(tmp_path, joint("elbow", "base", "bar", "revolute"))
    assert check_path(robot, pin(np.pi), [[3.0], [-3.0]]).clear


@pytest.mark.parametrize("leader", ["continuous", "revolute"])
def test_a_mimic_joint_turns_by_its_multiplier(tmp_path, leader):
    mimic = "<mimic joint='a' multiplier='-2'/>"
    robot = robot_of(
        tmp_path,
        joint("a", "base", "one", leader),
        joint("b", "one", "two", "continuous", mimic),
    )
    points = np.array([[0.0], [1.0], [2.8]])
    assert open_turns(robot.model, points).steps == (1,)
    assert check_path(robot, pin(0.0, z=9.0), points).unknown
    assert check_path(robot, pin(0.0, z=9.0), [[0.0], [1.5], [2.8]]).clear


def test_contact_that_every_way_leads_to_stays_contact(turn):
    at_start = pin(3.0)
    for found in both(turn, at_start, [[3.0], [-3.0]]):
        assert found.contact
    before = both(turn, pin(0.5), [[0.0], [1.0], [-3.0]])
    assert [found.contact for found in before] == [True, True]
    assert before[0].first_contact[1] < 0.5


def test_contact_on_one_of_two_ways_is_unknown(turn):
    for found in both(turn, pin(0.0), [[3.0], [-3.0]]):
        assert found.unknown


def test_stretches_beside_an_open_step_keep_what_is_known(turn):
    path = check_path(turn, pin(0.0, z=9.0), [[0.0], [1.0], [-3.0], [-2.0]])
    kept = [(s.start, s.end, s.verdict) for s in path.intervals]
    thirds = [0.0, 1 / 3, 2 / 3, 1.0]
    assert [verdict for _, _, verdict in kept] == ["clear", "unknown", "clear"]
    assert [start for start, _, _ in kept] == pytest.approx(thirds[:3])
    assert [end for _, end, _ in kept] == pytest.approx(thirds[1:])


def test_no_certificate_of_an_open_way(turn, tmp_path):
    file = tmp_path / "c.json"
    with pytest.raises(UsageError, match="spin"):
        write_path_certificate(turn, pin(np.pi), [[3.0], [-3.0]], 0.0, file)
    write_path_certificate(turn, pin(np.pi), [[3.0], [-3.0]], 0.0, file, long_way=True)
    assert bc.verify(file).accepted
    bound = bc.verify(file, turn, pin(np.pi), waypoints=[[3.0], [-3.0]])
    assert bound.accepted
    assert any("spin" in text for text in bound.not_known)


def test_the_command_asks_for_the_way(capsys, turn, tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("spin\n3.0\n-3.0\n")
    pin_file = tmp_path / "pin.obj"
    mesh = pin(np.pi).obstacles[0].mesh
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.triangles]
    pin_file.write_text("\n".join(lines) + "\n")
    words = ("check", turn.file, f"{pin_file}:m", "--path", path)
    status, out, _ = run(capsys, *words)
    assert status == 2
    assert "--long-way" in out
    status, out, _ = run(capsys, *words, "--long-way")
    assert status == 0
    assert "; that the controller turns continuous joint spin" in out


def test_a_plan_s_continuous_joint_goes_the_short_way(tmp_path):
    robot = robot_of(
        tmp_path,
        joint("spin", "base", "one"),
        joint("elbow", "one", "two", "revolute"),
    )
    rng = np.random.default_rng(5)
    q = np.array([3.1, 3.1])
    for wrapped in rng.uniform(-np.pi, np.pi, (50, 2)):
        after = nearest_turn(robot.model, wrapped, q)
        assert after[1] == wrapped[1]  # a joint with limits is where it is said to be
        assert np.cos(after[0] - wrapped[0]) == pytest.approx(1.0)
        assert abs(after[0] - q[0]) <= np.pi + 1e-9
        q = after
    assert nearest_turn(robot.model, np.array([-3.1, 0.0]), np.array([3.1, 0.0]))[
        0
    ] == pytest.approx(2.0 * np.pi - 3.1)


def open_steps(*steps, count=4):
    return OpenTurns(steps, count, "which way?", "as written")


def test_a_stretch_overlaps_an_open_step_by_more_than_a_waypoint():
    turns = open_steps(1, count=1)  # from waypoint 1 to 2, so that fractions are times
    for off, within in ((0.5e-9, False), (1.5e-9, True)):
        assert _overlap(0.0, 1.0 + off, turns) == within
        assert _overlap(2.0 - off, 3.0, turns) == within
    assert _overlap(0.0, 9.0, turns)
    assert not _overlap(0.0, 1.0, turns)
    assert not _overlap(2.0, 9.0, turns)
    assert _overlap(0.0, 1.0, open_steps(3, 0))


def written(first, *stretches):
    whole = stretches or (Stretch(0.0, 1.0, "clear", ()),)
    return PathVerdict("contact", "as found", ("q",), True, whole, first, 0.5)


AB = ("a", "b")


@pytest.mark.parametrize(
    ("first", "kept"),
    [((0.0, 0.25, AB), True), ((0.25, 0.3, AB), False), ((0.5, 0.75, AB), True)],
)
def test_where_contact_begins_is_kept_outside_open_steps(first, kept):
    """In one that is open another way may lead to it later, or not at all."""
    found = held_back(written(first), open_steps(1), "waypoint 2: a and b meet")
    assert found.verdict == "contact"
    assert not found.certified
    assert found.first_contact == (first if kept else None)
    assert found.reason == ("as found" if kept else "waypoint 2: a and b meet")


def test_contact_that_is_left_says_who_meets():
    stretch = Stretch(0.75, 1.0, "contact", (AB,))
    rest = Stretch(0.0, 0.75, "clear", ())
    for first in (None, (0.3, 0.4, AB)):
        found = held_back(written(first, rest, stretch), open_steps(1), None)
        assert found.first_contact is None
        assert found.reason == f"a and b meet {stretch.place}"
        assert [(s.start, s.end, s.verdict) for s in found.intervals] == [
            (0.0, 0.25, "clear"),
            (0.25, 0.5, "unknown"),
            (0.5, 0.75, "clear"),
            (0.75, 1.0, "contact"),
        ]
