"""The nearest of many pairs with one bound for all: as pair by pair."""

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.surfaces import Surface
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.nearest_first import FAR, NEAR, UNDECIDED
from borecheck.geometry.tree.world_boxes import gap_between, world_boxes
from borecheck.geometry.triangles.placing import place_mesh


@pytest.fixture(scope="module")
def trees():
    sizes = ((0.1, 0.2, 0.3), (0.4, 0.1, 0.1), (0.2, 0.2, 0.2), (0.05, 0.6, 0.05))
    return [Surface(box(f"m{k}", size)) for k, size in enumerate(sizes)]


def placements(rng, n, links, reach=0.8):
    one = lambda: transform(rng.uniform(-reach, reach, 3), rng.uniform(-3, 3, 3))  # noqa: E731
    return np.array([[one() for _ in range(links)] for _ in range(n)])


@pytest.fixture(scope="module")
def moving(trees):
    """Four links against three obstacles that stand turned, and among themselves."""
    rng = np.random.default_rng(4)
    standing = placements(rng, 1, 3)[0]
    links = [s.tree for s in trees]
    pairs = np.array([(0, 1), (0, 2), (1, 3), (2, 3)])
    return (
        MovingLinks.against(links, links[:3], standing),
        MovingLinks.among(links, pairs),
    )


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("tolerance", [0.0, 0.1, 1.5])
def test_least_of_all_pairs_is_the_least_of_each(moving, which, tolerance, rng):
    links = moving[which]
    posed = placements(rng, 60, 4)
    exact = links.pair_clearances(posed).min(axis=1)
    bounds, rows = links.nearest_pairs(posed, tolerance)
    touching = exact[:, 1] == 0.0
    assert 2 < touching.sum() < 55
    assert (bounds[touching] == 0.0).all()
    lower, upper = bounds[~touching].T
    # Both hold the true distance, which lies between the exact bounds.
    assert (lower <= exact[~touching, 1]).all()
    assert (upper >= exact[~touching, 0]).all()
    assert (upper <= (1.0 + tolerance) * lower + 1e-12).all()
    if tolerance == 0.0:
        np.testing.assert_array_equal(bounds, exact)
        each = links.pair_clearances(posed)
        named = each[np.arange(len(posed)), rows, 1]
        np.testing.assert_array_equal(named, exact[:, 1])


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("margin", [0.0, 1e-6, 0.1, 0.2, 4.0])
def test_whether_anything_comes_near_is_whether_the_least_distance_does(
    moving, which, margin, rng
):
    links = moving[which]
    posed = placements(rng, 60, 4)
    touching = links.first_contacts(posed)
    near, pairs = links.comes_near(posed, margin, touching)
    exact = links.clearances(posed)
    each = links.pair_clearances(posed)
    assert (near[touching] == FAR).all()
    for i in np.flatnonzero(~touching):
        expected = NEAR if exact[i, 1] <= margin else FAR
        assert near[i] == expected
        assert (pairs[i] == -1) == (expected == FAR)
        if expected == NEAR:
            assert each[i, pairs[i], 1] <= margin
    seen = set(near[~touching].tolist())
    assert seen == {0.0: {FAR}, 1e-6: {FAR}, 4.0: {NEAR}}.get(margin, {FAR, NEAR})


def test_a_distance_that_is_the_margin_is_not_called_far(trees):
    """Two boxes 50 mm apart along x: of a margin of 50 mm nobody says it is kept."""
    links = MovingLinks.against([trees[2].tree], [trees[2].tree])
    T = np.eye(4)
    T[0, 3] = 0.25
    for margin, allowed in (
        (0.05, (NEAR, UNDECIDED)),
        (0.05 * (1.0 + 1e-15), (NEAR, UNDECIDED)),
        (0.05 * (1.0 - 1e-6), (FAR,)),
        (0.05 * (1.0 + 1e-6), (NEAR,)),
    ):
        near, _ = links.comes_near(T[None, None], margin)
        assert near[0] in allowed, margin


def test_world_boxes_hold_every_corner_and_gaps_are_bounds(trees, rng):
    links = MovingLinks.among([s.tree for s in trees], np.array([(0, 1)]))
    packed = links.links
    posed = placements(rng, 40, 4)
    reach = np.empty((4, 2, 3))
    gaps = 0
    for i in range(len(posed)):
        world_boxes(packed.nodes, packed.frames, posed, i, reach)
        corners = [
            place_mesh(posed[i, k], s.mesh).vertices for k, s in enumerate(trees)
        ]
        for k in range(4):
            assert (corners[k] >= reach[k, 0]).all()
            assert (corners[k] <= reach[k, 1]).all()
            # and are no larger than they need be, but for float32
            np.testing.assert_allclose(reach[k, 0], corners[k].min(axis=0), atol=1e-6)
        gap = gap_between(reach, 0, reach, 1)
        nearest = np.linalg.norm(corners[0][:, None] - corners[1], axis=2).min()
        assert gap <= nearest
        gaps += gap > 0.0
    assert gaps > 10
