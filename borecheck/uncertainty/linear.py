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

import numpy as np
from numpy.typing import NDArray

from borecheck.bvh import Closest as TreeClosest
from borecheck.corridor import Corridor
from borecheck.pair_search import surface
from borecheck.placing import placed_bounds
from borecheck.scene import Scene
from borecheck.se3 import inverse
from borecheck.uncertainty.disturbed import Disturbed

Array = NDArray[np.float64]

WORLD = np.eye(4)

# Where the nearest pairs are looked up, in standard deviations, and how many random
# directions beside the principal ones; the seed is fixed: no verdict depends on it.
RADIUS = 2.0
DIRECTIONS = 24
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
        root: A with A A^T the covariance of x, (n, n).
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

    def bounds(self, margin: float) -> tuple[float, float]:
        """Bounds of that probability: the likeliest cut, and the sum of all."""
        pairs = zip(self.distance - margin, self.sigma, strict=True)
        chances = [_below(float(d), float(s)) for d, s in pairs]
        return max(chances), min(1.0, sum(chances))

    def margin(self, risk: float) -> float:
        """Nominal clearance that falls short of what is left with that risk, [m].

        For risks that the draws hardly reach: that of the widest cut alone.
        """
        from scipy.stats import norm  # 0.3 s

        alone = float(norm.isf(risk)) * float(self.sigma.max())
        if risk * DRAWS < 100.0:
            return alone
        left = np.concatenate(list(self._drawn()))
        return max(alone, float(self.distance.min() - np.quantile(left, risk)))

    def _drawn(self) -> Iterator[Array]:
        """Clearances of DRAWS draws of the linear model, in pieces."""
        rng = np.random.default_rng(SEED)
        slopes = (self.gradient @ self.root).T
        for _ in range(DRAWS // PIECE):
            x = rng.standard_normal((PIECE, len(self.root)))
            yield (self.distance + x @ slopes).min(axis=1)


def cuts(
    disturbed: Disturbed, scene: Scene, corridor: Corridor | None = None
) -> Cuts | None:
    """The cuts around the nominal pose; None if a pair is in contact there."""
    root = square_root(disturbed.uncertainty.covariance)
    origin = np.zeros(len(root))
    names: list[tuple[str, str]] = []
    points: list[Array] = []
    rows: list[tuple[float, Array]] = []
    nominal: dict[tuple[str, str], float] = {}
    for x in (origin, *_around(root)):
        placed = disturbed.placements(x)
        for index, number, closest in _near(disturbed, scene, placed, corridor, root):
            link = disturbed.robot.parts[index].link
            found = _cut(disturbed, link, closest, placed)
            if found is None:
                if x is origin:
                    return None
                continue
            name = (
                disturbed.robot.parts[index].mesh.name,
                scene.obstacles[number].name,
            )
            distance, gradient, point = found
            if x is origin:
                nominal[name] = distance
            other_side = distance < nominal.get(name, 0.0) - SAME_SIDE
            if not other_side and not _known(name, point, names, points):
                names.append(name)
                points.append(point)
                rows.append((distance, gradient))
    return Cuts(
        tuple(names),
        np.array([distance for distance, _ in rows]),
        np.array([gradient for _, gradient in rows]),
        root,
    )


def square_root(covariance: Array) -> Array:
    """A matrix A with A A^T = covariance, singular ones included."""
    values, vectors = np.linalg.eigh(covariance)
    return np.array(vectors * np.sqrt(np.maximum(values, 0.0)))


def _around(root: Array) -> list[Array]:
    """Errors RADIUS standard deviations off: along principal and random directions."""
    principal = [RADIUS * sign * column for column in root.T for sign in (1.0, -1.0)]
    z = np.random.default_rng(SEED).standard_normal((DIRECTIONS, len(root)))
    z *= RADIUS / np.linalg.norm(z, axis=1, keepdims=True)
    return [*(x for x in principal if x.any()), *(z @ root.T)]


def _near(
    disturbed: Disturbed,
    scene: Scene,
    placed: dict[str, Array],
    corridor: Corridor | None,
    root: Array,
) -> list[tuple[int, int, TreeClosest]]:
    """Pairs of part and obstacle near enough to matter, with their nearest points."""
    robot = disturbed.robot
    gaps = []
    for index, part in enumerate(robot.parts):
        low, high = placed_bounds(placed[part.link], part.mesh.bounds)
        for number, obstacle in enumerate(scene.obstacles):
            if corridor is not None and robot.may_enter(part.link, obstacle.role):
                continue
            box = obstacle.mesh.bounds
            gap = np.maximum(0.0, np.maximum(low - box[1], box[0] - high))
            gaps.append((float(np.linalg.norm(gap)), index, number))
    gaps.sort()
    kept: list[tuple[int, int, TreeClosest]] = []
    nearest = math.inf
    # a lever of 1 m turns an angle's standard deviation into metres
    widest = float(np.linalg.norm(root, axis=1).sum())
    for gap, index, number in gaps:
        if gap > nearest + REACH * widest:
            break
        part, obstacle = robot.parts[index], scene.obstacles[number]
        found = surface(part.mesh).tree.closest(
            surface(obstacle.mesh).tree, placed[part.link], WORLD
        )
        nearest = min(nearest, float(found.lower))
        kept.append((index, number, found))
    return kept


def _cut(
    disturbed: Disturbed, link: str, closest: TreeClosest, placed: dict[str, Array]
) -> tuple[float, Array, Array] | None:
    """Distance and gradient at x = 0, and the part's point in its own frame."""
    p, o = np.array(closest.point_self), np.array(closest.point_other)
    length = float(np.linalg.norm(p - o))
    if length <= 0.0:
        return None
    normal = (p - o) / length
    in_part = (inverse(placed[link]) @ [*p, 1.0])[:3]
    at_nominal = (disturbed.nominal[link] @ [*in_part, 1.0])[:3]
    gradient = disturbed.gradient(link, at_nominal, normal)
    return float(normal @ (at_nominal - o)), gradient, in_part


def _known(
    name: tuple[str, str],
    point: Array,
    names: list[tuple[str, str]],
    points: list[Array],
) -> bool:
    return any(
        name == other and np.abs(point - place).max() < SAME_POINT
        for other, place in zip(names, points, strict=True)
    )


def _below(distance: float, sigma: float) -> float:
    """P(distance + normal(sigma) <= 0)."""
    if sigma == 0.0:
        return 1.0 if distance <= 0.0 else 0.0
    return 0.5 * math.erfc(distance / sigma / math.sqrt(2.0))
