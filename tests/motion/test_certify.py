"""What a certificate says that it is about, and when there is none to write."""

import json
from hashlib import sha256

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.certify import about_what, write_path_certificate
from borecheck.plans.corridor import Corridor
from borecheck.robots.scene import Obstacle, Scene
from tests.places import ROBOTS

PATH = [[0.1], [0.4]]
CORRIDOR = Corridor(np.array([0.5, 0.0, 0.1]), np.array([0.5, 0.0, 0.04]), 0.0006)
RECORD = {
    "entry": [0.5, 0.0, 0.1],
    "target": [0.5, 0.0, 0.04],
    "radius_m": 0.0006,
    "slack_m": 0.002,
}


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOTS / "two_link.urdf")


def scene_of(x, opened=False):
    mesh = box("block", (0.1, 0.1, 0.1))
    faces = mesh.triangles[:-1] if opened else mesh.triangles
    moved = TriangleMesh("block", mesh.vertices + [x, 0, 0], faces)
    block = (Obstacle("block", "other", moved, "t"),)
    return Scene("room", None, {"tilt": "5"}, "t", block, {}, (), ())


@pytest.mark.parametrize(
    ("corridor", "plan", "more"),
    [
        (None, "", {}),
        (None, "liver", {}),  # without a corridor no needle enters anything
        (CORRIDOR, "", {"corridor": RECORD}),
        (CORRIDOR, "liver", {"plan": {"name": "liver", **RECORD}}),
    ],
)
def test_it_names_robot_scene_and_where_a_needle_may_be(arm, corridor, plan, more):
    about = about_what(arm, scene_of(3.0), corridor, plan)
    urdf = sha256(arm.urdf_text.encode()).hexdigest()
    assert about == {
        "robot": {"name": arm.name, "arguments": {}, "urdf_sha256": urdf},
        "scene": {"name": "room", "arguments": {"tilt": "5"}},
        **more,
    }


def test_what_is_written_holds_for_what_it_is_about_and_for_nothing_else(arm, tmp_path):
    file, scene = tmp_path / "way.json", scene_of(3.0)
    write_path_certificate(arm, scene, PATH, 0.01, file)
    assert json.loads(file.read_text())["about"] == about_what(arm, scene, None, "")
    for margin, accepted in ((0.01, True), (0.02, False)):
        found = bc.verify(file, arm, scene, waypoints=PATH, margin=margin)
        assert found.accepted == accepted


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (scene_of(0.0), "no certificate to write: .*block"),
        (scene_of(3.0, opened=True), "a surface is open"),
    ],
)
def test_there_is_none_of_what_touches_or_is_open(arm, tmp_path, scene, said):
    with pytest.raises(UsageError, match=said):
        write_path_certificate(arm, scene, PATH, 0.0, tmp_path / "way.json")
    assert not list(tmp_path.iterdir())


def test_a_turn_that_nobody_stated_has_none(tmp_path):
    """More than half a turn of a joint without ends: which way round is not said."""
    text = (ROBOTS / "two_link.urdf").read_text()
    assert 'type="revolute"' in text
    file = tmp_path / "turner.urdf"
    file.write_text(text.replace('type="revolute"', 'type="continuous"'))
    robot, scene = bc.load_robot(file), scene_of(3.0)
    way = [[0.0], [3.5]]
    with pytest.raises(UsageError, match="no certificate to write"):
        write_path_certificate(robot, scene, way, 0.0, tmp_path / "way.json")
    write_path_certificate(robot, scene, way, 0.0, tmp_path / "w.json", long_way=True)
    assert bc.verify(tmp_path / "w.json", robot, scene, waypoints=way).accepted
