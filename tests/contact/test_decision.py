"""What findings amount to: every row says what must be answered, and nothing else."""

from types import SimpleNamespace

import pytest

from borecheck.contact.decision import (
    Findings,
    about_itself,
    about_obstacles,
    worse_of,
)
from borecheck.contact.margin import (
    ENLARGE_BODY,
    ENLARGE_WORLD,
    NO_MARGIN,
    OFFSET,
    SECURITY,
    Margin,
)
from borecheck.contact.verdict import Answer, Closest, Containment, TrianglePair

MARGIN = 0.02


def findings(**given):
    return Findings(**given)


def closest(lower, upper=None):
    points = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    ends = (lower, lower if upper is None else upper)
    return Closest("arm", "bed", "couch", *ends, points, (0, 0))


def touch(obstacle="bed", link="arm"):
    return TrianglePair(link, obstacle, 0, 0)


def held(state, role="couch"):
    return Containment("arm", "bed", role, state, f"because {state}")


def answer(found=None, near=None, margin=NO_MARGIN, checker="exact"):
    return about_obstacles(found or findings(), checker, margin, near)


@pytest.mark.parametrize(
    ("margin", "lower", "upper", "verdict"),
    [
        # without a margin: clear is what is surely apart
        (NO_MARGIN, 1e-12, 1e-9, "clear"),
        (NO_MARGIN, 0.0, 1e-9, "unknown"),
        (NO_MARGIN, 0.0, 0.0, "unknown"),
        # the true distance must exceed the margin; between the bounds nobody knows
        (Margin(MARGIN, OFFSET), MARGIN + 1e-9, MARGIN + 2e-9, "clear"),
        (Margin(MARGIN, OFFSET), MARGIN, MARGIN + 2e-9, "unknown"),
        (Margin(MARGIN, OFFSET), MARGIN - 1e-9, MARGIN + 1e-9, "unknown"),
        (Margin(MARGIN, OFFSET), MARGIN - 1e-9, MARGIN, "contact"),
        (Margin(MARGIN, OFFSET), 0.5 * MARGIN, 0.6 * MARGIN, "contact"),
        # Coal saw no contact at its own margin: what is nearer is a contradiction
        (Margin(MARGIN, SECURITY), MARGIN + 1e-9, MARGIN + 2e-9, "clear"),
        (Margin(MARGIN, SECURITY), MARGIN, MARGIN, "unknown"),
        (Margin(MARGIN, SECURITY), 0.5 * MARGIN, 0.6 * MARGIN, "unknown"),
        # grown surfaces do not meet: the distance has nothing to keep
        (Margin(MARGIN, ENLARGE_BODY), 0.5 * MARGIN, 0.6 * MARGIN, "clear"),
        (Margin(MARGIN, ENLARGE_WORLD), 0.0, 0.6 * MARGIN, "unknown"),
    ],
)
def test_distance_alone(margin, lower, upper, verdict):
    found = answer(near=closest(lower, upper), margin=margin)
    assert found.verdict == verdict
    assert found.qualifiers == (("within_margin",) if verdict == "contact" else ())
    if upper > 0.0:
        assert "arm to bed" in found.reason
        assert f"{1e3 * lower:.3f} mm" in found.reason


def test_surfaces_that_meet_unseen_name_the_blind_checker():
    found = answer(near=closest(0.0), checker="paper:robot")
    assert found.verdict == "unknown"
    assert found.reason.startswith("paper:robot sees no contact, but")


def test_without_obstacles_nothing_is_clear():
    assert answer().verdict == "unknown"


def test_contact_is_contact_whatever_else():
    far = closest(1.0)
    seen = findings(contacts=[touch()], contained=[held("unknown")])
    for found in (answer(seen, far), about_itself(seen, 3)):
        assert found.verdict == "contact"
        assert found.reason == "arm meets bed (1 triangle pairs)"
        assert found.pairs == (("arm", "bed"),)


def test_of_itself_clear_is_no_contact_and_nothing_held():
    found = about_itself(findings(), 3)
    assert (found.verdict, found.reason) == ("clear", "none of 3 pairs of parts meet")
    found = about_itself(findings(), 1, allowed=2)
    assert found.reason == ("none of 1 pair of parts meet; 2 pairs of links may touch")
    open_pair = about_itself(findings(contained=[held("unknown", "self")]), 3)
    assert (open_pair.verdict, open_pair.reason) == ("unknown", "because unknown")
    inside = about_itself(
        findings(contained=[held("unknown", "self"), held("b_in_a", "self")]), 3
    )
    assert (inside.verdict, inside.qualifiers) == ("contact", ("contained",))
    assert inside.pairs == (("arm", "bed"),)


# about the obstacles, about the robot itself, and what decides
BOTH = [
    ("clear", "clear", "clear", "o"),
    ("clear", "contact", "contact", "i"),
    ("clear", "unknown", "unknown", "i"),
    ("unknown", "clear", "unknown", "o"),
    ("unknown", "contact", "contact", "i"),
    ("unknown", "unknown", "unknown", "o"),
    ("contact", "clear", "contact", "o"),
    ("contact", "unknown", "contact", "o"),
    ("contact", "contact", "contact", "o; and the robot itself: i"),
]


@pytest.mark.parametrize(("obstacles", "itself", "verdict", "reason"), BOTH)
def test_the_whole_is_the_worse_of_both(obstacles, itself, verdict, reason):
    whole = worse_of(Answer(obstacles, "o"), Answer(itself, "i"))
    assert (whole.verdict, whole.reason) == (verdict, reason)


@pytest.mark.parametrize(
    ("obstacles", "itself", "whole"),
    [
        (("touching",), ("touching",), ("touching",)),
        (("touching",), (), ()),
        ((), ("touching",), ()),
        (("within_margin",), (), ("within_margin",)),
        (("within_tolerance",), ("touching",), ()),
    ],
)
def test_a_whole_contact_is_as_shallow_as_both(obstacles, itself, whole):
    both = worse_of(Answer("contact", "o", obstacles), Answer("contact", "i", itself))
    assert both.qualifiers == whole
    only = worse_of(Answer("clear", "o"), Answer("contact", "i", itself))
    assert only.qualifiers == itself


def test_what_holds_or_is_held_is_contact():
    for state in ("a_in_b", "b_in_a"):
        open_first = [held("unknown"), held(state)]
        found = answer(findings(contained=open_first), closest(1.0))
        assert (found.verdict, found.qualifiers) == ("contact", ("contained",))
        assert found.reason == f"arm: because {state}"


def test_within_growth_is_contact_within_the_margin():
    grown = findings(within_growth=[("arm", "speck"), ("base", "bed")])
    found = answer(grown, closest(1.0), Margin(MARGIN, ENLARGE_BODY))
    assert (found.verdict, found.qualifiers) == ("contact", ("within_margin",))
    assert found.reason == "speck lies wholly within the margin of arm"


def test_what_cannot_be_told_takes_clear_away_and_nothing_else():
    open_pairs = findings(contained=[held("unknown")])
    found = answer(open_pairs, closest(1.0))
    assert (found.verdict, found.reason) == ("unknown", "because unknown")
    near = answer(open_pairs, closest(0.01), Margin(MARGIN, OFFSET))
    assert near.verdict == "contact"
    assert answer(findings(), closest(1.0)).verdict == "clear"


# margin, what was noted, qualifier
KINDS = [
    (NO_MARGIN, {"only_tolerance": False, "crossing": True}, ()),
    (NO_MARGIN, {"only_tolerance": False, "crossing": False}, ("touching",)),
    (NO_MARGIN, {"only_tolerance": True, "crossing": False}, ("within_tolerance",)),
    (NO_MARGIN, {"only_tolerance": True, "crossing": True}, ("within_tolerance",)),
    # with offset the triangles meet as they are
    (Margin(MARGIN, OFFSET), {"only_tolerance": False, "crossing": True}, ()),
    (Margin(MARGIN, OFFSET), {"only_tolerance": False}, ("touching",)),
    (
        Margin(MARGIN, ENLARGE_BODY),
        {"only_tolerance": False, "crossing": True},
        ("within_margin",),
    ),
    (Margin(MARGIN, SECURITY), {"only_tolerance": True}, ("within_margin",)),
    (Margin(0.0, SECURITY), {"only_tolerance": True}, ("within_tolerance",)),
]


@pytest.mark.parametrize(("margin", "noted", "qualifiers"), KINDS)
def test_how_deep_a_contact_is(margin, noted, qualifiers):
    found = answer(findings(contacts=[touch()], **noted), None, margin, "coal")
    assert found.qualifiers == qualifiers
    verb = "is within the margin of" if qualifiers == ("within_margin",) else "meets"
    assert found.reason == f"arm {verb} bed (1 triangle pairs)"


def test_parts_among_themselves_keep_no_margin():
    own = findings(contacts=[touch()], only_tolerance=False, crossing=True)
    assert about_itself(own, 1).qualifiers == ()


@pytest.mark.parametrize(
    ("obstacles", "reason"),
    [
        ("aab", "arm with a, arm with b (3 triangle pairs)"),
        ("abc", "arm with a, arm with b, arm with c (3 triangle pairs)"),
        ("abcde", "arm with a, arm with b, arm with c and 2 more (5 triangle pairs)"),
        ("aaa", "arm meets a (3 triangle pairs)"),
    ],
)
def test_three_pairs_are_named(obstacles, reason):
    found = findings(contacts=[touch(name) for name in obstacles], crossing=True)
    found.only_tolerance = False
    assert answer(found).reason == reason


def test_pairs_are_counted_over_all_surfaces():
    found = findings()
    for examined, first, second in ((5, 2, 7), (1, 3, 4)):
        a, b = SimpleNamespace(count=first), SimpleNamespace(count=second)
        found.count(SimpleNamespace(examined=examined), a, b)
    assert (found.examined, found.total) == (6, 26)
    fresh = findings()
    assert (fresh.examined, fresh.total, fresh.corridor_contacts) == (0, 0, 0)
    assert fresh.within_growth == []
    assert fresh.punctured == set()
