"""Turns as rotation vectors; numpy only."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def turns(w: ArrayLike) -> Array:
    """Rodrigues' formula for turns w (n, 3), [rad]: (n, 3, 3)."""
    w = np.asarray(w, float)
    angle = np.linalg.norm(w, axis=1)[:, None, None]
    W = np.zeros((len(w), 3, 3))
    W[:, 0, 1], W[:, 0, 2], W[:, 1, 2] = -w[:, 2], w[:, 1], -w[:, 0]
    W -= np.swapaxes(W, 1, 2)
    # sin(a)/a and (1 - cos(a))/a^2, which np.sinc has without a quotient of zeros
    half = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * W + half * W @ W)
