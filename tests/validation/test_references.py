"""A second source: another file of the robot, a closed form, sampled self-contact."""

import re

import pytest
from lxml import etree

from borecheck.cli import main
from borecheck.errors import InputError
from borecheck.validation import validate_file
from borecheck.validation.findings import Severity
from tests import corpus

ARM = corpus.FOLDER / "arm" / "arm.urdf"
TWISTED = corpus.FOLDER / "K614-reference-differs" / "axis.bad.urdf"
CLOSED_FORM = """
import numpy as np

def forward(positions):
    T = np.eye(4)
    c, s = np.cos(positions["shoulder"]), np.sin(positions["shoulder"])
    T[:2, :2], T[2, 3] = [[c, -s], [s, c]], {height}
    return {{"{frame}": T}}
"""


@pytest.fixture
def call(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)

    def run(*words):
        status = main(["validate", *map(str, words), "--no-run", "--no-meshes"])
        return status, *capsys.readouterr()

    return run


def codes(findings):
    return [finding.code for finding in findings]


def test_a_flipped_axis_is_seen_only_by_its_reference():
    alone = validate_file(TWISTED, configured=False, run=False)
    assert [f for f in alone if f.severity != Severity.INFO] == []
    beside = validate_file(TWISTED, configured=False, run=False, reference=ARM)
    assert codes(beside) == ["K614"]
    assert "axis 0 -1 0, in the reference 0 1 0" in beside[0].message
    assert beside[0].element == "robot/joint[@name='elbow']"


def test_the_reference_is_symmetric_and_a_file_is_its_own_reference():
    back = validate_file(ARM, configured=False, run=False, reference=TWISTED)
    assert codes(back) == ["K614"]
    assert validate_file(ARM, configured=False, run=False, reference=ARM) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (r'<axis xyz="1 0 0"/>', '<axis xyz="-2 0 0"/>', "axis -2 0 0"),
        (r'name="slide" type="prismatic"', 'name="slide" type="fixed"', "type"),
        (r'<origin xyz="0 0 0.15"', '<origin xyz="0 0 0.150001"', "origin 1e-06 m"),
        (r'lower="-1.5"', 'lower="-1.4"', "limits -1.4 1.5"),
        (r"<mimic [^>]*>", "", "follows no joint"),
        (r'joint name="tip"', 'joint name="tap"', "name 'tap'"),
    ],
)
def test_what_moves_otherwise_is_named(tmp_path, old, new, said):
    text, count = re.subn(old, new, ARM.read_text(), count=1)
    assert count == 1
    other = tmp_path / "other.urdf"
    other.write_text(text)
    found = validate_file(
        other, configured=False, run=False, meshes=False, reference=ARM, select=["K614"]
    )
    assert len(found) == 1
    assert said in found[0].message


@pytest.mark.parametrize("text", ["", "<robot", '<robot name="r"/>'])
def test_a_reference_that_cannot_be_moved_is_refused(tmp_path, call, text):
    broken = tmp_path / "broken.urdf"
    broken.write_text(text)
    with pytest.raises(InputError, match=r"broken\.urdf"):
        validate_file(ARM, configured=False, run=False, reference=broken)
    status, out, err = call(ARM, "--reference", broken)
    assert status == 2
    assert len(err.splitlines()) == 1
    assert out == ""


def test_a_closed_form_by_name(tmp_path, call, monkeypatch):
    for name, height, frame in (
        ("agrees", 0.2, "upper"),
        ("higher", 0.2001, "upper"),
        ("stranger", 0.2, "wrist"),
    ):
        module = tmp_path / f"{name}_form.py"
        module.write_text(CLOSED_FORM.format(height=height, frame=frame))
    assert call(ARM, "--closed-form", "agrees_form:forward")[0] == 0
    status, out, _ = call(ARM, "--closed-form", "higher_form:forward")
    assert status == 1
    assert "frame 'upper' is 0.0001 m" in out
    status, out, _ = call(ARM, "--closed-form", "stranger_form:forward")
    assert status == 1
    assert "no links: 'wrist'" in out


@pytest.mark.parametrize("name", ["nowhere:forward", "math:nothing", "math:sqrt", "x"])
def test_a_closed_form_that_is_none_ends_with_one_line(call, name):
    status, _, err = call(ARM, "--closed-form", name)
    assert status == 2
    assert name in err
    assert len(err.splitlines()) == 1


def test_an_srdf_is_proposed_and_its_names_are_sound(tmp_path, capsys):
    out = tmp_path / "arm.srdf"
    words = ["validate", str(ARM), "--no-run", "--write-srdf", str(out)]
    assert main(words) == 2
    assert "--self-contact N" in capsys.readouterr().err
    assert main([*words, "--self-contact", "50"]) == 0
    rows = etree.parse(str(out)).getroot().findall("disable_collisions")
    pairs = {frozenset((row.get("link1"), row.get("link2"))) for row in rows}
    reasons = {row.get("reason") for row in rows}
    assert frozenset(("upper", "lower")) in pairs
    assert "Adjacent" in reasons
    assert any("Never in 50: below 0.06" in reason for reason in reasons)
    assert validate_file(ARM, configured=False, run=False, srdf=out) == []


def test_the_proposal_and_the_findings_share_their_samples(tmp_path, monkeypatch):
    from borecheck.validation.checks import self_contact

    real, asked = self_contact._contact_table, []
    monkeypatch.setattr(
        self_contact, "_contact_table", lambda *a: asked.append(a[1]) or real(*a)
    )
    words = ["validate", str(ARM), "--no-run", "--self-contact", "5"]
    assert main([*words, "--write-srdf", str(tmp_path / "arm.srdf")]) == 0
    assert asked == [5]


def test_an_srdf_is_not_written_without_all_geometry(tmp_path, capsys):
    robot = tmp_path / "arm.urdf"
    robot.write_text(ARM.read_text().replace("../meshes/box.stl", "gone.stl"))
    out = tmp_path / "arm.srdf"
    words = ["validate", str(robot), "--no-run", "--self-contact", "5"]
    assert main([*words, "--write-srdf", str(out)]) == 2
    assert "'lower'" in capsys.readouterr().err
    assert not out.exists()
