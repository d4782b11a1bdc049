"""Strokes of a deep insertion: the tip goes on along its line and never jumps."""

import numpy as np
import pytest

from crane.dimensions import LIMITS, MOST_AHEAD
from crane.kinematics import forward
from crane.strokes import CLUTCHES, strokes

LOW, HIGH = LIMITS["q8"]


def tip(q, stroke, q8):
    q = np.append(q[:7], q8)
    return forward(q, needle_ahead=stroke.needle_ahead)["needle_tip"]


def test_the_tip_goes_straight_on_through_all_strokes():
    rng = np.random.default_rng(0)
    lower, upper = np.array(list(LIMITS.values())).T
    for _ in range(200):
        q = rng.uniform(lower, upper)
        ahead, begin = rng.uniform(0.0, 0.1), q[7]
        depth = rng.uniform(0.0, HIGH - begin + MOST_AHEAD - ahead)
        found = strokes(depth, needle_length=0.25, needle_ahead=ahead, begin=begin)
        assert found[0].begin == begin
        assert found[0].needle_ahead == ahead
        start = tip(q, found[0], begin)
        before = start
        for stroke in found:
            assert LOW <= stroke.begin < stroke.end <= HIGH + 1e-15
            assert stroke.needle_ahead <= 0.25 - CLUTCHES + 1e-15
            np.testing.assert_allclose(tip(q, stroke, stroke.begin), before, atol=1e-15)
            before = tip(q, stroke, stroke.end)
        gone = before[:3, 3] - start[:3, 3]
        np.testing.assert_allclose(gone, depth * start[:3, 2], atol=1e-12)
        # no fewer would do: all but the last use q8 up
        assert all(stroke.end == pytest.approx(HIGH) for stroke in found[:-1])


def test_the_deepest_is_reached_and_no_more():
    found = strokes(0.0475 + 0.11, needle_length=0.25)
    assert len(found) == 4
    assert found[-1].needle_ahead == pytest.approx(MOST_AHEAD)
    with pytest.raises(ValueError, match=r"deeper .* goes from here: 157.5 mm"):
        strokes(0.158, needle_length=0.25)
    assert len(strokes(0.0475)) == 1
    assert len(strokes(0.0575)) == 2
    with pytest.raises(ValueError, match=r"goes from here: 57.5 mm"):
        strokes(0.058)
    assert strokes(0.0) == ()


@pytest.mark.parametrize(
    ("depth", "more", "message"),
    [
        (-0.01, {}, "drive the needle on"),
        (np.nan, {}, "depth .*not finite"),
        (1e308, {}, "deeper"),
        (0.01, {"begin": 0.05}, "q8 = 0.05 m is not within"),
        (0.01, {"needle_ahead": 0.07}, "two clutches"),
        (0.01, {"needle_length": 0.08}, "two clutches"),
        (0.01, {"needle_length": np.inf}, "not finite"),
    ],
)
def test_what_is_no_insertion_is_refused(depth, more, message):
    with pytest.raises(ValueError, match=message):
        strokes(depth, **more)
