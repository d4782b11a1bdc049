"""A robot and a scanner in a package of their own, as docs/adding_a_robot.md says."""

import json
import os
import re
import subprocess
import sys
from dataclasses import fields, is_dataclass

import pytest

from borecheck import plugin
from borecheck.cli import main
from tests.places import PROJECT

EXAMPLE = PROJECT / "examples" / "tilt_arm"


@pytest.fixture(scope="module")
def borecheck(tmp_path_factory):
    """`borecheck` where the example is built as a wheel and installed."""
    site = tmp_path_factory.mktemp("site")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    options = ["--no-build-isolation", "--disable-pip-version-check"]
    subprocess.run([*pip, *options, "--target", str(site), str(EXAMPLE)], check=True)
    path = os.pathsep.join(filter(None, [str(site), os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, "PYTHONPATH": path}

    def run(*words):
        command = [sys.executable, "-m", "borecheck", *words]
        return subprocess.run(
            command, env=environment, cwd=site, capture_output=True, text=True
        )

    return run


def test_robot_and_scanner_are_listed(borecheck):
    listed = json.loads(borecheck("robots", "--format", "json").stdout)
    assert "tilt_arm" in {robot["name"] for robot in listed["robots"]}
    assert "tube" in {scanner["name"] for scanner in listed["scanners"]}


def test_its_closed_form_agrees_with_its_urdf(borecheck):
    done = borecheck("fk", "tilt_arm", "--random", "50", "--seed", "1")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("AGREE")


def test_plans_are_solved_and_certified(borecheck):
    plans = str(EXAMPLE / "plans.csv")
    words = ["check", "tilt_arm", "tube", "--plan", plans, "--margin", "1mm"]
    done = borecheck(*words, "--scene-arg", "width=0.8m", "--format", "json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert [plan["verdict"] for plan in result["plans"]] == ["clear", "clear"]
    assert all(plan["path"]["certified"] for plan in result["plans"])


def test_the_example_imports_nothing_but_the_public_door():
    for file in (EXAMPLE / "tilt_arm").glob("*.py"):
        for line in file.read_text().splitlines():
            if line.startswith(("import borecheck", "from borecheck")):
                assert line.startswith("from borecheck.plugin import"), file


ARM = """<robot name="a"><link name="base"/><link name="needle"><collision>
<geometry><box size="0.01 0.01 0.01"/></geometry></collision></link>
<joint name="drive" type="prismatic"><parent link="base"/><child link="needle"/>
<axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>
"""
FIELDS = """from pathlib import Path
from borecheck.plugin import JointMap, RobotDescription
def forward(q):
    return {"tip": [1.0, 2.0]}
def inverse(tip, direction, insertion):
    return [tip]
ROBOT = RobotDescription(name=__name__, title="t", source="s", not_modelled=(),
    xacro=Path(__file__).with_suffix(".urdf"), tool_frame="needle", %s)
"""
BROKEN = {
    "syntax": ("def (", "cannot be loaded: SyntaxError.*broken_syntax.py, line 1"),
    "gone": ("import no_such_thing", "No module named 'no_such_thing"),
    "exits": ("import sys\nsys.exit(3)", "cannot be loaded: SystemExit: 3"),
    "field": (FIELDS % "needel_link=''", "'needel_link' .*did you mean 'needle_link'"),
    "missing": (
        "from borecheck.plugin import RobotDescription\nRobotDescription(name='n')",
        "missing 4 required keyword-only arguments: 'title'",
    ),
    "kind": ("ROBOT = 3", "is int, not RobotDescription"),
    "joint": (FIELDS % "insertion_joint='drvie'", "'drvie' .*did you mean 'drive'"),
    "hook": (FIELDS % "forward=f'{__name__}:forwrd'", "forward .*'forwrd'"),
    "shape": (
        FIELDS % "forward=f'{__name__}:forward', frames={'tip': 'needle'}",
        r"forward .* returned dict: frame 'tip' has shape \(2,\), not numbers \(4, 4\)",
    ),
    "solutions": (
        FIELDS % "inverse=f'{__name__}:inverse', joints=(JointMap('drive'),)",
        "inverse .* returned list: it must be Solutions",
    ),
}


@pytest.fixture
def broken(tmp_path, monkeypatch):
    """All of them installed, each in a package of its own."""
    for what, (text, _) in BROKEN.items():
        name = f"broken_{what}"
        (tmp_path / f"{name}.py").write_text(text)
        (tmp_path / f"{name}.urdf").write_text(ARM)
        metadata = tmp_path / f"{name}-1.dist-info"
        metadata.mkdir()
        about = f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n"
        (metadata / "METADATA").write_text(about)
        entries = f"[borecheck.robots]\n{name} = {name}:ROBOT\n"
        entries += f"[borecheck.commands]\nstudy_{what} = {name}.study\n"
        (metadata / "entry_points.txt").write_text(entries)
    monkeypatch.syspath_prepend(str(tmp_path))


def test_broken_packages_are_a_line_each_and_take_no_other_down(broken, capsys):
    assert main(["robots"]) == 1
    listed = capsys.readouterr().out
    assert "robot zerobot: " in listed
    assert "scanner ct_gantry: " in listed
    for what, (_, line) in BROKEN.items():
        whose = rf"broken: robot broken_{what} \(package broken_{what}\): "
        assert re.search(f"^{whose}.*{line}", listed, re.M), what
    assert main(["check", "zerobot", "ct_gantry", "--q", "home"]) == 0
    capsys.readouterr()
    for what, (_, line) in BROKEN.items():
        if what in ("shape", "solutions"):  # a pose needs no closed form
            continue
        assert main(["check", f"broken_{what}", "ct_gantry", "--q", "home"]) == 2
        told = capsys.readouterr().err
        assert re.search(line, told), told
        assert told.count("\n") == 1


def test_a_name_that_two_packages_bring_is_nobodys(broken, tmp_path, capsys):
    """The later one would else stand in for a robot that people know."""
    entries = tmp_path / "broken_kind-1.dist-info" / "entry_points.txt"
    entries.write_text("[borecheck.robots]\nzerobot = broken_kind:ROBOT\n")
    assert main(["check", "zerobot", "ct_gantry", "--q", "home"]) == 2
    told = capsys.readouterr().err
    assert "the name is taken twice, by broken_kind:ROBOT and zerobot" in told


PAGE = (PROJECT / "docs" / "adding_a_robot.md").read_text()


def test_what_the_page_shows_of_the_example_is_its_text():
    blocks = re.findall(r"^```(?:python|toml)\n(.*?)^```$", PAGE, re.M | re.S)
    files = [*EXAMPLE.glob("*.toml"), *(EXAMPLE / "tilt_arm").glob("*.py")]
    texts = {file.name: file.read_text() for file in files}
    assert len(blocks) == 4
    for block in blocks:
        assert any(block in text for text in texts.values()), block
    for whole in ("pyproject.toml", "description.py"):
        assert texts[whole] in blocks


def test_the_page_names_all_that_the_door_gives():
    for name in plugin.__all__:
        assert re.search(rf"`{name}\b", PAGE), name
        if is_dataclass(getattr(plugin, name)):
            for field in fields(getattr(plugin, name)):
                hidden = (name, field.name) == ("TriangleMesh", "inner_vertices")
                assert hidden or re.search(
                    rf"`{field.name}\b|\b{field.name}[,=)]", PAGE
                )
