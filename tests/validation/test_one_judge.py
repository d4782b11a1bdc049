"""check refuses exactly the files in which validate finds an error (collision)."""

import os
import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from borecheck.cli import main
from borecheck.errors import BorecheckError
from borecheck.robots.robot import robot_with
from borecheck.validation import validate_file
from studies.one_judge import example_robot_data, judge, robot_files
from tests import corpus
from tests.places import DATA, ROBOTS

ARM = (corpus.FOLDER / "arm" / "arm.urdf").read_text()
ARM = re.sub("<mesh [^>]*>", '<box size="0.1 0.1 0.1"/>', ARM)
CASES = sorted((DATA / "cases").rglob("*.urdf"))


def agree(file: Path) -> bool:
    """True if both judges say the same; what they said is shown if they do not."""
    judged = judge(file)
    assert (judged.refusal is None) == (not judged.errors), judged
    return judged.agree


def of_text(folder: Path, text: str | bytes) -> bool:
    file = folder / "r.urdf"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return agree(file)


@pytest.mark.parametrize(
    "code", sorted({p.parent for p in robot_files([corpus.FOLDER])})
)
def test_about_every_file_of_the_corpus(code):
    apart = [
        judged for file in robot_files([code]) if not (judged := judge(file)).agree
    ]
    assert apart == []


@pytest.mark.parametrize(
    "file", [*CASES, *sorted(ROBOTS.glob("*.urdf"))], ids=lambda p: p.name
)
def test_about_every_case_that_was_once_judged_wrong(file):
    assert agree(file)


@pytest.mark.skipif(not example_robot_data(), reason="example-robot-data is not there")
@pytest.mark.parametrize(
    "name",
    [
        "double_pendulum_description/urdf/double_pendulum.urdf",
        "simple_humanoid_description/urdf/simple_humanoid_classical.urdf",
        "ur_description/urdf/ur3.urdf",
        "hector_description/robots/quadrotor_base.urdf.xacro",
        "hyq_description/robots/hyq_no_sensors.urdf",
    ],
)
def test_about_some_files_of_example_robot_data(name):
    """All of them: `python -m studies.one_judge`."""
    assert agree(example_robot_data()[0] / name)


def test_the_premise_that_both_judges_can_refuse_and_accept(tmp_path):
    file = tmp_path / "r.urdf"
    file.write_text(ARM)
    assert judge(file).refusal is None
    file.write_text(ARM.replace("<axis", "<axes", 1))
    judged = judge(file)
    assert judged.refusal is not None
    assert judged.errors


@pytest.mark.parametrize(
    "coding", ["iso-8859-1", "utf-16", "utf-16-le", "utf-8-sig", "cp1252"]
)
def test_a_declared_coding_is_read(tmp_path, coding):
    declared = {"utf-8-sig": "utf-8", "utf-16-le": "utf-16"}.get(coding, coding)
    head = f'<?xml version="1.0" encoding="{declared}"?>'
    text = re.sub(r"<\?xml[^>]*\?>", f"{head}<!-- gr\u00fc\u00dfe -->", ARM)
    text = text.replace('"elbow"', '"b\u00fcgel"')
    file = tmp_path / "r.urdf"
    file.write_bytes(text.encode(coding))
    assert of_text(tmp_path, text.encode(coding))
    assert "b\u00fcgel" in robot_with(file, {}).model.joint_names


@pytest.mark.parametrize(
    ("before", "behind"),
    [(b"\n  ", b""), (b"\xef\xbb\xbf\n", b""), (b"", b"\0\0\n\0"), (b"\t", b"\0")],
)
def test_stray_bytes_are_read_over_with_a_warning(tmp_path, before, behind):
    file = tmp_path / "r.urdf"
    file.write_bytes(before + ARM.encode() + behind)
    assert agree(file)
    assert robot_with(file, {}).warnings
    found = validate_file(file, configured=False, run=False)
    assert "D135" in {finding.code for finding in found}


@pytest.mark.parametrize(("before", "behind"), [(b"\n ", b""), (b"", b"\0\0")])
def test_stray_bytes_around_a_xacro_too(tmp_path, before, behind):
    xacro = ARM.replace("<robot ", '<robot xmlns:xacro="x" ', 1).encode()
    file = tmp_path / "r.urdf.xacro"
    file.write_bytes(before + xacro + behind)
    assert agree(file)
    assert robot_with(file, {}).warnings
    found = validate_file(file, configured=False, run=False)
    assert "D135" in {finding.code for finding in found}


def test_all_sources_of_kinematics_read_the_coding(tmp_path, capsys):
    head = '<?xml version="1.0" encoding="ISO-8859-1"?>'
    text = re.sub(r"<\?xml[^>]*\?>", head, ARM).replace('"elbow"', '"b\u00fcgel"')
    file = tmp_path / "r.urdf"
    file.write_bytes(text.encode("latin-1"))
    assert main(["fk", str(file), "--random", "20"]) == 0
    assert "yourdfpy" in capsys.readouterr().out


def test_a_silenced_error_is_not_told_again(tmp_path):
    file = tmp_path / "r.urdf"
    file.write_text(
        ARM.replace('<box size="0.1 0.1 0.1"/>', '<mesh filename="none.stl"/>')
    )
    options = {"configured": False, "run": False, "ignore": ["G501"]}
    assert judge(file).errors
    assert [f for f in validate_file(file, **options) if f.severity == "error"] == []


PIECES = (
    '<collision><geometry><box size="1 1 1"/></geometry></collision>',
    '<visual><geometry><box size="0 0 0"/></geometry></visual>',
    '<visual><geometry><box size="0 1 1"/></geometry></visual>',
    '<visual><geometry><mesh filename="none.stl"/></geometry></visual>',
    '<visual><geometry><sphere radius="-1"/></geometry></visual>',
    '<collision><geometry><capsule radius="1" length="1"/></geometry></collision>',
    '<collision><geometry><box size="1 1"/></geometry></collision>',
    '<collision><origin xyz="" rpy="0 0 0"/><geometry/></collision>',
    '<colision><geometry><box size="1 1 1"/></geometry></colision>',
    '<origin xyz="1 0 0" quat_xyzw="0 0 0 1"/>',
    '<axis xyz="0 0 2"/>',
    '<limit lower="0" upper="1" effort="x" velocity="-1"/>',
    '<limit lower="2" upper="1"/>',
    '<mimic joint="k"/>',
    '<dynamics damping="much"/>',
    '<material name="grey"><color rgba="1 x 1 1"/></material>',
    "<inertial><mass value='1'/></inertial>",
    "<group><link name='z'/></group>",
    "<gazebo><link><collision><geometry/></collision></link></gazebo>",
    "text",
    "",
)
TYPES = ("fixed", "revolute", "continuous", "prismatic", "floating", "planar", "hinge")


@settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.lists(st.sampled_from(PIECES), max_size=2),
    st.lists(st.sampled_from(PIECES), max_size=2),
    st.lists(st.sampled_from(PIECES), max_size=2),
    st.lists(st.sampled_from(PIECES), max_size=1),
    st.sampled_from(TYPES),
)
def test_about_robots_put_together_at_random(tmp_path, one, two, joint, beside, kind):
    text = (
        f'<robot name="r"><link name="a">{"".join(one)}</link>'
        f'<link name="b">{"".join(two)}</link><joint name="j" type="{kind}">'
        f'<parent link="a"/><child link="b"/>{"".join(joint)}</joint>'
        f"{''.join(beside)}</robot>"
    )
    assert of_text(tmp_path, text)


def test_a_deep_chain_is_one_line_everywhere(tmp_path):
    count = 1500
    links = "".join(f'<link name="l{i}"/>' for i in range(count))
    joints = "".join(
        f'<joint name="j{i}" type="fixed"><parent link="l{i}"/>'
        f'<child link="l{i + 1}"/></joint>'
        for i in range(count - 1)
    )
    file = tmp_path / "deep.urdf"
    file.write_text(f'<robot name="deep">{links}{joints}</robot>')
    assert agree(file)
    with pytest.raises(BorecheckError, match="more than 1000 are refused") as error:
        robot_with(file, {})
    assert os.linesep not in str(error.value)
