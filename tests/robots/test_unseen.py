"""What a verdict says of its robot: nothing that was left out is left unsaid."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.robots import drawn as drawn_module
from borecheck.robots.robot import robot_with
from tests.places import DATA

BOX = "<geometry><box size='0.1 0.04 0.04'/></geometry>"
JOINT = (
    "<joint name='j' type='fixed'><parent link='base'/><child link='probe'/></joint>"
)


def write(folder, inside, beside="", name="r.urdf"):
    base = f"<link name='base'><collision>{BOX}</collision></link>"
    text = f"<robot name='r'>{base}<link name='probe'>{inside}</link>{JOINT}{beside}"
    file = folder / name
    file.write_text(text + "</robot>")
    return file


def lines(file):
    return [
        line for line in robot_with(file, {}).not_modelled if "mesh" not in line[:8]
    ]


def said(file, word):
    return [line for line in lines(file) if word in line]


def drawn(size, x=0.0):
    origin = f"<origin xyz='{x} 0 0'/>"
    geometry = f"<geometry><box size='{size}'/></geometry>"
    return f"<visual>{origin}{geometry}</visual><collision>{BOX}</collision>"


def test_what_is_drawn_beyond_its_collision_is_said(tmp_path):
    file = write(tmp_path, drawn("0.1 0.04 0.04", 0.55))
    assert said(file, "drawn beyond") == [
        "what is drawn beyond its <collision>, more than 10 mm: probe by 550 mm"
    ]
    assert said(write(tmp_path, drawn("0.119 0.04 0.04")), "drawn beyond") == []
    assert said(write(tmp_path, drawn("0.05 0.04 0.04")), "drawn beyond") == []


def test_it_stands_in_the_verdict(tmp_path):
    file = write(tmp_path, drawn("0.1 0.04 0.04", 0.55))
    cube = DATA / "cases" / "box.stl"
    robot, scene = bc.load_robot(file), bc.load_scene(f"{cube}:m@3,0,0")
    verdict = bc.check(robot, scene, np.zeros(0))
    assert any("probe by 550 mm" in line for line in verdict.not_modelled)


def test_a_drawn_mesh_that_is_not_there_is_said(tmp_path):
    mesh = "<visual><geometry><mesh filename='no.stl'/></geometry></visual>"
    file = write(tmp_path, f"{mesh}<collision>{BOX}</collision>")
    assert said(file, "not readable") == [
        "what is drawn beside a <collision> and not readable: probe"
    ]


def test_the_answer_is_kept_and_a_changed_file_is_looked_at_again(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "cache"))
    looked = []
    real = drawn_module.overhang
    monkeypatch.setattr(
        drawn_module, "overhang", lambda *a: looked.append(1) or real(*a)
    )
    for size, x in (
        ("0.1 0.04 0.04", 0.3),
        ("0.1 0.04 0.04", 0.3),
        ("0.2 0.04 0.04", 0.3),
    ):
        file = write(tmp_path, drawn(size, x))
        assert len(said(file, "drawn beyond")) == 1
    assert len(looked) == 2
    (kept, _) = sorted((tmp_path / "cache").glob("drawn-beyond*"))
    kept.write_bytes(b"no archive")
    for size in ("0.1 0.04 0.04", "0.2 0.04 0.04"):
        assert len(said(write(tmp_path, drawn(size, 0.3)), "drawn beyond")) == 1
    assert len(looked) == 3


def test_a_shape_that_belongs_to_nothing_is_said(tmp_path):
    lost = f"<self_filter>{BOX}</self_filter>"
    file = write(tmp_path, f"<collision>{BOX}</collision>{lost}")
    (line,) = said(file, "no link's shape")
    assert "robot/link[@name='probe']/self_filter" in line
    gazebo = f"<gazebo><link name='x'><collision>{BOX}</collision></link></gazebo>"
    (line,) = said(
        write(tmp_path, f"<collision>{BOX}</collision>", gazebo), "no link's"
    )
    assert "robot/gazebo" in line
    assert said(write(tmp_path, f"<collision>{BOX}</collision>"), "no link's") == []


def test_an_up_axis_that_is_not_applied_is_said(tmp_path):
    source = (DATA / "cases" / "dae_y_up").glob("*.dae")
    name = next(source)
    (tmp_path / "up.dae").write_bytes(name.read_bytes())
    mesh = "<collision><geometry><mesh filename='up.dae'/></geometry></collision>"
    (line,) = said(write(tmp_path, mesh), "Y_UP")
    assert "up.dae" in line
    assert "not applied" in line


@pytest.mark.parametrize("size", ["0 0 0", "0 0 1"])
def test_a_drawn_point_covers_nothing_and_is_told(tmp_path, size):
    visual = f"<visual><geometry><box size='{size}'/></geometry></visual>"
    robot = robot_with(write(tmp_path, visual), {})
    assert [part.link for part in robot.parts] == ["base"]
    assert robot.warnings == ("link probe: a drawn shape without size is left out",)


def test_a_drawn_plate_without_thickness_is_looked_at(tmp_path):
    visual = "<visual><geometry><box size='0.5 0.5 0'/></geometry></visual>"
    robot = robot_with(write(tmp_path, visual), {})
    plate = robot.parts[1].mesh
    assert plate.bounds[1] == pytest.approx([0.25, 0.25, 0.0], abs=1e-6)
    assert plate.is_closed


def test_a_floating_root_is_warned_of_unless_it_is_placed(tmp_path):
    file = tmp_path / "m.urdf"
    file.write_text(
        f"<robot name='m'><link name='w'/><link name='c'><collision>{BOX}</collision>"
        "</link><joint name='free' type='floating'><parent link='w'/><child link='c'/>"
        "</joint></robot>"
    )
    assert bc.load_robot(file).warnings == (
        "joint free stands at its origin: --base places it",
    )
    placed = np.eye(4)
    placed[:3, 3] = (1.0, 2.0, 3.0)
    robot = bc.load_robot(file, base=placed)
    assert robot.warnings == ()
    np.testing.assert_array_equal(robot.placements([])["c"], placed)
