"""Which solid holds another along a motion: what is asked where, and told how."""

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.solid import Enclosure
from borecheck.motion import containment as module
from borecheck.motion.halving import TOUCHED, UNDECIDED
from borecheck.motion.outcome import Timeline
from borecheck.motion.problem import Body, PathProblem, path_motion
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS, WORLD
from tests.chains import slider

AB = ("part", "wall")


def open_box(name, edge=0.1):
    mesh = box(name, [edge] * 3)
    return TriangleMesh(name, mesh.vertices, mesh.triangles[1:])


def solid(name, edge=0.1):
    return box(name, [edge] * 3)


def setting(first, second, place=(0.5, 0, 0), *, chain=None, way=((0.0,), (1.0,))):
    """What `examine_containment` takes, of a part on a slider and what stands."""
    part, wall = Body("part", first, 0), Body("wall", second, WORLD, transform(place))
    problem = PathProblem(chain or slider(), (part,), (wall,))
    return problem.chain, problem.pairs[0], problem.routes[0], path_motion(problem, way)


def examined(monkeypatch, answers, taken=()):
    """The timeline of two solids of which each clear stretch says what is told."""
    timeline, times = Timeline(2.0), []
    timeline.add(AB, np.array(taken, dtype=float).reshape(-1, 3))
    chain, pair, way, motion = setting(
        solid("part"), solid("wall"), way=((0.0,), (1.0,), (2.0,))
    )
    waiting = iter(answers)

    def held(a, T_a, b, T_b):
        assert (a, b) == (pair.moving, pair.standing)
        np.testing.assert_array_equal(T_b, pair.standing.T_frame_mesh)
        times.append(float(T_a[0, 3]))
        return next(waiting)

    monkeypatch.setattr(module, "held", held)
    module.examine_containment(chain, pair, way, motion, timeline)
    return timeline, times


NONE = Enclosure("none", "nothing crosses")
HELD = Enclosure("a_in_b", "part is inside wall")
DOUBT = Enclosure("unknown", "cannot be told")


def test_every_clear_stretch_is_asked_once_where_it_begins(monkeypatch):
    taken = [(0.5, 0.75, UNDECIDED), (1.0, 1.25, TOUCHED)]
    timeline, times = examined(monkeypatch, [NONE, NONE, NONE], taken)
    assert times == [0.0, 0.75, 1.25]
    assert (timeline.contained, timeline.undecided) == ([], [])


def test_a_solid_that_is_held_is_contact_for_its_stretch(monkeypatch):
    taken = [(0.5, 0.75, UNDECIDED)]
    timeline, _ = examined(monkeypatch, [NONE, HELD], taken)
    assert timeline.contained == [(AB, "part is inside wall")]
    assert timeline.open[-1] == (0.375, 1.0, TOUCHED, AB)


def test_what_cannot_be_told_is_said_with_its_reason(monkeypatch):
    timeline, _ = examined(monkeypatch, [DOUBT])
    assert timeline.undecided == [(AB, "cannot be told")]
    assert (timeline.contained, timeline.open) == ([], [])


@pytest.mark.parametrize(
    ("first", "second", "names"),
    [
        (open_box("part"), solid("wall"), "part"),
        (solid("part"), open_box("wall"), "wall"),
        (open_box("part"), open_box("wall"), "part and wall"),
    ],
)
def test_of_an_open_surface_boxes_alone_tell(monkeypatch, first, second, names):
    monkeypatch.setattr(module, "held", lambda *given: 1 / 0)
    for place, apart in (((0.5, 0.0, 0.0), False), ((0.5, 0.3, 0.0), True)):
        given, timeline = setting(first, second, place), Timeline(1.0)
        module.examine_containment(*given, timeline)
        reason = f"{names}: open, what it holds cannot be told"
        assert timeline.undecided == ([] if apart else [(AB, reason)])


def test_what_is_left_of_the_path():
    left = module.left_of_path
    assert left([]) == [(0.0, 1.0)]
    assert left([(0.0, 1.0)]) == []
    assert left([(0.0, 0.5)]) == [(0.5, 1.0)]
    assert left([(0.5, 1.0)]) == [(0.0, 0.5)]
    nested = [(0.5, 0.75), (0.125, 0.625), (0.25, 0.375), (0.75, 0.875)]
    assert left(nested) == [(0.0, 0.125), (0.875, 1.0)]


def body(mesh, frame=WORLD):
    return Body(mesh.name, mesh, frame)


@pytest.mark.parametrize("swap", [False, True])
def test_which_of_two_solids_holds_the_other(swap):
    small, large = body(solid("small")), body(solid("large", 0.5))
    here = transform([3.0, 4.0, 5.0], [0.3, 0.2, 0.1])
    for place, kind, reason in (
        ((0.0, 0.0, 0.0), "in", "small is inside large"),
        ((0.19, 0.1, -0.1), "in", "small is inside large"),
        ((0.4, 0.0, 0.0), "none", "no ray crosses anything"),
        ((0.2, 0.0, 0.0), "in", "small touches large"),
        ((0.0, 0.0, 0.4), "none", "no ray crosses anything"),
        ((0.0, -9.0, 0.0), "none", "no ray crosses anything"),
    ):
        there = here @ transform(place)
        ends = (large, here, small, there) if swap else (small, there, large, here)
        if "touches" in reason:  # exactly so where nothing is turned
            ends = tuple(np.eye(4) if e is here else e for e in ends)
            ends = tuple(transform(place) if e is there else e for e in ends)
        found = module.held(*ends)
        expected = kind if kind == "none" else "b_in_a" if swap else "a_in_b"
        assert found.kind == expected, place
        assert found.reason == reason or "touches" in reason


def plates(turned):
    """Six plates as one mesh, round a room of 1 m; of one the sides may be turned."""
    vertices, triangles = [], []
    for k in range(6):
        axis, size = k % 3, np.full(3, 0.98)
        size[axis] = 0.01
        plate = box("room", size)
        vertices.append(plate.vertices + (0.5 if k < 3 else -0.5) * np.eye(3)[axis])
        faces = plate.triangles[:, ::-1] if turned and k == 0 else plate.triangles
        triangles.append(faces + 8 * k)
    return TriangleMesh("room", np.concatenate(vertices), np.concatenate(triangles))


@pytest.mark.parametrize("tells", [True, False])
@pytest.mark.parametrize("swap", [True, False])
def test_only_where_crossings_may_cancel_the_slow_way_is_asked(
    monkeypatch, tells, swap
):
    asked = []
    monkeypatch.setattr(module, "contained", lambda *a: asked.append(a) or DOUBT)
    room, small = body(plates(turned=not tells)), body(solid("small"))
    assert room.topology.winding_tells is tells
    place = transform([0.02, 0.01, 0.03])
    ends = [(small, place), (room, np.eye(4))]
    (a, T_a), (b, T_b) = ends[::-1] if swap else ends
    found = module.held(a, T_a, b, T_b)
    if tells:
        assert found == Enclosure("none", "no ray crosses anything")
        assert asked == []
        return
    assert found is DOUBT
    ((placed_a, placed_b, *topologies),) = asked
    np.testing.assert_allclose(placed_a.vertices, a.mesh.vertices + T_a[:3, 3])
    np.testing.assert_allclose(placed_b.vertices, b.mesh.vertices + T_b[:3, 3])
    assert topologies == [a.topology, b.topology]


def test_a_point_is_taken_back(rng, monkeypatch):
    monkeypatch.setattr(module, "_triple", module._triple.py_func)
    T, point = transform([0.3, -0.7, 0.4], [0.3, -0.4, 0.8]), rng.normal(size=3)
    back = module._taken_back.py_func(T, *(T[:3, :3] @ point + T[:3, 3]))
    np.testing.assert_allclose(back, point, atol=1e-12)
    # a true inverse, of what is not rigid, too
    T[:3, :3] = rng.normal(size=(3, 3))
    back = module._taken_back.py_func(T, *(T[:3, :3] @ point + T[:3, 3]))
    np.testing.assert_allclose(back, point, atol=1e-12)
    u, v, w = rng.normal(size=(3, 3))
    assert module._triple(u, v, w) == pytest.approx(np.linalg.det([u, v, w]))


def stay_apart(first, place, *, chain=None, way=((0.0,), (1.0,))):
    return module._boxes_stay_apart(
        *setting(first, solid("wall"), place, chain=chain, way=way)
    )


def turned(kind, axis):
    chain = slider()
    return JointChain(
        chain.parent, chain.origin, np.array([kind]), np.array([axis], dtype=float),
        chain.source, chain.factor, chain.offset,
    )  # fmt: skip


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_boxes_that_pass_beside_each_other_stay_apart(axis, side):
    """A part of 0.1 m that slides 1 m past a wall of 0.1 m, to either side of it."""
    along = np.eye(3)[(axis + 1) % 3]
    chain = turned(SLIDES, along)
    place = 0.5 * along + side * np.eye(3)[axis] * 0.2
    assert stay_apart(solid("part"), place, chain=chain)
    near = 0.5 * along + side * np.eye(3)[axis] * 0.1
    assert not stay_apart(solid("part"), near, chain=chain)


def test_how_far_it_goes_between_two_instants_is_allowed_for(monkeypatch):
    """1 m in 4 steps: from 0.25 m away on it may have been there in between."""
    monkeypatch.setattr(module, "INSTANTS", 5)
    for gap, apart in ((0.24, False), (0.26, True)):
        assert stay_apart(solid("part"), (0.5, 0.1 + gap, 0.0)) is apart
    still = ((0.5,), (0.5,))
    for gap, apart in ((1e-7, False), (1e-5, True)):
        assert stay_apart(solid("part"), (0.5, 0.1 + gap, 0.0), way=still) is apart


def test_what_stands_still_is_seen_once(monkeypatch):
    chain, pair, way, motion = setting(
        solid("part"), solid("wall"), (0.5, 0.3, 0.0), way=((0.2,), (0.2,))
    )
    seen = []
    real = type(motion).place
    monkeypatch.setattr(
        type(motion), "place", lambda m, c, t: seen.append(t) or real(m, c, t)
    )
    assert module._boxes_stay_apart(chain, pair, way, motion)
    assert seen == [0.0]


def test_a_long_body_that_turns_is_told_by_its_box_not_its_sphere():
    """And a body at whose corner the box is: by its sphere."""
    hinge = turned(TURNS, (0.0, 0.0, 1.0))
    rod = box("part", [1.0, 0.02, 0.02])
    little = ((0.0,), (0.01,))
    assert stay_apart(rod, (0.0, 0.2, 0.0), chain=hinge, way=little)
    assert not stay_apart(rod, (0.0, 0.06, 0.0), chain=hinge, way=little)
    assert not stay_apart(rod, (0.2, 0.2, 0.0), chain=hinge, way=((0.0,), (1.6,)))
    # turned by 45 degrees, the box round a cube reaches as far as its corners do
    cube, eighth = solid("part", 1.0), ((np.pi / 4,), (np.pi / 4,))
    diagonal = np.sqrt(0.5)
    corner = (diagonal + 0.04, diagonal + 0.04, 0.0)
    assert not stay_apart(cube, (diagonal + 0.04, 0.0, 0.0), chain=hinge, way=eighth)
    assert stay_apart(cube, corner, chain=hinge, way=eighth)


def test_a_standing_body_may_be_a_part_that_moves():
    """Two sliders: only what one moves against the other counts."""
    chain = JointChain(
        parent=np.array([-1, -1]),
        origin=np.stack([np.eye(4), transform([0.0, 0.0, 0.0], [0.0, 0.0, np.pi / 2])]),
        kind=np.array([SLIDES, SLIDES]),
        axis=np.array([(1.0, 0.0, 0.0)] * 2),
        source=np.array([0, 1]),
        factor=np.ones(2),
        offset=np.zeros(2),
    )
    parts = (Body("a", open_box("a"), 0), Body("b", open_box("b"), 1))
    problem = PathProblem(chain, parts, (), ((0, 1),))
    for start, end, apart in (
        ((1.0, 0.0), (2.0, 0.0), True),
        ((0.0, 1.0), (0.0, 2.0), True),
        ((0.3, -0.3), (-0.3, 0.3), False),
        ((1.0, 1.0), (0.1, 0.0), False),
    ):
        motion = path_motion(problem, [start, end])
        timeline = Timeline(1.0)
        module.examine_containment(
            chain, problem.pairs[0], problem.routes[0], motion, timeline
        )
        assert (timeline.undecided == []) is apart, (start, end)
