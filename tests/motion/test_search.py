"""How the search of a motion is put together: which pair is asked what, and counted."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.errors import UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.motion import halving
from borecheck.motion import search as module
from borecheck.motion.halving import TOUCHED, UNDECIDED
from borecheck.motion.outcome import PathVerdict, Stretch, Timeline
from borecheck.motion.problem import Body, PathProblem, path_motion
from borecheck.motion.search import Examined, examine_pair, joined, search
from tests.chains import hinge, slider

AB = ("a", "b")


def problem(*places, **more):
    """A cube of 0.1 m on a slider along x, and others that stand on its way."""
    part = Body("part", box("part", [0.1] * 3), 0)
    walls = tuple(
        Body(f"wall{k}", box(f"wall{k}", [0.1] * 3), T_frame_mesh=transform([x, 0, 0]))
        for k, x in enumerate(places)
    )
    return PathProblem(slider(), (part,), walls, **more)


@pytest.mark.parametrize("wrong", [0.0, -1e-6, np.inf, np.nan])
def test_a_resolution_that_is_no_length_is_refused(wrong):
    with pytest.raises(UsageError, match="not a distance"):
        search(problem(0.5), [[0.0], [1.0]], resolution=wrong)


def watched(monkeypatch, least):
    """What is asked of pairs of which boxes say that they stay so far apart."""
    asked = []

    def rooms(found, motion):
        asked.append("rooms")
        return SimpleNamespace(least=np.array(least))

    def examine(chain, pair, way, motion, resolution, piece_limit, timeline):
        asked.append(("surfaces", pair.standing.name, resolution, piece_limit))

    def inside(chain, pair, way, motion, timeline):
        asked.append(("solids", pair.standing.name))

    monkeypatch.setattr(module, "rooms_of_pairs", rooms)
    monkeypatch.setattr(module, "_examine", examine)
    monkeypatch.setattr(module, "examine_containment", inside)
    return asked


def test_what_boxes_show_is_not_asked_again(monkeypatch):
    """More than the margin: no surfaces. Any room at all: no solids."""
    least = [0.03, 0.02, 0.01, 0.0, -0.1]
    asked = watched(monkeypatch, least)
    walls = problem(1.0, 2.0, 3.0, 4.0, 5.0, margin=0.02)
    verdict = search(walls, [[0.0], [0.1]], resolution=0.25, piece_limit=7)
    assert asked == [
        "rooms",
        *(("surfaces", f"wall{k}", 0.25, 7) for k in (1, 2, 3, 4)),
        *(("solids", f"wall{k}") for k in (3, 4)),
    ]
    assert verdict.counts == {"pairs": 5, "pieces": 1, "poses": 0}


def test_without_boxes_every_pair_is_asked_everything(monkeypatch):
    asked = watched(monkeypatch, [])
    verdict = search(problem(1.0, 2.0), [[0.0], [0.1]], broadphase=False)
    assert [row[:2] for row in asked] == [
        *(("surfaces", "wall0"), ("surfaces", "wall1")),
        *(("solids", "wall0"), ("solids", "wall1")),
    ]
    assert asked[0][2:] == (1e-6, 20_000)
    assert verdict.counts["pieces"] == 0


def test_passages_are_examined_and_counted_with_the_pairs(monkeypatch):
    asked = watched(monkeypatch, [])
    seen = []
    monkeypatch.setattr(module, "examine_passage", lambda *given: seen.append(given))
    monkeypatch.setattr(module, "not_beside", lambda *given: [("rows", given[-1])])
    walls = problem(1.0, 0.0, margin=0.25)
    passage = SimpleNamespace(part=0, obstacle=1, corridor="corridor")
    walls = replace(walls, passages=(passage,))
    verdict = search(walls, [[0.0], [0.1]], broadphase=False)
    ((chain, needle, patient, corridor, _, timeline, stretches, margin),) = seen
    ((_, rows),) = stretches
    # the wall is where the needle is
    assert joined(rows) == [(0.0, 1.0, halving.TOUCHED)]
    assert margin == 0.25
    assert chain is walls.chain
    assert (needle, patient) == (walls.parts[0], walls.obstacles[1])
    assert corridor == "corridor"
    assert isinstance(timeline, Timeline)
    assert verdict.counts["pairs"] == 2
    assert [row[1] for row in asked] == ["wall0", "wall0"]


def test_a_doubt_holds_back_what_is_clear():
    verdict = search(problem(5.0, doubt="the unit is guessed"), [[0.0], [0.1]])
    assert (verdict.verdict, verdict.certified) == ("unknown", False)
    assert verdict.reason.startswith("the unit is guessed; ")


def test_round_shapes_are_asked_with_the_same_limits(monkeypatch):
    """The polyhedra within, only in contact, with everything that was asked for."""
    walls, shapes = problem(0.5), problem(5.0)
    kept = []
    real = module.search

    def inner(*given, **more):
        kept.append((given, more))
        return real(*given, **more)

    monkeypatch.setattr(module, "search", inner)
    monkeypatch.setattr(
        PathProblem, "within", property(lambda p: shapes if p is walls else None)
    )
    limits = {"resolution": 2e-6, "piece_limit": 500, "broadphase": False}
    way = [[0.0], [1.0]]
    verdict = real(walls, way, **limits)
    assert kept == [((shapes, way), limits)]
    assert verdict.verdict == "unknown"
    del kept[:]
    assert real(walls, [[0.0], [0.1]], **limits).verdict == "clear"
    assert kept == []


def pair_of(walls, waypoints):
    (pair,), (way,) = walls.pairs, walls.routes
    return walls.chain, pair, way, path_motion(walls, waypoints)


def quick(monkeypatch, rows, looked, judged):
    asked = []

    def boxes(chain, pair, way, motion, resolution, limit, settled):
        asked.append((resolution, limit, settled))
        return np.array(rows, dtype=float).reshape(-1, 3), looked, judged

    monkeypatch.setattr(module, "_by_boxes_and_planes", boxes)
    return asked


def slow(monkeypatch, further):
    asked = []

    def distances(chain, pair, way, motion, rows, resolution, limit):
        asked.append((rows.tolist(), resolution, limit))
        return np.array([[0.0, 0.5, TOUCHED]]), further

    monkeypatch.setattr(module, "_examined_by_distance", distances)
    return asked


OPEN, TOUCH = [0.0, 1.0, UNDECIDED], [0.0, 1.0, TOUCHED]


@pytest.mark.parametrize("rows", [[], [TOUCH], [OPEN, TOUCH]])
def test_what_boxes_and_planes_decide_is_kept(monkeypatch, rows):
    quick(monkeypatch, rows, 1000, 3)
    asked = slow(monkeypatch, 5)
    found = examine_pair(None, None, None, None, 1e-6, 20_000, "settled")
    assert (found.pieces, found.poses, found.gave_up) == (1000, 3, False)
    assert found.rows.tolist() == rows
    assert asked == []


@pytest.mark.parametrize(
    ("rows", "looked"), [([OPEN], 4), ([OPEN, OPEN], 1000), ([TOUCH], 1001), ([], 1001)]
)
@pytest.mark.parametrize("further", [7, 20_000, 20_001])
def test_what_they_leave_is_asked_by_distance(monkeypatch, rows, looked, further):
    quick(monkeypatch, rows, looked, 3)
    asked = slow(monkeypatch, further)
    found = examine_pair(None, None, None, None, 1e-6, 20_000, "settled")
    assert asked == [(rows, 1e-6, 20_000)]
    assert found.rows.tolist() == [[0.0, 0.5, TOUCHED]]
    assert (found.pieces, found.poses) == (looked + further, 3 + further)
    assert found.gave_up == (further > 20_000)


def test_boxes_and_planes_get_their_share_of_the_pieces(monkeypatch):
    asked = quick(monkeypatch, [], 1, 0)
    for limit, share, expected in (
        (20_000, None, 1_000),
        (20_000, 40, 40),
        (20_000, 0, 0),
        (30, None, 30),
        (30, 40, 30),
    ):
        examine_pair(None, None, None, None, 1e-6, limit, "settled", share)
        assert asked[-1] == (1e-6, expected, "settled")


def examined(monkeypatch, rows, gave_up=False):
    """A timeline to which `_examine` added what was found."""
    pair, timeline = SimpleNamespace(names=AB), Timeline(2.0)
    timeline.add_contained(("c", "d"), "held", 0.5, 0.75)

    def found(chain, of, way, motion, resolution, piece_limit, settled):
        assert (of, resolution, piece_limit) == (pair, 1e-6, 9)
        np.testing.assert_array_equal(settled, [[1.0, 1.5]])
        table = np.array(rows, dtype=float).reshape(-1, 3)
        return Examined(table, 7, 3, gave_up)

    monkeypatch.setattr(module, "examine_pair", found)
    module._examine(None, pair, None, None, 1e-6, 9, timeline)
    return timeline


def test_what_is_found_of_a_pair_stands_on_the_timeline(monkeypatch):
    timeline = examined(monkeypatch, [[0.0, 0.5, UNDECIDED]])
    assert (timeline.pieces, timeline.poses) == (7, 3)
    assert timeline.open[1:] == [(0.0, 0.25, UNDECIDED, AB)]
    assert timeline.notes == {}
    told = examined(monkeypatch, [], gave_up=True)
    assert told.notes == {AB: "gave up after 7 pieces"}
    assert len(told.open) == 1


def test_only_what_is_undecided_is_asked_by_distance_within_one_limit(monkeypatch):
    asked = []

    def distances(chain, pair, way, motion, stretch, lengths, limit):
        asked.append((stretch, lengths, limit))
        return [(stretch[0], stretch[1], TOUCHED)], 6

    monkeypatch.setattr(module, "by_distance", distances)
    findings = np.array(
        [
            *([0.0, 0.25, UNDECIDED], [0.25, 0.5, UNDECIDED], [0.5, 0.75, TOUCHED]),
            *([1.0, 1.5, UNDECIDED], [1.75, 2.0, UNDECIDED]),
        ]
    )
    rows, looked = module._examined_by_distance(
        None, None, None, None, findings, 1e-6, 8
    )
    lengths = (1e-6, 2e-3)
    assert asked == [
        ((0.0, 0.5), lengths, 8),
        ((1.0, 1.5), lengths, 2),
        ((1.75, 2.0), lengths, 0),
    ]
    assert looked == 18
    ends = [(0.0, 0.5), (0.5, 0.75), (1.0, 1.5), (1.75, 2.0)]
    assert rows.tolist() == [[*end, TOUCHED] for end in ends]
    none, looked = module._examined_by_distance(
        None, None, None, None, np.zeros((0, 3)), 1e-6, 8
    )
    assert (none.shape, looked) == ((0, 3), 0)


def test_neighbours_of_equal_outcome_are_one_and_no_others():
    rows = [(0, 1, 1), (1, 2, 1), (2, 3, 2), (3, 4, 2), (5, 6, 2), (6, 7, 1)]
    assert joined(np.array(rows, dtype=float)) == [
        *((0.0, 2.0, 1.0), (2.0, 4.0, 2.0), (5.0, 6.0, 2.0), (6.0, 7.0, 1.0))
    ]
    assert joined(np.zeros((0, 3))) == []


def test_where_no_number_lies_between_nothing_is_halved():
    """A hinge so fast that it turns far between two numbers, always in contact."""
    bar = Body("bar", box("bar", [1.0, 0.1, 0.1]), 0)
    hub = Body("hub", box("hub", [0.3] * 3))
    turning = PathProblem(hinge(), (bar,), (hub,))
    chain, pair, way, motion = pair_of(turning, [[0.0], [1e14]])
    last = 1.0 - 2.0**-50  # what comes before is said to be settled
    rows, looked, judged = module._by_boxes_and_planes(
        chain, pair, way, motion, 1e-6, 1000, np.array([[0.0, last]])
    )
    assert looked < 100
    assert judged <= 16
    assert (rows[:, 2] == TOUCHED).all()
    assert (rows[0, 0], rows[-1, 1]) == (last, 1.0)
    np.testing.assert_array_equal(rows[1:, 0], rows[:-1, 1])
    assert len(rows) == 8  # one for every number


def test_what_moves_less_than_the_resolution_is_not_halved():
    """A cube that passes through another: its edges are found in parts of 1/16 m."""
    chain, pair, way, motion = pair_of(problem(0.5), [[0.0], [1.0]])
    rows, looked, _ = module._by_boxes_and_planes(
        chain, pair, way, motion, 0.1, 1000, np.zeros((0, 2))
    )
    assert looked <= 31  # of a tree with 16 leaves
    lengths = rows[:, 1] - rows[:, 0]
    assert lengths.min() == 1.0 / 16.0
    assert rows[0, 0] <= 0.4 <= 0.6 <= rows[-1, 1]


def test_what_is_settled_is_not_looked_at():
    is_settled = halving._is_settled.py_func
    settled = np.array([[0.0, 1.0], [2.0, 5.0]])
    for start, end in ((0.0, 1.0), (0.25, 0.5), (2.0, 5.0), (3.0, 5.0), (2.0, 4.0)):
        assert is_settled(settled, start, end)
    for start, end in ((0.0, 1.5), (1.0, 2.0), (1.5, 3.0), (4.0, 6.0), (0.5, 3.0)):
        assert not is_settled(settled, start, end)
    assert not is_settled(settled[:0], 0.0, 1.0)


def pieces_of(first, last, node, begin, end, touches):
    """The halves of one waiting piece: rows (first, last, node, budget) and so on."""
    pieces = np.zeros((3, 4), np.int64)
    fractions, at = np.zeros((3, 2)), np.zeros((3, 2), np.int8)
    pieces[1] = first, last, node, 64
    fractions[1], at[1] = (begin, end), touches
    halving._halve.py_func(pieces, fractions, at, 1)
    assert not pieces[0].any()
    return [(pieces[k].tolist(), fractions[k].tolist(), at[k].tolist()) for k in (2, 1)]


def test_a_run_is_halved_at_a_waypoint_and_a_step_in_its_middle():
    assert pieces_of(3, 8, 5, 0.0, 1.0, (0, 1)) == [
        ([3, 5, 10, 128], [0.0, 1.0], [0, -1]),
        ([5, 8, 11, 128], [0.0, 1.0], [-1, 1]),
    ]
    assert pieces_of(3, 4, 5, 0.25, 0.75, (1, 0)) == [
        ([3, 4, 10, 128], [0.25, 0.5], [1, -1]),
        ([3, 4, 11, 128], [0.5, 0.75], [-1, 0]),
    ]


def test_the_path_verdict_is_of_this_search():
    verdict = search(problem(0.5), [[0.0], [1.0]])
    assert isinstance(verdict, PathVerdict)
    assert [s.verdict for s in verdict.intervals] == ["clear", "contact", "clear"]
    assert isinstance(verdict.intervals[0], Stretch)
    edges = [s.start for s in verdict.intervals]
    assert edges == pytest.approx([0.0, 0.4, 0.6], abs=2e-3)
