"""Robots, installed and strange: where they stand, what may touch what."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.core.se3 import inverse, transform
from borecheck.errors import BorecheckError, UnknownNameError, UrdfError, UsageError
from tests.places import ROBOTS

# transforms of a few metres, a dozen products
ROUNDING = 1e-12

BOX = "<collision><geometry><box size='0.1 0.1 0.1'/></geometry></collision>"


def write_robot(tmp_path, links, joints, name="r.urdf"):
    """Links as {name: inside}; joints as (type, parent, child, inside)."""
    text = "".join(f"<link name='{n}'>{inside}</link>" for n, inside in links.items())
    for kind, parent, child, inside in joints:
        text += (
            f"<joint name='{parent}_{child}' type='{kind}'><parent link='{parent}'/>"
            f"<child link='{child}'/>{inside}</joint>"
        )
    path = tmp_path / name
    path.write_text(f"<robot name='r'>{text}</robot>")
    return path


def linked_pairs(robot):
    names = [part.link for part in robot.parts]
    return {frozenset((names[i], names[j])) for i, j in robot.self_pairs}


SLIDE = "<limit lower='-1' upper='1' effort='1' velocity='1'/>"


def test_a_robot_by_name_and_by_file():
    by_name = bc.load_robot("zerobot", mount="-90")
    assert by_name.arguments["mount"] == "-90"
    assert by_name.model.joint_names == ("q1", "q2", "q3", "q4", "q5", "q6")
    by_file = bc.load_robot(ROBOTS / "two_link.urdf")
    assert by_file.description is None
    assert by_file.model.joint_names == ("j",)


@pytest.mark.parametrize("name", ["zerobot", "mri_arm"])
def test_the_base_frame_stands_where_it_was_put(name, rng):
    T_scene_base = transform(rng.uniform(-1, 1, 3), rng.uniform(-3, 3, 3))
    plain, moved = bc.load_robot(name), bc.load_robot(name, base=T_scene_base)
    base = plain.description.base_frame
    assert np.abs(moved.T_scene_base - T_scene_base).max() < ROUNDING
    for q in plain.model.random_configurations(rng, 5):
        before, after = plain.placements(q), moved.placements(q)
        assert np.abs(after[base] - T_scene_base).max() < ROUNDING
        shift = T_scene_base @ inverse(before[base])
        for link, T in before.items():
            assert np.abs(after[link] - shift @ T).max() < ROUNDING


def test_a_base_frame_that_is_not_the_root(tmp_path, zerobot):
    """Zerobot's frame W may stand anywhere below its root link."""
    assert zerobot.description.base_frame == "W"
    placements = zerobot.placements(zerobot.home)
    assert np.abs(placements["W"] - np.eye(4)).max() < ROUNDING


def test_robot_and_scene_moved_together_give_the_same_answer(arm_and_block):
    arm, scene_at = arm_and_block
    T = transform([0.4, -2.0, 1.0], [0.3, -1.0, 2.0])
    moved = bc.load_robot(ROBOTS / "two_link.urdf", base=T)
    for q in (-1.5, -0.3, 0.0, 0.4):
        here = bc.check(arm, scene_at(np.eye(4)), [q])
        there = bc.check(moved, scene_at(T), [q])
        assert here.verdict == there.verdict
        if here.clearance_m is not None:
            assert there.clearance_m == pytest.approx(here.clearance_m, abs=ROUNDING)


@pytest.fixture
def arm_and_block():
    from borecheck.geometry.mesh.primitives import box
    from borecheck.geometry.triangles.placing import place_mesh
    from borecheck.robots.scene import Obstacle, Scene

    mesh = box("block", (0.2, 0.3, 0.4))
    place = transform([0.25, 0.05, 0.7])

    def scene_at(T):
        placed = place_mesh(T @ place, mesh)
        return Scene(
            "t", None, {}, "t", (Obstacle("b", "other", placed, "t"),), {}, (), ()
        )

    return bc.load_robot(ROBOTS / "two_link.urdf"), scene_at


def test_a_base_that_is_no_placement_is_refused():
    for base in (
        np.zeros((4, 4)),
        np.diag([2.0, 1, 1, 1]),
        np.eye(3),
        np.full((4, 4), np.nan),
    ):
        with pytest.raises(BorecheckError):
            bc.load_robot("zerobot", base=base)


def test_self_pairs_leave_out_one_body_and_neighbours_only(tmp_path):
    links = {"a": BOX, "b": BOX, "c": BOX, "d": BOX, "e": BOX, "frame": ""}
    joints = [
        ("prismatic", "a", "b", SLIDE),
        ("fixed", "b", "c", ""),  # one body with b
        ("prismatic", "c", "frame", SLIDE),  # nothing to touch: d's neighbour is b, c
        ("prismatic", "frame", "d", SLIDE),
        ("prismatic", "a", "e", SLIDE),  # a sibling of b
    ]
    robot = bc.load_robot(write_robot(tmp_path, links, joints))
    assert linked_pairs(robot) == {
        frozenset(pair) for pair in (("a", "d"), ("b", "e"), ("c", "e"), ("d", "e"))
    }


def test_several_shapes_of_a_link_are_all_there_and_do_not_meet_each_other(tmp_path):
    far = BOX.replace("<geometry>", "<origin xyz='0 0 5'/><geometry>")
    links = {"a": BOX + far, "b": "", "c": BOX}
    joints = [("prismatic", "a", "b", SLIDE), ("prismatic", "b", "c", SLIDE)]
    robot = bc.load_robot(write_robot(tmp_path, links, joints))
    assert [part.mesh.name for part in robot.parts] == ["a[0]", "a[1]", "c"]
    # c's nearest body above with geometry is a: neighbours
    assert robot.self_pairs == ()


def test_no_two_parts_are_called_alike(tmp_path):
    """A contact of the one was told as the other link's."""
    far = BOX.replace("<geometry>", "<origin xyz='0 0 5'/><geometry>")
    links = {"a": BOX + far, "a[1]": BOX}
    file = write_robot(tmp_path, links, [("prismatic", "a", "a[1]", SLIDE)])
    robot = bc.load_robot(file)
    names = [part.mesh.name for part in robot.parts]
    assert names == ["a[0]", "a[1]'", "a[1]"]
    assert [part.link for part in robot.parts] == ["a", "a", "a[1]"]


def test_the_second_shape_of_a_link_is_checked_too(tmp_path):
    from borecheck.geometry.mesh.primitives import box
    from borecheck.geometry.mesh_files.reading import write_stl

    far = BOX.replace("<geometry>", "<origin xyz='0 0 0.5'/><geometry>")
    robot = bc.load_robot(write_robot(tmp_path, {"a": BOX + far}, []))
    write_stl(tmp_path / "b.stl", box("b", (0.1, 0.1, 0.1)))
    scene = bc.load_scene(f"{tmp_path / 'b.stl'}:m@0.09,0,0.5")
    verdict = bc.check(robot, scene, [])
    assert verdict.verdict == "contact"
    assert {pair.link for pair in verdict.contacts} == {"a[1]"}


def test_allowed_contacts_name_links_that_exist():
    for name in ("zerobot", "mri_arm"):
        robot = bc.load_robot(name)
        for pair in robot.allowed_contacts:
            assert pair.links <= set(robot.model.link_names)
            assert pair.links not in linked_pairs(robot)
            assert pair.reason
            assert pair.source == f"description of {name}"


def test_home_of_a_stranger_is_within_its_limits(tmp_path):
    limits = "<limit lower='0.2' upper='0.7' effort='1' velocity='1'/>"
    path = write_robot(
        tmp_path, {"a": BOX, "b": BOX}, [("prismatic", "a", "b", limits)]
    )
    robot = bc.load_robot(path)
    assert robot.home == pytest.approx([0.2])
    robot.model.check_limits(robot.home)


def test_xacro_arguments_may_have_any_name(tmp_path):
    """`level` is an option of load_robot, and may be a stranger's argument."""
    from borecheck.robots.robot import robot_with

    path = tmp_path / "r.urdf.xacro"
    path.write_text(
        "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'>"
        "<xacro:arg name='level' default='1'/><link name='a'><collision><geometry>"
        "<box size='$(arg level) 1 1'/></geometry></collision></link></robot>"
    )
    robot = robot_with(path, {"level": "3"})
    assert np.ptp(robot.parts[0].mesh.bounds, axis=0) == pytest.approx([3, 1, 1])


def test_refusals(tmp_path):
    with pytest.raises(UnknownNameError, match="zerobot"):
        bc.load_robot("zerobott")
    with pytest.raises(UnknownNameError, match="mount"):
        bc.load_robot("zerobot", mounts="+90")
    with pytest.raises(UsageError, match=r"\+90, -90"):
        bc.load_robot("zerobot", mount="45")
    with pytest.raises(UnknownNameError, match="level"):
        bc.load_robot("zerobot", level="finest")
    with pytest.raises(UrdfError, match="no such file"):
        bc.load_robot(tmp_path / "none.urdf")
    with pytest.raises(UrdfError, match="directory"):
        bc.load_robot(tmp_path)
    with pytest.raises(UrdfError, match="nothing to check"):
        bc.load_robot(write_robot(tmp_path, {"a": ""}, []))
    with pytest.raises(UsageError, match="takes no arguments"):
        bc.load_robot(ROBOTS / "two_link.urdf", length="3")
    with pytest.raises(BorecheckError):
        bc.load_robot("x" * 5000)
    with pytest.raises(BorecheckError):
        bc.load_robot("a\0b.urdf")
    binary = tmp_path / "b.urdf"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UrdfError, match="not well-formed XML"):
        bc.load_robot(binary)


def test_what_answers_are_kept_for_cannot_be_changed():
    """Chains, packed poses and boxes are made once: a change would be half heard."""
    robot = bc.load_robot(ROBOTS / "two_link.urdf", base=np.eye(4))
    joint, part = robot.model.tree.joints[0], robot.parts[0]
    shapes = [s for link in robot.model.tree.links for s in link.collisions]
    kept = [robot.T_scene_root, robot.T_scene_base, joint.origin, joint.axis]
    kept += [shapes[0].origin, part.mesh.bounds, part.mesh.vertices, part.mesh.corners]
    for array in kept:
        with pytest.raises(ValueError, match="read-only"):
            array += 1.0


def test_a_base_changed_after_loading_moves_nothing():
    base = np.eye(4)
    robot = bc.load_robot(ROBOTS / "two_link.urdf", base=base)
    base[0, 3] = 1.0
    np.testing.assert_array_equal(robot.T_scene_root, np.eye(4))
