"""The verifier's chain against the matrix exponential, samples and cases by hand."""

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.verify.chain import (
    WORLD,
    Chain,
    Joint,
    inverse,
    motion,
    skewness,
)

Array = NDArray[np.float64]

# a dozen products of matrices within some metres
ROUNDING = 1e-12
X, Y, Z = np.eye(3)


def joint(kind: str, parent: int, source: int, **given: object) -> Joint:
    fields = {
        "parent": parent,
        "origin": np.eye(4),
        "kind": kind,
        "axis": Z,
        "source": source,
        "factor": 1.0,
        "offset": 0.0,
    }
    return Joint(**{**fields, **given})  # type: ignore[arg-type]


def exponential(twist: Array) -> Array:
    """exp by its series, of a matrix scaled down and squared up again."""
    small, total, term = twist / 64.0, np.eye(4), np.eye(4)
    for k in range(1, 20):
        term = term @ small / k
        total = total + term
    for _ in range(6):
        total = total @ total
    return total


def twist(kind: str, axis: Array, value: float) -> Array:
    x, y, z = axis
    found = np.zeros((4, 4))
    if kind == "turns":
        found[:3, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    elif kind == "slides":
        found[:3, 3] = axis
    return value * found


@pytest.mark.parametrize("kind", ["turns", "slides", "fixed"])
def test_a_joint_moves_as_its_screw(kind: str, rng: np.random.Generator) -> None:
    for _ in range(30):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        value = float(rng.uniform(-4.0, 4.0))
        expected = exponential(twist(kind, axis, value))
        np.testing.assert_allclose(
            motion(joint(kind, WORLD, 0, axis=axis), value), expected, atol=ROUNDING
        )


def random_chain(rng: np.random.Generator, waypoints: int = 4) -> Chain:
    """A trunk of three joints and two branches, one joint mimicking another."""
    kinds = ["turns", "slides", "fixed", "turns", "turns", "slides"]
    parents = [WORLD, 0, 1, 2, 1, 4]
    joints = []
    for k, (kind, parent) in enumerate(zip(kinds, parents, strict=True)):
        axis = rng.normal(size=3)
        joints.append(
            joint(
                kind,
                parent,
                [0, 1, -1, 2, 0, 3][k],
                origin=transform(rng.uniform(-0.3, 0.3, 3), rng.uniform(-3, 3, 3)),
                axis=axis / np.linalg.norm(axis),
                factor=-0.7 if k == 4 else 1.0,
                offset=0.2 if k == 4 else 0.0,
            )
        )
    return Chain(joints, rng.uniform(-1.0, 1.0, (waypoints, 4)))


def test_frames_are_products_from_the_world_on(rng: np.random.Generator) -> None:
    for _ in range(20):
        chain = random_chain(rng)
        values = rng.uniform(-2.0, 2.0, 6)
        placed = chain.placed(values)
        for k in range(6):
            T, frame = np.eye(4), k
            while frame != WORLD:
                j = chain.joints[frame]
                value = float(values[frame])
                T = j.origin @ exponential(twist(j.kind, j.axis, value)) @ T
                frame = j.parent
            np.testing.assert_allclose(placed[k], T, atol=ROUNDING)


def test_values_are_linear_between_waypoints_and_met_at_them() -> None:
    joints = [joint("slides", WORLD, 1), joint("slides", 0, 0, factor=2.0, offset=0.5)]
    chain = Chain(joints, np.array([[0.0, 1.0], [1.0, 3.0], [5.0, -1.0]]))
    for time, first, second in (
        (0.0, 1.0, 0.5),
        (0.25, 1.5, 1.0),
        (1.0, 3.0, 2.5),
        (1.5, 1.0, 6.5),
        (2.0, -1.0, 10.5),
    ):
        np.testing.assert_allclose(chain.at(time), [first, second])
        z = [T[2, 3] for T in chain.placements(time)]
        np.testing.assert_allclose(z, [first, first + second])


def way_of(
    chain: Chain, frames: tuple[int, int], corners: Array, times: Array
) -> float:
    """Largest way of corners, fixed to the first frame, as the second one sees it."""
    places = []
    for time in times:
        placed = [*chain.placements(float(time)), np.eye(4)]  # [-1] is the world
        T = inverse(placed[frames[1]]) @ placed[frames[0]]
        places.append(corners @ T[:3, :3].T + T[:3, 3])
    return float(np.linalg.norm(np.array(places) - places[0], axis=2).max())


FRAMES = [(3, WORLD), (5, WORLD), (3, 5), (5, 3), (1, 0), (2, 4)]


@pytest.mark.parametrize("frames", FRAMES)
def test_no_point_moves_farther_than_the_bound(
    frames: tuple[int, int], rng: np.random.Generator
) -> None:
    """Intervals within a step, and over waypoints at which the motion turns back."""
    share = []
    for _ in range(8):
        chain = random_chain(rng)
        own = rng.uniform(-0.2, 0.2, (8, 3))
        for begin, end in ((0.2, 0.7), (0.5, 2.6), (0.0, 3.0)):
            at = float(rng.uniform(begin, end))
            T = chain.placements(at)[frames[0]]
            corners = own @ T[:3, :3].T + T[:3, 3]
            bound = chain.displacement(corners, frames, (begin, end, at))
            times = np.array([at, *np.linspace(begin, end, 30), *range(4)])
            times = times[(times >= begin) & (times <= end)]
            moved = way_of(chain, frames, own, times)
            assert moved <= bound + ROUNDING
            share.append(moved / bound)
    assert max(share) > 0.3, "a bound that nothing comes near to proves little"


def test_a_waypoint_within_the_interval_counts() -> None:
    """There and back: both ends are where the instant is, the middle is not."""
    for kind, expected in (("turns", 0.8 * 0.5), ("slides", 0.8)):
        chain = Chain([joint(kind, WORLD, 0)], np.array([[0.1], [0.9], [0.1]]))
        corners = np.array([[0.5, 0.0, 3.0], [0.0, -0.2, 1.0]])
        bound = chain.displacement(corners, (0, WORLD), (0.0, 2.0, 0.0))
        assert bound == pytest.approx(expected)
        # up to the waypoint, and from it on: it is an end then
        assert chain.displacement(corners, (0, WORLD), (0.0, 1.0, 1.0)) == bound
        assert chain.displacement(corners, (0, WORLD), (1.0, 2.0, 1.0)) == bound
        half = chain.displacement(corners, (0, WORLD), (0.5, 1.5, 0.5))
        assert half == pytest.approx(expected / 2)


def test_only_joints_between_both_frames_count() -> None:
    """A trunk moves both alike; what is fixed to the world, it moves against."""
    joints = [joint("slides", WORLD, 0), joint("slides", 0, 1), joint("slides", 0, 2)]
    chain = Chain(joints, np.array([[0.0, 0.0, 0.0], [1.0, 0.1, 0.01]]))
    corners, times = np.zeros((1, 3)), (0.0, 1.0, 0.0)
    for frames, expected in (
        ((1, WORLD), 1.1),
        ((1, 2), 0.11),
        ((2, 1), 0.11),
        ((1, 0), 0.1),
        ((0, 1), 0.1),
        ((0, WORLD), 1.0),
    ):
        assert chain.displacement(corners, frames, times) == pytest.approx(expected)


def test_extent_holds_every_frame(rng: np.random.Generator) -> None:
    for _ in range(20):
        chain = random_chain(rng)
        far = max(
            np.linalg.norm(T[:3, 3])
            for time in np.linspace(0.0, 3.0, 31)
            for T in chain.placements(float(time))
        )
        assert far <= chain.extent()
    arm = Chain(
        [joint("slides", WORLD, 0, origin=transform([0, 0, 0.25]))],
        np.array([[0.1], [-0.5]]),
    )
    assert arm.extent() == pytest.approx(0.75)


def test_rounding_grows_with_turns_joints_size_and_what_is_not_rigid() -> None:
    points = np.array([[0.0] * 3, [1.0] * 3])
    chain = Chain([joint("turns", k - 1, k) for k in range(3)], points)
    plain = chain.rounding(2.0, 0.0)
    assert 2.0**-53 < plain < 1e-12
    assert chain.rounding(4.0, 0.0) == pytest.approx(2.0 * plain)
    far = Chain(chain.joints, 100.0 * points)
    assert far.rounding(2.0, 0.0) > 5.0 * plain
    longer = Chain([joint("turns", k - 1, 0) for k in range(30)], points)
    assert longer.rounding(2.0, 0.0) > 3.0 * plain
    # what is not quite rigid puts a point at the size that much astray, each of it
    assert chain.rounding(2.0, 1e-9) > plain + 2.0 * 1e-9
    skew = transform([0, 0, 0])
    skew[0, 0] += 1e-9
    for change in ({"origin": skew}, {"axis": Z * (1.0 + 1e-9)}):
        off = Chain([joint("turns", WORLD, 0, **change)], points)
        right = Chain([joint("turns", WORLD, 0)], points)
        assert off.rounding(2.0, 0.0) > right.rounding(2.0, 0.0) + 1e-9


def test_arithmetic_stays_within_its_bound(rng: np.random.Generator) -> None:
    """The same products in numpy's longer numbers, which are off by far less."""
    for _ in range(10):
        chain = random_chain(rng)
        values = rng.uniform(-3.0, 3.0, 6)
        placed = chain.placed(values)
        longer: list[NDArray[np.longdouble]] = []
        for j, value in zip(chain.joints, values, strict=True):
            T = np.eye(4, dtype=np.longdouble)
            n = j.axis.astype(np.longdouble)
            turn = np.longdouble(value)
            if j.kind == "slides":
                T[:3, 3] = turn * n
            elif j.kind == "turns":
                across = np.cross(np.eye(3, dtype=np.longdouble), n)
                T[:3, :3] = np.eye(3) + np.sin(turn) * across
                T[:3, :3] += (1 - np.cos(turn)) * (across @ across)
            before = longer[j.parent] if j.parent >= 0 else np.eye(4)
            longer.append(before @ j.origin @ T)
        off = max(np.abs(a - b)[:3].max() for a, b in zip(placed, longer, strict=True))
        assert off <= chain.rounding(chain.extent() + 1.0, 0.0)


def tree(*parents: int, fixed: tuple[int, ...] = ()) -> Chain:
    kinds = ["fixed" if k in fixed else "turns" for k in range(len(parents))]
    joints = [joint(kind, p, 0) for kind, p in zip(kinds, parents, strict=True)]
    return Chain(joints, np.zeros((2, 1)))


@pytest.mark.parametrize(
    ("chain", "frames", "required"),
    [
        # a row of links: all but neighbours
        (tree(-1, 0, 1, 2), [0, 1, 2, 3], {(0, 2), (0, 3), (1, 3)}),
        # the same with a link without a shape between: the next ones are neighbours
        (tree(-1, 0, 1, 2), [0, 2, 3], {(0, 2)}),
        # joined by fixed joints: one body, whose neighbours are those of all of it
        (tree(-1, 0, 1, 2, fixed=(1,)), [0, 1, 2, 3], {(0, 3), (1, 3)}),
        # two shapes of one link, then a branch
        (tree(-1, 0, 0), [0, 0, 1, 2], {(2, 3)}),
        # what is fixed to the world is one body
        (tree(-1, -1, 1, fixed=(0, 1)), [0, 1, 2], set()),
        (tree(-1, -1), [0, 1], {(0, 1)}),
        # the first link moves against it, and is its neighbour
        (tree(-1, -1, 0, fixed=(1,)), [0, 1, 2], {(1, 2)}),
    ],
)
def test_who_must_be_examined(
    chain: Chain, frames: list[int], required: set[tuple[int, int]]
) -> None:
    assert chain.required_pairs(frames) == required


def test_inverse_and_skewness() -> None:
    T = transform([1.0, -2.0, 0.5], [0.3, 1.0, -2.0])
    np.testing.assert_allclose(inverse(T) @ T, np.eye(4), atol=ROUNDING)
    assert skewness(T) < 1e-15
    assert skewness(np.diag([1.0, 1.0, 1.0 + 1e-6, 1.0])) == pytest.approx(
        2e-6, rel=1e-3
    )
