"""A needle driven along a corridor, or out of it: what is proven, what is found."""

from dataclasses import replace

import numpy as np
import pytest

from borecheck.core.se3 import axis_rotation, transform
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.motion import passage_search
from borecheck.motion.beside import not_beside
from borecheck.motion.halving import CERTIFIED, TOUCHED, UNDECIDED
from borecheck.motion.outcome import Timeline
from borecheck.motion.passage import Approach
from borecheck.motion.passage_search import PassageSearch, legs_of
from borecheck.motion.problem import Body, Passage, PathProblem, path_motion
from borecheck.motion.search import search
from borecheck.plans.corridor import SLACK, Corridor
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS

RADIUS = 0.00055
LENGTH = 0.05
CORRIDOR = Corridor(np.zeros(3), np.array([0.0, 0.0, -LENGTH]), RADIUS)
# Drives of the sliding joint: tip at the stand-off, at the entry, at the target. At the
# entry a hair above the skin: two faces in one plane are never taken as planned.
STANDOFF, ENTRY, TARGET = 0.05, 1e-4, -LENGTH


def joined(name, *parts):
    starts = np.cumsum([0, *(len(p.vertices) for p in parts)])
    vertices = np.concatenate([p.vertices for p in parts])
    triangles = [p.triangles + s for p, s in zip(parts, starts[:-1], strict=True)]
    return TriangleMesh(name, vertices, np.concatenate(triangles))


def block(low=(-0.2, -0.2, -0.2), high=(0.2, 0.2, 0.0)):
    low, high = np.array(low), np.array(high)
    return box("block", high - low).moved(transform((low + high) / 2))


def rod(radius, length, sides=12):
    """A prism within a cylinder along z, centred: fewer triangles than `cylinder`."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    low, high = (
        np.column_stack([ring, np.full(sides, z * length)]) for z in (-0.5, 0.5)
    )
    i = np.arange(sides)
    j = (i + 1) % sides
    wall = [
        np.column_stack([i, j, j + sides]),
        np.column_stack([i, j + sides, i + sides]),
    ]
    k = np.arange(1, sides - 1)
    zero = np.zeros(sides - 2, dtype=int)
    ends = [
        np.column_stack([zero, k + 1, k]),
        np.column_stack([zero + sides, k + sides, k + 1 + sides]),
    ]
    return TriangleMesh("rod", np.vstack([low, high]), np.concatenate([*wall, *ends]))


def needle(shift=(0.0, 0.0, 0.0), hub_at=None, length=0.12):
    """A needle along z whose tip is its origin; with a hub of 5 mm from a height on."""
    shaft = rod(RADIUS, length)
    parts = [shaft.moved(transform(np.array([0, 0, length / 2]) + shift))]
    if hub_at is not None:
        hub = rod(0.005, 0.02)
        parts.append(hub.moved(transform([0, 0, hub_at + 0.01])))
    return joined("needle", *parts)


def crank(arm=0.0):
    """q: height of the needle, turn of a crank about an upright axis `arm` aside."""
    return JointChain(
        parent=np.array([-1, 0, 1]),
        origin=np.array([np.eye(4), transform([arm, 0, 0]), transform([-arm, 0, 0])]),
        kind=np.array([SLIDES, TURNS, FIXED]),
        axis=np.array([[0.0, 0, 1], [0, 0, 1], [1, 0, 0]]),
        source=np.array([0, 1, -1]),
        factor=np.ones(3),
        offset=np.zeros(3),
    )


def tilting():
    """q: height of the needle, its tilt about a point 40 mm above the tip."""
    return JointChain(
        parent=np.array([-1, 0, 1]),
        origin=np.array([np.eye(4), transform([0, 0, 0.04]), transform([0, 0, -0.04])]),
        kind=np.array([SLIDES, TURNS, FIXED]),
        axis=np.array([[0.0, 0, 1], [0, 1, 0], [1, 0, 0]]),
        source=np.array([0, 1, -1]),
        factor=np.ones(3),
        offset=np.zeros(3),
    )


def problem(*patient, tool=None, chain=None):
    mesh = joined("body", *(patient or (block(),)))
    part = Body("needle", tool or needle(), 2)
    passages = (Passage(0, 0, CORRIDOR),)
    return PathProblem(
        chain or crank(), (part,), (Body("body", mesh),), passages=passages
    )


# both legs of it, in waypoints
WHOLE = [(0.0, 2.0)]
STRAIGHT = [[STANDOFF, 0.0], [ENTRY, 0.0], [TARGET, 0.0]]


def test_a_straight_insertion_is_proven_clear_with_few_pieces():
    found = search(problem(), STRAIGHT)
    assert found.verdict == "clear"
    assert found.certified
    assert found.counts["pairs"] == 1
    without = PathProblem(crank(), problem().parts, problem().obstacles)
    assert search(without, STRAIGHT).verdict == "contact"


def test_with_a_corridor_somewhere_else_it_is_contact():
    wrong = Corridor(CORRIDOR.entry + [0.01, 0, 0], CORRIDOR.target, RADIUS)
    first = problem()
    moved = PathProblem(
        crank(), first.parts, first.obstacles, passages=(Passage(0, 0, wrong),)
    )
    found = search(moved, STRAIGHT)
    assert found.verdict == "contact"
    start, end, names = found.first_contact
    # the skin is met in the middle of the motion, and that is not far to narrow
    assert start <= 0.5 + 1e-3
    assert end >= 0.5 - 1e-3
    assert names == ("needle", "body")


@pytest.mark.parametrize(
    ("beyond", "verdict"), [(SLACK - 1e-6, "clear"), (SLACK + 1e-4, "contact")]
)
def test_the_target_may_be_passed_by_the_slack_alone(beyond, verdict):
    found = search(problem(), [*STRAIGHT[:2], [TARGET - beyond, 0.0]])
    assert found.verdict == verdict
    if verdict == "contact":
        assert found.qualifiers == ("contained",)
        assert "beyond the target" in found.reason
        assert found.intervals[0].verdict == "clear"
        assert found.intervals[-1].verdict == "contact"


@pytest.mark.parametrize("turns", [1, 3])
def test_a_needle_that_leaves_between_two_waypoints_is_not_clear(turns):
    """A crank goes once round: both ends are as planned, the middle 10 mm aside."""
    swing = [[TARGET, 0.0], [TARGET, turns * 2 * np.pi]]
    for q in swing:
        assert search(problem(chain=crank(0.005)), [q]).verdict == "clear"
    found = search(problem(chain=crank(0.005)), swing)
    assert found.verdict == "contact"
    assert 0.0 < found.first_contact[0] < 0.5 / turns


def test_above_the_skin_it_may_leave_its_line():
    swing = [[STANDOFF, 0.0], [STANDOFF, 2 * np.pi], *STRAIGHT[1:]]
    assert search(problem(chain=crank(0.005)), swing).verdict == "clear"
    post = block((0.008, -0.001, 0.01), (0.012, 0.001, 0.1))
    assert search(problem(block(), post, chain=crank(0.005)), STRAIGHT).certified
    in_its_way = search(problem(block(), post, chain=crank(0.005)), swing)
    assert in_its_way.verdict == "contact"


def test_a_leg_along_the_line_is_proven_as_one_piece():
    asked = problem()
    motion = path_motion(asked, STRAIGHT)
    bodies = asked.parts[0], asked.obstacles[0]
    found = PassageSearch(asked.chain, *bodies, CORRIDOR, motion)
    assert found.stays(0.0, 1.0)
    assert found.stays(1.0, 2.0)


# From 0.3 m aside of the line over to it, 5 cm above the skin, and in: a crank of 0.15
# m that turns by half a turn.
WAY = [[STANDOFF, np.pi], [STANDOFF, 0.0], *STRAIGHT[1:]]


def way(*patient, margin=0.0, chain=None, tool=None):
    first = problem(*patient, chain=chain or crank(0.15), tool=tool)
    return replace(first, margin=margin)


def test_a_way_beside_the_patient_and_in_is_one_clear_motion():
    """A ridge across the crank's way, as high as the line's slab could not pass."""
    for top, verdict in ((0.0499, "clear"), (0.0501, "contact")):
        ridge = block((0.1, -0.2, 0.0), (0.2, -0.05, top))
        found = search(way(block(), ridge), WAY)
        assert found.verdict == verdict, found.reason
    start, end, names = found.first_contact
    assert 0.0 < start <= end < 1 / 3
    assert names == ("needle", "body")


def test_beside_the_patient_the_margin_holds_as_for_any_part():
    """Nearer than it, aside of the line, is contact; along the line it is not asked."""
    ridge = block((0.1, -0.2, 0.0), (0.2, -0.05, 0.045))
    for margin, verdict in ((0.0049, "clear"), (0.0051, "contact")):
        found = search(way(block(), ridge, margin=margin), WAY)
        assert found.verdict == verdict, found.reason
    assert found.first_contact[1] < 1 / 3


def test_a_needle_in_the_patient_beside_its_corridor_is_contact():
    """It goes in where it may not, with surfaces that never meet, or that do."""
    around = block((0.21, -0.2, -0.2), (0.4, 0.2, 0.3))
    found = search(way(block(), around), WAY)
    assert found.verdict == "contact"
    assert found.qualifiers == ("contained",)
    aside = [[STANDOFF, np.pi], [TARGET, np.pi], [STANDOFF, np.pi], *WAY]
    assert search(way(), aside).verdict == "clear"  # beside the block, not in it
    under = block((0.21, -0.2, -0.2), (0.4, 0.2, -0.01))
    assert search(way(block(), under), aside).verdict == "contact"


def test_only_stretches_that_are_not_plainly_clear_are_asked():
    asked = way()
    motion = path_motion(asked, WAY)
    pair = asked.passage_pair(asked.passages[0])
    near = np.array([[2.5, 2.75, 1.0], [2.75, 3.0, 2.0]])
    assert not_beside(asked.chain, pair, motion, near) == [(2.5, 3.0)]
    assert not_beside(asked.chain, pair, motion, near[:0]) == []
    held = replace(pair, standing=Body("body", block((-1, -1, -1), (1, 1, 1))))
    assert not_beside(asked.chain, held, motion, near) == [(0.0, 3.0)]
    mesh = pair.standing.mesh
    opened = Body("body", TriangleMesh("body", mesh.vertices, mesh.triangles[1:]))
    standing = replace(pair, standing=opened)
    assert not_beside(asked.chain, standing, motion, near[:0]) == [(0.0, 3.0)]


def test_stretches_are_cut_at_waypoints():
    legs = legs_of([(0.25, 0.5), (0.75, 2.5), (3.0, 4.0)])
    assert legs == [(0.25, 0.5), (0.75, 1), (1, 2), (2, 2.5), (3, 4)]
    assert legs_of([]) == []


def test_tilting_in_the_patient_is_contact_and_back_again_too():
    wag = [[TARGET, 0.0], [TARGET, 0.2], [TARGET, 0.0]]
    found = search(problem(chain=tilting()), wag)
    assert found.verdict == "contact"
    small = [[TARGET, 0.0], [TARGET, 0.01], [TARGET, 0.0]]
    assert search(problem(chain=tilting()), small).verdict == "clear"


@pytest.mark.parametrize("gap", [1e-5, -1e-5])
def test_a_fold_beside_the_line_before_the_entry(gap):
    fold = block((RADIUS + gap, -0.05, 0.01), (0.1, 0.05, 0.02))
    found = search(problem(block(), fold), STRAIGHT)
    assert found.verdict == ("clear" if gap > 0 else "contact")
    if gap < 0:
        start, end, _ = found.first_contact
        known = 0.5 * (STANDOFF - 0.02) / (STANDOFF - ENTRY)
        assert start <= known <= end
        assert end - start < 2e-3


def test_a_sheet_across_the_line_is_contact():
    for height in (0.004, 0.03):
        sheet = block((-0.01, -0.01, height), (0.01, 0.01, height + 1e-5))
        assert search(problem(block(), sheet), STRAIGHT).verdict == "contact"


def test_a_fold_in_the_slab_but_not_in_the_needle_is_unknown():
    """The needle runs 1 mm aside, within its slack; the fold is on the other side."""
    tool = needle((-0.001, 0.0, 0.0))
    fold = block((0.0005, -0.05, 0.01), (0.1, 0.05, 0.02))
    assert search(problem(tool=tool), STRAIGHT).verdict == "clear"
    found = search(problem(block(), fold, tool=tool), STRAIGHT)
    assert found.verdict == "unknown"
    assert "needle and body" in found.reason
    assert "corridor" in found.reason
    assert found.counts["poses"] > 0


def test_a_hub_counts_where_it_is():
    """It is wider than the corridor and may come near the skin, not into it."""
    fold = block((0.003, -0.05, 0.0), (0.1, 0.05, 0.02))
    for hub_at, verdict in ((0.0701, "clear"), (0.0699, "contact")):
        found = search(problem(block(), fold, tool=needle(hub_at=hub_at)), STRAIGHT)
        assert found.verdict == verdict, found.reason
    for hub_at, verdict in ((0.0521, "clear"), (0.0499, "contact")):
        found = search(problem(tool=needle(hub_at=hub_at)), STRAIGHT)
        assert found.verdict == verdict, found.reason


def test_a_needle_within_the_patient_from_the_start_is_contact():
    found = search(problem(block((-0.3, -0.3, -0.3), (0.3, 0.3, 0.3))), STRAIGHT)
    assert found.verdict == "contact"
    assert found.qualifiers == ("contained",)
    short = problem(tool=needle(length=0.03))
    assert search(short, STRAIGHT).verdict == "contact"


def test_an_open_skin_is_unknown_where_its_box_holds_the_needle():
    first = problem(block(), block((0.15, 0.15, 0.01), (0.2, 0.2, 0.5)))
    assert search(first, STRAIGHT).verdict == "clear"
    mesh = first.obstacles[0].mesh
    opened = Body("body", TriangleMesh("body", mesh.vertices, mesh.triangles[1:]))
    found = search(
        PathProblem(crank(), first.parts, (opened,), passages=first.passages), STRAIGHT
    )
    assert found.verdict == "unknown"


def test_other_pairs_are_examined_as_ever():
    """A holder above the needle is no needle: the patient must stay clear of it."""
    first = problem()
    for height, verdict in ((0.051, "clear"), (0.049, "contact")):
        holder = box("holder", [0.05, 0.05, 0.01]).moved(
            transform([0, 0, height + 0.005])
        )
        both = PathProblem(
            crank(),
            (*first.parts, Body("holder", holder, 2)),
            first.obstacles,
            passages=first.passages,
        )
        found = search(both, STRAIGHT)
        assert found.verdict == verdict
        assert found.counts["pairs"] == 2


def test_giving_up_is_said(monkeypatch):
    monkeypatch.setattr(passage_search, "PIECE_LIMIT", 3)
    fold = block((RADIUS - 1e-6, -0.05, 0.01), (0.1, 0.05, 0.02))
    found = search(problem(block(), fold), STRAIGHT)
    assert found.verdict == "unknown"
    assert "gave up" in found.reason


def test_a_patient_that_is_placed_is_refused():
    first = problem()
    aside = Body("body", first.obstacles[0].mesh, T_frame_mesh=transform([0.1, 0, 0]))
    with pytest.raises(GeometryError, match="in the world"):
        PathProblem(crank(), first.parts, (aside,), passages=first.passages)


def random_chain(rng):
    """A few turning and sliding joints with offsets, one after the other."""
    n = 4
    origins = np.array([transform(rng.uniform(-0.2, 0.2, 3)) for _ in range(n)])
    return JointChain(
        parent=np.arange(n) - 1,
        origin=origins,
        kind=rng.choice([TURNS, SLIDES], n),
        axis=rng.normal(size=(n, 3)),
        source=np.arange(n),
        factor=rng.uniform(-1.0, 1.0, n),
        offset=rng.uniform(-0.1, 0.1, n),
    )


def test_slabs_hold_the_needle_at_every_instant(rng):
    """Random chains and pieces of legs: samples between the ends never leave."""
    tight = []
    for _ in range(30):
        chain = random_chain(rng)
        tool = Body("needle", needle(rng.uniform(-0.01, 0.01, 3)), 3)
        q = rng.uniform(-0.6, 0.6, (2, 4))
        motion = path_motion(PathProblem(chain, (tool,), ()), q)
        asked = PassageSearch(chain, tool, Body("body", block()), CORRIDOR, motion)
        begin, end = np.sort(rng.uniform(0.0, 1.0, 2))
        slabs = asked.sweep(float(begin), float(end))
        for time in np.linspace(begin, end, 25):
            T = motion.place(chain, float(time))[3]
            corners = place_mesh(T, tool.mesh).corners
            depth, aside = CORRIDOR.coordinates(corners.reshape(-1, 3))
            depth, aside = depth.reshape(-1, 3), aside.reshape(-1, 3)
            assert (depth.min(axis=1) >= slabs.low).all()
            assert (depth.max(axis=1) <= slabs.high).all()
            assert (aside.max(axis=1) <= slabs.aside).all()
            assert depth.min() <= slabs.tail
        tight.append(float((slabs.high - slabs.low).max()))
    assert min(tight) < 1.0  # bounds of metres would hold, too


def test_what_is_called_clear_is_clear_in_samples(rng):
    """Random eccentric, wagging insertions past random folds, against many poses."""
    count = {"clear": 0, "contact": 0, "unknown": 0}
    for _ in range(8):
        near = rng.uniform(0.0003, 0.003)
        low = rng.uniform(0.002, 0.04)
        fold = block((near, -0.02, low), (0.05, 0.02, low + 0.01))
        chain = tilting() if rng.random() < 0.5 else crank(rng.uniform(0, 0.002))
        tool = needle([*rng.uniform(-0.001, 0.001, 2), 0.0])
        wag = rng.uniform(-0.02, 0.02, 3) * (1 if chain.axis[1, 1] else 100)
        path = np.column_stack([[STANDOFF, ENTRY, TARGET], wag])
        asked = problem(block(), fold, tool=tool, chain=chain)
        found = search(asked, path)
        count[found.verdict] += 1
        motion = path_motion(asked, path)
        judge = PassageSearch(
            chain, asked.parts[0], asked.obstacles[0], CORRIDOR, motion
        )
        touched = [
            judge.judge(float(time))[0] == passage_search.TOUCHED
            for time in np.linspace(0.0, 2.0, 13)
        ]
        if any(touched):
            assert found.verdict == "contact"
    assert count["clear"] > 1
    assert count["contact"] > 1


def slanted(chain, R):
    """The chain on a turned foot."""
    foot = np.eye(4)
    foot[:3, :3] = R
    origin = np.array([foot @ chain.origin[0], *chain.origin[1:]])
    return JointChain(
        chain.parent, origin, chain.kind, chain.axis,
        chain.source, chain.factor, chain.offset,
    )  # fmt: skip


def spread(mesh, rng, count=1500):
    """Random points of a surface, corners included."""
    share = rng.dirichlet([1.0, 1.0, 1.0], count)
    corners = mesh.corners[rng.integers(len(mesh.triangles), size=count)]
    return np.vstack([np.einsum("ij,ijk->ik", share, corners), mesh.vertices])


def test_no_point_of_a_clear_needle_is_elsewhere_in_the_patient(rng, monkeypatch):
    """Slanted, eccentric, wagging needles; the patient is boxes, told by comparison."""
    monkeypatch.setattr(passage_search, "POSE_LIMIT", 20)  # quick: clear needs no pose
    count = {"clear": 0, "contact": 0, "unknown": 0}
    inside = 0
    for _ in range(20):
        low = rng.uniform(0.002, 0.03)
        corner = np.array([rng.uniform(0.0, 0.02), -0.05, low])
        boxes = [
            (np.array([-0.2, -0.2, -0.2]), np.array([0.2, 0.2, 0.0])),
            (corner, corner + [0.1, 0.1, 0.01]),
        ]
        angle = rng.uniform(-0.9, 0.9)
        R = axis_rotation([0.0, 1.0, 0.0], angle)
        corridor = Corridor(np.zeros(3), R @ CORRIDOR.target, RADIUS)
        wagging = rng.random() < 0.5
        chain = slanted(tilting() if wagging else crank(rng.uniform(0, 0.003)), R)
        wag = rng.uniform(-1.0, 1.0, 3) * (0.03 if wagging else 4.0)
        path = np.column_stack([[STANDOFF, ENTRY, TARGET], wag])
        tool = Body("needle", needle([*rng.uniform(-0.0015, 0.0015, 2), 0.0]), 2)
        body = Body("body", joined("body", *(block(*b) for b in boxes)))
        passages = (Passage(0, 0, corridor),)
        asked = PathProblem(chain, (tool,), (body,), passages=passages)
        found = search(asked, path)
        count[found.verdict] += 1
        if found.verdict != "clear":
            continue
        motion = path_motion(asked, path)
        points = spread(tool.mesh, rng)
        for time in np.linspace(0.0, 2.0, 60):
            T = motion.place(chain, float(time))[2]
            at = points @ T[:3, :3].T + T[:3, 3]
            held = [((at > a) & (at < b)).all(axis=1) for a, b in boxes]
            within = held[0] | held[1]
            inside += int(within.sum())
            assert corridor.holds(at[within]).all()
    assert count["clear"] > 3
    assert count["contact"] + count["unknown"] > 3
    assert inside > 10_000


def test_the_near_part_of_the_patient_is_what_is_asked(monkeypatch):
    """Without the look at what lies before the entry a fold would be called clear."""
    fold = block((RADIUS - 1e-4, -0.05, 0.01), (0.1, 0.05, 0.02))
    assert search(problem(block(), fold), STRAIGHT).verdict == "contact"
    monkeypatch.setattr(Approach, "is_free", lambda self, slabs: True)
    assert search(problem(block(), fold), STRAIGHT).verdict == "clear"


def pieces(monkeypatch, outcome, *, moved=1.0, stays=False, judged=0):
    """A search of one needle in which a pose says what is told, and what was asked."""
    made = problem()
    motion = path_motion(made, STRAIGHT)
    found = PassageSearch(
        made.chain, made.parts[0], made.obstacles[0], CORRIDOR, motion
    )
    asked = []

    def judge(self, time):
        asked.append(time)
        return outcome[len(asked) - 1]

    monkeypatch.setattr(PassageSearch, "stays", lambda self, begin, end: stays)
    monkeypatch.setattr(PassageSearch, "_moved", lambda self, begin, end: moved)
    monkeypatch.setattr(PassageSearch, "judge", judge)
    found.judged = judged
    return found, asked, Timeline(2.0)


FINEST, FIRST, COARSE = 1e-6, 1e-5, 2e-3
FREE, WRONG, OPEN = (CERTIFIED, ""), (TOUCHED, ""), (UNDECIDED, "cannot be told")


def test_a_piece_that_keeps_to_the_corridor_is_not_judged(monkeypatch):
    found, asked, timeline = pieces(monkeypatch, [], stays=True)
    assert found._outcome(0.0, 1.0, timeline) == CERTIFIED
    assert asked == []


@pytest.mark.parametrize(
    ("moved", "halved"), [(FIRST, False), (1.01 * FIRST, True), (0.99 * FIRST, False)]
)
def test_a_piece_is_judged_once_it_is_as_short_as_a_first_contact(
    monkeypatch, moved, halved
):
    found, asked, timeline = pieces(monkeypatch, [WRONG], moved=moved)
    answer = found._outcome(0.25, 0.5, timeline)
    assert answer == (None if halved else TOUCHED)
    assert asked == ([] if halved else [0.375])
    after = FIRST if halved else COARSE
    assert (found.enough, found.judged) == (after, 0 if halved else 1)
    assert found.finest == (FINEST if halved else COARSE)


def test_where_no_instant_lies_between_a_piece_is_judged(monkeypatch):
    found, asked, timeline = pieces(monkeypatch, [FREE])
    begin, end = 0.25, float(np.nextafter(0.25, 1.0))
    assert found._outcome(begin, end, timeline) == UNDECIDED
    assert asked == [0.25]


@pytest.mark.parametrize(("moved", "halved"), [(FINEST, False), (1.01 * FINEST, True)])
def test_a_pose_that_is_free_proves_no_piece(monkeypatch, moved, halved):
    """It is halved down to the finest, and undecided then."""
    found, asked, timeline = pieces(monkeypatch, [FREE], moved=moved)
    doubt = found.doubt
    assert found._outcome(0.25, 0.5, timeline) == (None if halved else UNDECIDED)
    assert asked == [0.375]
    assert found.judged == 1
    assert found.enough == (FIRST if halved else COARSE)
    assert found.doubt == doubt


def test_at_the_end_of_a_leg_the_waypoint_is_judged_too(monkeypatch):
    found, asked, timeline = pieces(monkeypatch, [FREE, WRONG], moved=FINEST)
    assert found._outcome(0.75, 1.0, timeline) == TOUCHED
    assert (asked, found.judged) == ([0.875, 1.0], 2)
    found, asked, timeline = pieces(monkeypatch, [WRONG], moved=FINEST)
    assert found._outcome(0.75, 1.0, timeline) == TOUCHED
    assert (asked, found.judged) == ([0.875], 1)


def test_a_pose_in_doubt_says_why(monkeypatch):
    found, _, timeline = pieces(monkeypatch, [OPEN], moved=FINEST)
    assert found._outcome(0.25, 0.5, timeline) == UNDECIDED
    assert found.doubt == "cannot be told"
    assert timeline.contained == []


def test_a_solid_held_is_contact_where_it_is(monkeypatch):
    found, _, timeline = pieces(monkeypatch, [(TOUCHED, "it is inside")], moved=FINEST)
    assert found._outcome(0.5, 1.5, timeline) == CERTIFIED
    names = ("needle", "body")
    assert timeline.contained == [(names, "it is inside")]
    assert timeline.open == [(0.25, 0.75, TOUCHED, names)]
    assert found.enough == found.finest == COARSE


@pytest.mark.parametrize(("judged", "gave_up"), [(199, False), (200, True)])
def test_after_so_many_poses_the_rest_is_undecided(monkeypatch, judged, gave_up):
    found, asked, timeline = pieces(monkeypatch, [WRONG], moved=FINEST, judged=judged)
    assert found._outcome(0.25, 0.5, timeline) == (UNDECIDED if gave_up else TOUCHED)
    assert len(asked) == (0 if gave_up else 1)


def test_legs_are_halved_in_order_and_counted(monkeypatch):
    found, _, timeline = pieces(monkeypatch, [])
    seen = []

    def outcome(self, begin, end, of):
        seen.append((begin, end))
        if end - begin == 1.0:
            return None
        return {0.0: CERTIFIED, 0.5: TOUCHED, 1.0: UNDECIDED, 1.5: UNDECIDED}[begin]

    monkeypatch.setattr(PassageSearch, "_outcome", outcome)
    found.judged = 3
    found.run(timeline, WHOLE)
    assert seen == [(0, 1), (0, 0.5), (0.5, 1), (1, 2), (1, 1.5), (1.5, 2)]
    names = ("needle", "body")
    assert timeline.open == [
        (0.25, 0.5, TOUCHED, names),
        (0.5, 1.0, UNDECIDED, names),
    ]
    assert (timeline.pieces, timeline.poses) == (6, 3)
    assert timeline.notes == {names: "not shown to keep to the plan's corridor"}


@pytest.mark.parametrize(("limit", "looked"), [(0, 2), (1, 3), (4, 6)])
def test_after_so_many_pieces_the_rest_is_undecided(monkeypatch, limit, looked):
    """One for every leg, and some more."""
    found, _, timeline = pieces(monkeypatch, [])
    monkeypatch.setattr(passage_search, "PIECE_LIMIT", limit)
    calls = []
    monkeypatch.setattr(PassageSearch, "_outcome", lambda self, *g: calls.append(g))
    found.run(timeline, WHOLE)
    assert len(calls) == looked
    (row,) = timeline.open
    assert row[:3] == (0.0, 1.0, UNDECIDED)
    assert list(timeline.notes.values()) == [
        "not shown to keep to the plan's corridor, gave up"
    ]


def test_poses_that_were_all_asked_are_said(monkeypatch):
    for judged, told in ((199, ""), (200, ", gave up")):
        found, _, timeline = pieces(monkeypatch, [], stays=True, judged=judged)
        found.run(timeline, WHOLE)
        (note,) = timeline.notes.values()
        assert note == f"not shown to keep to the plan's corridor{told}"
        assert timeline.open == []
