"""A robot and a scanner in a package of their own, as docs/adding_a_robot.md says."""

import json
import os
import subprocess
import sys

import pytest

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
