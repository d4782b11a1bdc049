"""Axes have round numbers; lines are told apart by more than their colour."""

import re

import numpy as np
import pytest

from crane.pictures import _Scale, curves


@pytest.mark.parametrize("span", [(0.0, 1.0), (-23.6, 613.6), (1e-9, 3e-9), (5.0, 5.0)])
def test_marks_are_round_within_and_few(span):
    scale = _Scale(span, 0.0, 100.0)
    marks = np.array(scale.marks())
    assert 4 <= len(marks) <= 9
    assert scale.low <= marks[0]
    assert marks[-1] <= scale.high
    step = np.diff(marks)
    np.testing.assert_allclose(step, step[0], rtol=1e-9)
    digits = f"{step[0]:.3e}"[0]
    assert digits in "125"
    np.testing.assert_allclose(marks / step[0], np.round(marks / step[0]), atol=1e-6)


def test_every_line_has_its_colour_and_its_dashes():
    svg = curves({name: [(0, 0), (1, k)] for k, name in enumerate("abc")}, "x", "y")
    assert len(set(re.findall(r'stroke-dasharray="([^"]+)"', svg))) == 3
    assert len(set(re.findall(r'<polyline fill="none" stroke="([^"]+)"', svg))) == 3
