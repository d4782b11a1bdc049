"""Configurations to start a search from: spread evenly over limits, always the same."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def spread(
    home: Array,
    active: NDArray[np.int64],
    lower: Array,
    upper: Array,
    first: int,
    count: int,
) -> Array:
    """Configurations (count, n): home with active joints anywhere in their limits.

    The first of all is home itself; the others follow a low-discrepancy sequence:
    shifts by powers of the root of x^(d+1) = x + 1, which generalises the golden ratio.
    A joint without limits is spread over one turn about home.

    Args:
        home: (n,).
        active: Entries of q to spread.
        lower: Limits, (n,), or -inf.
        upper: Likewise.
        first: Which of the sequence comes first.
        count: How many.
    """
    d = len(active)
    root = 1.5
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (d + 1))
    shifts = root ** -np.arange(1.0, d + 1)
    number = np.arange(first, first + count)
    shares = (0.5 + np.outer(number, shifts)) % 1.0
    low = np.where(np.isfinite(lower), lower, home - np.pi)[active]
    high = np.where(np.isfinite(upper), upper, home + np.pi)[active]
    qs = np.tile(home, (count, 1))
    qs[:, active] = low + shares * (high - low)
    if first == 0:
        qs[0] = home
        qs[0, active] = np.clip(home[active], lower[active], upper[active])
    return qs
