"""Two trees of certified edges that grow towards each other: RRT-Connect.

J. Kuffner, S. LaValle: RRT-Connect, ICRA 2000. The same seed gives the same trees,
whatever the machine does: work is counted in edges. A limit of time may end the search,
and changes nothing else.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from borecheck.planning.edges import Edges
from borecheck.planning.metric import Metric

Array = NDArray[np.float64]

# Longest edge, [m]: about the width of a bore, so that one edge may cross it.
STEP = 0.25


class Tree:
    """Configurations joined by certified edges to the one that the tree began with."""

    def __init__(self, root: Array, metric: Metric) -> None:
        self._metric = metric
        self._nodes = [root]
        self._before = [-1]

    def nearest(self, q: Array) -> int:
        """The node from which q is nearest."""
        return int(np.argmin(self._metric.between(np.array(self._nodes), q)))

    def node(self, index: int) -> Array:
        """Its configuration."""
        return self._nodes[index]

    def add(self, q: Array, before: int) -> int:
        """A new node behind another; its index."""
        self._nodes.append(q)
        self._before.append(before)
        return len(self._nodes) - 1

    def way(self, index: int) -> list[Array]:
        """The configurations from the tree's root to a node."""
        found = []
        while index >= 0:
            found.append(self._nodes[index])
            index = self._before[index]
        return found[::-1]


def connect(
    start: Array,
    goal: Array,
    edges: Edges,
    metric: Metric,
    sample: Callable[[], Array],
    most_edges: int,
    progress: Callable[[int, int], None] | None = None,
    out_of_time: Callable[[], bool] = lambda: False,
) -> Array | None:
    """A way of certified edges from start to goal, or None if none was found.

    Args:
        start: Configuration (joints,), clear.
        goal: Likewise.
        edges: What proves an edge.
        metric: What is near.
        sample: Draws a configuration within the limits.
        most_edges: Edges asked for at most.
        progress: Called with edges asked for, and their limit.
        out_of_time: Whether to give up; it cannot change which way is found.

    Returns:
        Configurations (k, joints), straight between them.
    """
    trees = [Tree(start, metric), Tree(goal, metric)]
    if edges.clear(start, goal):
        return np.array([start, goal])
    turn = 0
    while edges.asked < most_edges and not out_of_time():
        mine, other = trees[turn], trees[1 - turn]
        reached = _towards(mine, sample(), edges, metric, 1)
        if reached is not None:
            left = most_edges - edges.asked
            met = _towards(other, mine.node(reached), edges, metric, left)
            if met is not None and np.array_equal(other.node(met), mine.node(reached)):
                ways = [trees[0], trees[1]], [reached, met][:: 1 if turn == 0 else -1]
                first, last = (t.way(i) for t, i in zip(*ways, strict=True))
                return np.array([*first, *last[-2::-1]])
        if progress is not None:
            progress(min(edges.asked, most_edges), most_edges)
        turn = 1 - turn
    return None


def _towards(
    tree: Tree, q: Array, edges: Edges, metric: Metric, steps: int
) -> int | None:
    """The last node added on the way to q, in so many clear steps at most."""
    index, added = tree.nearest(q), None
    for _ in range(steps):
        here = tree.node(index)
        far = float(metric.between(here, q))
        if far == 0.0:
            return index
        there = q if far <= STEP else here + (STEP / far) * (q - here)
        if not edges.clear(here, there):
            break
        index = added = tree.add(there, index)
        if there is q:
            break
    return added
