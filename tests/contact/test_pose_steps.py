"""What a check asks of a pose, and in which order: with what it asks watched."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from borecheck.contact import check as module
from borecheck.contact import compare as comparing
from borecheck.contact import pose_kernel as kernel
from borecheck.contact.checked import _telling_arguments
from borecheck.contact.decision import Findings
from borecheck.contact.pose_batch import PoseBatch
from borecheck.contact.settings import settings
from borecheck.contact.skipped import pairs_without
from borecheck.contact.verdict import Answer, Containment, TrianglePair
from borecheck.errors import UnknownNameError, UsageError
from borecheck.geometry.tree.addresses import PAIR_COUNT

TOUCH = TrianglePair("a", "b", 0, 0)


def held(name, state="a_in_b"):
    return Containment(name, "b", "scanner", state, "")


class Together:
    """Compiled answers: that they were asked, with what."""

    def __init__(self):
        self.asked = []

    def held_around(self, *, unseen):
        self.asked.append(("around", unseen))
        return [held("quick around")]

    def held_within(self, *, unseen):
        self.asked.append(("within", unseen))
        return [held("quick within")]

    def closest(self):
        return "quick closest"

    def examine(self, checker, around, within):
        self.asked.append((checker, around, within))


def pose_of(monkeypatch, *, quick=True, around=(), within=(), **chosen):
    """A pose with contacts already found, its answers made up."""
    slow = []

    def of_obstacles(robot, scene, placements, punctured):
        slow.append((robot, scene, placements, punctured))
        return [held("slow around")]

    def of_itself(robot, placements):
        slow.append((robot, placements))
        return [held("slow within")]

    monkeypatch.setattr(module.containment, "of_obstacles", of_obstacles)
    monkeypatch.setattr(module.containment, "of_itself", of_itself)
    asked = settings(**chosen)
    if not quick:
        asked = replace(asked, pair_by_pair=True)
    known = [held("known")]
    pose = module._Pose(
        *("robot", "scene", np.zeros(1), asked, None, "placed"),
        Findings(list(around), list(known), punctured={("n", "p")}),
        Findings(list(within), list(known)),
    )
    pose.__dict__["together"] = Together()
    return pose, slow


def names(findings):
    return [c.link for c in findings.contained]


@pytest.mark.parametrize("around", [(), (TOUCH,)])
@pytest.mark.parametrize("within", [(), (TOUCH,)])
def test_solids_are_asked_only_of_surfaces_that_do_not_meet(
    monkeypatch, around, within
):
    """What is known already stays; the two questions are asked apart."""
    pose, slow = pose_of(monkeypatch, around=around, within=within)
    pose.look_inside()
    assert names(pose.around) == ["known", *([] if around else ["quick around"])]
    assert names(pose.within) == ["known", *([] if within else ["quick within"])]
    asked = [*([] if around else ["around"]), *([] if within else ["within"])]
    assert pose.together.asked == [(name, False) for name in asked]
    assert slow == []
    pose, slow = pose_of(monkeypatch, quick=False, around=around, within=within)
    pose.look_inside()
    assert names(pose.around) == ["known", *([] if around else ["slow around"])]
    assert names(pose.within) == ["known", *([] if within else ["slow within"])]
    assert pose.together.asked == []
    rows = [("robot", "scene", "placed", {("n", "p")}), ("robot", "placed")]
    assert slow == [r for r, met in zip(rows, (around, within), strict=True) if not met]


@pytest.mark.parametrize("checker", ["exact", "two-sided", "paper:robot"])
def test_a_checker_with_blind_spots_may_leave_surfaces_unseen(monkeypatch, checker):
    pose, _ = pose_of(monkeypatch, checker=checker)
    pose.look_inside()
    unseen = checker != "exact"
    assert pose.together.asked == [("around", unseen), ("within", unseen)]


def test_surfaces_are_asked_by_one_road(monkeypatch):
    slow = []
    monkeypatch.setattr(module, "examine_obstacles", lambda *given: slow.append(given))
    monkeypatch.setattr(module, "examine_itself", lambda *given: slow.append(given))
    pose, _ = pose_of(monkeypatch)
    chosen = settings("two-sided")
    pose.examine(chosen)
    assert pose.together.asked == [("two-sided", pose.around, pose.within)]
    assert slow == []
    chosen = settings(pruning="none")
    pose.examine(chosen)
    assert slow == [
        ("robot", "scene", "placed", chosen, None, pose.around),
        ("robot", "placed", chosen, pose.within),
    ]
    assert len(pose.together.asked) == 1


@pytest.mark.parametrize("touching", [False, True])
@pytest.mark.parametrize("links", [False, True])
@pytest.mark.parametrize("quick", [False, True])
def test_nearest_points_are_measured_where_nothing_touches_or_links_are_asked(
    monkeypatch, touching, links, quick
):
    kept = []

    def measured(*given, every_link):
        kept.append((given, every_link))
        return "slow closest", {"a": 1.0}

    monkeypatch.setattr(module.clearance, "to_obstacles", measured)
    around = (TOUCH,) if touching else ()
    pose, _ = pose_of(monkeypatch, quick=quick, around=around, within=(TOUCH,))
    asked = replace(pose.chosen, link_clearance=links)
    pose = replace(pose, chosen=asked)
    pose.__dict__["together"] = Together()
    answer = pose.measure()
    if touching and not links:
        assert answer == (None, None)
    elif quick and not links:
        assert answer == ("quick closest", None)
    else:
        assert answer == ("slow closest", {"a": 1.0})
        assert kept == [(("robot", "scene", "placed", None), links)]


def test_clear_stays_so_only_if_exact_sees_nothing():
    clear = Answer("clear", "nothing near", ("q",))
    assert module._unless(clear, [], "coal") is clear
    doubt = module._unless(clear, [("a", "b"), ("c", "d")], "coal")
    assert (doubt.verdict, doubt.qualifiers) == ("unknown", ("q",))
    assert doubt.reason.startswith("coal sees no contact, but exact sees a meet b;")
    for said in ("contact", "unknown"):
        other = Answer(said, "so")
        assert module._unless(other, [("a", "b")], "coal") is other


def test_a_part_that_is_held_has_no_clearance():
    findings = Findings(contained=[held("a"), held("c", "unknown")])
    assert module._without_held(None, findings) is None
    known = {"a": 1.0, "c": 2.0}
    assert module._without_held(known, findings) == {"a": 0.0, "c": 2.0}
    assert module._clearance(None, None) is None
    assert module._clearance(None, {}) is None
    assert module._clearance(None, {"a": 2.0, "b": 1.0}) == 1.0
    assert module._clearance(SimpleNamespace(distance=0.5), {"a": 0.25}) == 0.5


def test_arguments_that_are_not_as_usual_are_told_and_the_mount_always():
    usual = {
        name: SimpleNamespace(default=value)
        for name, value in {"mount": "+90", "hand": "none", "tool": "a"}.items()
    }
    given = {"mount": "+90", "hand": "none", "tool": "b"}
    described = SimpleNamespace(arguments=usual)
    robot = SimpleNamespace(description=described, arguments=given)
    assert _telling_arguments(robot) == {"mount": "+90", "tool": "b"}
    plain = SimpleNamespace(description=None, arguments=given)
    assert _telling_arguments(plain) == given


def body(link, name=None):
    return SimpleNamespace(link=link, mesh=SimpleNamespace(name=name or link))


ROBOT = SimpleNamespace(
    parts=[body("a"), body("b", "b 1"), body("b", "b 2")],
    self_pairs=((0, 1), (0, 2)),
)
SCENE = SimpleNamespace(obstacles=[SimpleNamespace(name=n) for n in ("wall", "bed")])
EVERY = [[i, j] for i in range(3) for j in range(2)]
AMONG = [[0, 1], [0, 2]]


@pytest.mark.parametrize(
    ("skip", "against", "among"),
    [
        ((), [], []),
        ([("a", "wall")], [[0, 0]], []),
        ([("bed", "a")], [[0, 1]], []),
        ([("b", "wall")], [[1, 0], [2, 0]], []),
        ([("b 2", "wall")], [[2, 0]], []),
        ([("b", "a")], [], [[0, 1], [0, 2]]),
        ([("a", "b 1")], [], [[0, 1]]),
        ([("b 1", "a"), ("a", "wall")], [[0, 0]], [[0, 1]]),
        ([("b", "wall"), ("bed", "b 1")], [[1, 0], [2, 0], [1, 1]], []),
    ],
)
def test_pairs_are_left_out_by_link_or_part_in_either_order(skip, against, among):
    left, own = pairs_without(ROBOT, SCENE, skip, True)
    assert left.tolist() == [pair for pair in EVERY if pair not in against]
    assert own.tolist() == [pair for pair in AMONG if pair not in among]
    again, none = pairs_without(ROBOT, SCENE, skip, False)
    assert again.tolist() == left.tolist()
    assert none.shape == (0, 2)


def test_of_no_pair_at_all_the_table_is_empty():
    bare = SimpleNamespace(obstacles=[])
    left, _ = pairs_without(ROBOT, bare, (), True)
    assert left.shape == (0, 2)
    alone = SimpleNamespace(parts=[body("a")], self_pairs=())
    assert pairs_without(alone, SCENE, (), True)[1].shape == (0, 2)


@pytest.mark.parametrize(
    ("skip", "error", "words"),
    [
        (["ab"], UsageError, "not a pair"),
        ([("a",)], UsageError, "not a pair"),
        ([("a", "b", "wall")], UsageError, "not a pair"),
        ([("a", "nobody")], UnknownNameError, "nobody"),
        ([("nobody", "a")], UnknownNameError, "nobody"),
        ([("a", "b"), ("wall", "bed")], UsageError, "two obstacles"),
        ([("wall", "wall")], UsageError, "two obstacles"),
    ],
)
def test_what_is_no_pair_that_is_there_is_refused(skip, error, words):
    with pytest.raises(error, match=words):
        pairs_without(ROBOT, SCENE, skip, True)


def compared(monkeypatch, found, *, links=None, checkers=("exact", "coal")):
    """A pose of one pair of surfaces of which checkers find what is told."""
    pair = SimpleNamespace(links=links, names=("a", "b"))
    gathered = comparing.Gathered(checkers)
    answers = {
        name: SimpleNamespace(pairs=np.zeros((count, 2), int))
        for name, count in found.items()
    }
    monkeypatch.setattr(comparing, "placed_pairs", lambda *given: [pair])
    monkeypatch.setattr(comparing, "_asked", lambda *given: answers)
    monkeypatch.setattr(comparing, "_contained", lambda pair: ["held"])
    monkeypatch.setattr(comparing, "_differences", lambda *given: [given[0]])
    robot = SimpleNamespace(placements=lambda q: {})
    comparing._compare_pose(robot, None, None, "bvh", gathered)
    return gathered


@pytest.mark.parametrize("links", [None, ("a", "b")])
def test_what_a_pose_is_to_every_checker(monkeypatch, links):
    gathered = compared(monkeypatch, {"exact": 1, "coal": 0}, links=links)
    assert gathered.pose_verdicts == [{"exact": True, "coal": False}]
    assert gathered.pose_obstacles == [{"exact": links is None, "coal": False}]
    assert gathered.touching_itself == (set() if links is None else {links})
    assert gathered.contained == [()]
    assert gathered.disagreements == [0]
    gathered = compared(monkeypatch, {"exact": 0, "coal": 2}, links=links)
    assert gathered.pose_verdicts == [{"exact": False, "coal": True}]
    assert gathered.contained == [("held",)]
    assert gathered.touching_itself == set()


def test_progress_is_told_after_every_pose(monkeypatch):
    told = []
    monkeypatch.setattr(comparing, "_warm_up", lambda names: None)
    monkeypatch.setattr(comparing, "_poses", lambda robot, qs: np.zeros((3, 1)))

    def close(robot, scene, q, pruning, gathered):
        gathered.close_pose({"exact": False}, {"exact": False}, [])

    monkeypatch.setattr(comparing, "_compare_pose", close)
    monkeypatch.setattr(comparing, "refuse_others", lambda *given: None)
    robot = SimpleNamespace(model=SimpleNamespace(joint_names=("q",)))
    found = comparing.compare(
        robot, None, None, checkers=[], progress=lambda *given: told.append(given)
    )
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert found.poses == ((0.0,),) * 3
    assert not found.interrupted


ANSWERS_PARTS = (("hand 1", "hand"), ("hand 2", "hand"), ("arm", "arm"))


def test_answers_name_links_once_whatever_of_their_parts_touch(monkeypatch):
    """Of the robot itself as of obstacles, which may be called like a part."""
    around = Answer("contact", "", (), (("hand 2", "wall"), ("arm", "hand 1")))
    itself = Answer("contact", "", (), (("hand 2", "arm"), ("hand 1", "arm")))
    monkeypatch.setattr(module, "about_obstacles", lambda *given: around)
    monkeypatch.setattr(module, "about_itself", lambda *given: itself)
    parts = [
        SimpleNamespace(mesh=SimpleNamespace(name=name), link=link)
        for name, link in ANSWERS_PARTS
    ]
    pose = SimpleNamespace(
        robot=SimpleNamespace(parts=parts, unexamined=(), self_pairs=()),
        chosen=SimpleNamespace(checker="exact", margin=None),
        scene=SimpleNamespace(doubt=None),
        around=None,
        within=None,
    )
    obstacles, own = module._answers(pose, None)
    assert obstacles.pairs == (("arm", "hand 1"), ("hand", "wall"))
    assert own.pairs == (("hand", "arm"),)


def asked_poses(monkeypatch, hits, corners):
    """`ask_poses` of poses with these first pairs; which solids it asked about."""
    count = len(hits)
    names = ("parent", "kind", "source", "factor", "offset", "parts", "frames")
    joints = SimpleNamespace(**{name: np.arange(2) for name in names})
    pairs = {12: SimpleNamespace(book={PAIR_COUNT: 7}, standing="standing"), 14: "own"}
    monkeypatch.setattr(kernel, "_open_chain", lambda book: (None, joints))
    monkeypatch.setattr(kernel, "_open_pairs", lambda book, k: pairs[k])
    monkeypatch.setattr(kernel, "_open_solid", lambda book, k: k)
    monkeypatch.setattr(kernel, "place_many", lambda *given: None)
    monkeypatch.setattr(kernel, "_is_within", lambda qs, i, limits: hits[i] != "beyond")
    monkeypatch.setattr(kernel, "_first_pair", lambda a, b, placed, i, code: hits[i])
    asked = []

    def ask_solids(of, links, others, placed, standing, moving, *rest):
        known, settled, row = rest[0], rest[1], rest[2]
        own = standing is placed
        asked.append((of is pairs[12], links, others, own, moving, known, row))
        assert settled.tolist() == [hit != kernel.NO_PAIR for hit in hits]
        return of == "own"

    monkeypatch.setattr(kernel, "_ask_solids", ask_solids)
    states, which = np.full(count, 9, np.int8), np.full(count, 9)
    told = kernel.ask_poses.py_func(
        None, np.zeros((count, 2)), 0, corners, states, which
    )
    return told, asked, states.tolist(), which.tolist()


def test_poses_are_asked_in_turn_and_solids_where_nothing_touches(monkeypatch):
    free, touches = kernel.FREE, kernel.TOUCHES
    hits = [kernel.NO_PAIR, 3, "beyond", kernel.NO_PAIR]
    told, asked, states, which = asked_poses(monkeypatch, hits, 0)
    assert told == (-1, False, 0, 1)
    assert asked == []
    assert states == [free, touches, kernel.BEYOND_LIMITS, free]
    assert which == [kernel.NO_PAIR, 3, kernel.NO_PAIR, kernel.NO_PAIR]
    told, asked, *_ = asked_poses(monkeypatch, hits, 2)
    assert told == (-1, True, 0, 1)
    assert asked == [
        (True, 16, 20, False, False, 2, 0),
        (False, 16, 16, True, True, 2, 7),
    ]


def test_a_pose_that_is_not_rigid_is_told_at_once(monkeypatch):
    hits = ["beyond", kernel._NOT_RIGID, kernel.NO_PAIR]
    told, asked, states, _ = asked_poses(monkeypatch, hits, 2)
    assert told == (1, False, 0, 0)
    assert (asked, states[2]) == ([], 9)


def test_what_is_opened_is_what_was_laid_out(monkeypatch, zerobot, ct_gantry):
    """Every array of a book, with its own shape; memory that is read is the array's."""
    laid = PoseBatch(zerobot, ct_gantry)._book
    arrays = [array for group in laid._groups for array in group]

    def opened(at, shape, kind):
        """The array at an address; of those without an entry any of that shape."""
        found = [
            array
            for array, place in zip(arrays, laid.entries[::2], strict=True)
            if place == at and array.shape == shape and array.dtype == kind
        ]
        assert found, f"nothing of shape {shape} lies there"
        return found[0]

    monkeypatch.setattr(kernel, "array_at", lambda at: at)
    monkeypatch.setattr(kernel, "carray", opened)
    for name in ("_integers", "_numbers"):
        monkeypatch.setattr(kernel, name, getattr(kernel, name).py_func)
    groups = (
        *kernel._open_chain.py_func(laid.entries),
        *(kernel._open_pairs.py_func(laid.entries, k) for k in (12, 14)),
        *(kernel._open_solid.py_func(laid.entries, k) for k in (16, 20)),
    )
    for group, expected in zip(groups, laid._groups, strict=True):
        assert group._fields == expected._fields
        for array, own in zip(group, expected, strict=True):
            assert array is own or own.size == 0
