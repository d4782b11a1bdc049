"""Which sample is the worst, what samples amount to, and where they lie."""

from types import SimpleNamespace

import numpy as np
import pytest

from borecheck.contact.verdict import Answer
from borecheck.motion.samples import (
    _intervals,
    _sampled,
    _worst,
    configurations_at,
    sample_fractions,
)
from borecheck.motion.turns import OpenTurns


def pose(verdict, room=None, own=(), reason="r", qualifiers=()):
    return SimpleNamespace(
        verdict=verdict,
        clearance_m=room,
        self_contacts=own,
        reason=reason,
        qualifiers=qualifiers,
        obstacles=Answer("clear" if own else verdict, reason, qualifiers),
        itself=Answer("contact" if own else "clear", reason, qualifiers),
    )


CLEAR, NEAR, FAR = pose("clear", 0.02), pose("clear", 0.01), pose("clear", 0.5)
UNTOLD, OPEN = pose("unknown"), pose("unknown", 0.3)
WITHIN, MEETS = pose("contact", 0.005), pose("contact")
OWN = pose("contact", 0.4, own=(1,))


@pytest.mark.parametrize(
    ("poses", "worst"),
    [
        ((CLEAR, NEAR, FAR), 1),
        ((FAR, FAR, CLEAR), 2),
        ((NEAR, pose("clear"), FAR), 0),  # no obstacle: no room that could be less
        ((NEAR, OPEN, UNTOLD), 1),
        ((NEAR, UNTOLD), 1),
        ((NEAR, OPEN, WITHIN), 2),
        ((WITHIN, MEETS, OPEN), 1),
        ((WITHIN, OWN), 1),
        ((MEETS, MEETS), 0),
        ((OWN, MEETS), 0),
        ((CLEAR, CLEAR), 0),
        ((pose("contact", 0.008), WITHIN), 1),
    ],
)
def test_the_worst_sample(poses, worst):
    assert _worst(poses) == worst


POINTS = np.array([[0.0], [1.0], [2.0]])
FRACTIONS = np.array([0.0, 0.5, 1.0])


def sampled(*poses, doubt=None, points=POINTS, turns=None):
    return _sampled(points, FRACTIONS[: len(poses)], poses, doubt, turns)


def test_the_first_contact_decides():
    first = pose("contact", reason="meets", qualifiers=("touching",))
    found = sampled(UNTOLD, first, MEETS)
    assert (found.verdict, found.first_contact) == ("contact", 0.5)
    assert found.reason == "at 50.0% of the motion: meets"
    assert found.qualifiers == ("touching",)
    assert found.sampled_clear == 0
    assert not found.certified


def test_all_clear_is_not_certified_but_for_one_pose():
    found = sampled(CLEAR, NEAR, FAR)
    assert (found.verdict, found.first_contact) == ("unknown", None)
    assert found.reason == "clear at 3 samples, not certified between them"
    assert (found.sampled_clear, found.worst) == (3, 1)
    one = sampled(pose("clear", 1.0, reason="far"), points=POINTS[:1])
    assert (one.verdict, one.reason) == ("clear", "far")
    undecided = sampled(pose("unknown", reason="open"), points=POINTS[:1])
    assert undecided.verdict == "unknown"


def test_what_is_undecided_at_a_pose_comes_before_what_is_so_of_the_scene():
    guessed = pose("unknown", reason="unit guessed; nearest")
    own = pose("unknown", reason="touches what is open", qualifiers=("q",))
    found = sampled(guessed, own, guessed, doubt="unit guessed")
    assert found.reason == "at 50.0% of the motion: touches what is open"
    assert found.qualifiers == ("q",)
    assert sampled(CLEAR, guessed, doubt="unit guessed").reason == "unit guessed"
    assert sampled(CLEAR, own, CLEAR).reason.startswith("at 50.0%")


def test_within_a_turn_whose_way_is_open_nothing_is_said():
    """At waypoints all ways lead through the same pose; between them they do not."""
    turns = OpenTurns((0,), 2, "which way?", "as written")
    halves = np.array([0.0, 0.25, 0.5])
    meets = pose("contact", reason="meets")

    def asked(*poses):
        return _sampled(POINTS, halves, poses, None, turns)

    assert asked(CLEAR, meets, CLEAR).verdict == "unknown"
    assert asked(CLEAR, meets, CLEAR).reason == "which way?"
    at_end = asked(CLEAR, CLEAR, meets)
    assert (at_end.verdict, at_end.first_contact) == ("contact", 0.5)
    assert asked(CLEAR, CLEAR, CLEAR).verdict == "unknown"


@pytest.mark.parametrize(
    ("verdicts", "told"),
    [
        ("kkk", [(0.0, 1.0, "unknown")]),
        ("kck", [(0.0, 1.0, "contact")]),
        ("kkc", [(0.0, 0.5, "unknown"), (0.5, 1.0, "contact")]),
        ("ckk", [(0.0, 0.5, "contact"), (0.5, 1.0, "unknown")]),
        ("kuk", [(0.0, 1.0, "unknown")]),
    ],
)
def test_between_samples_nothing_is_clear(verdicts, told):
    names = {"k": "clear", "c": "contact", "u": "unknown"}
    found = _intervals(FRACTIONS, [names[v] for v in verdicts])
    assert [(s.start, s.end, s.verdict) for s in found] == told


def test_one_pose_is_the_whole_motion():
    for verdict in ("clear", "contact", "unknown"):
        (only,) = _intervals(np.zeros(1), [verdict])
        assert (only.start, only.end, only.verdict) == (0.0, 1.0, verdict)


def test_waypoints_are_among_the_samples_and_met_exactly():
    points = np.array([[0.1, 3.0], [0.7, -1.0], [0.3, 0.2], [1.1, 0.9]])
    fractions = sample_fractions(points, 5)
    assert fractions.tolist() == pytest.approx([0, 0.25, 1 / 3, 0.5, 2 / 3, 0.75, 1])
    qs = configurations_at(points, fractions)
    for k, point in zip((0, 2, 4, 6), points, strict=True):
        assert np.array_equal(qs[k], point)
    np.testing.assert_allclose(qs[1], points[0] + 0.75 * (points[1] - points[0]))
    np.testing.assert_allclose(qs[3], (points[1] + points[2]) / 2)
    np.testing.assert_allclose(qs[5], points[2] + 0.25 * (points[3] - points[2]))
    one = configurations_at(points[:1], np.zeros(2))
    assert np.array_equal(one, [points[0], points[0]])
    assert sample_fractions(points[:1], 9).tolist() == [0.0]
    assert sample_fractions(points[:2], 1).tolist() == [0.0, 1.0]
