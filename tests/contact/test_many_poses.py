import copy
import gc
import pickle
from dataclasses import replace

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.pose_batch import PoseBatch, prepared
from borecheck.contact.pose_book import FREE
from borecheck.errors import JointLimitError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.kinematics.robot_chain import breadth_first, chain_of
from borecheck.robots.scene import Obstacle, Scene
from tests.places import ROBOTS

# two ways to multiply some dozen transforms near 1 m
ROUNDING = 1e-12


def test_placements_agree_with_pinocchio(zerobot, ct_gantry, rng):
    qs = zerobot.model.random_configurations(rng, 100)
    placed = prepared(zerobot, ct_gantry).placements(qs)
    for q, T_parts in zip(qs, placed, strict=True):
        reference = zerobot.placements(q)
        for part, T in zip(zerobot.parts, T_parts, strict=True):
            np.testing.assert_allclose(T, reference[part.link], atol=ROUNDING)


def test_same_answers_as_single_checks(zerobot, ct_gantry, rng):
    qs = zerobot.model.random_configurations(rng, 60)
    found = bc.first_contacts(zerobot, ct_gantry, qs)
    single = [bc.check(zerobot, ct_gantry, q).verdict == "contact" for q in qs]
    assert 10 < sum(single) < 58
    assert found.tolist() == single


def test_one_by_one_is_the_same_as_all_at_once(zerobot, ct_gantry, rng):
    qs = zerobot.model.random_configurations(rng, 40)
    together = bc.first_contacts(zerobot, ct_gantry, qs)
    alone = [bc.first_contacts(zerobot, ct_gantry, q[None])[0] for q in qs]
    in_threads = bc.first_contacts(zerobot, ct_gantry, qs, threads=2)
    assert together.tolist() == alone == in_threads.tolist()


@pytest.mark.parametrize("closed", [True, False])
def test_inside_a_solid_counts_and_so_does_an_open_one(closed):
    robot = bc.load_robot(ROBOTS / "two_link.urdf")
    room = box("room", (9.0, 9.0, 9.0))
    mesh = room if closed else TriangleMesh("r", room.vertices, room.triangles[1:])
    scene = Scene("s", None, {}, "t", (Obstacle("r", "other", mesh, ""),), {}, (), ())
    assert bc.first_contacts(robot, scene, [[0.0]]).tolist() == [True]
    surfaces = bc.first_contacts(robot, scene, [[0.0]], containment=False)
    assert surfaces.tolist() == [False]


def test_mimic_chains_move_along():
    robot = bc.load_robot(ROBOTS / "mimic_chain.urdf")
    wall = TriangleMesh("wall", box("w", (9, 0.1, 9)).vertices + [0, 1.0, 0], BOX)
    scene = Scene("s", None, {}, "t", (Obstacle("w", "other", wall, ""),), {}, (), ())
    qs = np.linspace(0.0, 0.6, 25)[:, None]
    found = bc.first_contacts(robot, scene, qs)
    single = [bc.check(robot, scene, q).verdict == "contact" for q in qs]
    assert found.tolist() == single
    assert 3 < sum(single) < 22


BOX = box("w", (1, 1, 1)).triangles


def test_refusals(zerobot, ct_gantry):
    with pytest.raises(JointLimitError, match=r"configuration 1: .*q1"):
        bc.first_contacts(zerobot, ct_gantry, [[0.0] * 6, [9.0, 0, 0, 0, 0, 0]])
    with pytest.raises(UsageError):
        bc.first_contacts(zerobot, ct_gantry, [0.0] * 6)
    with pytest.raises(UsageError):
        bc.first_contacts(zerobot, ct_gantry, [[np.nan] * 6])


def test_joints_come_from_the_root_outwards(zerobot):
    order, frame_of = breadth_first(zerobot.model.tree)
    joints = zerobot.model.tree.joints
    assert sorted(order) == list(range(len(joints)))
    for k, index in enumerate(order):
        assert frame_of[joints[index].child] == k + 1
        assert frame_of[joints[index].parent] <= k
    assert frame_of == chain_of(zerobot)[0]


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_copies_answer_from_their_own_arrays(zerobot, ct_gantry, rng, copied):
    qs = zerobot.model.random_configurations(rng, 40)
    batch = PoseBatch(zerobot, ct_gantry)
    expected = batch.ask(qs).which
    assert -1 == expected.min() < expected.max()
    twin = copied(batch)
    if copied is not copy.copy:
        books = [b._book._groups[2].book for b in (batch, twin)]
        assert np.intersect1d(*books).max() < 2**20  # lengths agree, addresses do not
    del batch
    gc.collect()
    np.testing.assert_array_equal(twin.ask(qs).which, expected)


def test_every_array_is_laid_out_with_all_that_it_holds(zerobot, ct_gantry):
    """Rows of numbers, of boxes, and placements of what stands, in the one pose."""
    batch = PoseBatch(zerobot, ct_gantry)
    groups = batch._book._groups
    arrays = [array for group in groups for array in group]
    standing = (groups[2].standing, groups[3].standing)
    assert [a.shape[1] for a in standing] == [len(ct_gantry.obstacles), 0]
    for array, rows in zip(arrays, batch._book.entries[1::2], strict=True):
        each = 16 if any(array is a for a in standing) else np.prod(array.shape[1:])
        assert rows * each == array.size


def test_a_robot_without_shapes_touches_nothing(zerobot, ct_gantry):
    batch = PoseBatch(replace(zerobot, parts=()), ct_gantry)
    assert batch.frames.dtype == np.int64  # numbers of frames, of none too
    qs = np.array([zerobot.home] * 2)
    assert batch.placements(qs).shape == (2, 0, 4, 4)
    assert batch.ask(qs).states.tolist() == [FREE, FREE]
