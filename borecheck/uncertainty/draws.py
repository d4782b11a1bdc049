"""Draws of the errors: all of them, or those beyond a radius that is proven harmless.

Errors are x = A z, z standard normal in k dimensions. Where |z| up to a radius is
proven to be harmless, contact can only come from beyond it: |z|^2 is chi-squared, so
how likely that is is known exactly, and it is enough to draw there. The probability of
contact is the product of both, and so are its limits: nothing is estimated but the
share of such draws.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri

Array = NDArray[np.float64]

# Beyond a radius this unlikely nothing more is gained.
LEAST_OUTSIDE = 1e-12


@dataclass(frozen=True)
class Shell:
    """Where draws are made.

    Attributes:
        dimensions: Of z, k.
        radius: Nothing is drawn within it.
        outside: P(|z| > radius).
    """

    dimensions: int
    radius: float
    outside: float

    @classmethod
    def beyond(cls, radius: float, dimensions: int) -> "Shell":
        """The shell outside a radius, or outside one that is unlikely enough."""
        if dimensions == 0 or radius <= 0.0:
            return cls(dimensions, 0.0, 1.0)
        most = enough_radius(dimensions, LEAST_OUTSIDE)
        used = min(radius, most)
        return cls(dimensions, used, float(chdtrc(dimensions, used**2)))

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Standard normal z given that they lie outside, (count, dimensions)."""
        z = rng.standard_normal((count, self.dimensions))
        if self.outside == 1.0:
            return z
        u = rng.uniform(np.finfo(float).tiny, 1.0, count)
        length = np.sqrt(chdtri(self.dimensions, u * self.outside))
        return np.asarray(z * (length / np.linalg.norm(z, axis=1))[:, None])


def enough_radius(dimensions: int, outside: float) -> float:
    """The radius that is exceeded with a probability."""
    return float(np.sqrt(chdtri(dimensions, outside))) if dimensions else 0.0
