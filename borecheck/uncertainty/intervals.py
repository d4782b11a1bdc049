"""What a share of draws says of a probability: exact limits, and an interval to show.

A risk is called kept or exceeded by exact one-sided limits (Clopper-Pearson): each is
wrong in at most one case of twenty, whatever the probability is. Those limits are
wider than they need to be on the average; the interval that is shown beside an
estimate is Jeffreys', which covers the probability in 95 of 100 cases.
"""

import math

from scipy.special import betaincinv

# Of the interval that is shown, and of each one-sided limit.
LEVEL = 0.95


def upper_limit(hits: int, draws: int) -> float:
    """The probability lies above it in at most 5 % of all cases (exact)."""
    if hits >= draws:
        return 1.0
    if hits == 0:
        return -math.expm1(math.log1p(-LEVEL) / draws)
    return float(betaincinv(hits + 1, draws - hits, LEVEL))


def lower_limit(hits: int, draws: int, level: float = LEVEL) -> float:
    """The probability lies below it in at most 1 - level of all cases (exact)."""
    if hits == 0 or draws == 0:
        return 0.0
    return float(betaincinv(hits, draws - hits + 1, 1.0 - level))


def shown_interval(hits: int, undecided: int, draws: int) -> tuple[float, float]:
    """Jeffreys' 95 % interval; draws that were not decided widen it both ways."""
    if draws == 0:
        return 0.0, 1.0
    tail, most = 0.5 * (1.0 - LEVEL), hits + undecided
    low = float(betaincinv(hits + 0.5, draws - hits + 0.5, tail)) if hits else 0.0
    if most == draws:
        return low, 1.0
    return low, float(betaincinv(most + 0.5, draws - most + 0.5, 1.0 - tail))


def draws_needed(risk: float, share: float = 0.0) -> int | None:
    """How many draws show that a risk is kept, a share of them being in contact.

    None where no number of draws would do (the share is not below the risk).
    """
    if risk >= 1.0:
        return 1
    fewest = math.ceil(math.log1p(-LEVEL) / math.log1p(-risk))
    if share == 0.0:
        return fewest
    if share >= risk:
        return None
    low, high = fewest, 2 * fewest
    while upper_limit(math.ceil(share * high), high) > risk:
        low, high = high, 2 * high
        if high > 10**12:
            return None
    while high - low > max(1, low // 100):
        middle = (low + high) // 2
        if upper_limit(math.ceil(share * middle), middle) > risk:
            low = middle
        else:
            high = middle
    return high
