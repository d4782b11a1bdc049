"""The clearance to first order: the smallest of linear functions of the errors.

At the nominal pose and at points two standard deviations away the nearest pair of each
part and obstacle is looked up. Each gives a cut: the distance of that point of the part
from the plane through the obstacle's point across the connecting line, which is linear
in the errors. A flat part near a wall thus has a cut for each of its corners. A cut
that is nearer at the nominal pose than the pair itself belongs to another side of the
obstacle and is left out.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from borecheck.contact.clearance import to_obstacles
from borecheck.core.se3 import inverse
from borecheck.geometry.surfaces import surface
from borecheck.geometry.triangles.placing import placed_bounds
from borecheck.plans.corridor import Corridor
from borecheck.robots.scene import Scene
from borecheck.uncertainty.disturbed import Disturbed

Array = NDArray[np.float64]
Pair = tuple[int, int]

WORLD = np.eye(4)

# Where the nearest pairs are looked up, in standard deviations, and how many random
# directions beside the principal ones; the seed is fixed: no verdict depends on it.
RADIUS = 2.0
DIRECTIONS = 16
SEED = 7

# Pairs farther off than so many standard deviations count for nothing.
REACH = 6.0

# Cuts of one pair whose points lie closer than this are one, [m].
SAME_POINT = 1e-3

# Two searches of the same distance agree far better than this, [m].
SAME_SIDE = 1e-9

DRAWS = 200_000
PIECE = 20_000


@dataclass(frozen=True, eq=False)
class Cuts:
    """Linear functions d + g x of errors x, x normal; the clearance is the smallest.

    Attributes:
        names: (link, obstacle) of each cut.
        distance: At x = 0, (k,), [m].
        gradient: (k, n).
        root: A with A A^T the covariance of x, (n, k).
    """

    names: tuple[tuple[str, str], ...]
    distance: Array
    gradient: Array
    root: Array

    @property
    def sigma(self) -> Array:
        """Standard deviation of each cut, (k,), [m]."""
        return np.linalg.norm(self.gradient @ self.root, axis=1)

    def probability(self, margin: float) -> float:
        """P(any cut <= margin), by many draws of the linear model."""
        hits = sum(int((left <= margin).sum()) for left in self._drawn())
        return hits / DRAWS

    def span(self, margin: float) -> tuple[float, float]:
        """The likeliest cut, and the sum of all: the model's probability is between."""
        pairs = zip(self.distance - margin, self.sigma, strict=True)
        chances = [_below(float(d), float(s)) for d, s in pairs]
        return max(chances), min(1.0, sum(chances))

    def margin(self, risk: float) -> float:
        """Nominal clearance that falls short of what is left with that risk, [m].

        For risks that the draws hardly reach: that of the widest cut alone.
        """
        alone = float(-ndtri(risk)) * float(self.sigma.max())
        if risk * DRAWS < 100.0:
            return alone
        left = np.concatenate(list(self._drawn()))
        return max(alone, float(self.distance.min() - np.quantile(left, risk)))

    def _drawn(self) -> Iterator[Array]:
        """Clearances of DRAWS draws of the linear model, in pieces."""
        rng = np.random.default_rng(SEED)
        slopes = (self.gradient @ self.root).T
        for _ in range(DRAWS // PIECE):
            x = rng.standard_normal((PIECE, self.root.shape[1]))
            yield (self.distance + x @ slopes).min(axis=1)


def cuts(
    disturbed: Disturbed, scene: Scene, corridor: Corridor | None = None
) -> Cuts | None:
    """The cuts around the nominal pose; None if a pair is in contact there."""
    root = disturbed.uncertainty.root
    found = _Found([], [], [])
    at_nominal: dict[Pair, float] = {}
    for pair in _near(disturbed, scene, corridor, root):
        cut = _cut(disturbed, scene, pair, disturbed.nominal)
        if cut is None:
            return None
        found.add(pair, cut)
        at_nominal[pair] = cut.distance
    pairs = _that_matter(found, root)
    for x in _around(root):
        placed = disturbed.placements(x)
        for pair in pairs:
            cut = _cut(disturbed, scene, pair, placed)
            if cut is not None and cut.distance >= at_nominal[pair] - SAME_SIDE:
                found.add(pair, cut)
    if not found.cuts:
        return None
    parts, obstacles = disturbed.robot.parts, scene.obstacles
    return Cuts(
        tuple((parts[i].mesh.name, obstacles[j].name) for i, j in found.pairs),
        np.array([cut.distance for cut in found.cuts]),
        np.array([cut.gradient for cut in found.cuts]),
        root,
    )


class _Cut(NamedTuple):
    """Distance and gradient at x = 0, and the part's point in its own frame."""

    distance: float
    gradient: Array
    point: Array


class _Found(NamedTuple):
    """Cuts so far, each with its pair; points closer than SAME_POINT are one."""

    pairs: list[Pair]
    cuts: list[_Cut]
    points: list[Array]

    def add(self, pair: Pair, cut: _Cut) -> None:
        for other, place in zip(self.pairs, self.points, strict=True):
            if pair == other and np.abs(cut.point - place).max() < SAME_POINT:
                return
        self.pairs.append(pair)
        self.cuts.append(cut)
        self.points.append(cut.point)


def _that_matter(found: _Found, root: Array) -> list[Pair]:
    """The pairs that can come nearer than the nominal clearance at all."""
    least = min((cut.distance for cut in found.cuts), default=0.0)
    return [
        pair
        for pair, cut in zip(found.pairs, found.cuts, strict=True)
        if cut.distance - REACH * np.linalg.norm(cut.gradient @ root) <= least
    ]


def _around(root: Array) -> list[Array]:
    """Errors RADIUS standard deviations off: along principal and random directions."""
    principal = [RADIUS * sign * column for column in root.T for sign in (1.0, -1.0)]
    z = np.random.default_rng(SEED).standard_normal((DIRECTIONS, root.shape[1]))
    z *= RADIUS / np.linalg.norm(z, axis=1, keepdims=True)
    return [*(x for x in principal if x.any()), *(z @ root.T)]


def _near(
    disturbed: Disturbed, scene: Scene, corridor: Corridor | None, root: Array
) -> list[Pair]:
    """Part and obstacle of the pairs that may matter by their boxes, nearest first."""
    robot = disturbed.robot
    gaps = []
    for index, part in enumerate(robot.parts):
        low, high = placed_bounds(disturbed.nominal[part.link], part.mesh.bounds)
        for number, obstacle in enumerate(scene.obstacles):
            if corridor is not None and robot.may_enter(part.link, obstacle.role):
                continue
            box = obstacle.mesh.bounds
            gap = np.maximum(0.0, np.maximum(low - box[1], box[0] - high))
            gaps.append((float(np.linalg.norm(gap)), index, number))
    closest, _ = to_obstacles(robot, scene, disturbed.nominal, corridor)
    least = closest.upper if closest is not None else 0.0
    # a lever of 1 m turns an angle's standard deviation into metres
    widest = float(np.linalg.norm(root, axis=1).sum())
    limit = least + REACH * widest
    return [(index, number) for gap, index, number in sorted(gaps) if gap <= limit]


def _cut(
    disturbed: Disturbed, scene: Scene, pair: Pair, placed: dict[str, Array]
) -> _Cut | None:
    """The cut of a pair's nearest points where the links are as placed."""
    part, obstacle = disturbed.robot.parts[pair[0]], scene.obstacles[pair[1]]
    T, T_nominal = placed[part.link], disturbed.nominal[part.link]
    tree, around = surface(part.mesh).tree, surface(obstacle.mesh).tree
    closest = tree.closest(around, T, WORLD)
    p, o = np.array(closest.point_self), np.array(closest.point_other)
    length = float(np.linalg.norm(p - o))
    if length <= 0.0:
        return None
    normal = (p - o) / length
    point = (inverse(T) @ [*p, 1.0])[:3]
    at_nominal = (T_nominal @ [*point, 1.0])[:3]
    gradient = disturbed.gradient(part.link, at_nominal, normal)
    return _Cut(float(normal @ (at_nominal - o)), gradient, point)


def _below(distance: float, sigma: float) -> float:
    """P(distance + normal(sigma) <= 0)."""
    if sigma == 0.0:
        return 1.0 if distance <= 0.0 else 0.0
    return 0.5 * math.erfc(distance / sigma / math.sqrt(2.0))
