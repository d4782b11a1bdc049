"""Certificates of plans: one file each, of what is proven clear, told by name."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import borecheck as bc
from borecheck.cli import main
from borecheck.commands import certificate_files
from borecheck.commands.certificate_files import MOST_BYTES, files_for
from borecheck.errors import UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.motion.certificate import digest
from borecheck.plans.plan_file import read_plans
from borecheck.plans.plan_motion import plan_motion
from borecheck.verify.check import verify
from tests.places import ROBOTS

ROBOT = ROBOTS / "two_link.urdf"
HEAD = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z"
CLEAR = "vertical,0,0,-0.0011,0,0,-0.07"
OTHER = "left side,0.02,0.0655,-0.0072,0.02,0.05,-0.08"
CONTACT = "chest_flank,0.16,-0.1039,-0.0064,0.16,-0.08,-0.06"
FAR = "far,0,0,2.0,0,0,1.9"


def run(capsys, *words):
    status = main(list(map(str, words)))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def check(folder, *rows, file="clear.json", more=()):
    """The words that check these plans and ask for their certificates there."""
    plans = folder / "plans.csv"
    plans.write_text("\n".join([HEAD, *rows]) + "\n")
    words = ["check", "zerobot", "ct_gantry", "--plan", plans, "--samples", "3"]
    return [*words, "--certificate", folder / file, *more]


def names(folder):
    return {path.name for path in folder.iterdir()}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Two plans that are clear, one in contact, one out of reach; and what is left."""
    folder = tmp_path_factory.mktemp("done")
    page, out = folder / "page.html", folder / "out.json"
    rows = (CLEAR, CONTACT, OTHER, FAR)
    words = check(folder, *rows, more=("--report", page, "--out", out))
    assert main([str(word) for word in words]) == 1
    return folder


@pytest.fixture
def copied(done, tmp_path):
    """The same folder, to be changed."""
    return Path(shutil.copytree(done, tmp_path / "copied"))


def test_each_clear_plan_has_its_own_and_the_result_says_which(done):
    plans = {p["name"]: p for p in json.loads((done / "out.json").read_text())["plans"]}
    verdicts = {name: plan["verdict"] for name, plan in plans.items()}
    assert verdicts == {
        "vertical": "clear",
        "chest_flank": "contact",
        "left side": "clear",
        "far": "unknown",
    }
    given = {name: plan["certificate"] for name, plan in plans.items()}
    for name, stem in (
        ("vertical", "clear_vertical"),
        ("left side", "clear_left_side"),
    ):
        assert given[name]["file"] == str(done / f"{stem}.json")
        assert given[name]["meshes"] == str(done / f"{stem}.npz")
        assert given[name]["reason"] is None
        assert verify(done / f"{stem}.json").accepted
    for name, reason in (("chest_flank", "contact"), ("far", "unknown")):
        assert given[name] == {"file": None, "meshes": None, "reason": reason}
    written = {path.name for path in done.glob("clear*")}
    stems = ("clear_vertical", "clear_left_side")
    assert written == {f"{s}.{kind}" for s in stems for kind in ("json", "npz")}


def test_text_and_page_say_which(capsys, done, tmp_path):
    page = (done / "page.html").read_text()
    assert "<td>clear_vertical.json</td>" in page  # pages name no folders
    assert "<td>none: contact</td>" in page
    assert "<td>none: unknown</td>" in page
    assert "Its certificate is <code>clear_left_side.json</code>" in page
    status, text, _ = run(capsys, *check(tmp_path, CLEAR, FAR))
    assert status == 2
    rows = {
        line.split("  ")[0]: line
        for line in text.split("certificate of")[1].splitlines()
    }
    assert str(tmp_path / "clear_vertical.json") in rows["vertical"]
    assert "none: unknown" in rows["far"]
    assert "\nUNKNOWN: of 2 plans 1 clear, 1 out of reach\n" in text


def test_it_speaks_of_the_plans_own_motion_and_corridor(done):
    """As planned once more from the file of plans, to the last bit."""
    robot = bc.load_robot("zerobot")
    plans = {plan.name: plan for plan in read_plans(done / "plans.csv")}
    for name, file in (("vertical", "vertical"), ("left side", "left_side")):
        stated = json.loads((done / f"clear_{file}.json").read_text())
        motion = plan_motion(robot, plans[name])
        np.testing.assert_array_equal(stated["waypoints"], motion.waypoints)
        (passage,) = stated["passages"]
        for record in (passage, stated["about"]["plan"]):
            np.testing.assert_array_equal(record["entry"], plans[name].entry)
            np.testing.assert_array_equal(record["target"], plans[name].target)
            assert record["radius_m"] == motion.corridor.radius
        assert stated["about"]["plan"]["name"] == name
        assert stated["about"]["robot"]["name"] == "zerobot"
        assert stated["about"]["robot"]["arguments"]["mount"] == "+90"
        assert stated["about"]["scene"]["name"] == "ct_gantry"


def test_verify_says_what_each_speaks_of(capsys, done):
    files = sorted(done.glob("clear_*.json"))
    assert len(files) == 2
    status, out, _ = run(capsys, "verify", *files)
    assert status == 0
    for file in files:
        assert f"ACCEPTED {file}: " in out
    assert out.count("  robot: zerobot (mount=+90") == 2
    assert out.count("  scene: ct_gantry (bore=") == 2
    assert (
        "  plan: vertical, entry (0.0, 0.0, -1.1), target (0.0, 0.0, -70.0) mm" in out
    )
    assert "  plan: left side, entry (20.0, 65.5, -7.2)" in out
    assert "allowed: needle in torso from (0.0, 0.0, -1.1)" in out
    assert out.count("names are as its writer stated them") == 2
    assert out.endswith("2 of 2 certificates accepted\n")
    status, alone, _ = run(capsys, "verify", files[0])
    assert alone.startswith("ACCEPTED: ")
    assert "certificates accepted" not in alone
    status, out, _ = run(capsys, "verify", *files, "--format", "json")
    document = json.loads(out)
    each = document["certificates"]
    assert [one["file"] for one in each] == [str(file) for file in files]
    assert document["intervals"] == sum(one["intervals"] for one in each) > 0
    assert [one["about"]["plan"]["name"] for one in each] == ["left side", "vertical"]


def test_one_changed_certificate_is_rejected_among_others(capsys, copied):
    """Needle and patient may touch in the named plan's corridor, and in no other."""
    good, bad = copied / "clear_vertical.json", copied / "clear_left_side.json"
    stated = json.loads(bad.read_text())
    stated["about"]["plan"]["target"][2] -= 1e-6
    bad.write_text(json.dumps(stated))
    status, out, _ = run(capsys, "verify", good, bad)
    assert status == 1
    assert f"REJECTED {bad}: " in out
    assert f"ACCEPTED {good}: " in out
    assert "does not have the hash" in out
    content = {name: value for name, value in stated.items() if name != "sha256"}
    bad.write_text(json.dumps({**content, "sha256": digest(content)}))
    status, out, _ = run(capsys, "verify", good, bad)
    assert status == 1
    assert "the corridor is not that of the plan 'left side'" in out
    assert out.endswith(f"1 of 2 certificates accepted; rejected: {bad}\n")
    status, out, _ = run(capsys, "verify", good, bad, "--format", "json")
    document = json.loads(out)
    assert document["accepted"] is False
    assert [one["accepted"] for one in document["certificates"]] == [True, False]
    assert document["problems"][0].startswith(f"{bad}: ")


def test_verify_refuses_meshes_for_several_and_what_is_none(capsys, copied):
    files = sorted(copied.glob("clear_*.json"))
    status, out, err = run(capsys, "verify", *files, "--meshes", copied / "m.npz")
    assert (status, out) == (2, "")
    assert "--meshes goes with one certificate" in err
    for wrong, expected, saying in (
        ("none.json", 2, "cannot be read: No such file or directory"),
        ("out.json", 1, "not a certificate: not in the format"),
        ("", 2, "is no ordinary file"),
    ):
        status, out, err = run(capsys, "verify", *files, copied / wrong)
        assert (status, err) == (expected, "")
        assert f"REJECTED {copied / wrong}: {saying}" in out
        assert all(f"ACCEPTED {file}: " in out for file in files)


def test_one_plan_has_the_file_itself_and_no_name_is_lost(capsys, tmp_path):
    assert run(capsys, *check(tmp_path, CLEAR))[0] == 0
    assert names(tmp_path) == {"plans.csv", "clear.json", "clear.npz"}
    _, out, _ = run(capsys, "verify", tmp_path / "clear.json")
    assert "  plan: vertical, " in out


def test_earlier_certificates_do_not_outlive_a_run(capsys, copied):
    """Of plans now in contact, and of FILE itself; of other plans they are told."""
    for name in ("clear", "clear_chest_flank", "clear_far", "clear_gone"):
        for kind in ("json", "npz"):
            shutil.copy(copied / f"clear_vertical.{kind}", copied / f"{name}.{kind}")
    for kind in ("json", "npz"):
        shutil.copy(
            copied / f"clear_left_side.{kind}", copied / f"clear_vertical.{kind}"
        )
    status, _, err = run(capsys, *check(copied, CLEAR, CONTACT, FAR))
    assert status == 1
    left = {path.name for path in copied.glob("clear*.json")}
    meshes = {path.name for path in copied.glob("clear*.npz")}
    kept = {"clear_vertical", "clear_gone", "clear_left_side"}
    assert left == {f"{name}.json" for name in kept}
    assert meshes == {f"{name}.npz" for name in kept}
    written = json.loads((copied / "clear_vertical.json").read_text())
    assert written["about"]["plan"]["name"] == "vertical"
    for name in ("clear_gone", "clear_left_side"):
        assert f"{copied / name}.json is an earlier certificate of none" in err
    assert "clear_vertical.json is an earlier" not in err


@pytest.mark.parametrize("kind", ["json", "npz"])
def test_what_is_no_certificate_stays_and_so_does_everything_else(capsys, copied, kind):
    mine = copied / f"clear_far.{kind}"
    mine.write_text("mine")
    before = {path.name: path.read_bytes() for path in copied.iterdir()}
    status, out, err = run(capsys, *check(copied, CLEAR, CONTACT, OTHER, FAR))
    assert (status, out) == (2, "")
    assert str(mine) in err
    assert {path.name: path.read_bytes() for path in copied.iterdir()} == before


def test_names_are_safe_and_never_shared():
    file = Path("folder") / "clear.json"
    given = ["left lobe", "../../etc", "v1.2", "Höhe 3", "a/b\\c:d", "con", "."]
    found = files_for(file, given)
    assert list(found) == given
    assert all(path.parent == file.parent for path in found.values())
    stems = {path.name for path in found.values()}
    assert "clear_left_lobe.json" in stems
    assert "clear_v1_2.json" in stems
    assert "clear_Höhe_3.json" in stems
    meshes = {path.with_suffix(".npz") for path in found.values()}
    assert len(stems) == len(meshes) == len(given)
    assert files_for(file, ["a/b"]) == {"a/b": file}
    # a FILE without suffix: the dot of a name is none
    bare = files_for(Path("clear"), ["v1.2", "v1.3"])
    assert len({path.with_suffix(".npz") for path in bare.values()}) == 2


@pytest.mark.parametrize(
    ("given", "saying"),
    [
        (["a b", "a/b"], "'a b' and 'a/b' would both have the certificate clear_a_b"),
        (["Left", "left"], "'Left' and 'left' would both have"),
        (["e\u0301", "\u00e9"], "would both have"),
        (["x" * 200, "ü" * 150], "too long for a file: give the plan a shorter name"),
    ],
)
def test_two_plans_on_one_file_are_refused(given, saying):
    with pytest.raises(UsageError, match=saying):
        files_for(Path("clear.json"), given)


def test_the_longest_names_can_be_written(tmp_path):
    room = MOST_BYTES - len("clear_.json")
    (tmp_path / files_for(Path("clear.json"), ["x" * room, "y"])["x" * room]).touch()
    with pytest.raises(UsageError, match="too long"):
        files_for(Path("clear.json"), ["x" * (room + 1), "y"])


def test_shared_names_are_refused_before_anything_is_taken_away(capsys, copied):
    before = names(copied)
    rows = (CLEAR, CONTACT.replace("chest_flank", "Vertical"))
    status, out, err = run(capsys, *check(copied, *rows))
    assert (status, out) == (2, "")
    assert "rename one of them" in err
    assert names(copied) == before


@pytest.mark.parametrize("option", ["--out", "--report"])
def test_another_output_of_that_name_is_refused(capsys, tmp_path, option):
    same = tmp_path / "x" / ".." / "clear_vertical.json"
    (tmp_path / "x").mkdir()
    status, out, err = run(capsys, *check(tmp_path, CLEAR, FAR, more=(option, same)))
    assert (status, out) == (2, "")
    assert "both write" in err


def test_a_pose_and_samples_alone_have_none(capsys, tmp_path):
    words = ["check", "zerobot", "ct_gantry", "--certificate", tmp_path / "c.json"]
    status, _, err = run(capsys, *words, "--q", "home")
    assert status == 2
    assert "--certificate goes with --path or --plan" in err
    more = ("--no-certificate",)
    status, _, err = run(capsys, *check(tmp_path, CLEAR, more=more))
    assert status == 2
    assert "exclude each other" in err


def test_an_interrupted_write_keeps_what_is_written(capsys, monkeypatch, tmp_path):
    real = certificate_files._write

    def interrupted_at_the_second(*words):
        if words[-1] != "vertical":
            raise KeyboardInterrupt
        real(*words)

    monkeypatch.setattr(certificate_files, "_write", interrupted_at_the_second)
    rows = (CLEAR, OTHER, OTHER.replace("left side", "again"))
    more = ("--format", "json")
    status, out, err = run(capsys, *check(tmp_path, *rows, more=more))
    assert status == 130
    given = [plan["certificate"] for plan in json.loads(out)["plans"]]
    assert given[0]["file"] == str(tmp_path / "clear_vertical.json")
    assert [one["reason"] for one in given] == [None, "interrupted", "interrupted"]
    assert names(tmp_path) == {"plans.csv", "clear_vertical.json", "clear_vertical.npz"}
    assert "no certificate written for plan again: interrupted" in err


def test_plans_that_were_not_checked_are_named(capsys, monkeypatch, tmp_path):
    from borecheck.commands import answers

    real = answers._one_plan

    def second_is_interrupted(*words):
        if words[-1].name != "vertical":
            raise KeyboardInterrupt
        return real(*words)

    monkeypatch.setattr(answers, "_one_plan", second_is_interrupted)
    status, out, _ = run(capsys, *check(tmp_path, CLEAR, OTHER))
    assert status == 130
    assert "of 2 plans 1 clear, 1 not checked" in out
    assert "left side       none: not checked" in out
    assert (tmp_path / "clear_vertical.json").exists()


def test_clear_without_the_certificate_asked_for_is_no_success(capsys, tmp_path):
    """An open surface far away: clear, but nobody can check that nothing is inside."""
    cup = box("cup", (0.1, 0.1, 0.1))
    write_stl(
        tmp_path / "cup.stl", TriangleMesh("cup", cup.vertices, cup.triangles[2:])
    )
    (tmp_path / "path.csv").write_text("j\n0\n-0.1\n")
    words = ["check", ROBOT, f"{tmp_path / 'cup.stl'}:m@3,0,0"]
    words += ["--path", tmp_path / "path.csv"]
    assert run(capsys, *words)[0] == 0
    status, out, err = run(capsys, *words, "--certificate", tmp_path / "c.json")
    assert status == 2
    assert "\nCLEAR" in out
    assert (
        "certificate: none, there is no certificate to write: a surface is open" in out
    )
    assert "no certificate written for the path" in err
    assert not (tmp_path / "c.json").exists()


def test_a_risk_that_is_not_kept_has_no_certificate(capsys, tmp_path):
    """Proven clear where it is planned, but not judged so: none for a safety file."""
    write_stl(tmp_path / "block.stl", box("block", (0.2, 0.2, 0.2)))
    (tmp_path / "path.csv").write_text("j\n0\n-0.1\n")
    words = ["check", ROBOT, f"{tmp_path / 'block.stl'}:m@0.2,0,0.6"]
    words += ["--path", tmp_path / "path.csv", "--certificate", tmp_path / "c.json"]
    assert run(capsys, *words)[0] == 0
    assert (tmp_path / "c.json").exists()
    (tmp_path / "u.json").write_text('{"joints": {"j": "5deg"}}')
    words += ["--uncertainty", tmp_path / "u.json", "--risk", "0.001"]
    status, out, err = run(capsys, *words, "--format", "json")
    document = json.loads(out)
    assert status == 2
    assert document["path"]["certified"] is True
    assert "exceeds the accepted" in document["reason"]
    assert document["certificate"]["file"] is None
    assert "no certificate written: the path is unknown" in err
    assert not (tmp_path / "c.json").exists()
