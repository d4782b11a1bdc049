"""Planners' queries: what `check` and `first_contacts` say, asked in bulk."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.queries import CANNOT_TELL, NO, YES
from borecheck.core.se3 import transform
from borecheck.errors import GeometryError, UnknownNameError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.scene import Obstacle, Scene


@pytest.fixture(scope="module")
def robot():
    return bc.load_robot("zerobot", mount="+90")


@pytest.fixture(scope="module")
def scene():
    return bc.load_scene("ct_gantry")


@pytest.fixture(scope="module")
def qs(robot):
    drawn = robot.model.random_configurations(np.random.default_rng(8), 60)
    return np.vstack([robot.home, drawn])


@pytest.fixture(scope="module")
def verdicts(robot, scene, qs):
    return [bc.check(robot, scene, q) for q in qs]


@pytest.fixture(scope="module")
def asked(robot, scene):
    return bc.queries(robot, scene)


def test_touches_is_what_check_does_not_call_clear(asked, qs, verdicts):
    expected = [v.verdict != "clear" for v in verdicts]
    assert asked.touches(qs).tolist() == expected
    assert asked.touches(qs, threads=2).tolist() == expected
    assert 0 < sum(expected) < len(expected)


def test_the_pair_named_is_one_that_check_found(asked, qs, verdicts):
    for row, verdict in zip(asked.touching_pair(qs), verdicts, strict=True):
        both = (*verdict.contacts, *verdict.self_contacts)
        named = {(pair.link, pair.obstacle) for pair in both}
        named |= {(c.link, c.obstacle) for c in verdict.contained}
        assert (row == -1) == (not named)
        assert row == -1 or asked.pairs[row] in named


def test_clearance_is_that_of_check(asked, qs, verdicts):
    for bounds, verdict in zip(asked.clearance(qs), verdicts, strict=True):
        if verdict.contacts or any(c.holds for c in verdict.contained):
            assert bounds.tolist() == [0.0, 0.0]
        else:
            assert bounds[0] == pytest.approx(verdict.closest.distance, abs=1e-12)
            assert bounds[1] == pytest.approx(verdict.closest.upper, abs=1e-12)
    rough = asked.clearance(qs, within=0.1)
    exact = asked.clearance(qs)
    assert (rough[:, 0] <= exact[:, 1]).all()
    assert (rough[:, 1] >= exact[:, 0]).all()
    assert (rough[:, 1] <= 1.1 * rough[:, 0] + 1e-9).all()


def test_each_link_and_each_pair_have_their_clearance(asked, robot, scene, qs):
    some = qs[:12]
    pairs, links = asked.clearances(some, "pair"), asked.clearances(some, "link")
    assert pairs.shape == (12, len(robot.parts) * len(scene.obstacles), 2)
    names = [part.mesh.name for part in robot.parts]
    for a, name in enumerate(names):
        mine = [
            k
            for k, (link, _) in enumerate(asked.pairs[: pairs.shape[1]])
            if link == name
        ]
        np.testing.assert_array_equal(links[:, a], pairs[:, mine].min(axis=1))
    np.testing.assert_allclose(links.min(axis=1), asked.clearance(some), atol=1e-12)
    with pytest.raises(UnknownNameError, match="each"):
        asked.clearances(some, "joint")


@pytest.mark.parametrize("distance", [0.0, 0.001, 0.02, 0.1])
def test_nearer_than_is_decided_by_the_clearance(asked, qs, distance):
    near, bounds = asked.nearer_than(qs, distance), asked.clearance(qs)
    touching = asked.touches(qs)
    for answer, (lower, upper), touch in zip(near, bounds, touching, strict=True):
        assert answer == (YES if touch or upper <= distance else NO)
        assert touch or (lower > distance) == (answer == NO)
    with_margin = bc.queries(asked._robot, asked._scene, distance)
    np.testing.assert_array_equal(with_margin.touches(qs), near != NO)
    rows = with_margin.touching_pair(qs)
    assert ((rows == -1) == (near == NO)).all()


def test_beyond_limits_is_a_mask_and_never_free(asked, robot, qs):
    some = qs[:4].copy()
    some[1, 0] = robot.model.upper[0] + 0.1
    some[3, 1] = robot.model.lower[1] - 0.1
    expected = [False, True, False, True]
    assert asked.beyond_limits(some).tolist() == expected
    assert asked.touches(some)[[1, 3]].all()
    assert (asked.touching_pair(some)[[1, 3]] == -2).all()
    assert (asked.nearer_than(some, 0.01)[[1, 3]] == CANNOT_TELL).all()
    for bounds in (
        asked.clearance(some),
        asked.clearances(some)[:, 0],
        asked.gradient(some),
    ):
        assert np.isnan(bounds).all(axis=1)[[1, 3]].all()
    np.testing.assert_array_equal(
        asked.touches(some)[[0, 2]], asked.touches(some[[0, 2]])
    )
    for bad in (np.nan, np.inf):
        some[0, 0] = bad
        with pytest.raises(UsageError, match="finite"):
            asked.touches(some)
    with pytest.raises(UsageError, match="shape"):
        asked.touches(qs[0])


def test_the_gradient_is_the_difference_quotient(asked, qs):
    """Central differences of the exact clearance, where the nearest pair stays one."""
    h, compared = 1e-6, 0
    free = qs[~asked.touches(qs)]
    gradients = asked.gradient(free)
    for q, gradient in zip(free, gradients, strict=True):
        for j in range(len(q)):
            step = np.eye(len(q))[j] * h
            low, middle, high = asked.clearance([q - step, q, q + step])[:, 1]
            if np.isnan([low, high]).any():
                continue
            left, right = (middle - low) / h, (high - middle) / h
            if abs(left - right) > 1e-4:
                continue  # a kink: another pair, corner or edge becomes the nearest
            assert gradient[j] == pytest.approx((left + right) / 2, abs=2e-4)
            compared += 1
    assert compared > 20
    touching = qs[asked.touches(qs)]
    assert np.isnan(
        asked.gradient(touching)[asked.clearance(touching)[:, 1] == 0]
    ).all()


def test_pairs_that_are_skipped_are_not_asked_and_no_others(robot, scene, asked, qs):
    contacts = asked.touching_pair(qs)
    row = int(np.bincount(contacts[contacts >= 0]).argmax())
    pair = asked.pairs[row]
    less = bc.queries(robot, scene, skip=[pair[::-1]])
    assert set(asked.pairs) - set(less.pairs) == {pair}
    freed = asked.touches(qs) & ~less.touches(qs)
    assert freed.any()
    for q in qs[freed]:
        verdict = bc.check(robot, scene, q)
        both = (*verdict.contacts, *verdict.self_contacts, *verdict.contained)
        assert {(x.link, x.obstacle) for x in both} == {pair}
    alone = bc.queries(robot, scene, itself=False)
    assert len(alone.pairs) == len(robot.parts) * len(scene.obstacles)
    for bad in ([("needle", "moon")], [("needle",)], ["needle"], [("couch", "couch")]):
        with pytest.raises((UsageError, UnknownNameError)):
            bc.queries(robot, scene, skip=bad)


def scene_of(*meshes):
    obstacles = tuple(Obstacle(m.name, "other", m, "t") for m in meshes)
    return Scene("s", None, {}, "t", obstacles, {}, (), ())


def test_moved_obstacles_and_base_are_those_of_a_scene_loaded_there(robot, qs):
    some = qs[:25]
    wall = box("wall", (0.4, 0.4, 0.05))
    shift = transform((0.1, 0.45, 0.3), (0.4, -0.2, 0.9))
    placed = TriangleMesh(
        "wall", wall.vertices @ shift[:3, :3].T + shift[:3, 3], wall.triangles
    )
    asked = bc.queries(robot, scene_of(wall))
    there = bc.queries(robot, scene_of(placed))
    moved = asked.moved({"wall": shift})
    np.testing.assert_array_equal(moved.touches(some), there.touches(some))
    np.testing.assert_allclose(moved.clearance(some), there.clearance(some), atol=1e-9)
    base = transform((0.05, 0.1, -0.02), (0.1, 0.2, 0.3))
    elsewhere = bc.load_robot("zerobot", mount="+90", base=base)
    there = bc.queries(elsewhere, scene_of(wall))
    moved = asked.moved(base=base)
    np.testing.assert_array_equal(moved.touches(some), there.touches(some))
    np.testing.assert_allclose(moved.clearance(some), there.clearance(some), atol=1e-9)
    np.testing.assert_allclose(moved.gradient(some), there.gradient(some), atol=1e-6)
    with pytest.raises(UnknownNameError):
        asked.moved({"moon": shift})
    with pytest.raises(GeometryError):
        asked.moved({"wall": 2.0 * shift})
    # and what was asked before stays where it was
    again = bc.queries(robot, scene_of(wall))
    np.testing.assert_array_equal(asked.touches(some), again.touches(some))


def test_what_stands_in_a_solid_touches_it_unless_solids_are_not_asked(robot):
    room = box("room", (9.0, 9.0, 9.0))
    q = robot.home[None]
    asked = bc.queries(robot, scene_of(room))
    assert asked.touches(q)[0]
    assert asked.nearer_than(q, 1e-3)[0] == YES
    assert asked.clearance(q).tolist() == [[0.0, 0.0]]
    assert (asked.clearances(q) == 0.0).all()
    assert np.isnan(asked.gradient(q)).all()
    surfaces = bc.queries(robot, scene_of(room), solids=False)
    assert not surfaces.touches(q)[0]
    assert surfaces.clearance(q)[0, 0] > 1.0
    opened = TriangleMesh("room", room.vertices, room.triangles[:-1])
    unsure = bc.queries(robot, scene_of(opened))
    assert unsure.touches(q)[0]
    assert unsure.nearer_than(q, 1e-3)[0] == CANNOT_TELL
    lower, upper = unsure.clearance(q)[0]
    assert lower == 0.0
    assert upper > 1.0
    twice = TriangleMesh(
        "room", room.vertices, np.vstack([room.triangles, room.triangles[:, ::-1]])
    )
    unsure = bc.queries(robot, scene_of(twice))
    assert unsure.touches(q)[0]
    assert unsure.nearer_than(q, 1e-3)[0] == CANNOT_TELL


def test_a_scene_in_doubt_or_a_margin_that_is_none_is_refused(robot, scene):
    for margin in (-1e-9, np.nan, np.inf):
        with pytest.raises(UsageError, match="margin"):
            bc.queries(robot, scene, margin)
    with pytest.raises(UsageError, match="distance"):
        bc.queries(robot, scene).nearer_than(robot.home[None], -1.0)


def test_a_robot_without_obstacles_has_only_itself_to_touch(robot, qs):
    asked = bc.queries(robot, scene_of())
    assert len(asked.pairs) == len(robot.self_pairs)
    touching = asked.touches(qs[:20])
    states = [bool(bc.check(robot, scene_of(), q).self_contacts) for q in qs[:20]]
    assert touching.tolist() == states
    assert np.isinf(asked.clearance(qs[:3])).all()
    assert np.isnan(asked.gradient(qs[:3])).all()
