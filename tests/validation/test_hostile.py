"""Strange, broken and hostile input: findings come back, nothing is raised or hangs."""

import random
import time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from borecheck.validation import Options, validate_file, validate_text
from studies import fuzz_validate
from tests.places import PROJECT

SCRIPT = PROJECT / "studies" / "fuzz_validate.py"
LINK = '<link name="l"><collision><geometry>{}</geometry></collision></link>'


def test_mutated_corpus_files_never_end_in_a_traceback():
    fuzz = fuzz_validate
    rng, seeds = random.Random(1), fuzz.seed_files()
    assert len(seeds) > 100
    for _ in range(300):
        fuzz.check(fuzz.mutated(rng, seeds))


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.binary(max_size=200))
def test_any_bytes(data):
    assert validate_text(data, options=Options(run=False))


def test_two_links_of_one_name_are_looked_at_one_by_one():
    def link(x, size):
        box = f'<origin xyz="{x} 0 0"/><geometry><box size="{size}"/></geometry>'
        drawn = '<visual><geometry><box size="1 1 1"/></geometry></visual>'
        return f'<link name="l">{drawn}<collision>{box}</collision></link>'

    bare = '<link name="l"><visual><geometry><sphere radius="1"/></geometry></visual>'
    text = f'<robot name="r">{link(9, "1 1 1")}{bare}</link></robot>'
    found = validate_text(text, options=Options(run=False))
    assert [f.line for f in found if f.code == "G524"] == [1]
    assert {"D122", "G522", "G524"} <= {f.code for f in found}


def test_half_a_character_is_one_finding():
    text = '<robot name="r">\n<link name="\ud800"/></robot>'
    found = validate_text(text, options=Options(run=False))
    assert [(f.code, f.line) for f in found] == [("D102", 2)]


_TEXT = st.text(st.characters(blacklist_characters='<>&"\x00'), max_size=12)
_NUMBER = st.one_of(
    st.floats().map(repr), st.sampled_from(["1e308", "-1e308", "1e-320", "1,5", ""])
)
_VECTOR = st.lists(_NUMBER, max_size=5).map(" ".join)


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(_VECTOR, _VECTOR, _VECTOR, _NUMBER, _NUMBER, _TEXT)
def test_any_numbers(xyz, rpy, axis, lower, upper, name):
    joint = (
        f'<joint name="{name}" type="revolute"><origin xyz="{xyz}" rpy="{rpy}"/>'
        f'<parent link="a"/><child link="b"/><axis xyz="{axis}"/>'
        f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>'
        f'<mimic joint="{name}" multiplier="{lower}"/></joint>'
    )
    shapes = f'<box size="{xyz}"/>', f'<cylinder radius="{lower}" length="{upper}"/>'
    bodies = "".join(
        f'<visual><origin xyz="{rpy}"/><geometry>{shape}</geometry></visual>'
        f"<collision><geometry>{shape}</geometry></collision>"
        for shape in shapes
    )
    links = f'<link name="a">{bodies}</link><link name="b">{bodies}</link>'
    text = f'<robot name="r">{links}{joint}</robot>'
    for finding in validate_text(text, options=Options(run=False, profile="dynamics")):
        assert finding.message


@pytest.mark.parametrize(
    "reference",
    [
        "/dev/zero",
        "/dev/stdin",
        "/proc/self/mem",
        "file:///etc/passwd",
        "package://../../etc/passwd",
        "../" * 40 + "etc/passwd",
        "a" * 5000,
        "http://example.invalid/a.stl",
        "\N{BELL}.stl",
    ],
)
def test_mesh_names_that_want_something_else(reference, tmp_path):
    mesh = LINK.format(f'<mesh filename="{reference}"/>')
    path = tmp_path / "a.urdf"
    path.write_text(f'<robot name="r">{mesh}</robot>')
    found = validate_file(path, run=False, configured=False)
    assert {"G501", "G502", "G504", "G505", "G530"} & {f.code for f in found}


def test_a_folder_that_links_to_itself_ends(tmp_path):
    (tmp_path / "loop").symlink_to(tmp_path)
    path = tmp_path / "a.urdf"
    mesh = LINK.format('<mesh filename="package://none/a.stl"/>')
    path.write_text(f'<robot name="r">{mesh}</robot>')
    start = time.process_time()
    found = validate_file(path, run=False, package_paths=[tmp_path], configured=False)
    assert time.process_time() - start < 5.0
    assert "G501" in {finding.code for finding in found}


def test_a_huge_flat_robot_ends(tmp_path):
    links = "".join(f'<link name="l{i}"/>' for i in range(4000))
    start = time.process_time()
    found = validate_text(
        f'<robot name="r">{links}</robot>', options=Options(run=False)
    )
    assert time.process_time() - start < 10.0
    assert {finding.code for finding in found} == {"T204"}


def test_a_library_that_dies_is_a_finding(monkeypatch):
    from borecheck.validation.checks import running

    monkeypatch.setattr(running, "_MODULE", "borecheck.no_such_module")
    found = validate_text('<robot name="r"><link name="l"/></robot>')
    assert {finding.code for finding in found} == {"G539", "K608", "K609"}
