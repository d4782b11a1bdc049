"""A batch answers what single queries answer, pose by pose."""

import copy
import gc
import pickle

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.errors import GeometryError, UnknownNameError
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.tree.packed import PackedTrees
from borecheck.geometry.triangles.published import NARROWPHASES

EYE = np.eye(4)
POSES = 40
# Two bounds of one distance by different walks differ by the error of a distance.
ROUNDING = 1e-12


def first_contacts(links, obstacles, placements, T_obstacles=None, *args, **kwargs):
    """Of all links against all obstacles."""
    scene = MovingLinks.against(links, obstacles, T_obstacles)
    return scene.first_contacts(placements, *args, **kwargs)


def first_self_contacts(links, pairs, placements):
    """Of the listed pairs of links."""
    return MovingLinks.among(links, pairs).first_contacts(placements)


def soup(rng, count, size=0.15):
    centres = rng.uniform(-0.5, 0.5, (count, 1, 3))
    corners = centres + size * rng.normal(size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


@pytest.fixture(scope="module")
def room():
    """Three links, two obstacles, poses: some clear, some not."""
    rng = np.random.default_rng(21)
    links = [MeshTree(*soup(rng, n)) for n in (1, 30, 12)]
    obstacles = [MeshTree(*soup(rng, n)) for n in (25, 40)]
    placements = np.array(
        [
            [transform(rng.uniform(-1.3, 1.3, 3), rng.uniform(-3, 3, 3)) for _ in links]
            for _ in range(POSES)
        ]
    )
    T_obstacles = np.array([EYE, transform((0.4, 0.3, -0.2), (0.1, 1.0, 2.0))])
    return links, obstacles, placements, T_obstacles


def single_pairs(room, narrowphase):
    """First (link, obstacle) in contact by single queries, or -1."""
    links, obstacles, placements, T_obstacles = room
    hits = []
    for pose in placements:
        hit = -1
        for k in reversed(range(len(links) * len(obstacles))):
            link, other = divmod(k, len(obstacles))
            if links[link].first_contact(
                obstacles[other], pose[link], T_obstacles[other], narrowphase
            ):
                hit = k
        hits.append(hit)
    return np.array(hits)


@pytest.mark.parametrize("narrowphase", NARROWPHASES)
def test_same_answers_as_single_queries(room, narrowphase):
    links, obstacles, placements, T_obstacles = room
    expected = single_pairs(room, narrowphase)
    assert POSES // 5 < (expected >= 0).sum() < POSES
    scene = MovingLinks.against(links, obstacles, T_obstacles)
    np.testing.assert_array_equal(scene.first_pairs(placements, narrowphase), expected)
    contact = first_contacts(links, obstacles, placements, T_obstacles, narrowphase)
    assert contact.dtype == np.bool_
    np.testing.assert_array_equal(contact, expected >= 0)


@pytest.mark.parametrize("threads", [2, 3, 64])
def test_threads_change_nothing(room, threads):
    links, obstacles, placements, T_obstacles = room
    scene = MovingLinks.against(links, obstacles, T_obstacles)
    np.testing.assert_array_equal(
        scene.first_pairs(placements, threads=threads), scene.first_pairs(placements)
    )
    np.testing.assert_array_equal(
        scene.clearances(placements, 0.1, threads), scene.clearances(placements, 0.1)
    )


def test_all_contacts_are_those_of_single_queries(room):
    links, obstacles, placements, T_obstacles = room
    expected = []
    for i, pose in enumerate(placements):
        for k in range(len(links) * len(obstacles)):
            link, other = divmod(k, len(obstacles))
            T, T_other = pose[link], T_obstacles[other]
            pairs = links[link].contacts(obstacles[other], T, T_other)
            expected += [(i, k, *pair) for pair in pairs.tolist()]
    scene = MovingLinks.against(links, obstacles, T_obstacles)
    assert len(expected) > 50
    np.testing.assert_array_equal(scene.contacts(placements), expected)


def test_more_contacts_than_room_at_first(monkeypatch, room):
    links, obstacles, placements, T_obstacles = room
    scene = MovingLinks.against(links, obstacles, T_obstacles)
    expected = scene.contacts(placements)
    monkeypatch.setattr("borecheck.geometry.tree.many_links._FIRST_ROOM", 3)
    np.testing.assert_array_equal(scene.contacts(placements), expected)


def test_obstacles_stand_in_the_world_unless_told_otherwise(room):
    links, obstacles, placements, _ = room
    still = np.tile(EYE, (2, 1, 1))
    np.testing.assert_array_equal(
        first_contacts(links, obstacles, placements),
        first_contacts(links, obstacles, placements, still),
    )


def test_self_contact_of_listed_pairs_only(room):
    links, _, placements, _ = room
    near = placements.copy()
    near[..., :3, 3] *= 0.5
    pairs = [(0, 1), (2, 1)]
    expected = np.array(
        [
            any(links[a].first_contact(links[b], T[a], T[b]) for a, b in pairs)
            for T in near
        ]
    )
    assert POSES // 5 < expected.sum() < POSES
    np.testing.assert_array_equal(first_self_contacts(links, pairs, near), expected)
    assert not first_self_contacts(links, [], near).any()
    one = MovingLinks.among(links, pairs).first_contacts(near[:1])
    np.testing.assert_array_equal(one, expected[:1])


def test_pair_clearances_are_those_of_single_queries(room):
    links, obstacles, placements, T_obstacles = room
    scene = MovingLinks.against(links, obstacles, T_obstacles)
    bounds = scene.pair_clearances(placements)
    assert bounds.shape == (POSES, 6, 2)
    for pose, of_pose in zip(placements, bounds, strict=True):
        for k, found in enumerate(of_pose):
            link, other = divmod(k, len(obstacles))
            expected = links[link].clearance(
                obstacles[other], pose[link], T_obstacles[other]
            )
            np.testing.assert_allclose(found, expected, atol=ROUNDING)
            assert (found[1] == 0.0) == (expected[1] == 0.0)


@pytest.mark.parametrize("tolerance", [0.0, 0.1, 1.0])
def test_clearance_of_a_pose_is_the_least_of_its_pairs(room, tolerance):
    links, obstacles, placements, T_obstacles = room
    scene = MovingLinks.against(links, obstacles, T_obstacles)
    exact = scene.pair_clearances(placements)
    bounds, pairs = scene.nearest_pairs(placements, tolerance)
    np.testing.assert_array_equal(scene.clearances(placements, tolerance), bounds)
    least = exact.min(axis=1)
    assert (least[:, 1] > 0.0).sum() > POSES // 4
    assert (bounds[:, 0] <= least[:, 1] + ROUNDING).all()
    assert (least[:, 0] <= bounds[:, 1] + ROUNDING).all()
    assert (bounds[:, 1] <= (1.0 + tolerance) * bounds[:, 0] + ROUNDING).all()
    np.testing.assert_array_equal(bounds[:, 1] == 0.0, least[:, 1] == 0.0)
    reached = exact[np.arange(POSES), pairs]
    assert (reached[:, 0] <= bounds[:, 1] + ROUNDING).all()


def test_packed_trees_serve_as_the_list_they_were_made_of(room):
    links, obstacles, placements, _ = room
    packed = PackedTrees(links), PackedTrees(obstacles)
    np.testing.assert_array_equal(
        first_contacts(*packed, placements),
        first_contacts(links, obstacles, placements),
    )
    assert np.shares_memory(PackedTrees(links[:1]).nodes, links[0].nodes)


def test_nothing_to_ask_is_clear(room):
    links, obstacles, placements, _ = room
    assert not first_contacts(links, [], placements).any()
    assert not first_contacts([], obstacles, np.zeros((3, 0, 4, 4))).any()
    assert first_contacts(links, obstacles, placements[:0]).shape == (0,)
    scene = MovingLinks.against(links, [])
    assert np.isinf(scene.clearances(placements)).all()
    assert scene.pair_clearances(placements).shape == (POSES, 0, 2)


def test_read_only_and_strided_placements(room):
    links, obstacles, placements, _ = room
    expected = first_contacts(links, obstacles, placements)
    frozen = placements.copy()
    frozen.setflags(write=False)
    np.testing.assert_array_equal(first_contacts(links, obstacles, frozen), expected)
    wide = np.repeat(placements, 2, axis=0)[::2]
    np.testing.assert_array_equal(first_contacts(links, obstacles, wide), expected)


def test_bad_placements_are_named(room):
    links, obstacles, placements, T_obstacles = room
    bad = placements.copy()
    bad[7, 2, 0, 0] += 0.01
    for threads in (1, 3):
        with pytest.raises(GeometryError, match=r"placements\[7, 2\]"):
            first_contacts(links, obstacles, bad, threads=threads)
    bad[7, 2] = np.nan
    with pytest.raises(GeometryError, match=r"placements\[7, 2\]"):
        MovingLinks.against(links, obstacles).clearances(bad)
    with pytest.raises(GeometryError, match="shape"):
        first_contacts(links, obstacles, placements[:, :2])
    with pytest.raises(GeometryError, match="shape"):
        first_contacts(links, obstacles, placements, T_obstacles[:1])
    with pytest.raises(GeometryError, match=r"T_world_obstacles\[1\]"):
        first_contacts(links, obstacles, placements, T_obstacles * [[[1]], [[2]]])
    with pytest.raises(GeometryError, match="link_pairs"):
        first_self_contacts(links, [(0, 3)], placements)
    with pytest.raises(UnknownNameError):
        first_contacts(links, obstacles, placements, narrowphase="none")
    with pytest.raises(GeometryError, match="threads"):
        first_contacts(links, obstacles, placements, threads=0)
    with pytest.raises(GeometryError, match="relative_tolerance"):
        MovingLinks.against(links, obstacles).clearances(placements, -1.0)


@pytest.mark.parametrize("narrowphase", NARROWPHASES)
def test_one_pose_is_asked_as_many(room, narrowphase):
    links, obstacles, placements, T_obstacles = room
    scene = MovingLinks.against(links, obstacles, T_obstacles)
    expected = scene.first_pairs(placements, narrowphase)
    given = [scene.first_pair(pose, narrowphase) for pose in placements]
    assert given == expected.tolist()
    assert min(given) == -1 < max(given)
    with pytest.raises(GeometryError, match=r"placements\[0, 1\]"):
        scene.first_pair(placements[0] * np.array([1, np.nan, 1])[:, None, None])


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_copies_answer_when_the_original_is_gone(room, copied):
    links, obstacles, placements, T_obstacles = room
    scene = MovingLinks.against(links, obstacles, T_obstacles)
    expected = scene.first_pairs(placements)
    twin = copied(scene)
    del scene
    gc.collect()
    np.testing.assert_array_equal(twin.first_pairs(placements), expected)
    lone, other = copied(links[1]), copied(obstacles[0])
    np.testing.assert_array_equal(
        lone.contacts(other, EYE, EYE), links[1].contacts(obstacles[0], EYE, EYE)
    )
