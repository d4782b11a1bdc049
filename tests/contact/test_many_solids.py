"""Solids in solids, pose by pose: the batch says what single checks say."""

from types import SimpleNamespace

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact import solid_pairs
from borecheck.contact.many_poses import as_configurations, refuse_beyond_limits
from borecheck.contact.pose_batch import prepared
from borecheck.contact.skipped import pairs_without
from borecheck.errors import JointLimitError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree.holding import WITNESSES
from borecheck.robots.scene import Obstacle, Scene

LINK = (
    '<link name="{}"><collision><geometry><box size="{}"/></geometry></collision>'
    "</link>"
)
JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>
<origin xyz="{4}" rpy="{5}"/><axis xyz="{6}"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>"""


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    """A turning hull that a bead slides into, with a far link between them."""
    file = tmp_path_factory.mktemp("r") / "r.urdf"
    parts = [
        LINK.format("base", "0.1 0.1 0.1"),
        LINK.format("hull", "1 0.6 0.4"),
        LINK.format("between", "0.1 0.1 0.1"),
        LINK.format("bead", "0.1 0.1 0.1"),
        JOINT.format("a", "revolute", "base", "hull", "2 0 0.5", "0.3 0 0.2", "0 0 1"),
        JOINT.format("b", "prismatic", "hull", "between", "0 0 3", "0 0 0", "1 0 0"),
        JOINT.format("c", "prismatic", "between", "bead", "0 0 -3", "0 0 0", "0 1 0"),
    ]
    file.write_text(f'<robot name="r">{"".join(parts)}</robot>')
    return bc.load_robot(file)


def scene_of(*meshes):
    obstacles = tuple(Obstacle(m.name, "other", m, "t") for m in meshes)
    return Scene("s", None, {}, "t", obstacles, {}, (), ())


def at(name, size, *place):
    mesh = box(name, size)
    return TriangleMesh(name, mesh.vertices + np.array(place), mesh.triangles)


FAR = at("far", (0.1,) * 3, 9.0, 9.0, 9.0)
QS = np.array(
    [
        [0.0, 0.0, 0.0],  # the bead in the hull
        [1.0, 0.3, 0.1],
        [1.0, -0.3, -0.1],
        [1.0, 0.8, 0.0],  # beside it, along x and along y
        [-2.0, 0.0, 0.8],
        [-2.0, -0.8, 0.0],
        [0.5, 0.45, 0.0],  # through its wall
    ]
)
EXPECTED = [True, True, True, False, False, False, True]


def test_a_part_in_another_that_turns(robot):
    single = [bc.check(robot, scene_of(FAR), q).verdict == "contact" for q in QS]
    assert single == EXPECTED
    assert bc.first_contacts(robot, scene_of(FAR), QS).tolist() == EXPECTED
    surfaces = bc.first_contacts(robot, scene_of(FAR), QS, containment=False)
    assert surfaces.tolist() == [False] * 6 + [True]


def test_a_speck_in_a_part_and_a_part_in_a_room(robot):
    """Both ways round; the first obstacle holds nothing."""
    beside = np.array([[0.4, 0.8, 0.0], [0.4, -0.8, 0.0], [-1.5, 0.8, 0.0]])
    T = robot.placements(beside[0])["bead"]
    speck = at("speck", (0.01,) * 3, *T[:3, 3])
    found = bc.first_contacts(robot, scene_of(FAR, speck), beside)
    assert found.tolist() == [True, False, False]
    room = at("room", (0.4,) * 3, *T[:3, 3])
    found = bc.first_contacts(robot, scene_of(FAR, room), beside)
    assert found.tolist() == [True, False, False]
    for q, expected in zip(beside, (True, False, False), strict=True):
        assert (bc.check(robot, scene_of(room), q).verdict == "contact") == expected


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_beside_a_room_is_not_in_it(robot, axis, side):
    """By a tenth of a metre, on each of its sides: the rest of the arm is elsewhere."""
    q = np.array([0.0, 0.0, 2.9])
    T = robot.placements(q)["bead"]
    shift = np.zeros(3)
    shift[axis] = side * 0.35
    inside = at("room", (0.4,) * 3, *T[:3, 3])
    beside = at("room", (0.4,) * 3, *(T[:3, 3] + shift))
    assert bc.first_contacts(robot, scene_of(inside), [q]).tolist() == [True]
    assert bc.first_contacts(robot, scene_of(beside), [q]).tolist() == [False]


def test_an_open_obstacle_might_hold_what_is_in_its_box(robot):
    q = np.array([[0.0, 0.0, 2.9], [0.0, 0.0, -2.9]])
    place = robot.placements(q[0])["bead"][:3, 3]
    whole = at("room", (0.4,) * 3, *place)
    opened = TriangleMesh("room", whole.vertices, whole.triangles[:-1])
    found = bc.first_contacts(robot, scene_of(opened), q)
    assert found.tolist() == [True, False]


def test_one_bad_number_among_many_is_refused(robot):
    for bad in (np.nan, np.inf):
        qs = QS.copy()
        qs[3, 1] = bad
        with pytest.raises(UsageError, match="not finite"):
            as_configurations(robot, qs)
    with pytest.raises(JointLimitError, match="configuration 4: "):
        refuse_beyond_limits(robot, np.where(np.arange(7)[:, None] == 4, 3.1, QS))
    for shape in ((3,), (2, 2), (2, 4), (1, 2, 3)):
        with pytest.raises(UsageError, match="shape"):
            as_configurations(robot, np.zeros(shape))
    copy = as_configurations(robot, QS)
    copy[0, 0] = 9.0
    assert QS[0, 0] == 0.0


def test_what_was_packed_is_packed_once(robot):
    scene = scene_of(FAR)
    assert prepared(robot, scene) is prepared(robot, scene)
    placed = prepared(robot, scene).placements(QS)
    for q, T_parts in zip(QS, placed, strict=True):
        for part, T in zip(robot.parts, T_parts, strict=True):
            np.testing.assert_allclose(T, robot.placements(q)[part.link], atol=1e-12)


@pytest.mark.parametrize(("unseen", "corners"), [(False, WITNESSES), (True, 1)])
def test_one_corner_tells_where_surfaces_may_meet_unseen(monkeypatch, unseen, corners):
    """Else as many as are kept must be within, before a ray is asked."""
    asked = []
    monkeypatch.setattr(solid_pairs, "holding", lambda *given: asked.append(given))
    entries = SimpleNamespace(entries="entries")
    links, others = (SimpleNamespace(arrays=name) for name in ("links", "others"))
    placements = np.zeros((2, 3, 4, 4))
    for standing in (None, "standing"):
        moving = SimpleNamespace(T_world_others=standing, pairs=[0] * 5, book=entries)
        pairs = solid_pairs.SolidPairs(moving, links, others)
        codes = pairs.codes(placements, unseen=unseen)
        assert codes.shape == (2, 5)
        book, *both, first, second, own, count, _, settled, room = asked[-1]
        assert (book, both) == ("entries", ["links", "others"])
        assert first is placements
        assert second is (placements if standing is None else standing)
        assert (own, count) == (standing is None, corners)
        assert not settled.any()
        assert room is codes


def test_pairs_that_are_left_are_whole_numbers_even_of_none(robot):
    for itself in (False, True):
        for pairs in pairs_without(robot, scene_of(), (), itself):
            assert pairs.dtype == np.int64
            assert pairs.shape[1] == 2
    assert len(pairs_without(robot, scene_of(), (), False)[1]) == 0
    assert len(pairs_without(robot, scene_of(), (), True)[1]) == len(robot.self_pairs)
