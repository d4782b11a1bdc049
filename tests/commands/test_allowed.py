"""`--srdf`, `--allow` and `--trust-never`: what is taken, and what is told."""

import json
import re

import pytest

from borecheck.cli import main
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from tests.sliders import pair, sliders, srdf


@pytest.fixture(scope="module")
def words(tmp_path_factory):
    """Robot and scene; a and b meet, the wall is far."""
    folder = tmp_path_factory.mktemp("allowed")
    (folder / "sliders.urdf").write_text(sliders())
    write_stl(folder / "wall.stl", box("wall", (1.0, 1.0, 1.0)))
    (folder / "way.csv").write_text("to_a,to_b,to_c,to_d\n0,0.07,2,3\n0,0.07,2,4\n")
    (folder / "arm.srdf").write_text(
        srdf(
            pair("a", "b", "Always"),
            pair("a", "rail", "Adjacent"),
            pair("b", "c", "Never"),
        )
    )
    return {
        "robot": str(folder / "sliders.urdf"),
        "wall": f"{folder / 'wall.stl'}:m@9,0,0",
        "way": str(folder / "way.csv"),
        "srdf": str(folder / "arm.srdf"),
        "folder": folder,
    }


def run(capsys, *given):
    status = main([str(word) for word in given])
    out, err = capsys.readouterr()
    return status, out, err


def check(capsys, words, *more):
    q = ("--q", "0,0.07,2,3")
    return run(capsys, "check", words["robot"], words["wall"], *q, *more)


def test_touching_itself_hides_no_clearance_and_says_what_to_type(capsys, words):
    status, out, _ = check(capsys, words)
    assert status == 1
    assert "\n  obstacles: CLEAR: nearest: d to wall, 5450.000 mm\n" in out
    assert "\n  itself: CONTACT: a meets b (" in out
    assert "a with b; if they may touch: --allow a:b\n" in out
    assert f"may say so: --srdf {words['srdf']}\n" in out
    assert check(capsys, words, "--allow", "a:b")[0] == 0
    status, out, _ = check(capsys, words, "--srdf", words["srdf"])
    assert status == 0
    assert "may touch, not examined: a with b (Always; arm.srdf, line 2)\n" in out
    assert "1 pair left out and examined all the same (1 Never): --trust-never" in out
    (covered,) = [x for x in out.splitlines() if x.startswith("not covered: ")]
    assert "contact of links that may touch: a with b; " in covered
    assert "obstacles:" not in out  # all is clear: the first line says it
    assert "hint:" not in out


def test_explained_every_pair_has_a_line(capsys, words):
    _, out, _ = check(
        capsys, words, "--srdf", words["srdf"], "--trust-never", "--explain"
    )
    told = [line for line in out.splitlines() if line.startswith("may touch: ")]
    assert told == [
        "may touch: a with b (Always; arm.srdf, line 2)",
        "may touch: a with rail (Adjacent; arm.srdf, line 3), joined or without "
        "geometry anyway",
        "may touch: b with c (Never; arm.srdf, line 4)",
    ]


def test_many_pairs_are_summed_up(capsys, words):
    pairs = ("a:b", "a:c", "a:d", "b:c")
    given = [word for names in pairs for word in ("--allow", names)]
    _, out, _ = check(capsys, words, *given)
    assert (
        "may touch, not examined: 4 pairs of links (4 by request); each with "
        "--explain\n" in out
    )
    assert "may touch: a with b, a with c, a with d and 1 more; " in out


def test_the_document_has_both_answers_and_every_pair(capsys, words):
    _, out, _ = check(capsys, words, "--srdf", words["srdf"], "--format", "json")
    document = json.loads(out)
    assert document["allowed"] == [
        {
            "first": "a",
            "second": "b",
            "reason": "Always",
            "source": "arm.srdf, line 2",
            "skips_check": True,
        },
        {
            "first": "a",
            "second": "rail",
            "reason": "Adjacent",
            "source": "arm.srdf, line 3",
            "skips_check": False,
        },
    ]
    assert document["robot"]["srdf"]["file"] == words["srdf"]
    _, out, _ = check(capsys, words, "--format", "json")
    document = json.loads(out)
    assert document["obstacles"]["verdict"] == "clear"
    assert document["itself"]["pairs"] == [["a", "b"]]
    assert document["robot"]["srdf"] is None
    assert "--allow a:b" in document["hints"][0]


def test_a_page_lists_the_pairs_and_what_to_type(capsys, words):
    page = words["folder"] / "page.html"
    check(capsys, words, "--report", page)
    assert "Hint: the robot touches itself: a with b" in page.read_text()
    check(capsys, words, "--srdf", words["srdf"], "--report", page)
    assert "<li>a with b (Always; arm.srdf, line 2)</li>" in page.read_text()


def test_a_certificate_and_its_verification(capsys, words):
    certificate = words["folder"] / "way.json"
    motion = ("--path", words["way"])
    scene = (words["robot"], words["wall"])
    asked = ("--srdf", words["srdf"])
    status, out, _ = run(
        capsys, "check", *scene, *motion, *asked, "--certificate", certificate
    )
    assert (status, "certified between them" in out) == (0, True)
    bound = ("--robot", words["robot"], "--scene", words["wall"], *motion)
    status, out, _ = run(capsys, "verify", certificate, *bound, *asked)
    assert status == 0
    assert "may touch, not covered: a and b: Always (arm.srdf, line 2)\n" in out
    status, out, _ = run(capsys, "verify", certificate, *bound)
    assert status == 1
    assert "if they may touch, give --srdf or --allow, too\n" in out
    status, _, err = run(capsys, "verify", certificate, *asked)
    assert status == 2
    assert "to bind a certificate give --robot" in err


def test_a_path_in_which_it_touches_itself(capsys, words):
    scene = (words["robot"], words["wall"])
    status, out, _ = run(capsys, "check", *scene, "--path", words["way"])
    assert status == 1
    assert "\n  obstacles: CLEAR: every instant is proven clear for 4 pairs\n" in out
    assert re.search(r"proven at every instant \(d to wall, 4450\.00\d mm", out)


def test_compare_tells_both_apart(capsys, words):
    scene = (words["robot"], words["wall"])
    q = ("--q", "0,0.07,2,3")
    _, out, _ = run(capsys, "compare", *scene, *q)
    assert "with obstacles" in out
    assert "--allow a:b" in out
    _, out, _ = run(capsys, "compare", *scene, *q, "--srdf", words["srdf"])
    assert "with obstacles" not in out
    assert "may touch, not examined: a with b (Always; arm.srdf, line 2)\n" in out


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (("--allow", "a:wall"), "names 'wall', which is no link of the robot"),
        (("--allow", "a:wall"), "never an obstacle"),
        (("--allow", "a:a"), "a with itself is no pair"),
        (("--trust-never",), "--trust-never goes with --srdf FILE"),
        (("--srdf", "nowhere.srdf"), "nowhere.srdf: no such file"),
    ],
)
@pytest.mark.parametrize("command", ["check", "compare"])
def test_what_makes_no_sense_is_one_line(capsys, words, command, given, told):
    scene = (words["robot"], words["wall"])
    status, out, err = run(capsys, command, *scene, "--q", "0,0,0,0", *given)
    assert (status, out) == (2, "")
    (line,) = [x for x in err.splitlines() if x.startswith("borecheck: error")]
    assert told in line


def test_the_srdf_is_no_place_for_a_result(capsys, words):
    before = (words["folder"] / "arm.srdf").read_bytes()
    asked = ("--srdf", words["srdf"], "--out", words["srdf"])
    assert check(capsys, words, *asked)[0] == 2
    assert (words["folder"] / "arm.srdf").read_bytes() == before
