"""Lines to parameters against the paper's chain typed in mri_arm.parameters."""

import numpy as np
import pytest

from borecheck.calibration.link_parameters import (
    choose_forms,
    lines_to_parameters,
    parameters_to_lines,
)
from borecheck.errors import GeometryError
from mri_arm.parameters import ANGLES, JOINT_TURNS, LINKS, NAMES, elementary, nominal

ROUNDING = 1e-13

# [Heikkila2010] section 4 at zero: z through the base, x at the shoulder and elbow, ...
POINTS = np.array(
    [[0, 0, 0], [0, 0, 0.6], [0, 0, 1.05], [0, 0, 1.05], [0, 1, 1.05], [0, 1, 1.05]]
)
DIRECTIONS = np.array(
    [[0, 0, 1], [1, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0]], dtype=float
)


def perturbed(rng, length, angle):
    values = nominal()
    for name in NAMES:
        size = angle if name in ANGLES else length
        values[name] += rng.uniform(-size, size)
    return values


def lines_of_the_paper(values):
    """Axes at zero by the paper's chain, independent of the code under test."""
    T = np.eye(4)
    points, directions = [], []
    for link, joint_turn in zip(LINKS.values(), JOINT_TURNS, strict=True):
        for name, step in link:
            T = T @ elementary(step, values[name])
        points.append(T[:3, 3])
        directions.append(T[:3, "xyz".index(joint_turn[1])])
    return np.array(points), np.array(directions)


def test_the_forms_are_those_of_the_paper():
    forms = choose_forms(POINTS, DIRECTIONS)
    assert forms.names == NAMES
    assert forms.angles == ANGLES
    assert [link.form for link in forms.links] == ["base", "dh", "hayati"] + 3 * ["dh"]


def test_paper_chain_gives_its_parameters_back():
    rng = np.random.default_rng(1)
    forms = choose_forms(POINTS, DIRECTIONS)
    for _ in range(100):
        values = perturbed(rng, 0.02, 0.1)
        points, directions = lines_of_the_paper(values)
        slid = points + rng.uniform(-1, 1, (6, 1)) * directions  # any point of the line
        found = lines_to_parameters(forms, slid, directions)
        for name in NAMES:
            assert found[name] == pytest.approx(values[name], abs=ROUNDING), name


def test_printed_signs_do_not_give_the_parameters_back():
    """[Heikkila2010] App. II prints be = asin(z), k = p/n and al = atan(y/z)."""
    th, d, b, be, al = 0.3, 0.2, 0.05, 0.4, 0.3
    H = elementary("Rz", th) @ elementary("Tz", d)
    H = H @ elementary("Ty", b) @ elementary("Ry", be)
    n, p = H[:3, 0], H[:3, 3] + 0.7 * H[:3, 0]
    assert np.arcsin(n[2]) == pytest.approx(-be)  # printed
    assert np.arcsin(-n[2]) == pytest.approx(be)  # corrected
    n1, p1 = (elementary("Rz", -th)[:3, :3] @ v for v in (n, p))
    printed, corrected = p1[0] / n1[0], -p1[0] / n1[0]
    assert abs(p1[2] + printed * n1[2] - d) > 0.1
    assert p1[2] + corrected * n1[2] == pytest.approx(d)
    t = (elementary("Rx", al) @ elementary("Tz", 0.45))[:3, 3]
    assert np.arctan(t[1] / t[2]) == pytest.approx(-al)  # printed
    assert np.arctan2(-t[1], t[2]) == pytest.approx(al)  # corrected


def test_any_axes_come_back_as_lines():
    """Skew axes of any direction: the lines of the parameters are the lines."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        p = rng.uniform(-1, 1, (7, 3))
        u = rng.normal(size=(7, 3))
        u /= np.linalg.norm(u, axis=1, keepdims=True)
        if rng.random() < 0.5:
            u[3] = rng.choice([-1, 1]) * u[2]
        forms = choose_forms(p, u)
        turned = u + rng.uniform(-0.05, 0.05, u.shape)
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        moved = p + rng.uniform(-0.01, 0.01, p.shape)
        values = lines_to_parameters(forms, moved, turned)
        q, v = parameters_to_lines(forms, values)
        np.testing.assert_allclose(v, turned, atol=1e-11)
        np.testing.assert_allclose(np.cross(q - moved, turned), 0, atol=1e-9)


def test_many_arms_at_once_are_the_single_ones():
    rng = np.random.default_rng(3)
    forms = choose_forms(POINTS, DIRECTIONS)
    lines = [lines_of_the_paper(perturbed(rng, 0.01, 0.02)) for _ in range(4)]
    points, directions = (np.array(x) for x in zip(*lines, strict=True))
    together = lines_to_parameters(forms, points, directions)
    for i in range(4):
        single = lines_to_parameters(forms, points[i], directions[i])
        for name in NAMES:
            assert together[name][i] == pytest.approx(single[name], abs=1e-15)


def test_coinciding_axes_are_refused():
    with pytest.raises(GeometryError, match="axes 2 and 3 coincide"):
        choose_forms(POINTS[[0, 1, 1, 3]], DIRECTIONS[[0, 1, 1, 3]])
