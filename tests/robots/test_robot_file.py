"""Names of robots and scenes: what was meant is said in one line."""

import pytest

import borecheck as bc
from borecheck.cli import main
from borecheck.errors import BorecheckError
from tests.places import ROBOTS

ARM = ROBOTS / "two_link.urdf"


def refusal(call, *words):
    with pytest.raises(BorecheckError) as error:
        call(*words)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("typed", ["two_link.urfd", "two_lnk.urdf", "two-link.urdf"])
def test_a_file_that_is_not_there_is_told_from_a_robot(typed):
    said = refusal(bc.load_robot, ROBOTS / typed)
    assert "no such file" in said
    assert "two_link.urdf" in said
    assert "unknown robot" not in said


def test_a_bare_word_is_a_robot():
    assert "did you mean 'zerobot'" in refusal(bc.load_robot, "zerobt")


def test_swapped_robot_and_scene_are_named():
    order = "the robot comes first, then the scene"
    assert order in refusal(bc.load_robot, "ct_gantry")
    assert order in refusal(bc.load_robot, "gantry.stl")
    assert order in refusal(bc.load_scene, "zerobot")


@pytest.mark.parametrize(
    "words", [("ct_gantry", "zerobot"), ("box.stl:m", str(ARM)), (str(ARM), "zerobot")]
)
def test_on_the_command_line_too(words, capsys):
    assert main(["check", *words, "--q", "home"]) == 2
    told = capsys.readouterr().err
    assert "the robot comes first" in told
    assert told.count("\n") == 1
