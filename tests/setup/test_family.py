"""CRANE's family puts the needle where it is asked, tilted too; other bases, too."""

import numpy as np

import borecheck as bc
from borecheck.setup.family import family_of, rotated
from borecheck.setup.mechanics import twists

RNG = np.random.default_rng(3)
TIP = np.array([0.02, 0.05, -0.01])
AIM = np.array([0.3, -0.2, -1.0]) / np.linalg.norm([0.3, -0.2, -1.0])


def coordinates(family, n):
    return RNG.uniform(family.lower, family.upper, (n, 3))


def test_the_needle_is_there_at_every_coordinate():
    robot = bc.load_robot("crane", base="0.1,0.02,0,0,0,20deg", base_x="-0.5")
    family = family_of(robot, 0.03)
    assert np.isclose(family.upper[2], 0.0475 - 0.03)
    qs = family.configurations(TIP, AIM, coordinates(family, 300))
    moved = twists(robot, qs)
    np.testing.assert_allclose(moved.tip, np.tile(TIP, (300, 1)), atol=1e-12)
    np.testing.assert_allclose(moved.axis, np.tile(AIM, (300, 1)), atol=1e-12)


def test_tilted_it_turns_about_its_tip_and_rolls_along():
    robot = bc.load_robot("crane", base="0,0,0,0,0,20deg")
    family = family_of(robot, 0.0)
    x = coordinates(family, 20)
    turns = 0.3 * RNG.normal(size=(7, 3))
    turns -= np.outer(turns @ AIM, AIM)
    qs = family.tilted(TIP, AIM, x, turns)
    moved = twists(robot, qs.reshape(-1, 8))
    tips = np.tile(TIP, (140, 1))
    np.testing.assert_allclose(moved.tip, tips, atol=1e-12)
    aims = np.tile(rotated(turns, AIM), (20, 1))
    np.testing.assert_allclose(moved.axis, aims, atol=1e-12)
    straight = family.configurations(TIP, AIM, x)
    np.testing.assert_allclose(
        family.tilted(TIP, AIM, x, np.zeros((1, 3)))[:, 0], straight, atol=1e-12
    )
    # the whole frame is turned by the same rotation, not the needle alone
    for q, there in zip(straight[:3], qs[:3, 0], strict=True):
        R = robot.placements(there)["8"][:3, :3] @ robot.placements(q)["8"][:3, :3].T
        angle = np.linalg.norm(turns[0])
        assert np.isclose(np.trace(R), 1.0 + 2.0 * np.cos(angle), atol=1e-12)


def test_an_arm_without_freedom_has_none():
    assert family_of(bc.load_robot("zerobot"), 0.0) is None
