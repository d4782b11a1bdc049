"""Configurations to compare kinematics at: zero, corners of the limits, random ones."""

from collections.abc import Iterable
from itertools import islice, product

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import JointLimitError, UsageError
from borecheck.robots.model import RobotModel

Array = NDArray[np.float64]

MAX_CORNERS = 64  # all corners of six joints; more joints get that many drawn ones


def sample_configurations(
    model: RobotModel, rng: np.random.Generator, count: int
) -> Array:
    """Zero, corners of the limits, then random ones: (count, n).

    Zero and corners are left out where a mimic joint would break its own limit.

    Raises:
        UsageError: No configuration is asked for, or a joint does not vary over the
            sample (a premise of the check).
    """
    if count < 1:
        raise UsageError(f"{count} configurations: at least 1 is needed")
    fixed = list(islice(_special(model, rng), count))
    drawn = model.random_configurations(rng, count - len(fixed))
    sample = np.array([*fixed, *drawn])
    still = np.flatnonzero(np.ptp(sample, axis=0) == 0.0)
    if count > 1 and len(still):
        names = [model.joint_names[i] for i in still]
        raise UsageError(f"joints that do not vary in the sample: {', '.join(names)}")
    return sample


def _special(model: RobotModel, rng: np.random.Generator) -> Iterable[Array]:
    """Zero and corners, as far as every joint is then within its limits."""
    lower = np.where(np.isfinite(model.lower), model.lower, -np.pi)
    upper = np.where(np.isfinite(model.upper), model.upper, np.pi)
    n = len(lower)
    if 2**n <= MAX_CORNERS:
        picks = np.array(list(product([False, True], repeat=n)))
    else:
        picks = rng.integers(0, 2, (MAX_CORNERS, n)).astype(bool)
    for q in [np.zeros(n), *np.where(picks, upper, lower)]:
        try:
            yield model.check_limits(q)
        except JointLimitError:
            continue
