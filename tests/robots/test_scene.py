"""Scenes: roles, places and units of what stands around the robot."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import (
    BorecheckError,
    MeshError,
    UnknownNameError,
    UrdfError,
    UsageError,
)
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.robots.scene import Obstacle, Scene, read_obstacle
from tests.places import ROBOTS

# STL holds float32
FLOAT32 = 1e-6


@pytest.fixture
def block(tmp_path):
    path = tmp_path / "block.stl"
    write_stl(path, box("block", (0.2, 0.4, 0.6)))
    return path


def bounds(scene):
    return {o.name: o.mesh.bounds for o in scene.obstacles}


def test_every_obstacle_of_a_scanner_has_its_role(ct_gantry):
    roles = {o.name: o.role for o in ct_gantry.obstacles}
    assert roles["gantry"] == "scanner"
    assert roles["couch"] == "couch"
    assert roles["torso"] == "patient"
    assert "other" not in roles.values()


def test_the_points_are_where_the_scene_says(ct_gantry):
    assert {"P1", "P2", "P3"} <= set(ct_gantry.points)
    for T in ct_gantry.points.values():
        assert T.shape == (4, 4)


def test_a_joint_of_the_scanner_moves_couch_and_patient_only(ct_gantry):
    moved = bc.load_scene("ct_gantry", couch_travel="0.1m")
    start = float(ct_gantry.arguments["couch_travel"])
    for name, before in bounds(ct_gantry).items():
        shift = bounds(moved)[name] - before
        if name in ("couch", "torso"):
            assert shift[:, 0] == pytest.approx([0.1 - start] * 2, abs=1e-9)
        else:
            assert np.abs(shift).max() < 1e-12


def test_pose_and_unit_of_a_file(block):
    scene = bc.load_scene(f"{block}:cm@1,0,0,0,0,90deg")
    (found,) = bounds(scene).values()
    half = np.array([0.002, 0.001, 0.003])  # 0.2 x 0.4 x 0.6 cm, turned about z
    assert found == pytest.approx(np.array([1, 0, 0]) + [-half, half], abs=FLOAT32)


def test_a_name_with_colons_is_taken_whole_if_it_is_there(tmp_path, block):
    odd = tmp_path / "a:mm@1,2,3.stl"
    odd.write_bytes(block.read_bytes())
    (found,) = bounds(bc.load_scene(str(odd))).values()
    assert found[1] == pytest.approx([0.1, 0.2, 0.3], abs=FLOAT32)


def test_equal_names_are_kept_apart(block):
    scene = bc.load_scene([f"{block}:m", f"{block}:m@5,0,0"], obstacles=[f"{block}:m"])
    assert [o.name for o in scene.obstacles] == ["block", "block#2", "block#3"]


def test_roles_of_added_files(block):
    scene = bc.load_scene(
        "ct_gantry", obstacles=[f"{block}:m"], patients=[f"{block}:m"]
    )
    roles = {o.name: o.role for o in scene.obstacles}
    assert roles["block"] == "other"
    assert roles["block#2"] == "patient"
    with pytest.raises(UnknownNameError):
        read_obstacle(f"{block}:m", "nurse")


def test_a_urdf_as_obstacle_stands_at_zero_and_says_so():
    scene = bc.load_scene(f"{ROBOTS / 'two_link.urdf'}@2,0,0")
    assert {o.name for o in scene.obstacles} == {"base", "arm"}
    robot = bc.load_robot(ROBOTS / "two_link.urdf")
    for part in robot.parts:
        T = robot.placements([0.0])[part.link]
        alone = part.mesh.moved(T).bounds + [2.0, 0.0, 0.0]
        assert bounds(scene)[part.link] == pytest.approx(alone, abs=1e-12)
    assert any("j=0" in warning for warning in scene.warnings)


def test_links_of_a_urdf_obstacle_without_collision_shape_are_taken_as_drawn(tmp_path):
    shape = "<geometry><box size='1 1 1'/></geometry>"
    fixed = "<joint name='f' type='fixed'><parent link='a'/><child link='b'/></joint>"
    path = tmp_path / "stand.urdf"
    path.write_text(
        f"<robot name='s'><link name='a'><collision>{shape}</collision></link>"
        f"<link name='b'><visual>{shape}</visual></link>{fixed}</robot>"
    )
    scene = bc.load_scene(str(path))
    assert [o.name for o in scene.obstacles] == ["a", "b"]
    assert any("b of" in phrase for phrase in scene.not_modelled)
    bare = tmp_path / "bare.urdf"
    bare.write_text("<robot name='s'><link name='b'/></robot>")
    with pytest.raises(UrdfError, match="no obstacle"):
        bc.load_scene(str(bare))


def test_refusals(tmp_path, block):
    with pytest.raises(UsageError, match="none of m, cm, mm"):
        bc.load_scene(f"{block}:furlong")
    with pytest.raises(UsageError, match="not 3 or 6"):
        bc.load_scene(f"{block}:m@1,2")
    with pytest.raises(UsageError, match="not 3 or 6"):
        bc.load_scene(f"{block}:m@")
    with pytest.raises(UsageError, match="metres"):
        bc.load_scene(f"{ROBOTS / 'two_link.urdf'}:mm")
    with pytest.raises(MeshError, match="no such file"):
        bc.load_scene(str(tmp_path / "none.stl"))
    with pytest.raises(UnknownNameError, match="bore"):
        bc.load_scene("ct_gantry", boer="780mm")
    with pytest.raises(UsageError, match=r"0\.70"):
        bc.load_scene("ct_gantry", bore="123mm")
    with pytest.raises(UsageError, match="installed scanner"):
        bc.load_scene(f"{block}:m", bore="780mm")
    with pytest.raises(BorecheckError, match="couch_travel"):
        bc.load_scene("ct_gantry", couch_travel="9m")
    with pytest.raises(BorecheckError):
        bc.load_scene("x" * 5000)
    robot = bc.load_robot(ROBOTS / "two_link.urdf")
    mesh = box("far", (1.0, 1.0, 1.0))
    moved = TriangleMesh("far", mesh.vertices + [1e13, 0.0, 0.0], mesh.triangles)
    obstacle = Obstacle("far", "other", moved, "test")
    far = Scene("far", None, {}, "test", (obstacle,), {}, (), ())
    with pytest.raises(BorecheckError, match="1e\\+12"):
        bc.check(robot, far, [0.0])


def test_no_obstacle_is_not_clear():
    robot = bc.load_robot(ROBOTS / "two_link.urdf")
    verdict = bc.check(robot, bc.load_scene([]), [0.0])
    assert verdict.verdict == "unknown"


@pytest.mark.parametrize("size", [200.0, 79.0, 299.0])
def test_a_size_that_fits_another_unit_too_is_not_guessed(tmp_path, size):
    """A 2 m gantry in cm (200) or inches (79), taken as mm, would be a small thing."""
    write_stl(tmp_path / "gantry.stl", box("g", (size, size / 2, size / 5)))
    with pytest.raises(MeshError, match="say the unit"):
        bc.load_scene(str(tmp_path / "gantry.stl"))
    stated = bc.load_scene(f"{tmp_path / 'gantry.stl'}:mm")
    assert len(stated.obstacles) == 1


@pytest.mark.parametrize("pose", ["0,0,-100", "800,0,0", "0,-10.5,0"])
def test_a_pose_in_millimetres_is_refused(tmp_path, pose):
    write_stl(tmp_path / "part.stl", box("p", (0.3, 0.3, 0.3)))
    with pytest.raises(UsageError, match="millimetres"):
        bc.load_scene(f"{tmp_path / 'part.stl'}:m@{pose}")
