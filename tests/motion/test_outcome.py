"""What findings of all pairs amount to over the whole motion: cases by hand."""

import numpy as np
import pytest

from borecheck.motion.halving import CERTIFIED, TOUCHED, UNDECIDED
from borecheck.motion.outcome import Timeline, in_doubt, path_verdict

AB, CD = ("a", "b"), ("c", "d")


def timeline(*rows, span=1.0, pair=AB):
    """One pair's findings (from, to, outcome), in waypoints."""
    found = Timeline(span)
    found.add(pair, np.array(rows, dtype=float).reshape(-1, 3))
    return found


def stretches_of(verdict):
    return [(s.start, s.end, s.verdict, s.pairs) for s in verdict.intervals]


def test_nothing_found_is_clear_of_so_many_pairs():
    found = path_verdict(Timeline(3.0), 4)
    assert (found.verdict, found.certified, found.worst) == ("clear", True, None)
    assert found.reason == "every instant is proven clear for 4 pairs"
    assert stretches_of(found) == [(0.0, 1.0, "clear", ())]
    assert found.first_contact is None
    assert found.qualifiers == ()


def test_nothing_examined_is_not_clear():
    found = path_verdict(Timeline(3.0), 0)
    assert (found.verdict, found.certified) == ("unknown", False)
    assert found.reason == "nothing was examined"


def test_contact_begins_at_the_earliest_touch_of_any_pair():
    for order in ((AB, CD), (CD, AB)):
        found = Timeline(4.0)
        for pair in order:
            begin = 3.0 if pair == AB else 2.0
            found.add(pair, np.array([[begin, begin + 1.0, TOUCHED]]))
        verdict = path_verdict(found, 2)
        assert verdict.verdict == "contact"
        assert verdict.first_contact == (0.5, 0.75, CD)
        assert verdict.worst == 0.5
        assert verdict.reason.startswith("c and d meet between 50.0000% and 75.0000%")
        assert not verdict.certified
        assert stretches_of(verdict) == [
            (0.0, 0.5, "clear", ()),
            (0.5, 0.75, "contact", (CD,)),
            (0.75, 1.0, "contact", (AB,)),
        ]


def test_of_touches_that_begin_alike_the_shorter_one_is_told_and_the_first_stays():
    found = Timeline(1.0)
    found.add(AB, np.array([[0.5, 0.75, TOUCHED]]))
    found.add(CD, np.array([[0.5, 0.75, TOUCHED]]))
    assert path_verdict(found, 2).first_contact == (0.5, 0.75, AB)
    found.add(CD, np.array([[0.5, 0.625, TOUCHED]]))
    assert path_verdict(found, 2).first_contact == (0.5, 0.625, CD)


def test_what_is_undecided_just_before_may_hold_the_contact():
    found = timeline((0.25, 0.5, UNDECIDED), (0.5, 1.0, TOUCHED))
    verdict = path_verdict(found, 1)
    assert verdict.first_contact == (0.25, 1.0, AB)
    # and what is clear between ends that
    apart = timeline((0.125, 0.25, UNDECIDED), (0.5, 1.0, TOUCHED))
    assert path_verdict(apart, 1).first_contact == (0.5, 1.0, AB)


def test_undecided_is_unknown_with_its_note():
    found = timeline((1.0, 2.0, UNDECIDED), span=4.0)
    verdict = path_verdict(found, 1)
    assert (verdict.verdict, verdict.worst) == ("unknown", 0.25)
    assert verdict.reason == (
        "a and b between 25.0000% and 50.0000% of the motion: "
        "no gap could be shown there"
    )
    found.note(AB, "gave up")
    found.note(AB, "again")
    assert path_verdict(found, 1).reason.endswith("motion: gave up")
    assert path_verdict(found, 1).first_contact is None


def test_what_is_certified_is_clear():
    verdict = path_verdict(timeline((0.0, 1.0, CERTIFIED)), 1)
    assert (verdict.verdict, verdict.certified) == ("clear", True)


def test_contact_beats_unknown_and_neighbours_are_joined():
    found = Timeline(1.0)
    found.add(AB, np.array([[0.0, 0.25, UNDECIDED], [0.25, 0.5, UNDECIDED]]))
    found.add(CD, np.array([[0.125, 0.25, TOUCHED]]))
    assert found.open[0] == (0.0, 0.5, UNDECIDED, AB)
    assert stretches_of(path_verdict(found, 2)) == [
        (0.0, 0.125, "unknown", (AB,)),
        (0.125, 0.25, "contact", (CD,)),
        (0.25, 0.5, "unknown", (AB,)),
        (0.5, 1.0, "clear", ()),
    ]


def test_two_pairs_open_at_once_are_both_named_once():
    found = Timeline(1.0)
    for pair in (AB, CD, AB):
        found.add(pair, np.array([[0.25, 0.5, UNDECIDED]]))
    assert stretches_of(path_verdict(found, 2))[1] == (0.25, 0.5, "unknown", (AB, CD))


def test_only_stretches_that_join_are_joined():
    found = Timeline(1.0)
    rows = [[0.0, 0.25, UNDECIDED], [0.5, 0.75, UNDECIDED], [0.75, 1.0, TOUCHED]]
    found.add(AB, np.array(rows))
    found.add(CD, np.array([[1.0, 1.0, TOUCHED]]))
    assert [row[:2] for row in found.open] == [
        (0.0, 0.25),
        (0.5, 0.75),
        (0.75, 1.0),
        (1.0, 1.0),
    ]


def test_a_solid_in_another_is_contact_for_its_stretch():
    found = Timeline(2.0)
    found.add_contained(AB, "a is in b", 0.25, 0.5)
    verdict = path_verdict(found, 1)
    assert (verdict.verdict, verdict.reason) == ("contact", "a is in b")
    assert verdict.qualifiers == ("contained",)
    assert stretches_of(verdict)[1] == (0.25, 0.5, "contact", (AB,))
    assert verdict.worst == 0.25
    np.testing.assert_allclose(found.settled(), [[0.5, 1.0]])


def test_a_solid_is_held_all_the_way_unless_it_is_said_where():
    found = Timeline(2.0)
    found.add_contained(AB, "a holds b")
    verdict = path_verdict(found, 1)
    assert stretches_of(verdict) == [(0.0, 1.0, "contact", (AB,))]
    assert verdict.worst == 0.0
    assert verdict.first_contact is None
    np.testing.assert_array_equal(found.settled(), [[0.0, 2.0]])


def test_what_nothing_can_be_told_of_is_unknown_everywhere_but_in_contact():
    found = Timeline(1.0)
    found.add_unknown(AB, "b is open")
    verdict = path_verdict(found, 1)
    assert (verdict.verdict, verdict.reason) == ("unknown", "b is open")
    assert stretches_of(verdict) == [(0.0, 1.0, "unknown", (AB,))]
    found.add(CD, np.array([[0.5, 1.0, TOUCHED]]))
    both = path_verdict(found, 2)
    assert both.verdict == "contact"
    assert [s.verdict for s in both.intervals] == ["unknown", "contact"]


def test_where_a_pair_was_not_shown_clear():
    found = Timeline(1.0)
    found.add(AB, np.array([[0.0, 0.25, UNDECIDED]]))
    found.add(CD, np.array([[0.5, 0.75, UNDECIDED], [0.75, 1.0, TOUCHED]]))
    assert found.not_clear_for(AB) == [(0.0, 0.25), (0.75, 1.0)]
    assert found.not_clear_for(CD) == [(0.5, 0.75), (0.75, 1.0)]


def test_work_is_counted():
    found = Timeline(1.0)
    found.count(3, 1)
    found.count(4, 2)
    assert path_verdict(found, 5).counts == {"pairs": 5, "pieces": 7, "poses": 3}


def test_times_beyond_the_end_by_rounding_are_its_end():
    found = timeline((2.0, 3.0 + 1e-12, UNDECIDED), span=3.0)
    assert found.open[0][1] == 1.0


def test_a_doubt_takes_clear_away_and_leaves_contact():
    clear = in_doubt(path_verdict(Timeline(1.0), 1), "the unit is guessed")
    assert (clear.verdict, clear.certified, clear.worst) == ("unknown", False, 0.0)
    assert clear.reason == (
        "the unit is guessed; every instant is proven clear for 1 pairs"
    )
    assert [s.verdict for s in clear.intervals] == ["unknown"]
    touching = path_verdict(timeline((0.5, 1.0, TOUCHED)), 1)
    found = in_doubt(touching, "the unit is guessed")
    assert (found.verdict, found.reason) == ("contact", touching.reason)
    assert [s.verdict for s in found.intervals] == ["unknown", "contact"]


@pytest.mark.parametrize(("start", "end"), [(0.25, 0.5)])
def test_json_names_them_from_and_to(start, end):
    verdict = path_verdict(timeline((start, end, UNDECIDED)), 1)
    assert verdict.intervals[1].to_json() == {
        "from": start,
        "to": end,
        "verdict": "unknown",
    }
