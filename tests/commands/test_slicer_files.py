"""Plans from 3D Slicer through `check`, and the result back in its scene."""

import json

import numpy as np
import pytest

from borecheck.cli import main
from borecheck.exchange.markups import read_markups
from borecheck.geometry.mesh_files.reading import read_mesh_file

PLACED = ["--isocentre", "12mm,-40mm,-750mm", "--position", "HFS"]
ARM = [
    "check",
    "arm.urdf",
    "gantry.stl:mm",
    *["--base", "0.55,0,-0.35,0,0,180deg", "--patient", "torso.stl:mm@0,0,-0.1"],
    *["--needle", "needle_link", "--tip", "needle_tip:z", "--samples", "3"],
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("slicer") / "files"
    assert main(["examples", str(made)]) == 0
    return made


@pytest.fixture
def run(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)

    def words(*more):
        status = main([*ARM, *map(str, more)])
        return status, *capsys.readouterr()

    return words


def test_a_line_of_slicer_is_the_plan_it_was_made_from(run, tmp_path):
    for file, more in (("plans.csv", []), ("line.mrk.json", PLACED)):
        out = tmp_path / f"{file}.json"
        assert run("--plan", file, "--out", out, *more)[0] == 0
    ours, theirs = (
        json.loads((tmp_path / f"{file}.json").read_text())["plans"][0]
        for file in ("plans.csv", "line.mrk.json")
    )
    assert ours["name"] == theirs["name"] == "straight"
    for end in ("entry", "target"):
        np.testing.assert_allclose(theirs[end], ours[end], atol=1e-12)


def test_verdict_bodies_and_transform_are_in_the_patients_coordinates(run, tmp_path):
    scene = tmp_path / "scene"
    status, *_ = run("--plan", "line.mrk.json", *PLACED, "--slicer", scene)
    assert status == 0
    said = (scene / "borecheck_verdict.txt").read_text()
    assert said.startswith("CLEAR: ")
    (plan,) = read_markups(scene / "plan_straight.mrk.json")
    np.testing.assert_allclose(
        1e3 * plan.points_lps, [[12, -40, -750], [12, 20, -750]], atol=1e-9
    )
    for name in ("patient_torso.stl", "robot_straight.stl", "other_gantry.stl"):
        assert read_mesh_file(scene / name, 1e-3).frame == "lps"
    torso = read_mesh_file(scene / "patient_torso.stl", 1e-3).mesh
    low, high = torso.bounds
    # 600 mm along the bore, 340 across, 200 high, its middle 100 mm below the isocentre
    np.testing.assert_allclose(high - low, [0.34, 0.2, 0.6], atol=1e-6)
    np.testing.assert_allclose((low + high) / 2, [0.012, 0.06, -0.75], atol=1e-6)
    # the transform that was written places the same plan
    again = tmp_path / "again.json"
    words = ["--transform", scene / "scanner_from_patient.tfm", "--out", again]
    assert run("--plan", scene / "plan_straight.mrk.json", *words)[0] == 0
    entry = json.loads(again.read_text())["plans"][0]["entry"]
    np.testing.assert_allclose(entry, 0.0, atol=1e-12)


def test_a_contact_has_its_place(run, tmp_path):
    scene, out = tmp_path / "scene", tmp_path / "out.json"
    words = ["--obstacle", "torso.stl:mm@0.2,0,0.3", "--slicer", scene, "--out", out]
    assert run("--plan", "line.mrk.json", *PLACED, *words)[0] == 1
    (row, *_) = json.loads(out.read_text())["plans"][0]["touching"]
    (marked,) = read_markups(scene / "contacts_straight.mrk.json")
    x, y, z = row["place_m"]
    there = [0.012 - y, -0.040 - z, -0.750 + x]
    np.testing.assert_allclose(marked.points_lps[0], there, atol=1e-9)
    assert marked.labels[0] == f"{row['link']} - {row['obstacle']}"


REFUSED = {
    "no place": ([], "--isocentre X,Y,Z"),
    "no position": (PLACED[:2], "--position"),
    "no isocentre": (PLACED[2:], "goes with --isocentre"),
    "millimetres": (["--isocentre", "12,-40,-750", *PLACED[2:]], "millimetres"),
    "both": ([*PLACED, "--transform", "t.tfm"], "give one"),
    "no file": (["--transform", "t.tfm"], "t.tfm: cannot be read"),
    "another file": (["--transform", "plans.csv"], "no transform"),
    "a full folder": ([*PLACED, "--slicer", "."], "no empty folder"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_place_that_is_none_is_told_in_a_line(case, run):
    words, said = REFUSED[case]
    status, out, err = run("--plan", "line.mrk.json", *words)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_the_patients_place_is_bound_by_verify(run, folder, tmp_path, capsys):
    certificate = tmp_path / "plan.json"
    words = ["--plan", "line.mrk.json", "--certificate", certificate]
    assert run(*words, *PLACED)[0] == 0
    bound = ["verify", str(certificate), "--robot", "arm.urdf", "--scene", *ARM[2:-2]]
    bound += ["--plan", "line.mrk.json"]
    assert main([*bound, *PLACED]) == 0
    other = ["--isocentre", "12mm,-40mm,-751mm", *PLACED[2:]]
    assert main([*bound, *other]) == 1
