"""What is proven without draws: displacements, rooms, and the shell beyond them."""

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from borecheck.contact.verdict import CLEAR
from borecheck.motion.bounds import route
from borecheck.motion.problem import PathProblem
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.search import search
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import plan_motion
from borecheck.robots.kinematics.forward import WORLD
from borecheck.robots.robot import Robot, load_robot
from borecheck.robots.scene import Scene, load_scene
from borecheck.uncertainty.covariance import from_document
from borecheck.uncertainty.disturbed import Disturbance
from borecheck.uncertainty.draws import Shell, enough_radius
from borecheck.uncertainty.judging import Judge, State
from borecheck.uncertainty.reach import arms, effects_of, per_sigma, sizes
from borecheck.uncertainty.room import Rooms, RoomSearch, open_pairs, restricted

DOCUMENT = {
    "joints": {"q1": "1mm", "q4": "0.3deg", "q5": "0.3deg"},
    "dimensions": {"tip_offset_x": "1mm", "q4_offset": "0.2deg"},
    "registration": {"y": "1mm", "z": "1mm", "rx": "0.2deg", "rz": "0.1deg"},
}


@pytest.fixture(scope="module")
def zerobot() -> Robot:
    return load_robot("zerobot")


@pytest.fixture(scope="module")
def disturbance(zerobot: Robot) -> Disturbance:
    return Disturbance(zerobot, from_document(DOCUMENT, zerobot))


def drawn(disturbance: Disturbance, count: int, scale: float) -> np.ndarray:
    root = disturbance.uncertainty.root
    z = np.random.default_rng(1).standard_normal((count, root.shape[1]))
    return scale * z @ root.T


def test_no_point_moves_farther_than_the_bound(
    zerobot: Robot, disturbance: Disturbance
) -> None:
    """Obstacle pairs and self pairs; nearly reached, so that slack would be seen."""
    problem = path_problem(zerobot, load_scene("ct_gantry"))
    effects = effects_of(disturbance)
    q = np.array([0.05, 0.02, -0.03, 0.3, 0.2, 0.01])
    before = problem.chain.placed(problem.chain.thetas(q))
    tightest = 0.0
    for pair in [problem.pairs[0], problem.pairs[30], *problem.pairs[-3:]]:
        a, b = pair.moving, pair.standing
        way = route(problem.chain, b.frame, a.frame)
        to_world = b.frame == WORLD
        c = arms(effects, problem.chain, way, a, (-1, -1), to_world, before)
        for x in drawn(disturbance, 20, 3.0):
            chain = disturbance.chain(x)
            after = chain.placed(chain.thetas(q + disturbance.joints(x)))
            moved = np.zeros(1)
            for frames, sign in ((before, -1.0), (after, 1.0)):
                T = frames[a.frame]
                if not to_world:
                    T = np.linalg.inv(frames[b.frame]) @ T
                moved = moved + sign * (a.mesh.vertices @ T[:3, :3].T + T[:3, 3])
            far = float(np.linalg.norm(moved, axis=1).max())
            bound = float(sizes(effects, x[None])[0] @ c)
            assert far <= bound + 1e-12
            tightest = max(tightest, far / max(bound, 1e-12))
    assert tightest > 0.6


def test_bound_over_a_ball_holds_for_all_directions(disturbance: Disturbance) -> None:
    effects = effects_of(disturbance)
    rng = np.random.default_rng(3)
    coefficients = rng.uniform(0.0, 1.0, (5, len(effects)))
    root = disturbance.uncertainty.root
    bound = per_sigma(effects, coefficients, [root])
    z = rng.standard_normal((4000, root.shape[1]))
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    found = (sizes(effects, z @ root.T) @ coefficients.T).max(axis=0)
    assert (found <= bound * (1.0 + 1e-12)).all()


@pytest.fixture(scope="module")
def plan_problem(zerobot: Robot) -> tuple[PathProblem, np.ndarray]:
    scene: Scene = load_scene("ct_gantry", bore="0.85", couch_height="-0.2")
    plan = NeedlePlan("p", (0.0, 0.0, -0.20113), (0.0, 0.0, -0.24113))
    motion = plan_motion(zerobot, plan)
    return path_problem(zerobot, scene, 0.0, motion.corridor), motion.waypoints


@pytest.fixture(scope="module")
def rooms(
    disturbance: Disturbance, plan_problem: tuple[PathProblem, np.ndarray]
) -> Rooms:
    return RoomSearch(disturbance, *plan_problem, 4.0).run()


def test_errors_within_the_radius_leave_the_motion_clear(
    disturbance: Disturbance,
    plan_problem: tuple[PathProblem, np.ndarray],
    rooms: Rooms,
) -> None:
    problem, points = plan_problem
    assert rooms.radius > 0.1
    root = disturbance.uncertainty.root
    rng = np.random.default_rng(2)
    judge = Judge(disturbance, problem, points)
    everything = set(range(rooms.count))
    for _ in range(8):
        z = rng.standard_normal(root.shape[1])
        x = root @ (rooms.radius * z / np.linalg.norm(z))
        assert judge.judge(x, everything)[0] is State.CLEAR


def test_pairs_that_are_left_out_are_clear(
    disturbance: Disturbance,
    plan_problem: tuple[PathProblem, np.ndarray],
    rooms: Rooms,
) -> None:
    """The verdict by the open pairs alone is that by all pairs."""
    problem, points = plan_problem
    xs = drawn(disturbance, 12, 1.0)
    left = open_pairs(rooms, sizes(effects_of(disturbance), xs))
    plain = Judge(disturbance, problem, points)
    quick = Judge(disturbance, problem, points, rooms.needles)
    states = set()
    for x, row in zip(xs, left, strict=True):
        one = quick.judge(x, set(np.flatnonzero(row).tolist()))[0]
        assert one is plain.judge(x, set(range(rooms.count)))[0]
        states.add(one)
    assert State.CONTACT in states
    assert left.any()
    assert not left.all()


def test_restricted_problems_make_up_the_whole(
    plan_problem: tuple[PathProblem, np.ndarray],
) -> None:
    problem, points = plan_problem
    n = len(problem.pairs)
    names = [p.names for p in problem.pairs]
    alone = [restricted(problem, {k}) for k in range(n)]
    assert [one.pairs[0].names for one in alone] == names
    assert all(len(one.pairs) == 1 and not one.passages for one in alone)
    through = restricted(problem, {n})
    assert through.pairs == ()
    assert through.passages == problem.passages
    assert search(through, points).verdict == CLEAR


def test_draws_of_the_shell_are_normal_draws_beyond_its_radius() -> None:
    shell = Shell.beyond(2.0, 5)
    assert shell.outside == pytest.approx(chi2.sf(4.0, 5))
    z = shell.draw(np.random.default_rng(0), 4000)
    squares = (z**2).sum(axis=1)
    assert squares.min() >= 4.0
    share = chi2.sf(squares, 5) / shell.outside  # uniform, if the law is right
    assert kstest(share, "uniform").pvalue > 0.01
    plain = np.random.default_rng(1).standard_normal((200_000, 5))
    beyond = plain[(plain**2).sum(axis=1) > 4.0]
    assert np.abs(z).mean() == pytest.approx(np.abs(beyond).mean(), rel=0.02)
    assert np.abs(z.mean(axis=0)).max() < 0.1


def test_shell_without_a_radius_is_everything() -> None:
    shell = Shell.beyond(0.0, 3)
    assert (shell.outside, shell.radius) == (1.0, 0.0)
    assert Shell.beyond(np.inf, 0).outside == 1.0
    far = Shell.beyond(1e9, 3)
    assert far.radius == pytest.approx(enough_radius(3, 1e-12))
    assert far.draw(np.random.default_rng(0), 5).shape == (5, 3)
