"""Studies say at once what they do."""

import subprocess
import sys

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


@pytest.mark.parametrize(("more", "said"), [((), True), (("--help",), False)])
def test_it_is_told_before_anything_else(more, said):
    """A study that is refused at once, by an option that there is not."""
    words = [sys.executable, "-m", "studies.paths", "--pahts", "1", *more]
    done = subprocess.run(words, cwd=PROJECT, capture_output=True, text=True)
    first = (done.stderr or done.stdout).splitlines()[0]
    line = studies.first_line("studies.paths")
    assert (first == f"studies.paths: {line}") == said
