"""Stretch, stiffness and bearing loads: laws of elastic arms, and ranges looked at."""

from dataclasses import fields, replace

import numpy as np
import pytest

from borecheck_models.closed_form import sources
from crane.dimensions import LIMITS
from crane.kinematics import forward, jacobian
from crane.statics import (
    IDLERS,
    PULLEYS,
    Idler,
    Mechanics,
    cable_stretch,
    compliance,
    idler_load,
    joint_deflection,
    joint_stiffness,
    load_test,
    rating,
    ratings,
    series,
    tube_compliance,
)

HOME = np.array([0.0, 0.2, 0.0, 0.0, 0.0, 0.0, np.pi / 6, 0.0])
LOWER, UPPER = np.array(list(LIMITS.values())).T
RIGID_TUBE = replace(Mechanics(), modulus=1e30, shear=1e30)


def test_every_number_has_its_source():
    assert all(len(source) > 10 for source in sources(Mechanics).values())


def test_stretch_and_deflection_by_hand():
    """100 N on 2 m of 1 mm^2 at 100 GPa: 2 mm; on a pulley of 20 mm: 0.2 rad."""
    stretch = cable_stretch(100.0, 2.0, 1e-6, 100e9)
    assert stretch == pytest.approx(2e-3, rel=1e-12)
    assert joint_deflection(stretch, 0.02) == pytest.approx(0.2, rel=1e-12)


def test_springs_in_series():
    assert series(3.0, 6.0) == pytest.approx(2.0)
    assert series(3.0, float("inf")) == pytest.approx(3.0)
    assert series(float("inf")) == float("inf")


def test_joint_stiffness_is_torque_over_turn():
    m = replace(Mechanics(), strands=1.0)
    for joint, D in PULLEYS.items():
        force = 0.7 / (0.5 * D)  # of a torque of 0.7 Nm
        stretch = cable_stretch(force, m.cable_length, m.cable_area, m.cable_modulus)
        turn = joint_deflection(stretch, D)
        assert joint_stiffness(m)[joint] == pytest.approx(0.7 / float(turn), rel=1e-12)
    # a pretensioned loop is twice as stiff as its one side
    assert joint_stiffness()["q5"] == pytest.approx(2.0 * joint_stiffness(m)["q5"])


def test_two_halves_of_a_belt_press_as_the_sum_of_two_pulls():
    for wrap in np.linspace(0.0, 3.0 * np.pi, 40):
        pulls = np.array([1.0, 0.0]) - [np.cos(wrap), np.sin(wrap)]
        assert idler_load(5.0, wrap) == pytest.approx(5.0 * np.hypot(*pulls), abs=1e-12)


@pytest.mark.parametrize("wrap", [0.8, 1.6, 2.6, 3.1, 3.6, 5.0, 8.9])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rating_is_the_least_over_the_whole_range(wrap, sign):
    limits = {"q7": (-0.7, 0.5)}
    found = rating(Idler("q7", wrap, sign, "q8"), 180.0, limits)
    q = np.linspace(-0.7, 0.5, 200_001)
    tension = 180.0 / (2.0 * np.abs(np.sin(0.5 * (wrap + sign * q))))
    assert found.tension == pytest.approx(tension.min(), rel=1e-9)
    assert -0.7 <= found.at <= 0.5
    assert (
        pytest.approx(
            float(idler_load(found.tension, wrap + sign * found.at)), rel=1e-9
        )
        == 180.0
    )
    assert found.inside == (found.at not in (-0.7, 0.5) and found.ends > found.tension)
    assert found.ends >= found.tension


def test_ends_alone_would_allow_too_much_at_the_tip():
    found = [rating(i, 180.0) for i in IDLERS]
    inside = [f for f in found if f.inside]
    assert inside
    assert all(f.tension == pytest.approx(90.0) for f in inside)  # 2 T at 180 deg
    assert all(f.ends > 1.03 * f.tension for f in inside)
    least = min(f.tension for f in found)
    allowed = ratings()
    assert allowed["q8"] == pytest.approx(least)
    assert allowed["q5"] == pytest.approx(0.014 * least)


def test_a_cable_that_leaves_its_idler_is_refused():
    with pytest.raises(ValueError, match="leaves the idler"):
        rating(Idler("q5", 0.3, 1.0, "q6"), 180.0)


def test_the_tube_is_a_beam():
    """Its end's shift and turn by integrating the curvature M / EI along it."""
    m = Mechanics()
    EI = m.modulus * np.pi / 64.0 * (m.outer**4 - m.inner**4)
    n = 20_000
    s = (np.arange(n) + 0.5) / n * m.free_length
    C = tube_compliance(m)
    for force, moment in ((1.0, 0.0), (0.0, 1.0)):
        bent = (force * (m.free_length - s) + moment) / EI
        turn = bent.sum() * m.free_length / n
        shift = ((m.free_length - s) * bent).sum() * m.free_length / n
        # along y, turning about z
        assert C[1, 1] * force + C[1, 5] * moment == pytest.approx(shift, rel=1e-6)
        assert C[5, 1] * force + C[5, 5] * moment == pytest.approx(turn, rel=1e-6)
        # along z, turning about -y
        assert C[2, 2] * force - C[2, 4] * moment == pytest.approx(shift, rel=1e-6)
        assert -C[4, 2] * force + C[4, 4] * moment == pytest.approx(turn, rel=1e-6)
    # slope at the end of a beam loaded there: 1.5 d / L
    assert C[5, 1] == pytest.approx(1.5 * C[1, 1] / m.free_length, rel=1e-12)


def test_compliance_is_symmetric_and_nothing_gives_way_against_the_force():
    for q in np.random.default_rng(0).uniform(LOWER, UPPER, (20, 8)):
        for part in compliance(q):
            np.testing.assert_allclose(part, part.T, atol=1e-15)
            assert np.linalg.eigvalsh(part).min() > -1e-12


def test_cables_give_way_as_the_jacobian_says():
    q = np.random.default_rng(1).uniform(LOWER, UPPER, 8)
    J = jacobian(q)
    give = np.zeros(8)
    for joint, k in joint_stiffness().items():
        give[int(joint[1]) - 1] = 1.0 / k
    body = J @ np.diag(give) @ J.T
    R = np.kron(np.eye(2), forward(q)["8"][:3, :3])
    np.testing.assert_allclose(compliance(q)[1], R @ body @ R.T, atol=1e-15)


def test_a_tube_seen_farther_out_gives_way_more():
    """By hand at home: a force down, levers of a bent and twisted end."""
    T = forward(HOME)
    d = T["8"][:3, 3] - T["4"][:3, 3]
    C = tube_compliance()
    down = C[2, 2] - 2.0 * d[0] * C[2, 4] + d[0] ** 2 * C[4, 4] + d[1] ** 2 * C[3, 3]
    assert compliance(HOME)[0][2, 2] == pytest.approx(down, rel=1e-12)


def test_the_load_test_is_eq_3_in_one_direction():
    tube, cables = compliance(HOME)
    found = load_test(HOME, [0.0, 0.0, -2.0])
    k = series(1.0 / tube[2, 2], 1.0 / cables[2, 2])
    assert found.stiffness_without == pytest.approx(k, rel=1e-12)
    assert found.both == pytest.approx(5.0 / k, rel=1e-12)
    assert found.link == pytest.approx(5.0 * tube[2, 2], rel=1e-12)
    assert found.reading == pytest.approx(0.03e-3 / np.sqrt(12 * 5))
    assert load_test(HOME, [0, 0, -1.0], RIGID_TUBE).link < 1e-15


@pytest.mark.parametrize(
    ("direction", "message"),
    [
        ([0.0, 0.0, 0.0], "no length"),
        ([0.0, 0.0, np.inf], "not finite"),
        ([np.nan, 0.0, 1.0], "not finite"),
        ([0.0, 1.0], "x, y, z"),
    ],
)
def test_a_load_without_direction_is_refused(direction, message):
    with pytest.raises(ValueError, match=message):
        load_test(HOME, direction)


def test_only_the_direction_of_a_load_counts():
    for length in (1e-320, 1e-160, 1e160, 1e308):
        found = load_test(HOME, [0.0, length, 0.0])
        assert found == load_test(HOME, [0.0, 1.0, 0.0])


@pytest.mark.parametrize("q", [HOME[:7], HOME * np.nan, HOME + np.inf, HOME[None]])
def test_what_is_no_configuration_has_no_stiffness(q):
    with pytest.raises(ValueError, match=r"not finite|\(8,\)"):
        load_test(q, [0.0, 0.0, 1.0])


@pytest.mark.parametrize("name", [item.name for item in fields(Mechanics)])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_an_arm_of_no_such_numbers_is_refused(name, value):
    with pytest.raises(ValueError, match=f"{name} .*(not finite|must be positive)"):
        replace(Mechanics(), **{name: value})


def test_a_tube_has_a_wall():
    with pytest.raises(ValueError, match="has no bore"):
        replace(Mechanics(), inner=0.038)


def test_a_part_without_stiffness_leaves_none():
    assert series(0.0, 5.0) == 0.0
    assert series(0.0, float("inf")) == 0.0
    assert series(1e-310, 1e-310) == pytest.approx(0.5e-310)
    assert series(1e308, 1e308) == pytest.approx(0.5e308)
    for wrong in (-1.0, np.nan):
        with pytest.raises(ValueError, match="is none"):
            series(3.0, wrong)


def test_no_cable_and_no_pulley_is_refused_by_name():
    with pytest.raises(ValueError, match=r"area = 0\.0 must be positive"):
        cable_stretch(1.0, 1.0, 0.0, 1e9)
    with pytest.raises(ValueError, match=r"force .*not finite"):
        cable_stretch(np.inf, 1.0, 1e-6, 1e9)
    with pytest.raises(ValueError, match="diameter"):
        joint_deflection(1e-3, [0.02, -0.02])
    with pytest.raises(ValueError, match=r"wrap .*not finite"):
        idler_load(1.0, np.nan)
    for bearing in (0.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="bearing"):
            rating(IDLERS[0], bearing)
