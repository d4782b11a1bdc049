"""A motion between polyhedra round its shapes and within them: put together by hand."""

from dataclasses import replace

import pytest

from borecheck.contact.verdict import Answer
from borecheck.motion.outcome import PathVerdict, Stretch
from borecheck.motion.round_shapes import between

AB, CD = ("a", "b"), ("c", "d")
EXCESS = {"a": 1e-4, "b": 0.0, "c": 2e-4, "d": 5e-5}


def found(*stretches, first=None, reason="as found", qualifiers=(), **more):
    """A verdict of stretches (start, end, verdict, pairs...); the worst decides."""
    intervals = tuple(Stretch(*tupled(stretch)) for stretch in stretches)
    verdicts = [s.verdict for s in intervals]
    verdict = next(v for v in ("contact", "unknown", "clear") if v in verdicts)
    return PathVerdict(
        verdict=verdict,
        reason=reason,
        qualifiers=qualifiers,
        certified=verdict == "clear",
        intervals=intervals,
        first_contact=first,
        worst=0.0,
        counts={"pairs": 1},
        **more,
    )


def tupled(stretch):
    start, end, verdict, *pairs = stretch
    return start, end, verdict, tuple(pairs)


def rows(verdict):
    return [(s.start, s.end, s.verdict, s.pairs) for s in verdict.intervals]


AROUND = found(
    (0.0, 0.25, "clear"),
    (0.25, 0.75, "contact", AB),
    (0.75, 1.0, "clear"),
    first=(0.25, 0.3, AB),
    reason="a and b meet",
    qualifiers=("contained",),
)


def test_contact_is_where_both_say_so_and_the_band_is_unknown():
    inside = found(
        (0.0, 0.5, "clear"),
        (0.5, 0.625, "contact", CD),
        (0.625, 1.0, "unknown", CD),
        first=(0.5, 0.5625, CD),
        reason="c and d meet",
        qualifiers=("other",),
    )
    verdict = between(AROUND, inside, EXCESS)
    assert rows(verdict) == [
        (0.0, 0.25, "clear", ()),
        (0.25, 0.5, "unknown", (AB,)),
        (0.5, 0.625, "contact", (CD,)),
        (0.625, 0.75, "unknown", (AB,)),
        (0.75, 1.0, "clear", ()),
    ]
    assert (verdict.verdict, verdict.certified, verdict.worst) == (
        "contact",
        False,
        0.5,
    )
    # contact may begin as early as the polyhedra round the shapes touch
    assert verdict.first_contact == (0.25, 0.5625, CD)
    assert verdict.reason == (
        "c and d meet between 25.0000% and 56.2500% of the motion"
    )
    assert verdict.qualifiers == ("other",)
    assert verdict.counts == AROUND.counts


def test_the_inner_contact_may_be_found_to_begin_earlier_by_its_bounds():
    inside = found((0.0, 1.0, "contact", AB), first=(0.125, 0.5, AB))
    verdict = between(AROUND, inside, EXCESS)
    assert verdict.first_contact == (0.125, 0.5, AB)
    assert rows(verdict) == [
        (0.0, 0.25, "clear", ()),
        (0.25, 0.75, "contact", (AB,)),
        (0.75, 1.0, "clear", ()),
    ]
    assert verdict.worst == 0.25


def test_stretches_are_cut_where_the_other_ones_end():
    inside = found(
        *((0.0, 0.125, "unknown", CD), (0.125, 0.5, "contact", CD)),
        *((0.5, 0.875, "contact", AB), (0.875, 1.0, "clear")),
    )
    verdict = between(replace(AROUND, certified=True), inside, EXCESS)
    assert rows(verdict) == [
        (0.0, 0.125, "clear", ()),
        (0.125, 0.25, "clear", ()),
        (0.25, 0.5, "contact", (CD,)),
        (0.5, 0.75, "contact", (AB,)),
        (0.75, 0.875, "clear", ()),
        (0.875, 1.0, "clear", ()),
    ]
    assert not verdict.certified


@pytest.mark.parametrize("lacking", ["around", "inside"])
def test_of_a_solid_held_the_reason_stays(lacking):
    """Then no first contact of surfaces is known."""
    inside = found((0.0, 1.0, "contact", AB), first=(0.5, 0.6, AB), reason="a in b")
    around = AROUND
    if lacking == "inside":
        inside = found((0.0, 1.0, "contact", AB), reason="a in b")
    else:
        around = found((0.0, 1.0, "contact", AB))
    verdict = between(around, inside, EXCESS)
    assert verdict.reason == "a in b"
    assert verdict.first_contact == inside.first_contact


@pytest.mark.parametrize("inner", ["clear", "unknown"])
def test_without_contact_within_it_is_unknown_and_says_how_wide_the_band_is(inner):
    answer = Answer("clear", "none")
    inside = found((0.0, 1.0, inner, CD), itself=answer)
    verdict = between(AROUND, inside, EXCESS)
    assert rows(verdict) == [
        (0.0, 0.25, "clear", ()),
        (0.25, 0.75, "unknown", (AB,)),
        (0.75, 1.0, "clear", ()),
    ]
    assert (verdict.verdict, verdict.certified, verdict.worst) == (
        *("unknown", False),
        0.25,
    )
    assert (verdict.first_contact, verdict.qualifiers) == (None, ())
    assert verdict.reason == (
        "a and b between 25.0000% and 75.0000% of the motion: no gap and no contact "
        "shown; a is round and known to 0.100 mm"
    )


def test_the_first_contact_with_names_is_told_with_both_widths():
    around = found(
        (0.0, 0.25, "unknown", AB),
        (0.25, 0.5, "contact"),
        (0.5, 0.75, "contact", CD, AB),
        (0.75, 1.0, "contact", AB),
    )
    verdict = between(around, found((0.0, 1.0, "clear")), EXCESS)
    assert verdict.reason == (
        "c and d between 50.0000% and 75.0000% of the motion: no gap and no contact "
        "shown; c is round and known to 0.200 mm and d is round and known to 0.050 mm"
    )
    assert verdict.worst == 0.0


def test_contact_of_which_no_pair_is_known_is_told_as_it_seems():
    around = found((0.0, 0.5, "contact"), (0.5, 1.0, "unknown", AB), reason="held")
    verdict = between(around, found((0.0, 1.0, "clear")), EXCESS)
    assert verdict.reason == ("held, or so it seems of the polyhedra round the shapes")


def test_contact_within_that_is_clear_around_is_clear():
    """Rounding at an edge: what is clear by the larger is clear by the smaller."""
    inside = found((0.0, 0.25, "contact", AB), (0.25, 1.0, "clear"), first=None)
    verdict = between(AROUND, inside, EXCESS)
    assert [r[2] for r in rows(verdict)] == ["clear", "unknown", "clear"]
    assert verdict.worst == 0.0
