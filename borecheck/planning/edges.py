"""Edges between configurations, each proven or not taken."""

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.queries import Queries
from borecheck.motion.problem import PathProblem
from borecheck.motion.search import search

Array = NDArray[np.float64]

# Poses of an edge that are looked at before it is searched: a look takes some
# microseconds, a search of an edge in contact many milliseconds.
LOOKS = 8
# Pieces that an edge is looked at in for each pair before it is not taken: most need a
# few, one that grazes ten thousands, and seconds; a tree goes round it sooner.
PIECES = 2_000


class Edges:
    """Asks whether straight ways between configurations are clear at every instant.

    Attributes:
        asked: How many edges were asked for.
    """

    def __init__(self, problem: PathProblem, quick: Queries) -> None:
        self._problem = problem
        self._quick = quick
        self.asked = 0

    def clear(self, a: Array, b: Array) -> bool:
        """Whether every instant from a to b is proven clear."""
        self.asked += 1
        shares = np.linspace(1.0, 0.0, LOOKS, endpoint=False)[:, None]
        if self._quick.touches(a + shares * (b - a)).any():
            return False
        edge = np.array([a, b])
        return search(self._problem, edge, piece_limit=PIECES).clear

    def free(self, q: Array) -> bool:
        """Whether a configuration touches nothing; that is a look, and no edge."""
        return not bool(self._quick.touches(q[None, :])[0])
