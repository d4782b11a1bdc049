"""A robot and a scanner in a package of their own, as docs/adding_a_robot.md says."""

import json
import os
import re
import subprocess
import sys

import pytest

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


BROKEN = {
    "syntax": ("def (", "cannot be loaded: SyntaxError", "broken_syntax.py, line 1"),
    "gone": (
        "import no_such_thing",
        "No module named 'no_such_thing",
        "",
    ),
    "field": (
        "from borecheck.plugin import RobotDescription\nRobotDescription(nam=1)",
        "cannot be loaded: TypeError: .*unexpected keyword argument 'nam'",
        "broken_field.py, line 2",
    ),
    "kind": ("ROBOT = 3", "is int, not RobotDescription", ""),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_package_is_one_line_and_takes_no_other_down(
    what, tmp_path, monkeypatch, capsys
):
    text, line, place = BROKEN[what]
    name = f"broken_{what}"
    (tmp_path / f"{name}.py").write_text(text)
    metadata = tmp_path / f"{name}-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n"
    )
    entry = f"[borecheck.robots]\n{name} = {name}:ROBOT\n"
    (metadata / "entry_points.txt").write_text(entry)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["robots"]) == 2
    told = capsys.readouterr()
    assert "robot zerobot: " in told.out
    assert "scanner ct_gantry: " in told.out
    assert re.search(rf"^borecheck: error: robot package {name}.*{line}", told.err)
    assert place in told.err
    assert told.err.count("\n") == 1
    assert main(["check", name, "ct_gantry", "--q", "home"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
