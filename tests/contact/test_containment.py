"""Surfaces that cancel: the same answer for a pose, a batch and a motion."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.certify import write_path_certificate
from borecheck.robots.scene import Obstacle, Scene
from borecheck.verify.check import verify
from tests.geometry.triangles.test_solid import flipped, joined, twice
from tests.places import ROBOTS


def scene_of(mesh):
    obstacle = Obstacle("room", "other", mesh, "")
    return Scene("s", None, {}, "test", (obstacle,), {}, (), ())


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOTS / "two_link.urdf")


ROOM, CAVE = box("room", (9.0, 9.0, 9.0)), box("cave", (8.0, 8.0, 8.0))
BESIDE = TriangleMesh("room", ROOM.vertices + [0.5, 0.4, 0.3], ROOM.triangles)
WALLS = joined(
    *(
        TriangleMesh("w", wall.vertices + 4.0 * sign * np.eye(3)[k], wall.triangles)
        for k in range(3)
        for sign in (1.0, -1.0)
        for wall in [box("w", np.where(np.arange(3) == k, 0.5, 8.8 + 0.1 * k))]
    ),
    name="walls",
)
ROOMS = {
    "solid": (ROOM, "contact"),
    "inverted": (flipped(ROOM), "contact"),
    "drawn twice": (twice(ROOM), "unknown"),
    "other diagonals": (twice(ROOM, True), "unknown"),
    "overlapping, one inverted": (joined(ROOM, flipped(BESIDE)), "unknown"),
    "overlapping": (joined(ROOM, BESIDE), "contact"),
    "cavity": (joined(ROOM, flipped(CAVE)), "clear"),
    "walls that cross": (WALLS, "clear"),
    "block in an inverted one": (joined(flipped(ROOM), CAVE), "unknown"),
}


@pytest.mark.parametrize("kind", ROOMS)
def test_pose_batch_and_motion_agree(arm, kind, tmp_path):
    mesh, expected = ROOMS[kind]
    scene = scene_of(mesh)
    qs = np.array([[0.0], [0.7], [-1.2]])
    verdicts = [bc.check(arm, scene, q) for q in qs]
    assert {v.verdict for v in verdicts} == {expected}
    batch = bc.first_contacts(arm, scene, qs)
    assert batch.tolist() == [expected != "clear"] * 3
    motion = bc.check_path(arm, scene, qs)
    assert motion.verdict == expected
    assert motion.certified == (expected == "clear")
    if expected == "clear":
        write_path_certificate(arm, scene, qs, 0.0, tmp_path / "c.json")
        assert verify(tmp_path / "c.json").accepted
    if expected == "unknown":
        assert f"inside {mesh.name}" in verdicts[0].reason
        assert f"inside {mesh.name}" in motion.reason


@pytest.mark.parametrize("drawn", [lambda m: m, twice])
def test_an_obstacle_inside_a_part_drawn_twice(tmp_path, drawn):
    mesh = drawn(box("hull", (1.0, 1.0, 1.0)))
    lines = ["solid hull"]
    for corners in mesh.corners:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {} {} {}".format(*corner) for corner in corners]
        lines += ["endloop", "endfacet"]
    (tmp_path / "hull.stl").write_text("\n".join([*lines, "endsolid hull", ""]))
    hull = '<collision><geometry><mesh filename="hull.stl"/></geometry></collision>'
    joint = '<joint name="j" type="prismatic"><parent link="b"/><child link="hull"/>'
    joint += '<axis xyz="1 0 0"/>'
    joint += '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
    text = f'<robot name="r"><link name="b"/><link name="hull">{hull}</link>{joint}'
    (tmp_path / "r.urdf").write_text(text + "</robot>")
    robot = bc.load_robot(tmp_path / "r.urdf")
    scene = scene_of(box("speck", (0.1, 0.1, 0.1)))
    expected = "contact" if drawn is not twice else "unknown"
    assert bc.check(robot, scene, [0.1]).verdict == expected
    assert bc.check_path(robot, scene, [[0.1], [0.2]]).verdict == expected
    found = bc.first_contacts(robot, scene, [[0.1], [2.0]])
    assert found.tolist() == [True, False]
