"""Studies say at once what they do."""

import ast
import subprocess
import sys
from importlib.util import find_spec

import pytest

import studies
from tests.places import PROJECT


def test_every_study_has_a_line():
    names = [
        path.stem
        for path in (PROJECT / "studies").iterdir()
        if path.suffix == ".py" or (path / "__main__.py").is_file()
    ]
    told = {name: studies.first_line(f"studies.{name}") for name in names}
    del told["__init__"]
    assert len(told) > 20
    for line in told.values():
        assert len(line) > 20
        assert line.endswith((".", "?", ":")) or line[-1].isalnum()


@pytest.mark.parametrize("folder", ["benchmarks", "studies"])
def test_what_they_import_of_each_other_is_there(folder):
    """What is ignored by version control is there only for who wrote it."""
    files = [*(PROJECT / folder).rglob("*.py")]
    trees = [ast.parse(file.read_text()) for file in files]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    named = {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
    own = sorted(name for name in named if name and name.startswith(f"{folder}."))
    assert len(own) > 5
    assert [name for name in own if find_spec(name) is None] == []


@pytest.mark.parametrize(("more", "said"), [((), True), (("--help",), False)])
def test_it_is_told_before_anything_else(more, said):
    """A study that is refused at once, by an option that there is not."""
    words = [sys.executable, "-m", "studies.paths", "--pahts", "1", *more]
    done = subprocess.run(words, cwd=PROJECT, capture_output=True, text=True)
    first = (done.stderr or done.stdout).splitlines()[0]
    line = studies.first_line("studies.paths")
    assert (first == f"studies.paths: {line}") == said
