import math

import numpy as np
import pytest

from borecheck.core.units import parse_angle, parse_length, parse_pose
from borecheck.errors import UsageError


@pytest.mark.parametrize(
    ("text", "metres"),
    [("20mm", 0.02), ("0.02m", 0.02), ("0.02", 0.02), ("-3cm", -0.03), ("1e3um", 1e-3)],
)
def test_lengths(text, metres):
    assert parse_length(text) == pytest.approx(metres, rel=1e-15)


def test_angles():
    assert parse_angle("90deg") == pytest.approx(math.pi / 2, rel=1e-15)
    assert parse_angle("0.5") == 0.5


@pytest.mark.parametrize("text", ["20", "20 mm", " 20mm "])
def test_spaces_are_allowed(text):
    assert math.isfinite(parse_length(text))


@pytest.mark.parametrize(
    "text", ["", "mm", "20deg", "20 furlong", "1e999", "nan", "1,5"]
)
def test_what_is_no_length_is_refused_in_one_line(text):
    with pytest.raises(UsageError) as refused:
        parse_length(text)
    assert "\n" not in str(refused.value)


def test_pose_with_units():
    T = parse_pose("100mm,0,-0.5m,0,0,90deg")
    np.testing.assert_allclose(T[:3, 3], [0.1, 0.0, -0.5])
    np.testing.assert_allclose(T[:3, 0], [0.0, 1.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("text", ["1,2", "1,2,3,4", "a,b,c", "0,0,0,0,0,1mm"])
def test_what_is_no_pose_is_refused(text):
    with pytest.raises(UsageError):
        parse_pose(text)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("0,0,0,0,0,90", "90deg"),
        ("0,0,0,-45,0,0", "90deg"),
        ("0,0,0,0,6.3,0", "90deg"),
        ("0,0,0,0,361deg,0", "90deg"),
        ("0,800,0", "800mm"),
        ("0,0,-10.1", "800mm"),
    ],
)
def test_degrees_and_millimetres_without_their_unit_are_refused(text, hint):
    with pytest.raises(UsageError, match=hint):
        parse_pose(text)


@pytest.mark.parametrize("angle", ["6.2832", "-6.283185307179586", "360deg"])
def test_a_whole_turn_is_no_mistake(angle):
    T = parse_pose(f"10,0,0,0,0,{angle}")
    np.testing.assert_allclose(T[:3, 0], [1.0, 0.0, 0.0], atol=1e-4)
