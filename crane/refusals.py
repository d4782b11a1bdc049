"""What is no number, no size and no direction is refused by name; numpy only."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def unit(directions: ArrayLike) -> Array:
    """Directions (..., 3) with their length taken away.

    Raises:
        ValueError: A number is not finite, or one has no length.
    """
    n = np.asarray(directions, dtype=np.float64)
    if n.shape[-1:] != (3,):
        raise ValueError(f"a direction is x, y, z, not {n.shape}")
    refuse_no_numbers(direction=n)
    if not n.any(axis=-1).all():
        raise ValueError("the needle direction has no length")
    # by a power of two: squares of the least and the greatest numbers are none
    n = np.ldexp(n, -np.frexp(np.abs(n).max(axis=-1, keepdims=True))[1])
    return np.asarray(n / np.linalg.norm(n, axis=-1, keepdims=True))


def refuse_no_numbers(**values: ArrayLike) -> None:
    """Refuses what is no number.

    Raises:
        ValueError: Names the first.
    """
    for name, value in values.items():
        if not np.isfinite(value).all():
            raise ValueError(f"{name} holds a number that is not finite: {value!r}")


def refuse_unless_positive(**numbers: ArrayLike) -> None:
    """Refuses what is no size.

    Raises:
        ValueError: Names the first.
    """
    refuse_no_numbers(**numbers)
    for name, value in numbers.items():
        if not (np.asarray(value) > 0.0).all():
            raise ValueError(f"{name} = {value!r} must be positive")
