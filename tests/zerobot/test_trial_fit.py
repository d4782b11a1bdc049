"""Fits to the published table: what can make it is found, what cannot is named."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from zerobot.trials.errors import Sources
from zerobot.trials.fit import (
    FAMILIES,
    FLIP_MM,
    Effects,
    columns,
    first_order,
    log_likelihood,
    maximum_likelihood,
    needed_margin_mm,
    smallest_disturbance,
    spread_mm,
)
from zerobot.trials.published import approaches


def effects() -> list[Effects]:
    """Normals as in a round bore: up on either side, straight up for P2."""
    found = []
    for a in approaches():
        side = {"P1": -1.0, "P2": 0.0, "P3": 1.0}[a.point]
        tilt = side * (0.75 if a.axis == "Y" else 0.65)
        normal = np.array([0.0, tilt, -math.sqrt(1.0 - tilt * tilt)])
        found.append(Effects(a, normal, 0.01 * a.q4_deg, 0.02 * a.q5_deg))
    return found


def test_log_likelihood_is_the_product_of_the_cells() -> None:
    missed = np.array([True, False])
    found = log_likelihood(np.array([4.0, 1.0]), np.array([2.0, 2.0]), missed)
    right = norm.cdf(2.0) - norm.cdf(-3.0)
    assert found == pytest.approx(math.log(norm.sf(0.5)) + math.log(right))


@pytest.mark.parametrize("family", FAMILIES)
def test_columns_have_names_and_only_their_own_approaches(family: str) -> None:
    told = effects()
    A, names = columns(family, told)
    assert A.shape == (len(told), len(names))
    assert len(set(names)) == len(names)
    assert np.linalg.norm(A, axis=1).min() > 0.99


def test_unknown_family_is_refused() -> None:
    with pytest.raises(ValueError, match="no family"):
        columns("two offsets", effects())


def test_one_offset_cannot_make_the_published_table() -> None:
    """Posture (0,0) has the same normals as (-30,-15) here, and never fails."""
    found = smallest_disturbance("one offset", effects())
    assert found.size_mm is None
    assert found.parameters == {}


def test_offset_by_posture_can_and_it_is_the_smallest() -> None:
    told = effects()
    found = smallest_disturbance("offset by posture", told)
    assert found.size_mm is not None
    A, names = columns("offset by posture", told)
    x = np.array([found.parameters[name] for name in names])
    error = A @ x
    missed = np.array([e.missed for e in told])
    assert ((error > FLIP_MM) == missed).all()
    assert (np.abs(error[~missed]) <= FLIP_MM).all()
    # a bit shorter, and a miss is lost: a scaled vector is no longer a solution
    assert ((A @ (0.99 * x) > FLIP_MM) != missed).any()
    assert all(v == 0.0 for k, v in found.parameters.items() if "(0,0)" in k)


def test_likeliest_offset_of_a_planted_table() -> None:
    """More freedom never fits worse; the free one calls every cell."""
    told, sources = effects(), Sources()
    fits = [maximum_likelihood(family, told, sources) for family in FAMILIES]
    by_name = {fit.family: fit for fit in fits}
    one = by_name["one offset"].log_likelihood
    posture = by_name["offset by posture"].log_likelihood
    assert posture > one
    assert by_name["offset by posture"].right_cells >= 30
    assert by_name["one offset"].expected_misses == pytest.approx(7, abs=2)


def test_spread_of_the_error_is_that_of_the_draws() -> None:
    told, sources = effects(), Sources()
    drawn = first_order(told, sources, np.random.default_rng(0), 40_000)
    stated = np.array([spread_mm(e, sources) for e in told])
    assert drawn.std(axis=0) == pytest.approx(stated, rel=0.03)
    assert drawn.mean(axis=0) == pytest.approx([e.bending_mm for e in told], abs=0.05)


def test_rods_shift_the_errors_when_the_model_misplaces_them() -> None:
    told = effects()
    rods = Sources(level_parts="frame4")
    one, other = (
        first_order(told, s, np.random.default_rng(0), 10) for s in (Sources(), rods)
    )
    assert (other - one)[0] == pytest.approx([e.rods_mm for e in told])


def test_margin_window_of_a_known_error() -> None:
    rng = np.random.default_rng(1)
    error = rng.normal(0.0, 1.0, (100_000, 1))
    clear = np.stack([25.0 + error, 15.0 + error], axis=2)
    low, high = needed_margin_mm(clear)
    assert low == pytest.approx(15.0 + norm.isf(1e-3), abs=0.15)
    assert high == pytest.approx(25.0 - norm.isf(1e-3), abs=0.15)
