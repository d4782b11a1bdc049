"""What a user states as needle is held against the geometry; nothing is guessed."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.needle_shape import half_width
from tests.places import ROBOTS

ARM = ROBOTS / "needle_arm.urdf"


def test_a_stated_needle_may_enter_the_patient_and_nothing_else():
    robot = bc.load_robot(ARM, needle="needle_link", tip="needle_tip")
    links = robot.model.link_names
    assert [link for link in links if robot.may_enter(link, "patient")] == [
        "needle_link"
    ]
    assert not any(
        robot.may_enter("needle_link", role) for role in ("scanner", "other")
    )


def test_without_a_needle_no_link_may_enter():
    robot = bc.load_robot(ARM)
    assert robot.needle is None
    assert not any(robot.may_enter(link, "patient") for link in robot.model.link_names)


def test_a_description_states_its_own(zerobot):
    needle = zerobot.needle
    assert (needle.link, needle.tip, needle.insertion) == ("needle", "E", "q6")
    assert needle.radius == zerobot.description.needle_radius


@pytest.mark.parametrize(
    "given",
    [
        {"needle": "needle"},
        {"tip": "E"},
        {"needle": "needle", "tip": "E:z", "insertion": "q6"},
    ],
)
def test_a_descriptions_needle_stated_again_stays_its_own(zerobot, given):
    """With its width from the paper, and its closed form."""
    again = bc.load_robot("zerobot", **given)
    assert again.stated_needle is None
    assert again.needle.radius == zerobot.needle.radius


def test_another_needle_of_an_installed_robot_is_its_own_statement(zerobot):
    other = bc.load_robot("zerobot", needle="needle", tip="E:z", insertion="q1")
    assert other.stated_needle.insertion == "q1"


def test_the_proposal_would_be_accepted():
    robot = bc.load_robot(ARM)
    with pytest.raises(UsageError, match="has no needle") as told:
        robot.needle_with_tip()
    words = str(told.value).split()
    link, tip = (words[words.index(name) + 1] for name in ("--needle", "--tip"))
    assert robot.with_needle(link, tip).needle.link == "needle_link"


@pytest.mark.parametrize(
    ("needle", "tip", "says"),
    [
        ("needle_link", "needle_tip:x", "would fit"),
        ("needle_link", "needle_tip:-z", "needle_tip:z would fit"),
        ("needle_link", "needle_link", "180.0 mm beyond needle_link"),
        ("needle_link", "forearm", "a joint moves forearm against needle_link"),
        ("flange", "flange:x", "20.0 mm beyond flange"),
        ("needle_tip", "needle_tip", "no geometry"),
    ],
)
def test_what_is_no_needle_is_refused(needle, tip, says):
    with pytest.raises(UsageError, match=says):
        bc.load_robot(ARM, needle=needle, tip=tip)


@pytest.mark.parametrize(
    ("needle", "tip", "close"),
    [
        ("needle_lnik", None, "needle_link"),
        ("needle_link", "needle_tpi", "needle_tip"),
        ("needle_link", "needle_tip:w", "known: x, y, z, -x, -y, -z"),
        ("needle_link", "needle_tip:", None),
        ("", None, None),
    ],
)
def test_unknown_names_are_told_with_those_that_exist(needle, tip, close):
    if close is None and tip is not None:
        assert bc.load_robot(ARM, needle=needle, tip=tip).needle is not None
        return
    with pytest.raises(UnknownNameError, match=close or "unknown link"):
        bc.load_robot(ARM, needle=needle, tip=tip)


def test_an_insertion_joint_slides():
    with pytest.raises(UsageError, match="does not slide"):
        bc.load_robot(ARM, needle="needle_link", tip="needle_tip", insertion="joint_1")
    with pytest.raises(UsageError, match="--needle"):
        bc.load_robot(ARM, tip="needle_tip")


def test_half_the_width_of_a_tilted_cylinder(rng):
    """Of a round shaft: its radius, from whichever side, never more."""
    turn = np.linspace(0.0, 2.0 * np.pi, 97)
    ring = 0.002 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
    top = ring + (0.0, 0.0, 0.1)
    sides = np.stack([ring[:-1], ring[1:], top[:-1]], axis=1)
    for _ in range(5):
        rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        found = half_width(sides @ rotation.T, rotation[:, 2], 0.01)
        assert 0.002 * (1.0 - 1e-4) < found <= 0.002 + 1e-12


def test_a_hub_behind_is_not_the_needle():
    """What lies behind the length looked at does not count, cut or not."""
    spike = np.array([[[0.0, 0.0, 1.0], [-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]]])
    assert half_width(spike, np.array([0.0, 0.0, 1.0]), 0.1) == pytest.approx(0.01)
