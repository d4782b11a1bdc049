"""Eight lanes at once against the same formulas in float64 numpy."""

import numpy as np
import pytest
from numba import njit

from borecheck.geometry.tree.build import NO_BOX
from borecheck.geometry.tree.simd import PROBE_COLUMNS, gap_mask, overlap_mask

F32 = np.float32
# Contracted or not, a dozen float32 operations on numbers below 10.
ROUNDING = 1e-5


@njit
def overlaps(nodes, node, probe):
    return overlap_mask(nodes, node, probe)


@njit
def gaps_below(nodes, node, probe, limit, gaps):
    return gap_mask(nodes, node, probe, limit, gaps)


def random_case(rng):
    """Nodes with boxes of any size, and a probe with a true rotation."""
    nodes = np.zeros((5, 7, 8), F32)
    nodes[:, :3] = rng.uniform(-1, 1, (5, 3, 8))
    nodes[:, 3:6] = 10.0 ** rng.uniform(-2, 0, (5, 3, 8))
    probe = np.zeros(PROBE_COLUMNS, F32)
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    slack, own = 1e-3, 10.0 ** rng.uniform(-2, 0, 3)
    probe[:3] = rng.uniform(-1, 1, 3)
    probe[3:6] = np.abs(R.T) @ own + slack
    probe[6:9] = own + slack
    probe[9:18] = R.reshape(-1)
    probe[18] = slack
    return nodes, probe


def plain_excesses(nodes, node, probe):
    """How far apart the projections are along the six axes, (6, 8)."""
    node, probe = nodes[node].astype(float), probe.astype(float)
    d = node[:3] - probe[:3, None]
    R = probe[9:18].reshape(3, 3)
    own = np.abs(d) - node[3:6] - probe[3:6, None]
    other = np.abs(R @ d) - np.abs(R) @ node[3:6] - probe[6:9, None]
    return np.concatenate([own, other]), d, R @ d


def plain_gaps(nodes, node, probe):
    excesses, d, seen = plain_excesses(nodes, node, probe)
    far = np.maximum(excesses, 0.0)
    axes = np.sqrt(np.maximum((far[:3] ** 2).sum(0), (far[3:] ** 2).sum(0)))
    half = nodes[node, 3:6].astype(float) + probe[18]
    reach = (np.abs(d) * half).sum(0) + probe[6:9].astype(float) @ np.abs(seen)
    length = np.linalg.norm(d, axis=0)
    return np.maximum(axes, length - reach / length)


def bits(mask):
    return np.array([(mask >> i) & 1 for i in range(8)], bool)


def test_overlaps_are_those_of_the_plain_formulas():
    rng = np.random.default_rng(31)
    met = asked = 0
    for _ in range(500):
        nodes, probe = random_case(rng)
        worst = plain_excesses(nodes, 3, probe)[0].max(axis=0)
        kept = bits(overlaps(nodes, 3, probe))
        sure = np.abs(worst) > ROUNDING
        np.testing.assert_array_equal(kept[sure], worst[sure] <= 0.0)
        met, asked = met + kept.sum(), asked + 8
    assert asked // 20 < met < asked


def test_gaps_are_those_of_the_plain_formulas_and_never_above():
    rng = np.random.default_rng(32)
    gaps = np.zeros(8, F32)
    for _ in range(500):
        nodes, probe = random_case(rng)
        limit = F32(rng.uniform(0, 2))
        below = bits(gaps_below(nodes, 2, probe, limit, gaps))
        np.testing.assert_array_equal(below, gaps < limit)
        expected = plain_gaps(nodes, 2, probe)
        np.testing.assert_allclose(gaps, expected, rtol=2e-5, atol=ROUNDING)
        assert (gaps <= expected + 1e-6).all()


def test_unused_slots_never_meet_anything_and_are_infinitely_far():
    nodes, probe = random_case(np.random.default_rng(33))
    nodes[1, :3, 4:], nodes[1, 3:6, 4:] = 0.0, NO_BOX
    nodes[1, :3, :4], nodes[1, 3:6, :4] = probe[:3, None], 1.0
    assert overlaps(nodes, 1, probe) == 0b1111
    gaps = np.zeros(8, F32)
    assert gaps_below(nodes, 1, probe, F32(np.inf), gaps) == 0b1111
    assert np.isinf(gaps[4:]).all()


@pytest.mark.parametrize("row", [0, 4])
def test_a_number_that_is_none_keeps_the_box(row):
    nodes, probe = random_case(np.random.default_rng(34))
    nodes[0, :3], nodes[0, 3:6] = probe[:3, None], 1.0
    nodes[0, row, 5] = np.nan
    assert bits(overlaps(nodes, 0, probe))[5]
