import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from borecheck.cli import join_signed, main
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from tests.places import PROJECT, ROBOTS

ROBOT = str(ROBOTS / "two_link.urdf")
PLANS = PROJECT / "urdf" / "zerobot" / "examples" / "plans.csv"


@pytest.fixture
def block(tmp_path):
    """A block 200 mm wide, 50 mm beside the arm."""
    path = tmp_path / "block.stl"
    write_stl(path, box("block", (0.2, 0.2, 0.2)))
    return f"{path}:m@0.2,0,0.6"


def run(capsys, *words):
    status = main(list(map(str, words)))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def check_refused(capsys, *words, saying=""):
    """One line on standard error, exit status 2, nothing on standard output."""
    status, out, err = run(capsys, *words)
    lines = [line for line in err.splitlines() if "compiling" not in line]
    assert status == 2
    assert out == ""
    assert len(lines) == 1, err
    assert lines[0].startswith("borecheck: error: ")
    assert "Traceback" not in err
    assert saying in lines[0]


def test_signed_values_are_no_options():
    words = ["check", "--q", "-0.1,0", "--mount", "-90", "--format", "json"]
    joined = ["check", "--q=-0.1,0", "--mount=-90", "--format", "json"]
    assert join_signed(words) == joined


def test_check_clear_contact_and_margin(capsys, block):
    assert run(capsys, "check", ROBOT, block, "--q", "0")[0] == 0
    status, out, _ = run(capsys, "check", ROBOT, block, "--q", "j=20deg")
    assert status == 1
    assert "\nCONTACT: arm meets block" in out
    status, out, _ = run(capsys, "check", ROBOT, block, "--q", "0", "--margin", "60mm")
    assert status == 1
    assert "within_margin" in out


def test_json_holds_the_contract(capsys, block):
    status, out, _ = run(capsys, "check", ROBOT, block, "--q=0", "--format", "json")
    document = json.loads(out)
    assert status == 0
    for key in (
        "schema_version",
        "verdict",
        "reason",
        "qualifiers",
        "checker",
        "pruning",
        "margin_m",
        "margin_kind",
        "clearance_m",
        "closest",
        "contacts",
        "self_contacts",
        "contained",
        "not_modelled",
        "pairs_examined",
        "pairs_pruned",
        "seconds",
    ):
        assert key in document
    assert document["clearance_m"] == pytest.approx(0.05, abs=1e-4)
    assert set(document["closest"]) >= {"link", "obstacle", "points"}


def test_a_sampled_path_is_never_clear(capsys, block, tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("j\n0\n-0.5\n")
    words = ("check", ROBOT, block, "--path", path, "--no-certificate")
    status, out, _ = run(capsys, *words, "--format", "json")
    document = json.loads(out)
    assert status == 2
    assert document["verdict"] == "unknown"
    assert "not certified between" in document["reason"]
    assert document["path"]["certified"] is False
    assert document["path"]["sampled_clear"] == document["path"]["samples"] == 41


def test_a_path_into_the_block(capsys, block, tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("j\n-0.5\n0.5\n")
    status, out, _ = run(capsys, "check", ROBOT, block, "--path", path, "--format=json")
    document = json.loads(out)
    assert status == 1
    assert 0.5 < document["path"]["first_contact"] < 0.7
    assert document["obstacles"]["verdict"] == "contact"
    assert document["itself"]["verdict"] == "clear"  # searched, not only sampled
    verdicts = [i["verdict"] for i in document["path"]["intervals"]]
    assert "contact" in verdicts


@pytest.mark.parametrize(
    ("words", "saying"),
    [
        (("check", "zerobott", "ct_gantry", "--q", "home"), "did you mean 'zerobot'"),
        (("check", "zerobot", "ct_gantri", "--q", "home"), "ct_gantri"),
        (("check", ROBOT, "BLOCK", "--q", "3"), "is outside [-2, 2]"),
        (("check", ROBOT, "BLOCK", "--q", "0,0"), "1 values in the order j"),
        (("check", ROBOT, "BLOCK", "--q", "elbow=1"), "unknown joint 'elbow'"),
        (("check", ROBOT, "BLOCK", "--q", "j=20mm"), "unit 'mm' is none of"),
        (("check", ROBOT, "BLOCK", "--q", "0", "--checker", "fcl"), "unknown checker"),
        (("check", ROBOT, "BLOCK", "--q", "0", "--margin", "-1mm"), "margin"),
        (("check", ROBOT, "nothing.stl", "--q", "0"), "there is no such file"),
        (("check", ROBOT, "FOLDER", "--q", "0"), "is a directory"),
        (("check", ROBOT, "EMPTY.stl", "--q", "0"), "is empty"),
        (("check", ROBOT, "SHORT.stl", "--q", "0"), "SHORT.stl"),
        (("check", ROBOT, "NAN.obj", "--q", "0"), "not finite"),
        (("check", ROBOT, "BIG.stl:m", "--q", "0"), "1000 times too large"),
        (("check", ROBOT, "BLOCK", "--path", "EMPTY.csv"), "is empty"),
        (("check", ROBOT, "BLOCK", "--path", "OTHER.csv"), "unknown joint 'k'"),
        (("check", "zerobot", "ct_gantry", "--plan", "SWAPPED.csv"), "SWAPPED.csv"),
        (("check", "zerobot", "ct_gantry", "--plan", "POINT.csv"), "POINT.csv"),
        (("check", "zerobot", "ct_gantry", "--plan", "MM.csv"), "MM.csv"),
        (("check", "zerobot", "ct_gantry", "--q", "home", "--arg", "arm=2"), "arm"),
        (("check", "zerobot", "ct_gantry", "--q", "home", "--mount", "45"), "mount"),
        (("check", "BROKEN.xacro", "BLOCK", "--q", "0"), "BROKEN.xacro"),
        (("check", ROBOT, "BLOCK", "--q", "0", "--out", "no/where.json"), "no folder"),
    ],
)
def test_bad_input_is_one_clear_line(
    capsys, block, tmp_path, monkeypatch, words, saying
):
    monkeypatch.chdir(tmp_path)
    header = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z\n"
    (tmp_path / "FOLDER").mkdir()
    (tmp_path / "EMPTY.stl").touch()
    (tmp_path / "EMPTY.csv").touch()
    whole = (tmp_path / "block.stl").read_bytes()
    (tmp_path / "SHORT.stl").write_bytes(whole[:300])
    (tmp_path / "NAN.obj").write_text("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    write_stl(tmp_path / "BIG.stl", box("big", (400.0, 300.0, 600.0)))
    (tmp_path / "OTHER.csv").write_text("k\n0\n")
    swapped = "entry_x,entry_y,entry_z,name,target_x,target_y,target_z\n"
    (tmp_path / "SWAPPED.csv").write_text(swapped + "liver,0,0,0.1,0,0,0.05\n")
    (tmp_path / "POINT.csv").write_text(header + "a,0,0,0.1,0,0,0.1\n")
    (tmp_path / "MM.csv").write_text(header + "a,0,0,100,0,0,50\n")
    (tmp_path / "BROKEN.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="b">'
        "<link name='${nothing}'/></robot>"
    )
    files = set(tmp_path.iterdir())
    words = [block if word == "BLOCK" else word for word in words]
    check_refused(capsys, *words, saying=saying)
    assert set(tmp_path.iterdir()) == files


@pytest.mark.skipif(os.getuid() == 0, reason="root may read and write everything")
def test_no_permission(capsys, block, tmp_path):
    locked = tmp_path / "locked.stl"
    locked.write_bytes((tmp_path / "block.stl").read_bytes())
    locked.chmod(0)
    check_refused(capsys, "check", ROBOT, locked, "--q", "0", saying="permission")


def test_compare_explains_a_coarse_wall(capsys, tmp_path):
    wall = tmp_path / "wall.obj"
    wall.write_text("v 0.03 -9 -9\nv 0.03 9 -9\nv 0.03 0 9\nf 1 2 3\n")
    dump = tmp_path / "dump.json"
    words = ("compare", ROBOT, f"{wall}:m", "--q", "0")
    status, out, _ = run(capsys, *words, "--out", dump, "--format", "json")
    document = json.loads(out)
    assert status == 0
    contact = {
        name: bool(c["contact_poses"]) for name, c in document["checkers"].items()
    }
    assert contact == {
        "exact": True,
        "paper:robot": False,
        "paper:scanner": True,
        "two-sided": True,
        "coal": True,
    }
    assert document["disagreements"]
    assert {d["cause"] for d in document["disagreements"]} == {"one-sided test"}
    status, out, _ = run(capsys, "compare", ROBOT, wall, "--replay", dump)
    assert status == 0
    assert "one-sided test" in out


def test_fk_agrees_and_says_so(capsys):
    status, out, _ = run(
        capsys, "fk", "zerobot", "--random", "20", "--seed", "1", "--format", "json"
    )
    document = json.loads(out)
    assert status == 0
    assert document["worst"]["position_m"] < 1e-9
    assert set(document["frames"]["E"]) == {"analytic", "pinocchio", "yourdfpy"}
    assert document["parameters"]["l1"] == 0.9


def test_robots_lists_joints_in_the_order_of_q(capsys):
    status, out, _ = run(capsys, "robots", "--format", "json")
    robots = {robot["name"]: robot for robot in json.loads(out)["robots"]}
    assert status == 0
    joints = [joint["name"] for joint in robots["zerobot"]["joints"]]
    assert joints == ["q1", "q2", "q3", "q4", "q5", "q6"]


def test_plans_with_the_contract_keys(capsys):
    words = ("check", "zerobot", "ct_gantry", "--plan", PLANS, "--samples", "5")
    status, out, _ = run(capsys, *words, "--no-certificate", "--format", "json")
    document = json.loads(out)
    assert status == 1
    assert len(document["plans"]) >= 6
    verdicts = {plan["verdict"] for plan in document["plans"]}
    assert "contact" in verdicts


def test_a_plan_that_is_reachable_only_the_other_way_round_says_so(capsys, tmp_path):
    head, *rows = PLANS.read_text().splitlines()
    assert head == "name,entry_x,entry_y,entry_z,target_x,target_y,target_z"
    name, *numbers = rows[0].split(",")
    plans = tmp_path / "plans.csv"
    swapped = ",".join([name, *numbers[3:], *numbers[:3]])
    plans.write_text(f"{head}\n{swapped}\nfar,0,0,2.0,0,0,1.9\n")
    words = ("check", "zerobot", "ct_gantry", "--plan", plans, "--samples", "2")
    status, out, _ = run(capsys, *words, "--no-certificate", "--format", "json")
    document = json.loads(out)
    first, far = document["plans"]
    assert status == 2
    assert (first["verdict"], first["reachable"]) == ("unknown", False)
    assert first["reason_code"] == far["reason_code"] == "out_of_reach"
    assert document["reason"] == "all 2 plans are out of reach"
    assert "out of reach" in first["reason"]
    assert "entry and target look swapped" in first["reason"]
    assert "out of reach" in far["reason"]
    assert "swapped" not in far["reason"]
    _, text, _ = run(capsys, *words, "--no-certificate")
    assert "\nOUT OF REACH: no plan can be driven, so nothing was checked\n" in text
    assert "UNKNOWN" not in text
    assert "proven of the whole motion" not in text


def test_interrupted_plans_keep_what_is_finished(capsys, monkeypatch):
    from borecheck.commands import answers

    finished = []
    real = answers._one_plan

    def second_is_interrupted(*args):
        if finished:
            raise KeyboardInterrupt
        finished.append(real(*args))
        return finished[-1]

    monkeypatch.setattr(answers, "_one_plan", second_is_interrupted)
    words = ("check", "zerobot", "ct_gantry", "--plan", PLANS, "--samples", "2")
    status, out, _ = run(capsys, *words, "--no-certificate", "--format", "json")
    document = json.loads(out)
    assert status == 130
    assert document["interrupted"] is True
    assert len(document["plans"]) == 1


def test_help_imports_nothing_heavy():
    code = (
        "import sys\n"
        "from borecheck.cli import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy','numba','pinocchio','coal','trimesh','yourdfpy','scipy'}\n"
        "sys.exit(','.join(heavy & set(sys.modules)) or 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "check" in done.stdout
    assert "the 64 published trials" in done.stdout


def test_check_imports_neither_trimesh_nor_yourdfpy(block):
    code = (
        "import sys\n"
        "from borecheck.cli import main\n"
        f"assert main(['check', {ROBOT!r}, {block!r}, '--q', '0']) == 0\n"
        "sys.exit(','.join({'trimesh','yourdfpy'} & set(sys.modules)) or 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_no_kernel_is_loaded_while_a_checks_clock_runs():
    """What numba loads after the warm-up, in a process of its own: nothing."""
    code = (
        "import gc\n"
        "import borecheck as bc\n"
        "from numba.core.dispatcher import Dispatcher\n"
        "from borecheck.commands.warm_up import warm_up\n"
        "from borecheck.contact.check import check_with\n"
        "from borecheck.contact.settings import settings\n"
        "def loaded():\n"
        "    all = [d for d in gc.get_objects() if isinstance(d, Dispatcher)]\n"
        "    return {(str(d), str(s)) for d in all for s in d.overloads}\n"
        "robot, scene = bc.load_robot('zerobot'), bc.load_scene('ct_gantry')\n"
        "for checker in ('exact', 'paper'):\n"
        "    chosen = settings(checker, link_clearance=True)\n"
        "    warm_up(chosen)\n"
        "    before = loaded()\n"
        "    assert len(before) > 5\n"
        "    check_with(robot, scene, robot.home, chosen)\n"
        "    new = loaded() - before\n"
        "    assert not new, new\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_out_is_the_same_document(capsys, block, tmp_path):
    out_file = tmp_path / "result.json"
    words = ("check", ROBOT, block, "--q", "0", "--out", out_file, "--format", "json")
    _, out, _ = run(capsys, *words)
    stored = json.loads(out_file.read_text())
    display = stored.pop("display")
    assert stored == json.loads(out)
    assert [link["name"] for link in display["links"]] == ["base", "arm"]
    assert "arm" in display["frames"]
    assert display["motions"][0]["poses"] == 1


@pytest.fixture
def paths(tmp_path):
    """A path that stays clear of the block, and one into it."""
    clear, into, single = (tmp_path / f"{n}.csv" for n in ("clear", "into", "single"))
    clear.write_text("j\n0\n-0.5\n")
    into.write_text("j\n-0.5\n0.5\n")
    single.write_text("j\n0\n")
    return clear, into, single


def test_an_earlier_certificate_does_not_outlive_a_contact_run(
    capsys, block, tmp_path, paths
):
    clear, into, _ = paths
    file = tmp_path / "certificate.json"
    words = ("check", ROBOT, block, "--certificate", file, "--path")
    assert run(capsys, *words, clear)[0] == 0
    status, out, _ = run(capsys, "verify", file)
    assert status == 0
    assert "obstacles: block" in out
    assert run(capsys, *words, into)[0] == 1
    assert not file.exists()
    assert not file.with_suffix(".npz").exists()


def test_a_file_that_is_no_certificate_is_left_alone(capsys, block, tmp_path, paths):
    file = tmp_path / "mine.json"
    file.write_text("{}")
    words = ("check", ROBOT, block, "--path", paths[0], "--certificate", file)
    check_refused(capsys, *words, saying="no certificate")
    assert file.read_text() == "{}"
    status, out, err = run(capsys, "verify", file)
    assert (status, err) == (1, "")
    assert out.startswith("REJECTED: not a certificate")


def test_meshes_without_their_certificate_are_taken_away_or_left_alone(
    capsys, block, tmp_path, paths
):
    clear, into, _ = paths
    file, meshes = tmp_path / "c.json", tmp_path / "c.npz"
    words = ("check", ROBOT, block, "--certificate", file, "--path")
    assert run(capsys, *words, clear)[0] == 0
    file.unlink()
    assert run(capsys, *words, into)[0] == 1
    assert not meshes.exists()
    np.savez(meshes, mine=np.zeros(3))
    check_refused(capsys, *words, clear, saying="holds no meshes of a certificate")
    assert meshes.exists()


def test_boxes_face_to_face_are_certified_and_verified(capsys, tmp_path, paths):
    """A gantry of touching boxes: its shared edges belong to four triangles."""
    lower, upper = box("lower", (0.2, 0.2, 0.2)), box("upper", (0.2, 0.2, 0.2))
    shifted = upper.vertices + [0.0, 0.0, 0.2]
    mesh = TriangleMesh(
        "stack",
        np.concatenate([lower.vertices, shifted]),
        np.concatenate([lower.triangles, upper.triangles + len(lower.vertices)]),
    )
    write_stl(tmp_path / "stack.stl", mesh)
    file = tmp_path / "stack.json"
    scene = f"{tmp_path / 'stack.stl'}:m@0.25,0,0.5"
    words = ("check", ROBOT, scene, "--path", paths[0], "--certificate", file)
    assert run(capsys, *words)[0] == 0
    status, out, _ = run(capsys, "verify", file)
    assert status == 0, out
    assert out.startswith("ACCEPTED")


def test_a_path_in_degrees_is_the_same_motion(capsys, block, tmp_path):
    answers = []
    for header, factor in (("j", 1.0), ("j_deg", 180.0 / np.pi)):
        path = tmp_path / f"{header}.csv"
        path.write_text(f"{header}\n{-0.2 * factor!r}\n{0.1 * factor!r}\n")
        words = ("check", ROBOT, block, "--path", path, "--samples", "3")
        _, out, _ = run(capsys, *words, "--format", "json")
        answers.append(json.loads(out)["path"]["waypoints"])
    assert answers[0] == [{"j": -0.2}, {"j": 0.1}]
    for plain, converted in zip(*answers, strict=True):
        assert converted == pytest.approx(plain, rel=1e-15)


def test_a_path_of_one_waypoint_is_refused(capsys, block, paths):
    words = ("check", ROBOT, block, "--path", paths[2])
    check_refused(capsys, *words, saying="one waypoint")


def test_a_contained_robot_has_no_clearance_in_text_and_page(capsys, tmp_path, paths):
    write_stl(tmp_path / "room.stl", box("room", (4.0, 4.0, 4.0)))
    room, page = f"{tmp_path / 'room.stl'}:m@0.3,0,0", tmp_path / "page.html"
    status, out, _ = run(capsys, "check", ROBOT, room, "--q", "0")
    assert status == 1
    assert "\nCONTACT (contained): " in out
    assert "clearance" not in out
    for what in (("--q", "0"), ("--path", paths[0], "--samples", "3")):
        assert run(capsys, "check", ROBOT, room, *what, "--report", page)[0] == 1
        text = page.read_text().split("borecheck-result")[0]
        assert "none, in contact" in text
        assert "Inside one another" in text
        rows = re.findall(r'data-value="([^"]*)">[^<]* mm</td>', text)
        assert rows
        assert {float(value) for value in rows} == {0.0}


def test_an_unknown_scanner_lists_the_known_ones(capsys):
    words = ("check", "zerobot", "ct_gantrie", "--q", "home")
    check_refused(capsys, *words, saying="did you mean 'ct_gantry'")


def test_a_strangers_verdict_says_what_it_does_not_cover(capsys, block):
    _, out, _ = run(capsys, "check", ROBOT, block, "--q", "0", "--format", "json")
    assert len(json.loads(out)["not_modelled"]) >= 3


# In every place of a file that a command shows: what would erase a line, begin one
# that a program reads as a command, or turn a name round.
SPOOF = "a&#10;::error::x&#155;2K&#x202e;b"


def test_no_control_character_of_a_file_is_printed(capsys, tmp_path):
    text = (
        Path(ROBOT)
        .read_text()
        .replace('"arm"', f'"{SPOOF}"')
        .replace('"j"', f'"{SPOOF}j"')
    )
    robot = tmp_path / "robot.urdf"
    robot.write_text(text)
    near, far = tmp_path / "n\x1b[1Aear.stl", tmp_path / "far\u202e.stl"
    write_stl(near, box("near", (3.0, 3.0, 3.0)))
    write_stl(far, box("far", (0.2, 0.2, 0.2)))
    path = tmp_path / "p\nath.csv"
    path.write_text("elbow\n0\n")
    pose = ("--q", "0")
    for words in (
        ("check", robot, near, *pose),
        ("check", robot, f"{far}@2,0,0", *pose),
        ("check", robot, near, "--path", path),
        ("check", robot, tmp_path / "no\x1b[2K", *pose),
        ("compare", robot, near, *pose),
        ("fk", robot, *pose),
        ("check", robot, near, "--q", "0,0"),
        ("calibrate", "observe", robot, path),
        ("report", path, tmp_path / "page.html"),
    ):
        _, out, err = run(capsys, *words)
        assert out or err
        said = (out + err).replace("\n", "")
        assert said.isprintable(), (words, [c for c in said if not c.isprintable()])
        assert not any(line.startswith("::") for line in (out + err).splitlines())
