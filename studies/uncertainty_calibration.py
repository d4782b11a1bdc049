"""Is a stated probability of contact right, and is a risk called kept only where it is?

Analytic cases (`studies.uncertainty_cases`) are asked as a user asks: the interval must
cover the known probability in 94 to 96 of 100 cases, and of the cases whose probability
is above the accepted risk no more than the stated 5 % may be called kept.

    python -m studies.uncertainty_calibration --cases 1200
"""

import argparse
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from borecheck.uncertainty.contact_probability import (
    EXCEEDED,
    KEPT,
    ContactProbability,
    contact_probability,
)
from borecheck.uncertainty.covariance import from_document
from borecheck.uncertainty.intervals import shown_interval
from studies.uncertainty_cases import Case, makers

Array = NDArray[np.float64]

# How far the accepted risk is from the true probability, as a factor either way.
SPREAD = 2.0


@dataclass(frozen=True)
class Outcome:
    """A case, the risk that was accepted, and the answer."""

    case: Case
    risk: float
    found: ContactProbability

    @property
    def covers(self) -> bool:
        """Whether the interval holds the true probability."""
        low, high = self.found.interval
        return low <= self.case.probability <= high

    @property
    def wrongly_kept(self) -> bool:
        """Whether a risk is called kept that is not."""
        return self.found.answer == KEPT and self.case.probability > self.risk

    @property
    def wrongly_exceeded(self) -> bool:
        """Whether a risk is called exceeded that is not."""
        return self.found.answer == EXCEEDED and self.case.probability <= self.risk


@lru_cache
def _spans(draws: int) -> Array:
    """The interval of every possible count, (draws + 1, 2)."""
    return np.array([shown_interval(k, 0, draws) for k in range(draws + 1)])


def expected_coverage(outcome: Outcome) -> float:
    """How often the interval of that many draws covers, by the binomial law."""
    draws, outside = outcome.found.samples, outcome.found.outside
    share = outcome.case.probability / outside
    spans = _spans(draws)
    inside = (spans[:, 0] <= share) & (share <= spans[:, 1])
    chances = binom.pmf(np.arange(draws + 1), draws, share)
    return float(chances[inside].sum())


def outcomes(cases: int, seed: int, folder: Path) -> list[Outcome]:
    """Cases of all kinds in turn, each with draws of its own."""
    rng = np.random.default_rng(seed)
    kinds = makers(folder)
    found = []
    for k in range(cases):
        case = kinds[k % len(kinds)](rng)
        risk = min(case.probability * SPREAD ** rng.uniform(-1.0, 1.0), 0.9)
        answer = contact_probability(
            case.robot,
            case.scene,
            case.motion,
            from_document(case.errors, case.robot),
            margin=case.margin,
            risk=risk,
            seed=int(rng.integers(2**31)),
        )
        found.append(Outcome(case, risk, answer))
        if (k + 1) % 100 == 0:
            print(f"{k + 1} cases", file=sys.stderr, flush=True)
    return found


def report(found: list[Outcome]) -> list[str]:
    """The table by kind, and the totals."""
    rows = ["kind                 cases  covered  draws  undecided  wrongly kept"]
    for kind in dict.fromkeys(o.case.kind for o in found):
        own = [o for o in found if o.case.kind == kind]
        rows.append(
            f"{kind:20s} {len(own):5d}  {np.mean([o.covers for o in own]):7.1%}  "
            f"{sum(o.found.samples for o in own):5d}  "
            f"{sum(o.found.undecided for o in own):9d}  "
            f"{sum(o.wrongly_kept for o in own):12d}"
        )
    over = [o for o in found if o.case.probability > o.risk]
    under = [o for o in found if o.case.probability <= o.risk]
    kept, exceeded = (
        sum(o.wrongly_kept for o in over),
        sum(o.wrongly_exceeded for o in under),
    )
    covered, answers = (
        sum(o.covers for o in found),
        Counter(o.found.answer for o in found),
    )
    error = np.sqrt(0.95 * 0.05 / len(found))
    return [
        *rows,
        f"coverage of the 95 % interval: {covered} of {len(found)} cases, "
        f"{covered / len(found):.2%} (standard error {error:.2%}; "
        f"{np.mean([expected_coverage(o) for o in found]):.2%} by the binomial law)",
        f"risk above what is accepted: {len(over)} cases, {kept} called kept "
        f"({kept / max(len(over), 1):.2%}; stated error 5 %, so up to "
        f"{int(binom.ppf(0.999, len(over), 0.05))} by chance)",
        f"risk within what is accepted: {len(under)} cases, {exceeded} called exceeded "
        f"({exceeded / max(len(under), 1):.2%}; stated error 5 %)",
        "answers: " + ", ".join(f"{n} {word}" for word, n in sorted(answers.items())),
    ]


def main() -> int:
    """Runs the study; 1 if a claim does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=1200)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = outcomes(args.cases, args.seed, Path(folder))
    print("\n".join(report(found)))
    covered = float(np.mean([o.covers for o in found]))
    over = sum(o.case.probability > o.risk for o in found)
    kept = sum(o.wrongly_kept for o in found)
    return int(not 0.94 <= covered <= 0.96 or kept > 0.05 * over)


if __name__ == "__main__":
    sys.exit(main())
