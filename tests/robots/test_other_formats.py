"""Files of other tools: refused by check and validate alike, with a way on."""

import json

import numpy as np
import pytest
import trimesh

from borecheck.cli import main
from borecheck.errors import MeshError
from borecheck.geometry.mesh_files.reading import read_mesh
from tests.places import ROBOTS

MJCF = '<mujoco model="a"><worldbody><body name="b"/></worldbody></mujoco>'
SDF = '<?xml version="1.0"?><sdf version="1.9"><model name="a"/></sdf>'
MESH = (
    '<robot name="r"><link name="base"><collision><geometry><mesh filename="{}"/>'
    "</geometry></collision></link></robot>"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("formats")
    for suffix in ("xml", "urdf"):
        (made / f"mjcf.{suffix}").write_text(MJCF)
        (made / f"sdf.{suffix}").write_text(SDF)
    (made / "model.sdf").write_text(SDF)
    block = trimesh.creation.box((0.2, 0.3, 0.4))
    for suffix in ("glb", "3mf", "stl"):
        block.export(made / f"block.{suffix}")
    for name in ("block.glb", "block.3mf", "block.step"):
        (made / f"{name}.urdf").write_text(MESH.format(name))
    (made / "block.step").write_text("ISO-10303-21;")
    return made


@pytest.fixture
def run(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)

    def run(*words):
        status = main(list(words))
        return status, *capsys.readouterr()

    return run


ROBOT_FILES = {
    "mjcf.xml": "mjcf-urdf-simple-converter",
    "mjcf.urdf": "mjcf-urdf-simple-converter",
    "sdf.xml": "sdformat_urdf",
    "sdf.urdf": "sdformat_urdf",
    "model.sdf": "sdformat_urdf",
    "block.glb.urdf": "trimesh.load('x.glb', force='mesh').export('x.stl')",
    "block.3mf.urdf": "trimesh.load('x.3mf', force='mesh').export('x.stl')",
    "block.step.urdf": "no mesh format is known by '.step'",
}


@pytest.mark.parametrize("name", ROBOT_FILES)
def test_check_and_validate_refuse_a_robot_alike(run, name):
    status, out, err = run("check", name, "block.stl:m@2,0,0", "--q", "home")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert ROBOT_FILES[name] in err
    status, out, _ = run("validate", name, "--format", "json", "--no-run")
    errors = [
        f for f in json.loads(out)["files"][0]["findings"] if f["severity"] == "error"
    ]
    assert status == 1
    assert [ROBOT_FILES[name] in finding["message"] for finding in errors] == [True]


@pytest.mark.parametrize("name", ["block.glb", "block.3mf", "block.step"])
def test_an_obstacle_is_refused_in_one_line(run, name):
    arm = str(ROBOTS / "two_link.urdf")
    status, out, err = run("check", arm, f"{name}:m", "--q", "home")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "no mesh format is known by" in err


@pytest.mark.parametrize("name", ["block.glb", "block.3mf"])
def test_the_way_that_is_told_leads_to_the_same_body(folder, name):
    with pytest.raises(MeshError) as error:
        read_mesh(folder / name)
    told = str(error.value).partition("for example by ")[2].partition(",")[0]
    assert told.startswith("trimesh.load(")
    made = folder / "made.stl"
    trimesh.load(folder / name, force="mesh").export(made)
    bounds = [read_mesh(file).bounds for file in (made, folder / "block.stl")]
    np.testing.assert_allclose(*bounds, rtol=1e-6)
