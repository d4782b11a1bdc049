import json

import pytest

from borecheck.core.cache import cache_folder
from borecheck.errors import UrdfError
from borecheck.robots.urdf.expanded_text import expanded_text
from borecheck.robots.urdf.xacro import expand

XACRO = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="stored">
  <xacro:include filename="part.xacro"/>
  <xacro:arg name="length" default="1"/>
  <link name="base"/><link name="tip_$(arg length)_${size}"/>
</robot>
"""
PART = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="size" value="7"/>
</robot>
"""


@pytest.fixture
def xacro(tmp_path, monkeypatch):
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "cache"))
    (tmp_path / "part.xacro").write_text(PART)
    path = tmp_path / "stored.urdf.xacro"
    path.write_text(XACRO)
    return path


def test_the_stored_text_is_what_expanding_gives(xacro):
    fresh = expanded_text(xacro, {"length": "2"})
    stored = expanded_text(xacro, {"length": "2"})
    assert fresh == stored == expand(xacro, {"length": "2"}).text
    assert "tip_2_7" in fresh
    assert "tip_3_7" in expanded_text(xacro, {"length": "3"})


@pytest.mark.parametrize("changed", ["stored.urdf.xacro", "part.xacro"])
def test_a_changed_file_is_expanded_again(xacro, changed):
    expanded_text(xacro, {})
    file = xacro.parent / changed
    file.write_text(file.read_text().replace('"7"', '"8"').replace("base", "foot"))
    again = expanded_text(xacro, {})
    assert "tip_1_8" in again or "foot" in again


@pytest.mark.parametrize("content", ["{", "[]", "{}", json.dumps({"text": "<robot/>"})])
def test_a_damaged_file_is_ignored(xacro, content):
    whole = expanded_text(xacro, {})
    for file in cache_folder().glob("expanded-*"):
        file.write_text(content)
    assert expanded_text(xacro, {}) == whole


def test_a_folder_that_cannot_be_written_costs_nothing(xacro, tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.touch()
    monkeypatch.setenv("BORECHECK_CACHE", str(blocked / "below"))
    assert "tip_1_7" in expanded_text(xacro, {})


def test_errors_are_not_stored(xacro):
    xacro.write_text(XACRO.replace("${size}", "${missing}"))
    for _ in range(2):
        with pytest.raises(UrdfError):
            expanded_text(xacro, {})
