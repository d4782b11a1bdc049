"""`check --uncertainty` as typed: cases once judged wrong, and what is refused."""

import json
from pathlib import Path

import pytest
from scipy.stats import norm

from borecheck.cli import main
from tests.places import DATA

CASES = DATA / "cases"


def run(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    status = main([str(word) for word in words])
    captured = capsys.readouterr()
    return status, captured.out + captured.err


def check(
    capsys: pytest.CaptureFixture[str], folder: str, words: str, out: Path, *more: str
) -> tuple[int, str, dict]:
    """The verdict in a case's folder: status, text, and the block of the JSON."""
    place = CASES / folder
    files = [place / word.removesuffix(":m") for word in words.split()]
    named = [f"{file}:m" if str(file).endswith(".stl") else file for file in files]
    errors = next(place.glob("*.json"))
    status, text = run(
        capsys, "check", *named, "--uncertainty", errors, "--out", out, *more
    )
    return status, text, json.loads(out.read_text())


def test_a_spike_that_no_plane_stands_for_counts(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "r.json"
    words = ("unc_draws0_spike", "cube.urdf plate15.stl:m", out, "--q", "x=0")
    status, text, document = check(capsys, *words, "--draws", "0")
    assert status == 2
    assert "not shown: no draws were made" in text
    assert document["uncertainty"]["probability"] is None
    status, text, document = check(capsys, *words)
    found = document["uncertainty"]
    assert (status, document["verdict"]) == (2, "unknown")
    assert "exceeds the accepted 0.001" in document["reason"]
    assert found["lower"] < 0.0668 < found["upper"]


def test_the_robot_against_itself_counts(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    status, text, document = check(
        capsys, "unc_self_contact", "self.urdf far.stl:m", tmp_path / "r.json",
        "--q", "x=0,f=0,g=0",
    )  # fmt: skip
    found = document["uncertainty"]
    assert status == 2
    assert found["interval"][0] < norm.cdf(-0.5) - norm.cdf(-2.5) < found["upper"]
    assert found["meets"][0][:2] == ["a", "b"]
    assert "most often a meets b" in text


def test_a_draw_inside_a_solid_counts(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    status, _, document = check(
        capsys, "unc_solid_swallows", "guide.urdf wall.stl:m", tmp_path / "r.json",
        "--q", "x=0", "--draws", "1000", "--risk", "0.1",
    )  # fmt: skip
    found = document["uncertainty"]
    assert status == 2
    assert found["answer"] == "exceeded"
    assert found["interval"][0] < norm.sf(1.0) < found["interval"][1]


def test_the_needle_beside_its_corridor_counts_at_every_instant(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Sigma 10 mm across a corridor that gives way by 2 mm; and the other body."""
    place, out = CASES / "unc_needle_hand", tmp_path / "r.json"
    status, text = run(
        capsys, "check", "zerobot", "ct_gantry", "--scene-arg", "bore=0.85",
        "--scene-arg", "couch_height=-0.2", "--plan", place / "plan.json",
        "--samples", "3", "--patient", f"{place / 'hand.stl'}:m",
        "--uncertainty", place / "regy10.json", "--draws", "100", "--out", out,
    )  # fmt: skip
    (plan,) = json.loads(out.read_text())["plans"]
    found = plan["uncertainty"]
    assert (status, plan["verdict"]) == (2, "unknown")
    # the needle's edge leaves what is allowed between 1.9 and 2.0 mm off
    assert found["lower"] < 2.0 * norm.sf(1.9 / 10.0)
    assert found["upper"] > 2.0 * norm.sf(2.0 / 10.0)
    assert found["meets"][0][:2] == ["needle", "torso"]
    assert "probability of contact" in text
    assert "0.001 exceeded" in text


def test_kept_is_said_with_its_limit(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    errors = tmp_path / "small.json"
    errors.write_text('{"joints": {"x": "0.5mm"}}')
    place, out = CASES / "unc_draws0_spike", tmp_path / "r.json"
    words = (
        "check", place / "cube.urdf", f"{place / 'plate15.stl'}:m", "--q", "x=0",
        "--uncertainty", errors, "--out", out,
    )  # fmt: skip
    status, text = run(capsys, *words)
    document = json.loads(out.read_text())
    found = document["uncertainty"]
    assert (status, document["verdict"]) == (0, "clear")
    assert "risk of 0.001 kept: contact at most" in document["reason"]
    assert "risk of 0.001 kept: at most" in text
    assert found["upper"] <= 1e-3
    # a margin is asked about as a distance, in no other sense
    status, text = run(
        capsys, *words, "--margin", "1mm", "--margin-kind", "enlarge-axes",
        "--checker", "two-sided",
    )  # fmt: skip
    assert (status, "offset" in text) == (2, True)


@pytest.mark.parametrize("file", ["huge.json", "hugecov.json", "unhashable.json"])
def test_what_once_ended_in_a_traceback_is_one_line(
    file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    place = CASES / "unc_tracebacks"
    status, text = run(
        capsys, "check", place / "cube.urdf", f"{place / 'bigbox.stl'}:m@3,0,0",
        "--q", "x=0", "--uncertainty", place / file,
    )  # fmt: skip
    assert status == 2
    assert text.count("\n") == 1
    assert file in text
    assert "defect" not in text
