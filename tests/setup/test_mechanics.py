"""Torques and manipulability against the closed form, and against their definition."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.setup.mechanics import efforts, twists
from crane.kinematics import jacobian, manipulability

RNG = np.random.default_rng(16)


@pytest.fixture(scope="module")
def crane():
    return bc.load_robot("crane")


def test_manipulability_is_the_closed_forms(crane):
    qs = bc.random_configurations(crane, 200, seed=1)
    moved = twists(crane, qs)
    np.testing.assert_allclose(moved.manipulability, manipulability(qs), atol=1e-12)
    # and the square root of a determinant, as eq. (25) has it
    tilting = jacobian(qs)[:, 3:5]
    det = np.linalg.det(tilting @ np.swapaxes(tilting, 1, 2))
    np.testing.assert_allclose(moved.manipulability**2, det, atol=1e-12)


def test_torques_are_the_largest_of_all_loads(crane):
    """J^T F of sampled loads never exceeds them, and comes near."""
    q = bc.random_configurations(crane, 1, seed=2)
    most = twists(crane, q).torques(5.0, 0.1)[0]
    J = jacobian(q, "needle_tip")[0]
    about = RNG.normal(size=(20_000, 3))
    about *= 0.1 / np.linalg.norm(about, axis=1, keepdims=True)
    loads = np.zeros((len(about), 6))
    loads[:, 2], loads[:, 3:] = RNG.choice([-5.0, 5.0], len(about)), about
    torques = np.abs(loads @ J).max(axis=0)
    assert (torques <= most + 1e-12).all()
    np.testing.assert_allclose(torques, most, rtol=0.02, atol=1e-9)


def test_efforts_are_the_files(crane):
    assert efforts(crane)[4:].tolist() == [1.0, 1.0, 1.0, 20.0]
