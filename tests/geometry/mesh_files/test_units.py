"""A unit that nobody stated: shown, warned of, and never a reason to say clear."""

import json
import re

import numpy as np
import pytest

import borecheck as bc
from borecheck.cli import main
from borecheck.contact.settings import settings
from borecheck.errors import UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.motion.certify import write_path_certificate
from borecheck.motion.check import check_motion
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.search import search
from borecheck.uncertainty.contact_probability import contact_probability
from borecheck.uncertainty.covariance import from_document
from borecheck.view.first_plan import first_plan
from borecheck.view.session import Session
from tests.places import DATA

ROBOT = DATA / "robots" / "two_link.urdf"
WAYPOINTS = [[-0.02], [0.02]]


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOT)


@pytest.fixture
def gantry(tmp_path):
    """3.5 m wide, in centimetres: taken as millimetres it is a small box."""
    path = tmp_path / "gantry.stl"
    write_stl(path, box("gantry", (350.0, 350.0, 350.0)))
    return path


def check_doubted(verdict, path, unit="mm"):
    assert verdict.verdict == "unknown"
    assert f"{path} was guessed ({unit})" in verdict.reason
    assert f"type {path}:{unit}" in verdict.reason


def test_a_large_gantry_in_centimetres_is_never_clear(arm, gantry):
    guessed = bc.load_scene(f"{gantry}@1,0,0.6")
    verdict = bc.check(arm, guessed, [0.0])
    check_doubted(verdict, gantry)
    assert f"type {gantry}:mm@1,0,0.6 if" in verdict.reason
    assert verdict.clearance_m == pytest.approx(0.775, abs=1e-3)
    truth = bc.check(arm, bc.load_scene(f"{gantry}:cm@1,0,0.6"), [0.0])
    assert truth.verdict == "contact"  # the arm stands inside
    stated = bc.check(arm, bc.load_scene(f"{gantry}:mm@1,0,0.6"), [0.0])
    assert stated.verdict == "clear"
    away = bc.check(arm, bc.load_scene(f"{gantry}:cm@2,0,0.6"), [0.0])
    assert away.verdict == "clear"


@pytest.mark.parametrize("checker", ["exact", "two-sided", "paper", "coal"])
def test_no_checker_says_clear_from_a_guess(arm, gantry, checker):
    scene = bc.load_scene(f"{gantry}@1,0,0.6")
    check_doubted(bc.check(arm, scene, [0.0], checker=checker), gantry)


@pytest.mark.parametrize("role", ["obstacles", "patients"])
def test_an_added_file_makes_a_clear_scene_doubtful(arm, gantry, tmp_path, role):
    write_stl(tmp_path / "wall.stl", box("wall", (0.2, 0.2, 0.2)))
    wall = f"{tmp_path / 'wall.stl'}:m@1,1,0"
    assert bc.check(arm, bc.load_scene(wall), [0.0]).verdict == "clear"
    more = {role: [f"{gantry}@1,0,0.6"]}
    check_doubted(bc.check(arm, bc.load_scene(wall, **more), [0.0]), gantry)


def test_contact_stays_contact(arm, gantry):
    scene = bc.load_scene(f"{gantry}@0.2,0,0.6")
    assert bc.check(arm, scene, [0.0]).verdict == "contact"
    assert bc.check_path(arm, scene, WAYPOINTS).verdict == "contact"


def test_a_motion_is_not_certified_from_a_guess(arm, gantry, tmp_path):
    guessed, stated = (bc.load_scene(f"{gantry}{unit}@1,0,0.6") for unit in ("", ":mm"))
    assert bc.check_path(arm, stated, WAYPOINTS).certified
    found = bc.check_path(arm, guessed, WAYPOINTS)
    check_doubted(found, gantry)
    assert not found.certified
    assert {s.verdict for s in found.intervals} == {"unknown"}
    for certify in (True, False):
        motion = check_motion(
            arm, guessed, WAYPOINTS, settings(), samples=3, certify=certify
        )
        check_doubted(motion, gantry)
        assert not motion.certified
        assert motion.sampled_clear == 0
        assert {s.verdict for s in motion.intervals} == {"unknown"}
    file = tmp_path / "certificate.json"
    with pytest.raises(UsageError, match="was guessed"):
        write_path_certificate(arm, guessed, WAYPOINTS, 0.0, file)
    assert not file.exists()


def test_clear_stretches_beside_a_contact_are_doubtful_too(arm, gantry):
    waypoints = np.array([[-1.5], [0.0]])
    guessed, stated = (
        search(path_problem(arm, bc.load_scene(f"{gantry}{unit}@0.2,0,0.6")), waypoints)
        for unit in ("", ":mm")
    )
    assert stated.verdict == guessed.verdict == "contact"
    assert "clear" in {s.verdict for s in stated.intervals}
    assert "clear" not in {s.verdict for s in guessed.intervals}


def test_many_poses_at_once_refuse_a_guess(arm, gantry):
    with pytest.raises(UsageError, match=r"was guessed \(mm\)"):
        bc.first_contacts(arm, bc.load_scene(f"{gantry}@1,0,0.6"), [[0.0]])


def test_a_risk_is_not_kept_on_a_guess(arm, gantry):
    uncertainty = from_document({"joints": {"j": "0.1deg"}}, arm)
    guessed, stated = (
        contact_probability(
            arm,
            bc.load_scene(f"{gantry}{unit}@1,0,0.6"),
            [0.0],
            uncertainty,
            risk=0.1,
            samples=50,
        )
        for unit in ("", ":mm")
    )
    assert stated.within_risk is True
    assert guessed.within_risk is None
    assert guessed.contacts == stated.contacts == 0


@pytest.mark.parametrize(
    ("size", "unit"), [(1.9, None), (2.4, "m"), (5.0, "m"), (0.3, None)]
)
def test_metres_that_may_be_inches_are_a_guess(arm, tmp_path, size, unit):
    """2.4 m of gantry, or a phantom of 2.4 inches: both stand in scanner rooms."""
    path = tmp_path / "thing.stl"
    write_stl(path, box("thing", (size, size, size)))
    scene = bc.load_scene(f"{path}@4,0,0")
    assert np.ptp(scene.obstacles[0].mesh.bounds[:, 0]) == pytest.approx(size, abs=1e-6)
    verdict = bc.check(arm, scene, [0.0])
    if unit is None:
        assert (verdict.verdict, scene.warnings) == ("clear", ())
    else:
        check_doubted(verdict, path, unit)
        assert "inches" in scene.warnings[0]
    assert bc.check(arm, bc.load_scene(f"{path}:m@4,0,0"), [0.0]).verdict == "clear"


def test_collada_that_states_its_unit_is_no_guess(arm, tmp_path):
    text = (DATA / "meshes" / "good" / "centimetres.dae").read_text()
    size = float(np.ptp(bc.load_scene(_dae(tmp_path, text)).obstacles[0].mesh.bounds))
    metres = 0.01 * 3.0 / size  # so that it is 3 m large
    stated = text.replace('meter="0.01"', f'meter="{metres!r}"')
    assert stated != text
    assert bc.load_scene(_dae(tmp_path, stated)).doubt is None


def _dae(folder, text):
    path = folder / "thing.dae"
    path.write_text(text)
    return str(path)


def test_a_file_with_signs_in_its_name_can_state_its_unit(tmp_path):
    odd = tmp_path / "a@1,2.stl"
    write_stl(odd, box("odd", (300.0, 300.0, 400.0)))
    assert bc.load_scene(str(odd)).doubt is not None
    stated = bc.load_scene(f"{odd}:mm")
    assert stated.doubt is None
    assert np.ptp(stated.obstacles[0].mesh.bounds[:, 2]) == pytest.approx(0.4)


def test_the_command_warns_in_json_and_writes_no_certificate(capsys, gantry, tmp_path):
    path, file = tmp_path / "path.csv", tmp_path / "c.json"
    path.write_text("j\n-0.02\n0.02\n")
    page = tmp_path / "page.html"
    words = ["check", ROBOT, f"{gantry}@1,0,0.6", "--path", path, "--samples", "3"]
    words += ["--certificate", file, "--format", "json", "--report", page]
    status = main(list(map(str, words)))
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert status == 2
    assert document["verdict"] == "unknown"
    assert f"type {gantry}:mm@1,0,0.6" in document["reason"]
    assert document["warnings"] == document["scene"]["warnings"]
    assert len(document["warnings"]) == 1
    assert document["clearance_m"] > 0.7
    assert "no certificate written" in captured.err
    assert not file.exists()
    text = page.read_text()
    assert "Unknown: treat as not clear" in text
    assert "was guessed (mm)" in text


def test_without_a_certificate_the_guess_is_told_once_and_at_no_place(arm, gantry):
    """It holds for the whole scene; what one pose alone leaves open keeps its place."""
    guessed = bc.load_scene(f"{gantry}@1,0,0.6")
    motion = check_motion(arm, guessed, WAYPOINTS, settings(), certify=False)
    assert motion.reason == guessed.doubt
    assert motion.sampled_clear == 0
    into = check_motion(
        arm,
        bc.load_scene(f"{gantry}@0.2,0,0.6"),
        [[-1.5], [0.0]],
        settings(),
        certify=False,
    )
    assert into.verdict == "contact"
    assert re.match(r"at [0-9.]+% of the motion: ", into.reason)


def test_a_plan_is_not_clear_from_a_guess(capsys, gantry, tmp_path):
    plans = tmp_path / "plans.csv"
    head = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z"
    plans.write_text(f"{head}\nvertical,0,0,-0.0011,0,0,-0.07\n")
    found = {}
    for unit in (":mm", ""):
        words = ["check", "zerobot", "ct_gantry", "--plan", plans, "--samples", "3"]
        words += ["--obstacle", f"{gantry}{unit}@0,0,2.0", "--format", "json"]
        words += ["--certificate", tmp_path / "plan.json"]
        status = main(list(map(str, words)))
        found[unit] = status, json.loads(capsys.readouterr().out)["plans"][0]
        assert (tmp_path / "plan.json").exists() == (unit == ":mm")
    assert found[":mm"][0] == 0
    status, plan = found[""]
    assert plan["certificate"]["reason"] == "unknown"
    assert status == 2
    assert plan["verdict"] == "unknown"
    assert f"type {gantry}:mm@0,0,2.0" in plan["reason"]
    assert not plan["path"]["certified"]
    assert "clear" not in {s["verdict"] for s in plan["path"]["intervals"]}


def test_comparisons_carry_the_warning(capsys, gantry, tmp_path):
    page = tmp_path / "page.html"
    words = ["compare", ROBOT, f"{gantry}@1,0,0.6", "--q", "0", "--report", page]
    main(list(map(str, words)))
    assert "nothing is called clear until the unit is stated" in capsys.readouterr().out
    assert "nothing is called clear until the unit is stated" in page.read_text()


def test_the_live_view_never_says_clear_and_forgets_a_replaced_guess(arm, tmp_path):
    path = tmp_path / "lump.stl"
    write_stl(path, box("lump", (350.0, 350.0, 350.0)))
    scene = bc.load_scene([])
    session = Session(arm, scene, first_plan(arm, scene))
    guessed = session.with_patient(f"{path}@1,0,0.6")
    assert guessed.judge(np.zeros(1)).state == "unknown"
    assert "was guessed" in guessed.judge(np.zeros(1)).reason
    stated = guessed.with_patient(f"{path}:mm@1,0,0.6")
    assert stated.judge(np.zeros(1)).state == "clear"
    assert stated.scene.warnings == ()
