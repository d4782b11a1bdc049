"""Compiled kinematics against products of plain numpy matrices."""

import dataclasses

import numpy as np
import pytest

from borecheck.core.se3 import axis_rotation, transform
from borecheck.errors import GeometryError
from borecheck.robots.kinematics.chain import FIXED, PRISMATIC, REVOLUTE, Chain

# Ten products of matrices with entries near 1.
ROUNDING = 1e-14


def random_chain(rng, joints=10, variables=6):
    """A tree with every kind of joint, branches and mimic joints."""
    axes = rng.normal(size=(joints, 3))
    return Chain(
        parents=[int(rng.integers(0, k + 1)) for k in range(joints)],
        origins=[
            transform(rng.uniform(-0.5, 0.5, 3), rng.uniform(-3, 3, 3))
            for _ in range(joints)
        ],
        axes=axes / np.linalg.norm(axes, axis=1, keepdims=True),
        kinds=[FIXED, REVOLUTE, PRISMATIC] + [REVOLUTE] * (joints - 3),
        sources=rng.integers(0, variables, joints),
        multipliers=rng.choice([1.0, -1.0, 0.5], joints),
        offsets=rng.uniform(-1, 1, joints),
        variables=variables,
    )


def plain_placements(chain, q, T_world_root):
    frames = [T_world_root]
    for k in range(len(chain.parents)):
        T = np.eye(4)
        x = chain.multipliers[k] * q[chain.sources[k]] + chain.offsets[k]
        if chain.kinds[k] == REVOLUTE:
            T[:3, :3] = axis_rotation(chain.axes[k], x)
        if chain.kinds[k] == PRISMATIC:
            T[:3, 3] = x * chain.axes[k]
        frames.append(frames[chain.parents[k]] @ chain.origins[k] @ T)
    return np.array(frames)


@pytest.mark.parametrize("seed", range(5))
def test_placements_are_products_of_matrices(seed):
    rng = np.random.default_rng(seed)
    chain = random_chain(rng)
    qs = rng.uniform(-4, 4, (20, 6))
    root = transform(rng.uniform(-1, 1, 3), rng.uniform(-3, 3, 3))
    placements = chain.placements(qs, T_world_root=root)
    expected = np.array([plain_placements(chain, q, root) for q in qs])
    np.testing.assert_allclose(placements, expected, atol=ROUNDING)
    assert np.ptp(placements[..., :3, 3], axis=0).max() > 0.1
    in_world = chain.placements(qs)
    np.testing.assert_allclose(root @ in_world, expected, atol=ROUNDING)


def test_frames_come_in_the_order_asked():
    chain = random_chain(np.random.default_rng(6))
    qs = np.random.default_rng(7).uniform(-1, 1, (4, 6))
    every = chain.placements(qs)
    np.testing.assert_array_equal(
        chain.placements(qs, [7, 0, 3, 3]), every[:, [7, 0, 3, 3]]
    )
    assert chain.placements(qs, []).shape == (4, 0, 4, 4)
    assert chain.placements(qs[:0]).shape == (0, 11, 4, 4)
    assert (every[:, :, 3] == (0.0, 0.0, 0.0, 1.0)).all()


def test_tiny_turns_keep_their_digits():
    """1 - cos(x) of x = 1e-9 is not 0."""
    chain = Chain([0], [np.eye(4)], [[0.6, 0.8, 0.0]], [REVOLUTE], [0], [1.0], [0.0], 1)
    R = chain.placements([[1e-9]])[0, 1, :3, :3]
    assert R[0, 1] == pytest.approx(0.48 * 0.5e-18, rel=1e-12)


def test_a_lone_root_and_a_robot_without_variables():
    empty = Chain([], np.zeros((0, 4, 4)), np.zeros((0, 3)), [], [], [], [], 0)
    root = transform((1.0, 2.0, 3.0))
    placements = empty.placements(np.zeros((2, 0)), T_world_root=root)
    np.testing.assert_array_equal(placements, np.tile(root, (2, 1, 1, 1)))


def test_arrays_are_copied():
    rng = np.random.default_rng(8)
    origins = np.tile(np.eye(4), (1, 1, 1))
    chain = Chain([0], origins, [[1.0, 0, 0]], [PRISMATIC], [0], [1.0], [0.0], 1)
    qs = rng.uniform(-1, 1, (3, 1))
    before = chain.placements(qs)
    origins += 1.0
    np.testing.assert_array_equal(chain.placements(qs), before)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("parents", [0, 2], "joint 1 stands in frame 2"),
        ("parents", [-1, 0], "joint 0 stands in frame -1"),
        ("parents", [0, 1, 2], "shape"),
        ("origins", np.tile(np.diag([1.0, 1, -1, 1]), (2, 1, 1)), "origin of joint 0"),
        ("axes", [[1.0, 0, 0], [0, 0, 2.0]], "unit length"),
        ("kinds", [REVOLUTE, 7], "kinds"),
        ("sources", [0, 2], "source"),
        ("multipliers", [1.0, np.nan], "not finite"),
        ("offsets", ["a", "b"], "no numbers"),
    ],
)
def test_chains_that_do_not_hold_together_are_refused(name, value, words):
    good = {
        "parents": [0, 1],
        "origins": np.tile(np.eye(4), (2, 1, 1)),
        "axes": [[1.0, 0, 0], [0, 0, 1.0]],
        "kinds": [REVOLUTE, REVOLUTE],
        "sources": [0, 1],
        "multipliers": [1.0, 1.0],
        "offsets": [0.0, 0.0],
        "variables": 2,
    }
    assert dataclasses.is_dataclass(Chain(**good))
    with pytest.raises(GeometryError, match=words):
        Chain(**{**good, name: value})


def test_configurations_and_frames_without_an_answer_are_refused():
    chain = random_chain(np.random.default_rng(9))
    with pytest.raises(GeometryError, match="shape"):
        chain.placements(np.zeros(6))
    with pytest.raises(GeometryError, match="configuration 1"):
        chain.placements([[0.0] * 6, [np.nan] * 6])
    for frames in ([11], [-1], [[0]]):
        with pytest.raises(GeometryError, match="frames"):
            chain.placements(np.zeros((1, 6)), frames)
    with pytest.raises(GeometryError, match="T_world_root"):
        chain.placements(np.zeros((1, 6)), T_world_root=np.zeros((4, 4)))
