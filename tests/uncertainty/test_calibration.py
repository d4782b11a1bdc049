"""A seeded part of `studies.uncertainty_calibration`, and the cases it is made of."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from borecheck.uncertainty.contact_probability import contact_probability
from borecheck.uncertainty.covariance import from_document
from studies.uncertainty_calibration import outcomes, report
from studies.uncertainty_cases import makers

CASES = 24


def test_intervals_cover_and_no_risk_is_called_kept_that_is_not(
    tmp_path: Path,
) -> None:
    found = outcomes(CASES, 11, tmp_path)
    missed = sum(not outcome.covers for outcome in found)
    # of 24 intervals of 95 % as many miss by chance once in a thousand
    assert missed <= binom.ppf(0.999, CASES, 0.05)
    assert sum(o.wrongly_kept for o in found) <= binom.ppf(0.999, CASES, 0.05)
    assert {o.found.answer for o in found} == {"kept", "exceeded", "not shown"}
    assert sum(o.found.undecided for o in found) <= 0.01 * 300 * CASES
    assert len(report(found)) == 12 + 5


def test_every_kind_is_near_its_closed_form(tmp_path: Path) -> None:
    """As wide as four standard errors: a wrong closed form would be seen."""
    rng = np.random.default_rng(5)
    for make in makers(tmp_path):
        case = make(rng)
        found = contact_probability(
            case.robot,
            case.scene,
            case.motion,
            from_document(case.errors, case.robot),
            margin=case.margin,
            samples=400,
            seed=1,
        )
        p = case.probability / found.outside
        error = found.outside * np.sqrt(p * (1.0 - p) / 400)
        assert found.probability == pytest.approx(
            case.probability, abs=4.0 * error + 1e-9
        ), case.kind
