"""Compiled kinematics against products of plain numpy matrices."""

import dataclasses

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.errors import GeometryError
from borecheck.motion.bounds import route
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS, WORLD
from tests.robots.kinematics.plain import relative_placement

# One joint about x.
ONE = {
    "parent": [WORLD],
    "origin": [np.eye(4)],
    "kind": [TURNS],
    "axis": [[1.0, 0.0, 0.0]],
    "source": [0],
    "factor": [1.0],
    "offset": [0.0],
}
# Ten products of matrices with entries near 1.
ROUNDING = 1e-14


def random_chain(rng, joints=10, variables=6):
    """A tree with every kind of joint, branches and mimic joints."""
    kinds = [FIXED, TURNS, SLIDES] + [TURNS] * (joints - 3)
    sources = rng.integers(0, variables, joints)
    sources[-1] = variables - 1
    return JointChain(
        parent=[int(rng.integers(WORLD, k)) for k in range(joints)],
        origin=[
            transform(rng.uniform(-0.5, 0.5, 3), rng.uniform(-3, 3, 3))
            for _ in range(joints)
        ],
        axis=rng.normal(size=(joints, 3)),
        kind=kinds,
        source=np.where(np.array(kinds) == FIXED, -1, sources),
        factor=rng.choice([1.0, -1.0, 0.5], joints),
        offset=rng.uniform(-1, 1, joints),
    )


def plain_placements(chain, q):
    return [
        relative_placement(chain, route(chain, WORLD, frame), chain.thetas(q))
        for frame in range(chain.frame_count)
    ]


@pytest.mark.parametrize("seed", range(5))
def test_placements_are_products_of_matrices(seed):
    rng = np.random.default_rng(seed)
    chain = random_chain(rng)
    qs = rng.uniform(-4, 4, (20, 6))
    placements = chain.placements(qs)
    expected = np.array([plain_placements(chain, q) for q in qs])
    np.testing.assert_allclose(placements, expected, atol=ROUNDING)
    assert np.ptp(placements[..., :3, 3], axis=0).max() > 0.1
    one = [chain.placed(chain.thetas(q)) for q in qs]
    np.testing.assert_array_equal(one, placements)


def test_frames_come_in_the_order_asked():
    chain = random_chain(np.random.default_rng(6))
    qs = np.random.default_rng(7).uniform(-1, 1, (4, 6))
    every = chain.placements(qs)
    np.testing.assert_array_equal(
        chain.placements(qs, [7, 0, 3, 3]), every[:, [7, 0, 3, 3]]
    )
    assert chain.placements(qs, []).shape == (4, 0, 4, 4)
    assert chain.placements(qs[:0]).shape == (0, 10, 4, 4)
    assert (every[:, :, 3] == (0.0, 0.0, 0.0, 1.0)).all()


def test_tiny_turns_keep_their_digits():
    """1 - cos(x) of x = 1e-9 is not 0."""
    chain = JointChain(**{**ONE, "axis": [[0.6, 0.8, 0.0]]})
    R = chain.placements([[1e-9]])[0, 0, :3, :3]
    assert R[0, 1] == pytest.approx(0.48 * 0.5e-18, rel=1e-12)


def test_a_lone_root_and_a_robot_without_variables():
    root = transform((1.0, 2.0, 3.0))
    alone = JointChain(**{**ONE, "origin": [root], "kind": [FIXED], "source": [-1]})
    placements = alone.placements(np.zeros((2, 0)))
    np.testing.assert_array_equal(placements, np.tile(root, (2, 1, 1, 1)))


def test_arrays_are_copied():
    rng = np.random.default_rng(8)
    origins = np.tile(np.eye(4), (1, 1, 1))
    chain = JointChain(**{**ONE, "origin": origins, "kind": [SLIDES]})
    qs = rng.uniform(-1, 1, (3, 1))
    before = chain.placements(qs)
    origins += 1.0
    np.testing.assert_array_equal(chain.placements(qs), before)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("parent", [-1, 1], "joint 1 comes before its parent"),
        ("parent", [-2, 0], "joint 0 comes before its parent"),
        ("parent", [-1, 0, 1], "shape"),
        ("origin", np.tile(np.diag([1.0, 1, -1, 1]), (2, 1, 1)), "origin of joint 0"),
        ("axis", [[1.0, 0, 0], [0, 0, 0.0]], "length 0"),
        ("kind", [TURNS, 7], "kind 7"),
        ("source", [0, -1], "no source"),
        ("factor", [1.0, np.nan], "not finite"),
        ("offset", ["a", "b"], "no number"),
    ],
)
def test_chains_that_do_not_hold_together_are_refused(name, value, words):
    good = {
        "parent": [WORLD, 0],
        "origin": np.tile(np.eye(4), (2, 1, 1)),
        "axis": [[1.0, 0, 0], [0, 0, 1.0]],
        "kind": [TURNS, TURNS],
        "source": [0, 1],
        "factor": [1.0, 1.0],
        "offset": [0.0, 0.0],
    }
    assert dataclasses.is_dataclass(JointChain(**good))
    with pytest.raises(GeometryError, match=words):
        JointChain(**{**good, name: value})


def test_axes_are_brought_to_length_1():
    chain = JointChain(**{**ONE, "axis": [[0.0, 0.0, 2.0]], "kind": [SLIDES]})
    assert chain.placements([[0.5]])[0, 0, 2, 3] == 0.5


def test_configurations_and_frames_without_an_answer_are_refused():
    chain = random_chain(np.random.default_rng(9))
    with pytest.raises(GeometryError, match="shape"):
        chain.placements(np.zeros(6))
    with pytest.raises(GeometryError, match="configuration 1"):
        chain.placements([[0.0] * 6, [np.nan] * 6])
    for frames in ([10], [-1], [[0]]):
        with pytest.raises(GeometryError, match="frames"):
            chain.placements(np.zeros((1, 6)), frames)
