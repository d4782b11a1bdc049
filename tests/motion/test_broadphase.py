"""Boxes first: what they say holds at every instant, and changes no verdict."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.motion import least_clearance as least
from borecheck.motion.broadphase import Rooms, rooms_of_pairs
from borecheck.motion.problem import Body, PathProblem, path_motion
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.search import search
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS, WORLD
from studies import paths

SAMPLES = 60


def edges(robot, rng, sizes):
    """Motions of a robot by so much of its joints' range."""
    lower, upper = robot.model.lower, robot.model.upper
    for size in sizes:
        start = rng.uniform(lower, upper)
        step = size * rng.uniform(-1.0, 1.0, len(lower)) * (upper - lower)
        yield np.array([start, np.clip(start + step, lower, upper)])


def test_pairs_have_the_room_that_boxes_tell(zerobot, ct_gantry, rng):
    """Every pair of Zerobot, itself included, at many instants of motions."""
    problem = path_problem(zerobot, ct_gantry)
    told = tight = 0
    for waypoints in edges(zerobot, rng, [0.001, 0.01, 0.03, 0.1]):
        motion = path_motion(problem, waypoints)
        rooms = rooms_of_pairs(problem, motion)
        where = rng.choice(np.flatnonzero(rooms.least > 0.0), 25)
        for time in np.linspace(0.0, 1.0, 7):
            placed = motion.place(problem.chain, time)
            for k in where:
                a, b = problem.pairs[k].moving, problem.pairs[k].standing
                T_b = b.T_frame_mesh if b.frame == WORLD else placed[b.frame]
                distance, _ = a.tree.clearance(b.tree, placed[a.frame], T_b)
                assert distance > rooms.least[k]
                told += 1
                tight += rooms.least[k] > 0.3 * distance
    assert told > 500
    assert tight > 50, "a bound that nothing comes near to proves little"


def test_random_chains_move_no_farther_than_told(rng):
    """Boxes on every frame of random chains: mimics, slides, waypoints between."""
    seen = 0
    for _ in range(25):
        chain = paths._random_chain(rng)
        shape = box("b", tuple(rng.uniform(0.02, 0.1, 3)))
        parts = tuple(Body(str(k), shape, k) for k in range(chain.frame_count))
        wall = (Body("wall", shape.moved(_shift(rng.uniform(-1, 1, 3)))),)
        pairs = tuple((i, j) for j in range(len(parts)) for i in range(j))
        problem = PathProblem(chain, parts, wall, pairs)
        points = rng.uniform(-1, 1, (4, chain.joint_count)) * rng.choice([0.02, 0.5])
        motion = path_motion(problem, points)
        rooms = rooms_of_pairs(problem, motion)
        for time in np.linspace(0.0, len(points) - 1.0, SAMPLES):
            placed = motion.place(chain, time)
            for pair, room in zip(problem.pairs, rooms.least, strict=True):
                if room > 0.0:
                    seen += 1
                    assert _box_distance(pair, placed) > room
    assert seen > 1000


def _shift(by):
    T = np.eye(4)
    T[:3, 3] = by
    return T


def _box_distance(pair, placed):
    a, b = pair.moving, pair.standing
    T_b = b.T_frame_mesh if b.frame == WORLD else placed[b.frame]
    return a.tree.clearance(b.tree, placed[a.frame], T_b, 0.1)[1]


@pytest.mark.parametrize("margin", [0.0, 0.02])
def test_verdicts_are_those_without_it(zerobot, ct_gantry, rng, margin):
    problem = path_problem(zerobot, ct_gantry, margin)
    verdicts = set()
    near_home = [np.array([zerobot.home, zerobot.home + s]) for s in (0.001, 0.02)]
    for waypoints in [*near_home, *edges(zerobot, rng, [0.001] * 6 + [0.02] * 6)]:
        with_it = search(problem, waypoints)
        plain = search(problem, waypoints, broadphase=False)
        assert with_it.verdict == plain.verdict
        assert with_it.reason == plain.reason
        assert with_it.intervals == plain.intervals
        assert with_it.first_contact == plain.first_contact
        verdicts.add(plain.verdict)
    assert verdicts == {"clear", "contact"}


def test_least_clearances_are_those_without_it(zerobot, ct_gantry, monkeypatch):
    tolerance = least.Tolerance()
    blind = Rooms(np.full(110, -np.inf), np.full(110, np.inf))
    for step in (0.001, 0.02):
        edge = [zerobot.home, zerobot.home + step]
        with_it = bc.check_path(zerobot, ct_gantry, edge).least
        with monkeypatch.context() as patch:
            patch.setattr(least, "rooms_of_pairs", lambda *_: blind)
            plain = bc.check_path(zerobot, ct_gantry, edge).least
        assert with_it.names == plain.names
        assert with_it.upper == pytest.approx(plain.upper, abs=1e-9)
        for found in (with_it, plain):
            assert found.within_tolerance
            assert found.upper - found.lower <= tolerance.allowed(found.upper)


def test_what_is_held_is_not_taken_for_apart():
    """A speck that slides in a closed room: its box is within the other's."""
    chain = _slider()
    room, speck = box("room", (1.0, 1.0, 1.0)), box("speck", (0.1, 0.1, 0.1))
    problem = PathProblem(chain, (Body("speck", speck, 0),), (Body("room", room),))
    found = search(problem, [[0.0], [0.1]])
    assert found.verdict == "contact"
    assert "inside" in found.reason
    beside = search(problem, [[2.0], [2.1]])
    assert beside.verdict == "clear"


def test_turns_about_a_far_axis_move_the_whole_arm():
    """Half a turn of a bar two metres out passes a box that both ends are far from."""
    chain = JointChain(
        [WORLD], [np.eye(4)], [TURNS], [[0.0, 0.0, 1.0]], [0], [1.0], [0.0]
    )
    bar = box("bar", (0.1, 0.1, 0.1)).moved(_shift([2.0, 0.0, 0.0]))
    block = box("block", (0.1, 0.1, 0.1)).moved(_shift([0.0, 2.0, 0.0]))
    problem = PathProblem(chain, (Body("bar", bar, 0),), (Body("block", block),))
    assert search(problem, [[0.0], [np.pi]]).verdict == "contact"
    assert search(problem, [[0.0], [0.5]]).verdict == "clear"


def _slider():
    return JointChain(
        [WORLD], [np.eye(4)], [SLIDES], [[1.0, 0.0, 0.0]], [0], [1.0], [0.0]
    )
