"""Bounds on motion against densely sampled motion of random chains."""

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.errors import GeometryError
from borecheck.motion import bound_kernels
from borecheck.motion.bounds import (
    Route,
    chord_slack,
    displacement,
    gains,
    mesh_radius,
    route,
)
from borecheck.motion.problem import PathProblem
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS, WORLD
from studies import paths
from tests.robots.kinematics.plain import relative_placement

Array = NDArray[np.float64]

# Forward kinematics of a few joints within a metre or two.
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def chains() -> list[JointChain]:
    rng = np.random.default_rng(11)
    study = paths
    return [study._random_chain(rng) for _ in range(40)]


def _motions(rng: np.random.Generator, chain: JointChain, size: float) -> Array:
    """Joint values (101, n) along a straight motion."""
    start = rng.uniform(-1.5, 1.5, chain.joint_count)
    end = start + size * rng.normal(size=chain.joint_count)
    t = np.linspace(0.0, 1.0, 101)[:, None]
    return chain.thetas((1 - t) * start + t * end)


def _ways(chain: JointChain) -> list[Route]:
    """From the world, from one frame to another, and against the chain."""
    last = chain.frame_count - 1
    return [route(chain, WORLD, last), route(chain, 0, last), route(chain, last, 0)]


def _followed(chain: JointChain, way: Route, theta: Array, points: Array) -> Array:
    """Places (samples, points, 3) of points of b in the frame of a."""
    placed = np.array([relative_placement(chain, way, values) for values in theta])
    return np.einsum("kij,pj->kpi", placed[:, :3, :3], points) + placed[:, None, :3, 3]


@pytest.mark.parametrize("size", [0.01, 0.3, 2.0])
def test_points_stay_within_the_displacement(
    chains: list[JointChain], size: float
) -> None:
    rng = np.random.default_rng(12)
    used = []
    for chain in chains:
        theta = _motions(rng, chain, size)
        points = rng.uniform(-0.2, 0.2, (20, 3))
        for way in _ways(chain):
            gain = gains(chain, way, mesh_radius(points), np.abs(theta).max(axis=0))
            places = _followed(chain, way, theta, points)
            moved = np.linalg.norm(places - places[0], axis=2).max(axis=1)
            bound = displacement(way, gain, theta - theta[0])
            assert (moved <= bound + ROUNDING).all()
            if bound[-1] > 0.0:
                used.append(moved[-1] / bound[-1])
    assert max(used) > 0.4, "a bound that nothing comes near to proves little"


@pytest.mark.parametrize("size", [0.01, 0.3, 2.0])
def test_points_stay_near_the_chord(chains: list[JointChain], size: float) -> None:
    rng = np.random.default_rng(13)
    used = []
    for chain in chains:
        theta = _motions(rng, chain, size)
        points = rng.uniform(-0.2, 0.2, (20, 3))
        t = np.linspace(0.0, 1.0, len(theta))[:, None, None]
        for way in _ways(chain):
            gain = gains(chain, way, mesh_radius(points), np.abs(theta).max(axis=0))
            places = _followed(chain, way, theta, points)
            chord = (1 - t) * places[0] + t * places[-1]
            off = np.linalg.norm(places - chord, axis=2).max()
            slack = chord_slack(chain, way, gain, theta[-1] - theta[0])
            assert off <= slack + ROUNDING
            if slack > 1e-9:
                used.append(off / slack)
    assert max(used) > 0.2, "a bound that nothing comes near to proves little"


def test_a_lone_hinge_needs_all_of_the_chord_bound() -> None:
    """One turn of a point at the reach: the sagitta is theta^2 / 8 to second order."""
    chain = _chain(kind=[TURNS])
    way = route(chain, WORLD, 0)
    gain = gains(chain, way, 0.5, np.array([0.02]))
    slack = chord_slack(chain, way, gain, np.array([0.02]))
    assert slack == pytest.approx(0.5 * (1 - np.cos(0.01)), rel=1e-4)


def test_of_many_changes_each_has_its_own_bounds() -> None:
    chain = _chain(kind=[TURNS, SLIDES], parent=[-1, 0], source=[0, 1])
    way = route(chain, WORLD, 1)
    gain = gains(chain, way, 0.5, np.array([0.3, 0.2]))
    changes = np.array([[0.02, 0.1], [-0.3, 0.0], [0.0, 0.2]])
    for bound in (lambda c: displacement(way, gain, c),
                  lambda c: chord_slack(chain, way, gain, c)):  # fmt: skip
        np.testing.assert_allclose(bound(changes), [bound(c) for c in changes])
    # by hand: the slide moves along while the hinge turns
    hand = 0.7 * 0.02 * 0.02 / 8.0 + 0.1 * 2.0 * 0.02 / 8.0
    assert chord_slack(chain, way, gain, changes)[0] == pytest.approx(hand)


def test_mimic_joints_count_with_their_own_motion() -> None:
    """Two hinges driven by one q, the second twice as far the other way."""
    chain = _chain(
        kind=[TURNS, TURNS], parent=[-1, 0], source=[0, 0], factor=[1.0, -2.0]
    )
    theta = chain.thetas(np.array([[0.0], [0.1]]))
    np.testing.assert_allclose(theta[1], [0.1, -0.2])
    way = route(chain, WORLD, 1)
    gain = gains(chain, way, 0.5, np.abs(theta).max(axis=0))
    moved = displacement(way, gain, theta[1] - theta[0])
    assert moved == pytest.approx(0.1 * 0.5 + 0.2 * 0.5)


def test_slides_move_all_points_alike_and_lengthen_the_reach() -> None:
    chain = _chain(kind=[TURNS, SLIDES], parent=[-1, 0], source=[0, 1])
    way = route(chain, WORLD, 1)
    gain = gains(chain, way, 0.25, np.array([0.0, 0.5]))
    np.testing.assert_allclose(gain, [0.75, 1.0])


def test_kernels_give_the_plain_forms(chains: list[JointChain]) -> None:
    rng = np.random.default_rng(14)
    for chain in chains:
        theta = _motions(rng, chain, 1.0)
        largest = np.abs(theta).max(axis=0)
        for way in _ways(chain):
            plain = gains(chain, way, 0.3, largest)
            kernel = bound_kernels.gains(
                way.joints, way.forward, chain.kind, chain.length, 0.3, largest
            )
            np.testing.assert_array_equal(kernel, plain)
        placed = chain.placed(theta[7])
        for frame in range(chain.frame_count):
            expected = relative_placement(chain, route(chain, WORLD, frame), theta[7])
            np.testing.assert_allclose(placed[frame], expected, atol=ROUNDING)


def test_bend_is_the_largest_distance_from_the_line() -> None:
    theta = np.array([[0.0, 0.0], [1.0, 0.3], [2.0, -0.1], [3.0, 0.0]])
    bend = np.zeros(2)
    bound_kernels.bend_of_run(theta, 0, 3, bend)
    np.testing.assert_allclose(bend, [0.0, 0.3], atol=1e-15)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"parent": [0]}, "before its parent"),
        ({"kind": [7]}, "of kind 7"),
        ({"source": [-1]}, "no source"),
        ({"axis": [[0.0, 0.0, 0.0]]}, "length 0"),
        ({"factor": [np.nan]}, "not finite"),
        ({"origin": [np.diag([1.0, 1.0, -1.0, 1.0])]}, "origin of joint 0"),
        ({"offset": [0.0, 1.0]}, "shape"),
    ],
)
def test_chains_that_make_no_sense(change: dict[str, list[float]], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        _chain(**{"kind": [TURNS], **change})


def test_bounds_hold_for_rotations_only() -> None:
    """Typed with six digits an origin is good enough to place, not to bound."""
    chain = _chain(kind=[TURNS], origin=[np.diag([1.0, 1.0, 1.0 + 1e-9, 1.0])])
    assert chain.placements([[0.0]])[0, 0, 2, 2] == 1.0 + 1e-9
    with pytest.raises(GeometryError, match="joint 0 is not quite a rotation"):
        PathProblem(chain, (), ())


def _chain(*, kind: list[int], **given: object) -> JointChain:
    """Joints about z at the origin, unless said otherwise."""
    n = len(kind)
    fields: dict[str, object] = {
        "parent": list(range(-1, n - 1)),
        "origin": np.tile(np.eye(4), (n, 1, 1)),
        "kind": kind,
        "axis": [[0.0, 0.0, 1.0]] * n,
        "source": list(range(n)),
        "factor": [1.0] * n,
        "offset": [0.0] * n,
    }
    return JointChain(**{**fields, **given})  # type: ignore[arg-type]


def test_fixed_joints_do_not_count() -> None:
    chain = _chain(kind=[TURNS, FIXED], source=[0, -1])
    way = route(chain, WORLD, 1)
    gain = gains(chain, way, 0.5, np.zeros(2))
    np.testing.assert_allclose(gain, [0.5, 0.0])
