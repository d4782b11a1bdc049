"""A robot's text is parsed once on a trip, and errors name the user's own lines."""

import pytest

from borecheck.errors import UrdfError
from borecheck.robots.robot import load_robot
from borecheck.robots.urdf import source
from borecheck.validation import validate_file

BALL = '<link name="ball"><collision><geometry><sphere radius="0.1"/></geometry>'
PLAIN = f'<robot name="r">{BALL}</collision></link></robot>'


@pytest.fixture
def parsed(monkeypatch):
    """How many texts were parsed as XML."""
    texts, real = [], source._parse
    monkeypatch.setattr(source, "_parse", lambda *a: texts.append(a) or real(*a))
    return texts


@pytest.mark.parametrize("trip", [load_robot, validate_file])
def test_a_text_is_parsed_once(tmp_path, parsed, trip):
    file = tmp_path / "r.urdf"
    file.write_text(PLAIN)
    trip(file)
    assert len(parsed) == 1


def test_a_refused_xacro_is_told_at_the_line_of_its_source(tmp_path):
    """Lines of the expansion are no lines of a file that the user has."""
    part = tmp_path / "part.xacro"
    xacro = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    part.write_text(f'<robot {xacro}>\n\n\n<link name="a"/><link name="b"/>\n</robot>')
    file = tmp_path / "r.urdf.xacro"
    file.write_text(
        f'<robot name="r" {xacro}>\n<xacro:include filename="{part}"/></robot>'
    )
    with pytest.raises(UrdfError) as caught:
        load_robot(file)
    assert caught.value.file == f"{part}:4"
