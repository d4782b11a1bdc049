"""All pairs by sign bits against all pairs one by one: the same pairs, always."""

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.geometry.triangles import all_pairs, narrowphase
from borecheck.geometry.triangles.published import NARROWPHASES
from borecheck.geometry.triangles.sign_bits import PLANES, plane_signs_plain

Rows = NDArray[np.float64]
CODES = sorted(NARROWPHASES.values())


def _scattered(rng: np.random.Generator, count: int, size: float) -> Rows:
    """Triangles about so large with middles in a box of edge 1."""
    middles = rng.uniform(-0.5, 0.5, (count, 1, 3))
    return (middles + size * rng.normal(size=(count, 3, 3))).reshape(count, 9)


def _on_a_lattice(rng: np.random.Generator, count: int) -> Rows:
    """Corners on few integers: many touch, are coplanar, or have no area."""
    return rng.integers(0, 4, (count, 9)).astype(float)


def _flattened(rows: Rows) -> Rows:
    """The first half of the triangles squeezed to segments and to points."""
    rows = rows.copy()
    half = len(rows) // 2
    rows[:half, 6:] = 0.25 * rows[:half, :3] + 0.75 * rows[:half, 3:6]
    rows[: half // 2, 3:6] = rows[: half // 2, :3]
    rows[: half // 2, 6:] = rows[: half // 2, :3]
    return rows


def _agree(code: int, first: Rows, second: Rows, vector: bool) -> int:
    expected = narrowphase.all_contacts(code, first, second)
    found = all_pairs.all_contacts(code, first, second, vector=vector)
    np.testing.assert_array_equal(found, expected)
    return len(expected)


@pytest.mark.parametrize("vector", [True, False])
@pytest.mark.parametrize("code", CODES)
def test_scattered_triangles(code: int, vector: bool) -> None:
    """Counts beside the multiples of 64 planes and of one block of betas."""
    rng = np.random.default_rng(1)
    first = _scattered(rng, 2 * PLANES + 3, 0.08)
    second = _scattered(rng, all_pairs.BLOCK + 5, 0.08)
    assert _agree(code, first, second, vector) > 100


@pytest.mark.parametrize("vector", [True, False])
@pytest.mark.parametrize("code", CODES)
def test_lattice_with_shared_corners(code: int, vector: bool) -> None:
    rng = np.random.default_rng(2)
    found = _agree(code, _on_a_lattice(rng, 150), _on_a_lattice(rng, 200), vector)
    assert found > 100


@pytest.mark.parametrize("vector", [True, False])
def test_segments_and_points_stay_candidates(vector: bool) -> None:
    """Zero-area triangles have no plane, yet touch; the exact test sees it."""
    rng = np.random.default_rng(3)
    first = _flattened(_on_a_lattice(rng, 200))
    second = _on_a_lattice(rng, 200)
    exact = NARROWPHASES["exact"]
    pairs = narrowphase.all_contacts(exact, first, second)
    assert (pairs[:, 0] < 50).sum() > 100, "no contact of points to find"
    _agree(exact, first, second, vector)
    _agree(exact, second, first, vector)


@pytest.mark.parametrize("flatness", [1e-3, 1e-5, 1e-7, 1e-12, 1e-16])
def test_slivers(flatness: float) -> None:
    """Around the limit beyond which a triangle has no plane, and far beyond."""
    rng = np.random.default_rng(4)
    first = _scattered(rng, 200, 0.3)
    along = rng.uniform(size=(200, 1))
    first[:, 6:] = along * first[:, :3] + (1 - along) * first[:, 3:6]
    first[:, 6:] += flatness * rng.normal(size=(200, 3))
    second = _scattered(rng, 300, 0.3)
    assert _agree(NARROWPHASES["exact"], first, second, True) > 100


@pytest.mark.parametrize("gap", [0.0, 1e-15, 1e-12, 1e-9, -1e-15, -1e-12, -1e-9])
def test_parallel_sheets_within_the_dead_band(gap: float) -> None:
    """Two grids face to face: every sign is within rounding of zero."""
    u, v = np.meshgrid(np.arange(8.0), np.arange(8.0), indexing="ij")
    corner = np.column_stack([u.ravel(), v.ravel(), np.zeros(64)]) / 7.0
    low = (corner[:, None] + np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) / 7.0).reshape(
        -1, 9
    )
    high = low + np.tile([0.03, 0.02, gap], 3)
    tilt = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    first, second = (
        (rows.reshape(-1, 3) @ tilt.T).reshape(-1, 9) for rows in (low, high)
    )
    found = _agree(NARROWPHASES["exact"], low, high, True)
    assert (found > 100) == (gap == 0.0)
    _agree(NARROWPHASES["exact"], first, second, True)


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("away", [1e3, 1e6])
def test_far_from_the_origin(code: int, away: float) -> None:
    """Coordinates that leave the narrowphases few digits."""
    rng = np.random.default_rng(6)
    first, second = (_scattered(rng, n, 0.1) + away for n in (130, 400))
    assert _agree(code, first, second, True) > 30


def test_one_triangle_and_none() -> None:
    one = np.array([[0.0, 0, 0, 1, 0, 0, 0, 1, 0]])
    none = np.zeros((0, 9))
    code = NARROWPHASES["exact"]
    assert all_pairs.all_contacts(code, one, one).tolist() == [[0, 0]]
    assert all_pairs.all_contacts(code, one, none).shape == (0, 2)
    assert all_pairs.all_contacts(code, none, one).shape == (0, 2)


def test_plain_signs_are_the_signs() -> None:
    """The words against numpy, with points inside the band."""
    rng = np.random.default_rng(7)
    planes = rng.normal(size=(4, PLANES)).astype(np.float32)
    points = rng.normal(size=(3, 50)).astype(np.float32)
    band = np.float32(0.1)
    above, below = np.zeros((2, 50), np.uint64)
    plane_signs_plain(planes, *points, 50, band, above, below)
    side = points.T.astype(float) @ planes[:3] + planes[3]
    bits = np.arange(PLANES, dtype=np.uint64)
    for words, expected in ((above, side > band), (below, side < -band)):
        found = (words[:, None] >> bits) & np.uint64(1) == 1
        decided = np.abs(np.abs(side) - band) > 1e-5
        assert (found == expected)[decided].all()
        assert expected.any()
        assert not expected.all()


def test_vector_signs_work_here() -> None:
    """The fast form is the one in use; elsewhere the plain one gives the same."""
    assert all_pairs.vector_signs_work()
