"""How the bounds of the least clearance are narrowed: each step by itself."""

from math import inf
from types import SimpleNamespace

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.motion import least_clearance as module
from borecheck.motion.least_clearance import Tolerance, _Search
from borecheck.motion.problem import Body, PathProblem, path_motion
from tests.chains import slider

TOUCHED = 1.0


def search_of(*gaps, upper=inf, floor=None, tolerance=None, way=None):
    """A search of as many pairs, from whose boxes so much room is known."""
    part = Body("part", box("part", [0.1] * 3), 0)
    walls = tuple(
        Body(f"wall{k}", box(f"wall{k}", [0.1] * 3), T_frame_mesh=transform([9, k, 0]))
        for k in range(len(gaps))
    )
    problem = PathProblem(slider(), (part,), walls)
    motion = path_motion(problem, [[0.0], [1.0], [2.0]] if way is None else way)
    found = _Search(problem, motion, tolerance or Tolerance(), floor)
    found.least = np.array(gaps, dtype=float)
    found.upper = upper
    return found


def watch_distances(monkeypatch, of=lambda k, time: 1.0):
    """The pairs and times that are asked."""
    asked = []

    def distance(self, k, time, cutoff=None):
        asked.append((k, time))
        length = of(k, time)
        if length < self.upper:
            self.upper, self.time, self.nearest = length, time, k
        return length

    monkeypatch.setattr(_Search, "_distance", distance)
    return asked


def test_pairs_that_cannot_be_nearer_are_not_asked(monkeypatch):
    """Those whose boxes are as far as what is known, and what was kept before."""
    asked = watch_distances(monkeypatch, lambda k, time: 9.0)
    gaps = np.array([0.5, 0.3, 0.7, 0.1, 0.2, 0.9])
    monkeypatch.setattr(module, "gaps_of_pairs", lambda *given: gaps)
    found = search_of(0.0, 0.0, 0.0, 0.0, 0.6, 0.0, upper=0.5)
    found._look(1.5)
    assert asked == [(3, 1.5), (1, 1.5)]


def test_a_nearer_distance_ends_the_look_sooner(monkeypatch):
    asked = watch_distances(monkeypatch, lambda k, time: 0.25 + k)
    gaps = np.array([0.0, 0.3, 0.2, 0.4])
    monkeypatch.setattr(module, "gaps_of_pairs", lambda *given: gaps)
    search_of(0.0, 0.0, 0.0, 0.0)._look(1.0)
    assert asked == [(0, 1.0), (2, 1.0)]


@pytest.mark.parametrize("near", [3, 4])
def test_of_few_pairs_no_boxes_are_compared(monkeypatch, near):
    asked = watch_distances(monkeypatch, lambda k, time: 9.0)
    compared = []

    def gaps(problem, placed):
        compared.append(float(placed[0, 0, 3]))
        return np.zeros(6)

    monkeypatch.setattr(module, "gaps_of_pairs", gaps)
    found = search_of(
        *[0.5 - 0.01 * k for k in range(near)], *[1.0] * (5 - near), upper=1.0
    )
    found._look(1.5)
    assert compared == ([] if near == 3 else [1.5])
    order = [k for k, _ in asked]
    assert order == (list(range(near))[::-1] if near == 3 else sorted(order))
    assert len(order) == near


def test_a_distance_is_remembered_if_it_is_the_least(monkeypatch):
    answers = iter([(0.25, 0.5), (0.75, 1.0), (0.5, 0.5)])
    limits = []

    def clearance(self, other, T_a, T_b, tolerance, limit, *, known_apart):
        limits.append(
            (float(T_a[0, 3]), float(T_b[0, 3]), tolerance, limit, known_apart)
        )
        return next(answers)

    from borecheck.geometry.tree.mesh_tree import MeshTree

    monkeypatch.setattr(MeshTree, "clearance", clearance)
    found = search_of(0.125, 0.125, upper=2.0, floor=0.0)
    found.change = np.array([0.0625, 0.25])
    assert found._distance(0, 1.5) == 0.5
    assert (found.upper, found.time, found.nearest) == (0.5, 1.5, 0)
    assert found.least.tolist() == [0.1875, 0.125]
    assert found._distance(1, 2.0, inf) == 1.0
    assert (found.upper, found.time, found.nearest) == (0.5, 1.5, 0)
    assert found.least.tolist() == [0.1875, 0.5]
    found.floor = None
    assert found._distance(1, 0.0) == 0.5  # as near as before: the first stays
    assert (found.time, found.nearest) == (1.5, 0)
    assert found.least.tolist() == [0.1875, 0.5]
    assert limits == [
        (1.5, 9.0, 0.0, 2.0, True),
        (2.0, 9.0, 0.0, inf, True),
        (0.0, 9.0, 0.0, 0.5, False),
    ]


def test_the_nearest_instant_is_followed(monkeypatch):
    """Of |t - 0.7| to 0.62 ** 12 of the stretch, with one look a step."""
    asked = watch_distances(monkeypatch, lambda k, time: abs(time - 0.7))
    found = search_of(0.0)
    found._follow(0, 0.0, 2.0)
    assert len(asked) == 2 + 12
    assert found.time == pytest.approx(0.7, abs=2.0 * 0.62**12)
    assert min(time for _, time in asked) >= 0.0
    later = search_of(0.0)
    monkeypatch.undo()
    asked = watch_distances(monkeypatch, lambda k, time: abs(time - 1.9))
    later._follow(0, 1.0, 2.0)
    assert later.time == pytest.approx(1.9, abs=0.62**12)
    assert len({time for _, time in asked}) == 14


def test_the_longest_stretches_are_looked_into(monkeypatch):
    asked = watch_distances(monkeypatch, lambda k, time: abs(time - 1.35))
    followed = []
    monkeypatch.setattr(_Search, "_follow", lambda self, *given: followed.append(given))
    rows = np.array(
        [
            *([0.0, 0.0625, TOUCHED], [0.125, 0.375, TOUCHED], [0.5, 0.5625, TOUCHED]),
            *([1.0, 1.25, TOUCHED], [1.25, 1.75, TOUCHED], [1.8, 2.0, TOUCHED]),
        ]
    )
    search_of(0.0)._look_into(0, rows)
    looked = [(asked[7 * n][1], asked[7 * n + 6][1]) for n in range(len(asked) // 7)]
    assert looked == [(1.0, 1.75), (0.125, 0.375), (1.8, 2.0), (0.0, 0.0625)]
    assert [time for _, time in asked[:7]] == pytest.approx(np.linspace(1.0, 1.75, 7))
    # around the nearest of the seven, and up to the ends
    assert followed[0] == pytest.approx((0, 1.25, 1.5))
    assert followed[1] == pytest.approx((0, 0.375 - 0.25 / 6, 0.375))
    assert followed[2] == pytest.approx((0, 1.8, 1.8 + 0.2 / 6))


def levels(upper, floor, *tolerance):
    found = search_of(0.0, upper=upper, floor=floor, tolerance=Tolerance(*tolerance))
    return list(found._levels())


def test_levels_are_aimed_at_then_less_is_asked():
    assert levels(1.0, None, 0.05, 1e-4) == pytest.approx([0.96, 0.96, 0.5])
    # the share is less than the length: first the share
    assert levels(1.0, None, 0.05, 0.1) == pytest.approx([0.96, 0.92, 0.5])
    assert levels(1.0, None, 0.0, 0.1) == pytest.approx([0.92, 0.92, 0.5])
    # no level below what is kept already: half the room is left
    assert levels(1.0, 0.98, 0.05, 1e-4) == pytest.approx([0.99] * 3)
    assert levels(1.0, 0.9, 0.05, 1e-4) == pytest.approx([0.96, 0.96, 0.95])
    assert levels(1.0, 1.0, 0.05, 1e-4) == []
    assert levels(0.0, None, 0.05, 1e-4) == []


def kept(monkeypatch, answers, uppers=(), floor=0.125, rounds=50):
    """`_kept` of a pair: the rows told to each level, and the upper bound after."""
    asked, after = [], iter(uppers)
    waiting = iter(answers)

    def nearer(self, k, level):
        asked.append(level)
        return [0] * next(waiting)

    def look(self, k, rows):
        self.upper = next(after, self.upper)

    monkeypatch.setattr(module, "ROUNDS", rounds)
    monkeypatch.setattr(
        _Search, "_levels", lambda self: iter((self.upper - 0.125, 0.25))
    )
    monkeypatch.setattr(_Search, "_nearer_than", nearer)
    monkeypatch.setattr(_Search, "_look_into", look)
    return search_of(0.0, upper=1.0, floor=floor)._kept(0), asked


def test_the_first_level_without_an_objection_is_kept(monkeypatch):
    assert kept(monkeypatch, [0]) == (0.875, [0.875])
    assert kept(monkeypatch, [1, 0]) == (0.25, [0.875, 0.25])


def test_where_no_level_is_reached_what_was_known_stays(monkeypatch):
    assert kept(monkeypatch, [1, 2]) == (0.125, [0.875, 0.25])
    assert kept(monkeypatch, [1, 1], floor=None) == (None, [0.875, 0.25])


def test_a_bound_that_fell_by_a_tenth_is_asked_again(monkeypatch):
    """Of the room between what was known and the level."""
    found = kept(monkeypatch, [1, 0], [0.98])
    assert found == (pytest.approx(0.855), pytest.approx([0.875, 0.855]))
    assert kept(monkeypatch, [1, 0], [0.99]) == (0.25, [0.875, 0.25])
    # at the second level it must fall by a tenth of more
    assert kept(monkeypatch, [1, 1], [0.99, 0.95])[0] == 0.125
    assert kept(monkeypatch, [1, 1, 0], [0.99, 0.75])[0] == 0.625
    assert kept(monkeypatch, [1] * 3, [0.5, 0.25, 0.125], rounds=3) == (
        0.125,
        [0.875, 0.375, 0.125],
    )


def test_how_a_pair_is_asked_for_a_level(monkeypatch):
    asked = []

    def examine(chain, pair, way, motion, *rest):
        asked.append((pair.margin, pair.standing.name, rest[0], rest[1], rest[3]))
        assert rest[2].shape == (0, 2)
        return SimpleNamespace(rows="rows")

    monkeypatch.setattr(module, "examine_pair", examine)
    found = search_of(0.0, 0.5, upper=1.0)
    assert found._nearer_than(1, 0.25).shape == (0, 3)
    assert asked == []
    assert found._nearer_than(1, 0.5) == "rows"
    assert found._nearer_than(0, 1.0 - 1e-6) == "rows"
    assert asked == [
        (0.5, "wall1", 0.01, 4_000, 40),
        (1.0 - 1e-6, "wall0", 1e-6, 4_000, 40),
    ]


def test_where_it_looks_first():
    found = search_of(0.0)
    assert found._first_times([]) == [k / 4 for k in range(9)]
    assert found._first_times([0.3])[2:4] == [0.5, 0.6]
    long = search_of(0.0, way=np.linspace(0.0, 1.0, 101)[:, None])
    times = long._first_times([])
    assert (times[0], times[-1]) == (0.0, 100.0)
    evenly = {k * 12.5 for k in range(9)}
    assert evenly <= set(times)
    at_waypoints = {float(t) for t in np.linspace(0.0, 100.0, 24).round()}
    assert set(times) == evenly | at_waypoints


def test_a_run_looks_half_way_first_and_keeps_the_least_of_all_pairs(monkeypatch):
    asked = watch_distances(monkeypatch, lambda k, time: 0.5 + abs(time - 0.75) + k)
    kept = {0: 0.25, 1: 0.125, 2: 0.375}
    order = []
    monkeypatch.setattr(_Search, "_kept", lambda self, k: order.append(k) or kept[k])
    monkeypatch.setattr(_Search, "_result", lambda self, lower: lower)
    followed = []
    monkeypatch.setattr(_Search, "_follow", lambda self, *given: followed.append(given))
    found = search_of(0.0, 0.0, 0.0)
    found.least = np.array([0.2, 0.1, 0.3])
    assert found.run([]) == 0.125
    assert asked[0][1] == 1.0
    assert followed == [(0, 0.5, 1.0)]
    assert order == [1, 0, 2]
    kept[0] = None
    again = search_of(0.0, 0.0, 0.0)
    assert again.run([]) is None


@pytest.mark.parametrize(("at", "stretch"), [(0.0, (0.0, 0.25)), (2.0, (1.75, 2.0))])
def test_at_an_end_it_follows_from_there(monkeypatch, at, stretch):
    watch_distances(monkeypatch, lambda k, time: 0.5 + abs(time - at))
    monkeypatch.setattr(_Search, "_kept", lambda self, k: 0.25)
    monkeypatch.setattr(_Search, "_result", lambda self, lower: lower)
    followed = []
    monkeypatch.setattr(_Search, "_follow", lambda self, *given: followed.append(given))
    assert search_of(0.0).run([]) == 0.25
    assert followed == [(0, *stretch)]


def test_a_distance_of_nothing_leaves_no_clearance(monkeypatch):
    monkeypatch.setattr(_Search, "_kept", lambda self, k: 0.0)
    monkeypatch.setattr(_Search, "_result", lambda self, lower: "a result")
    for length, expected in ((0.0, None), (1.0, "a result"), (1e-9, "a result")):
        watch_distances(monkeypatch, lambda k, time, length=length: length)
        assert search_of(0.0).run([]) == expected


def test_the_result_names_pair_and_instant_and_allows_for_round_shapes(monkeypatch):
    found = search_of(0.0, 0.0, upper=0.5, tolerance=Tolerance(0.25, 0.0))
    found.time, found.nearest = 1.5, 1
    part, wall = found.pairs[1].moving, found.pairs[1].standing
    assert (part.mesh.excess, wall.mesh.excess) == (0.0, 0.0)
    result = found._result(0.375)
    assert (result.lower, result.upper, result.at) == (0.375, 0.5, 0.75)
    assert (result.pair, result.names) == ((0, 1), ("part", "wall1"))
    assert result.within_tolerance
    assert result.closest.lower == pytest.approx(np.hypot(9 - 1.5 - 0.1, 0.9))
    assert not found._result(0.374).within_tolerance
    assert found._result(0.75).lower == 0.5
    for mesh, excess in ((part.mesh, 0.125), (wall.mesh, 0.0625)):
        object.__setattr__(mesh, "excess", excess)
    assert found._result(0.375).upper == 0.6875
    assert Tolerance(0.25, 0.1).allowed(1.0) == 0.25
    assert Tolerance(0.25, 0.1).allowed(0.2) == 0.1


def said(verdict, certified=False):
    return SimpleNamespace(verdict=verdict, certified=certified)


def asked_of(monkeypatch, verdict, margin, again="unknown", tolerance=None):
    """What a search is made of, or None; and what was searched before."""
    searches = []

    def search(problem, waypoints):
        searches.append((problem.margin, waypoints))
        return said(again)

    def made(problem, motion, tolerance, floor):
        parts = (problem.margin, motion.span, tolerance, floor)
        return SimpleNamespace(run=lambda instants: (*parts, instants))

    problem = PathProblem(slider(), (), (), margin=margin)
    monkeypatch.setattr(module, "search", search)
    monkeypatch.setattr(module, "_Search", made)
    monkeypatch.setattr(
        module, "path_motion", lambda problem, points: SimpleNamespace(span=points)
    )
    found = module.least_clearance(problem, "points", verdict, tolerance, (0.5,))
    return found, searches


def test_what_was_kept_already_is_more_than_the_margin(monkeypatch):
    mine = Tolerance(0.5, 0.25)
    found, searches = asked_of(monkeypatch, said("clear", True), 0.25, tolerance=mine)
    assert found == (0.25, "points", mine, np.nextafter(0.25, 1.0), (0.5,))
    assert searches == []
    for verdict in (said("unknown"), said("clear")):
        found, searches = asked_of(monkeypatch, verdict, 0.25)
        assert found == (0.25, "points", Tolerance(0.05, 1e-4), None, (0.5,))
        assert searches == []


def test_in_contact_the_motion_is_asked_again_without_its_margin(monkeypatch):
    found, searches = asked_of(monkeypatch, said("contact"), 0.25)
    assert searches == [(0.0, "points")]
    assert (found[0], found[3]) == (0.0, None)
    found, searches = asked_of(monkeypatch, said("contact"), 0.25, again="contact")
    assert (found, searches) == (None, [(0.0, "points")])
    assert asked_of(monkeypatch, said("contact"), 0.0) == (None, [])


def test_what_boxes_say_of_obstacles_is_where_a_search_begins(monkeypatch):
    rooms = SimpleNamespace(
        least=np.array([0.5, 0.25, 9.0]), moved=np.array([0.125, 1.0, 9.0])
    )
    monkeypatch.setattr(module, "rooms_of_pairs", lambda *given: rooms)
    parts = (Body("part", box("part", [0.1] * 3), 0),)
    wall = Body("wall", box("wall", [0.1] * 3), T_frame_mesh=transform([9, 0, 0]))
    problem = PathProblem(slider(), parts, (wall, wall), ((0, 0),))
    motion = path_motion(problem, [[0.0], [1.0], [2.0]])
    found = _Search(problem, motion, Tolerance(), None)
    assert len(found.pairs) == 2
    assert found.least.tolist() == [0.5, 0.25]
    assert found.change.tolist() == [0.25, 2.0]
    assert (found.span, found.upper, found.time, found.nearest) == (2.0, inf, 0.0, -1)
    assert (
        _Search(PathProblem(slider(), parts, ()), motion, Tolerance(), None).run([])
        is None
    )
