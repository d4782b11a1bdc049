"""Limits and intervals against the binomial law they are made for."""

import numpy as np
import pytest
from scipy.stats import binom

from borecheck.uncertainty.intervals import (
    draws_needed,
    lower_limit,
    shown_interval,
    upper_limit,
)


@pytest.mark.parametrize(("hits", "draws"), [(0, 20), (1, 20), (7, 300), (299, 300)])
def test_limits_are_where_the_binomial_law_leaves_five_per_cent(
    hits: int, draws: int
) -> None:
    upper, lower = upper_limit(hits, draws), lower_limit(hits, draws)
    assert binom.cdf(hits, draws, upper) == pytest.approx(0.05, rel=1e-9)
    if hits:
        assert binom.sf(hits - 1, draws, lower) == pytest.approx(0.05, rel=1e-9)
    else:
        assert lower == 0.0


def test_all_draws_in_contact_leave_no_upper_limit() -> None:
    assert upper_limit(50, 50) == 1.0
    assert lower_limit(0, 0) == 0.0


@pytest.mark.parametrize("risk", [1e-1, 1e-2, 1e-3, 1e-4])
def test_fewest_draws_without_contact(risk: float) -> None:
    needed = draws_needed(risk)
    assert needed is not None
    assert upper_limit(0, needed) <= risk < upper_limit(0, needed - 1)


def test_draws_for_a_risk_of_one_in_a_thousand() -> None:
    assert draws_needed(1e-3) == 2995  # log(0.05) / log(0.999)


def test_draws_with_a_share_in_contact() -> None:
    needed = draws_needed(1e-2, 5e-3)
    assert needed is not None
    assert upper_limit(int(np.ceil(needed * 5e-3)), needed) <= 1e-2
    fewer = needed // 2
    assert upper_limit(int(np.ceil(fewer * 5e-3)), fewer) > 1e-2
    assert draws_needed(1e-2, 1e-2) is None


def test_shown_interval_covers_in_95_of_100_cases_on_the_average() -> None:
    draws = 300
    spans = np.array([shown_interval(k, 0, draws) for k in range(draws + 1)])
    covered = []
    for p in np.exp(np.linspace(np.log(0.01), np.log(0.5), 400)):
        inside = (spans[:, 0] <= p) & (p <= spans[:, 1])
        covered.append(binom.pmf(np.arange(draws + 1), draws, p)[inside].sum())
    assert np.mean(covered) == pytest.approx(0.95, abs=0.005)


def test_undecided_draws_widen_the_interval_upwards_only() -> None:
    low, high = shown_interval(3, 0, 300)
    same, higher = shown_interval(3, 5, 300)
    assert same == low
    assert higher == shown_interval(8, 0, 300)[1] > high
    assert shown_interval(0, 300, 300) == (0.0, 1.0)
