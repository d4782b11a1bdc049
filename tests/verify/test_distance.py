"""No distance is said to be larger than it is, or smaller but for rounding."""

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.core.se3 import axis_rotation, transform
from borecheck.geometry.mesh.primitives import box, sphere
from borecheck.geometry.triangles.distance import pair_distance
from borecheck.verify.distance import GroupedMesh, lower_bounds, nearer_than

Array = NDArray[np.float64]


def _rotation(rng: np.random.Generator) -> Array:
    axis = rng.normal(size=3)
    return axis_rotation(axis / np.linalg.norm(axis), rng.uniform(-3.0, 3.0))


def test_bounds_are_the_distances_of_the_search() -> None:
    """Of triangles, segments and points; 0 or less where they meet."""
    rng = np.random.default_rng(3)
    first = rng.normal(size=(400, 3, 3))
    second = rng.normal(size=(400, 3, 3)) + rng.uniform(0, 2, (400, 1, 3))
    first[:50, 2] = first[:50, 1]  # segments
    second[25:75] = second[25:75, :1]  # points
    found = lower_bounds(first, second)
    expected = np.array(
        [
            pair_distance(tuple(a.reshape(9)), tuple(b.reshape(9)))[0]
            for a, b in zip(first, second, strict=True)
        ]
    )
    np.testing.assert_allclose(np.maximum(found, 0.0), expected, atol=1e-12)
    assert (found <= 0.0).sum() > 20
    assert (found > 0.1).sum() > 100


@pytest.mark.parametrize("size", [1e-3, 1.0, 100.0])
def test_nearly_parallel_edges_are_not_said_to_be_farther(size: float) -> None:
    """Ridges that cross at a hair's angle: their gap is known by construction.

    Two roofs, one upside down over the other, with ridges of length `size` at an angle
    from 1e-12 to 1; between the ridges is the gap. The closest points of such edges
    cannot be found to better than rounding over the angle.
    """
    rng = np.random.default_rng(11)
    worst = 0.0
    for angle in np.logspace(-12, 0, 60):
        for gap in size * np.array([1e-7, 1e-4, 0.1]):
            reach = rng.uniform(0.2, 1.0, 4) * size
            e = np.array([1.0, 0.0, 0.0])
            f = np.array([np.cos(angle), np.sin(angle), 0.0])
            up = np.array([0.0, 0.0, gap])
            aside = [rng.normal(size=3) * size for _ in range(2)]
            first = np.array([-reach[0] * e, reach[1] * e, aside[0]])
            first[2, 2] = -abs(first[2, 2])
            second = np.array([up - reach[2] * f, up + reach[3] * f, aside[1]])
            second[2, 2] = gap + abs(second[2, 2])
            R, shift = _rotation(rng), rng.uniform(-1.0, 1.0, 3) * size
            moved = [(t @ R.T + shift)[None] for t in (first, second)]
            bound = float(lower_bounds(*moved)[0])
            # the corners themselves are rounded when they are turned and shifted
            assert bound <= gap + 8e-16 * size
            worst = max(worst, (gap - bound) / size)
    assert worst < 1e-13


def test_a_pair_is_answered_whatever_it_is_asked_with() -> None:
    """Small triangles beside far larger ones, of either side: bounds as alone."""
    rng = np.random.default_rng(5)
    small = 1e-3 * rng.normal(size=(2, 20, 3, 3))
    small[1] += [0.0, 0.0, 5e-3]
    alone = lower_bounds(*small)
    for side in (0, 1):
        large = np.zeros((2, 1, 3, 3))
        large[side] = 1e6 * rng.normal(size=(1, 3, 3))
        together = lower_bounds(*np.concatenate([small, large], axis=1))
        # lengths of millimetres are rounded by 1e-18
        np.testing.assert_allclose(together[:-1], alone, rtol=0.0, atol=1e-17)


def test_groups_drop_nothing_that_is_near() -> None:
    rng = np.random.default_rng(4)
    a, b = sphere("a", 0.1), box("b", [0.1, 0.2, 0.3])
    some = a.triangles[::101]  # all pairs of them are measured
    first = GroupedMesh(a.vertices, some)
    second = GroupedMesh(b.vertices, b.triangles)
    i, j = np.divmod(np.arange(len(some) * len(b.triangles)), len(b.triangles))
    for _ in range(10):
        T = transform(rng.uniform(0.15, 0.5, 3), rng.uniform(-3, 3, 3))
        placed = first.corners @ T[:3, :3].T + T[:3, 3]
        truth = lower_bounds(placed[i], b.corners[j]).min()
        assert nearer_than(first, second, T, truth * 1.000001)
        assert not nearer_than(first, second, T, truth * 0.999999)
