"""Two answers about a motion, and what its check adds: every branch, by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from borecheck.contact.verdict import Answer, Closest, Containment, TrianglePair
from borecheck.motion import check as checks
from borecheck.motion import halves
from borecheck.motion.outcome import LeastClearance, PathVerdict, Stretch
from borecheck.motion.problem import PathProblem
from borecheck.motion.samples import Interval, MotionVerdict
from borecheck.motion.turns import HALF_TURN, TURN
from tests.motion.test_search import problem

AB, CD = ("a", "b"), ("c", "d")
LINKS = {"a": "A", "b": "B", "c": "C"}


def verdict(said, *stretches, **more):
    return PathVerdict(
        verdict=said,
        reason=f"it is {said}",
        qualifiers=("q",),
        certified=said == "clear",
        intervals=tuple(stretches) or (Stretch(0.0, 1.0, said),),
        first_contact=None,
        worst=None,
        **more,
    )


def searched(monkeypatch, found, itself, *, pairs=((0, 0),)):
    """`halves.searched` of a robot of which the second search says `itself`."""
    asked = []

    def search(of, points):
        row = (of.obstacles == (), of.self_pairs, of.doubt, len(of.passages), points)
        asked.append(row)
        return itself if of.obstacles == () else "obstacles alone"

    monkeypatch.setattr(halves, "search", search)
    passage = SimpleNamespace(part=0, obstacle=0, corridor=None)
    robot = problem(0.0, self_pairs=pairs, doubt="a doubt", passages=(passage,))
    return halves.searched(robot, "points", found), asked


def test_one_search_does_where_it_says_clear_or_there_is_no_other_question(monkeypatch):
    clear, contact = verdict("clear"), verdict("contact")
    answers, asked = searched(monkeypatch, clear, None)
    assert (answers, asked) == ((clear, None), [])
    answers, asked = searched(monkeypatch, contact, None, pairs=())
    assert (answers, asked) == ((contact, None), [])


def test_a_robot_that_is_clear_of_itself_leaves_the_first_answer(monkeypatch):
    contact, clear = verdict("contact"), verdict("clear")
    answers, asked = searched(monkeypatch, contact, clear)
    assert answers == (contact, clear)
    assert asked == [(True, ((0, 0),), None, 0, "points")]


@pytest.mark.parametrize("said", ["contact", "unknown"])
def test_else_the_obstacles_are_asked_alone(monkeypatch, said):
    itself = verdict(said)
    answers, asked = searched(monkeypatch, verdict("contact"), itself)
    assert answers == ("obstacles alone", itself)
    assert asked[1] == (False, (), "a doubt", 1, "points")


def test_answers_name_the_links_in_contact():
    around = verdict(
        "contact",
        *(
            Stretch(0.0, 0.25, "contact", (CD, AB)),
            Stretch(0.25, 0.5, "contact", (AB,)),
        ),
        Stretch(0.5, 1.0, "unknown", (("b", "x"),)),
    )
    itself = verdict("contact", Stretch(0.0, 1.0, "contact", (("a", "c"),)))
    obstacles, own = halves.answers_of(problem(0.5), around, itself, LINKS)
    pairs = (("A", "b"), ("C", "d"))
    assert obstacles == Answer("contact", "it is contact", ("q",), pairs)
    assert own == Answer("contact", "it is contact", ("q",), (("A", "C"),))


@pytest.mark.parametrize(
    ("pairs", "reason"),
    [
        ((), "no two parts of it could meet"),
        (((0, 0),) * 3, "every instant is proven clear for 3 pairs of parts"),
    ],
)
def test_without_a_second_search_the_robot_is_clear_of_itself(pairs, reason):
    robot = problem(0.5, self_pairs=pairs)
    _, own = halves.answers_of(robot, verdict("clear"), None, LINKS)
    assert own == Answer("clear", reason)


def pose(said, pairs=(), qualifiers=(), **more):
    answer = Answer(said, f"pose {said}", qualifiers, pairs)
    other = Answer("clear", "nothing")
    return SimpleNamespace(
        verdict=said, obstacles=answer, itself=other, contacts=(), self_contacts=(),
        contained=(), **more,
    )  # fmt: skip


def test_samples_say_contact_before_unknown_and_where():
    poses = [
        pose("clear"),
        pose("unknown", (("A", "u"),)),
        pose("contact", (("A", "z"), ("A", "b")), ("touching",)),
        pose("contact", (("A", "b"),)),
    ]
    fractions = [0.0, 0.25, 0.5, 1.0]
    obstacles, itself = halves.of_samples(fractions, poses, [""] * 4)
    pairs = (("A", "b"), ("A", "u"), ("A", "z"))
    reason = "at 50.0% of the motion: pose contact"
    assert obstacles == Answer("contact", reason, ("touching",), pairs)
    assert itself == Answer("unknown", "clear at 4 samples, not certified between")
    obstacles, _ = halves.of_samples(fractions[:2], poses[:2], [""] * 2)
    reason = "at 25.0% of the motion: pose unknown"
    assert obstacles == Answer("unknown", reason, (), (("A", "u"),))


def test_samples_that_may_not_lie_on_the_motion_say_nothing():
    poses = [pose("clear"), pose("contact", (("A", "b"),)), pose("clear")]
    doubts = ["", "the way is not known", "nor here"]
    obstacles, itself = halves.of_samples([0.0, 0.5, 1.0], poses, doubts)
    assert obstacles == itself == Answer("unknown", "the way is not known")
    (alone, _) = halves.of_samples([0.0], poses[1:2], [""])
    assert alone == poses[1].obstacles
    (alone, _) = halves.of_samples([0.0], poses[:1], [""])
    assert alone == poses[0].obstacles


def motion(*poses, said="contact", **more):
    fields = {
        "verdict": said,
        "reason": "samples",
        "qualifiers": (),
        "fractions": tuple(np.linspace(0.0, 1.0, len(poses)).tolist()),
        "poses": poses,
        "sampled_clear": 0,
        "certified": False,
        "intervals": (),
        "first_contact": 0.5,
        "worst": len(poses) - 1,
        "waypoints": ((0.0,), (1.0,)),
        "obstacles": Answer("unknown", "sampled obstacles"),
        "itself": Answer("unknown", "sampled itself"),
    }
    return MotionVerdict(**{**fields, **more})


NEAREST = SimpleNamespace(
    lower=0.01, upper=0.02, point_self=np.array([1.0, 2.0, 3.0]),
    point_other=np.array([4.0, 5.0, 6.0]), triangle_self=7, triangle_other=8,
)  # fmt: skip
LEAST = LeastClearance(0.009, 0.021, 0.5, (0, 1), ("a", "wall"), NEAREST, True)
SCENE = SimpleNamespace(
    obstacles=[SimpleNamespace(role=r) for r in ("scanner", "couch")],
)


def within_margin(monkeypatch, *poses, margin=0.02):
    asked = []
    monkeypatch.setattr(checks, "search", lambda of, points: (of.margin, points))

    def least(of, points, found, tolerance, instants):
        asked.append((of.margin, points, found, tolerance, instants))
        return LEAST

    monkeypatch.setattr(checks, "least_clearance", least)
    seen, robot = motion(*poses), problem(0.5, margin=margin)
    return seen, checks._within_margin(robot, "points", SCENE, seen, "tol"), asked


TOUCH = TrianglePair("a", "b", 0, 0)
TOUCHING = {
    "contacts": (TOUCH,),
    "self_contacts": (TOUCH,),
    "contained": (Containment("a", "b", "scanner", "a_in_b", ""),),
}


@pytest.mark.parametrize("kind", TOUCHING)
def test_one_pose_that_touches_leaves_no_clearance(monkeypatch, kind):
    touching = pose("contact")
    setattr(touching, kind, TOUCHING[kind])
    for poses in ((touching, pose("clear")), (pose("clear"), touching)):
        seen, found, asked = within_margin(monkeypatch, *poses)
        assert found is seen
        assert asked == []


@pytest.mark.parametrize("state", ["none", "unknown", "self"])
def test_within_the_margin_alone_the_clearance_is_asked_without_it(monkeypatch, state):
    near = pose("contact")
    if state == "unknown":
        near.contained = (Containment("a", "b", "scanner", "unknown", ""),)
    if state == "self":
        near.contained = (Containment("a", "b", "self", "a_in_b", ""),)
    _, found, asked = within_margin(monkeypatch, pose("clear"), near)
    assert asked == [(0.0, "points", (0.0, "points"), "tol", [1.0])]
    assert found.least is LEAST
    assert found.closest == Closest(
        link="a", obstacle="wall", role="couch", distance=0.01, upper=0.021,
        points=((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), triangles=(7, 8),
    )  # fmt: skip
    seen, same, asked = within_margin(monkeypatch, near, margin=0.0)
    assert same is seen
    assert asked == []


def test_without_a_least_clearance_there_are_no_nearest_points():
    seen = motion(pose("clear"))
    assert checks._nearest(SCENE, seen) is seen


def certified(outcome, *poses, **more):
    proof = checks.Proof(problem(0.5, **more), np.zeros((2, 1)), outcome, None)
    seen = motion(*poses, said="unknown", not_covered=("the rest",))
    return checks._certified(proof, seen), proof


def test_clear_is_said_where_proof_and_samples_agree():
    around, own = Answer("clear", "proven"), Answer("clear", "proven itself")
    outcome = verdict("clear", obstacles=around, itself=own, least=LEAST)
    found, proof = certified(outcome, pose("clear"), pose("clear"))
    assert (found.verdict, found.certified) == ("clear", True)
    assert found.reason == "it is clear; nearest: a to wall"
    assert (found.obstacles, found.itself) == (around, own)
    assert (found.least, found.proof) == (LEAST, proof)
    assert found.intervals == (Interval(0.0, 1.0, "clear"),)
    assert (found.first_contact, found.begins) == (None, None)
    assert found.qualifiers == ("q",)
    assert found.not_covered[0] == "the rest"


def test_a_sample_that_is_not_clear_takes_it_back():
    outcome = verdict("clear", obstacles=Answer("clear", "proven"), least=LEAST)
    found, _ = certified(outcome, pose("clear"), pose("unknown"))
    assert (found.verdict, found.certified) == ("unknown", False)
    assert found.reason == "samples"
    assert found.obstacles == Answer("unknown", "sampled obstacles")
    assert found.itself == Answer("unknown", "sampled itself")


def test_a_proof_that_is_not_clear_decides_and_says_where_contact_begins():
    touching = Answer("contact", "proven")
    first = (0.25, 0.5, AB)
    for said in ("contact", "unknown"):
        outcome = checks.replace(verdict(said, obstacles=touching), first_contact=first)
        found, _ = certified(outcome, pose("clear"), pose("unknown"))
        assert (found.verdict, found.certified) == (said, False)
        assert found.reason == f"it is {said}"
        assert found.obstacles == touching
        is_contact = said == "contact"
        assert found.first_contact == (0.25 if is_contact else None)
        assert found.begins == ((0.25, 0.5) if is_contact else None)


def test_half_a_turn_is_told_to_a_microradian():
    assert pytest.approx(2.0 * np.pi) == TURN
    assert np.pi - 1.01e-6 < HALF_TURN < np.pi - 0.99e-6


def test_what_touches_at_the_ends_of_an_open_step(monkeypatch):
    asked = []

    def search(of, points):
        asked.append(float(points[0, 0]))
        return answers.get(asked[-1], verdict("clear"))

    monkeypatch.setattr(checks, "search", search)
    points, turns = np.arange(6.0)[:, None], SimpleNamespace(steps=(3, 1))
    answers = {}
    touched = checks._touched
    assert touched(problem(0.5), points, turns, verdict("contact")) is None
    assert asked == [1.0, 2.0, 3.0, 4.0]
    answers[2.0] = checks.replace(verdict("contact"), first_contact=(0.0, 1.0, AB))
    found = touched(problem(0.5), points, turns, verdict("contact"))
    assert found == "waypoint 3: a and b meet"
    answers = {4.0: verdict("contact"), 1.0: verdict("unknown")}
    found = touched(problem(0.5), points, turns, verdict("contact"))
    assert found == "waypoint 5: it is contact"
    del asked[:]
    for said in ("clear", "unknown"):
        assert touched(problem(0.5), points, turns, verdict(said)) is None
    assert asked == []
    assert isinstance(problem(0.5), PathProblem)


@pytest.mark.parametrize("around", ["contact", "clear", "unknown"])
def test_samples_in_contact_ask_only_what_is_still_open(monkeypatch, around):
    """A robot that touches itself alone may still be clear of what stands around."""
    seen = SimpleNamespace(
        verdict="contact", obstacles=Answer(around, "sampled obstacles")
    )
    monkeypatch.setattr(checks, "checked_waypoints", lambda robot, given: given)
    monkeypatch.setattr(checks, "open_turns", lambda model, points: None)
    monkeypatch.setattr(checks, "sample_motion", lambda *given, **more: seen)
    monkeypatch.setattr(checks, "path_problem", lambda *given: "problem")
    monkeypatch.setattr(checks, "link_of", lambda robot: LINKS)
    monkeypatch.setattr(checks, "_within_margin", lambda *given: ("margin", given))
    monkeypatch.setattr(checks, "_around", lambda *given: ("around", given))
    monkeypatch.setattr(checks, "_nearest", lambda scene, found: found)
    own = []
    monkeypatch.setattr(checks, "_own", lambda *given: own.append(given) or given[2])
    chosen = SimpleNamespace(
        checker="exact", margin=SimpleNamespace(kind="offset", size=0.5)
    )
    robot, points = SimpleNamespace(model=None), np.zeros((2, 1))
    asked, given = checks.check_motion(robot, "scene", points, chosen)
    assert asked == ("margin" if around == "contact" else "around")
    assert given[:2] == ("problem", points)
    assert any(item is seen for item in given)
    # what it does to itself is still open where an obstacle is touched
    assert len(own) == (around == "contact")
