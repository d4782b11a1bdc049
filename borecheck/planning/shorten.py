"""A shorter way through certified edges."""

import numpy as np
from numpy.typing import NDArray

from borecheck.planning.edges import Edges
from borecheck.planning.metric import Metric

Array = NDArray[np.float64]

# Shortcuts tried, and how many in a row may fail before it is enough.
TRIES, IN_VAIN = 200, 40


def shorten(
    way: Array, edges: Edges, metric: Metric, rng: np.random.Generator
) -> Array:
    """The way with shortcuts between random points of it, where they are proven clear.

    Args:
        way: Configurations (k, joints) joined by certified edges.
        edges: What proves a shortcut.
        metric: What is short.
        rng: Draws the points.

    Returns:
        Configurations (m, joints), joined by certified edges: what is left of an edge
        that a shortcut leaves in its middle is a part of a proven one.
    """
    vain = 0
    for _ in range(TRIES):
        if len(way) < 3 or vain >= IN_VAIN:
            break
        cut = _cut(way, metric, rng)
        if cut is None or not edges.clear(cut[1], cut[2]):
            vain += 1
            continue
        first, a, b, last = cut
        shorter = np.array([*way[: first + 1], a, b, *way[last + 1 :]])
        vain = 0 if metric.length(shorter) < 0.999 * metric.length(way) else vain + 1
        way = _without_repeats(shorter)
    return way


def _cut(
    way: Array, metric: Metric, rng: np.random.Generator
) -> tuple[int, Array, Array, int] | None:
    """Two points of the way on different edges, and these edges; or None."""
    lengths = metric.between(way[:-1], way[1:])
    along = np.append(0.0, np.cumsum(lengths))
    begin, end = np.sort(rng.uniform(0.0, along[-1], 2))
    first, last = (
        int(np.clip(np.searchsorted(along, at, "right") - 1, 0, len(way) - 2))
        for at in (begin, end)
    )
    if first == last:
        return None
    a, b = (
        way[k] + (at - along[k]) / max(lengths[k], 1e-300) * (way[k + 1] - way[k])
        for k, at in ((first, begin), (last, end))
    )
    return first, a, b, last


def _without_repeats(way: Array) -> Array:
    apart = np.any(way[1:] != way[:-1], axis=1)
    return way[np.append(True, apart)]
