"""Questions that planners ask thousands of times, of one robot and one scene.

Everything that does not change from pose to pose is made once, by `queries`. Answers
are arrays; a configuration beyond a joint limit is an answer, not an exception.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.gradient import of_distance
from borecheck.contact.many_poses import as_configurations
from borecheck.contact.pose_batch import PoseBatch
from borecheck.contact.pose_book import BEYOND_LIMITS, FREE, MIGHT_TOUCH, TOUCHES
from borecheck.contact.skipped import Names, pairs_without
from borecheck.core.se3 import check_transform
from borecheck.errors import UnknownNameError, UsageError
from borecheck.geometry.tree.nearest_first import FAR, NEAR, UNDECIDED
from borecheck.robots.given import length, refuse_others
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

# Answers of `nearer_than`.
NO, YES, CANNOT_TELL = FAR, NEAR, UNDECIDED


def queries(
    robot: Robot,
    scene: Scene,
    margin: float | str = 0.0,
    *,
    skip: Iterable[Names] = (),
    itself: bool = True,
    solids: bool = True,
) -> "Queries":
    """What `Queries` needs, made once.

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        margin: Clearance to obstacles that counts as touching, [m], or "20mm".
        skip: Pairs of names that are not asked: a link and an obstacle, or two links.
        itself: Whether parts of the robot are asked against each other.
        solids: Whether to ask also if a solid holds another.

    Raises:
        UsageError: The unit of an obstacle was guessed; a margin that is no distance; a
            pair that is not there.
        UnknownNameError: A name that is no link, part or obstacle.
    """
    refuse_others(robot, scene)
    margin = length(margin, "margin")
    if scene.doubt is not None:
        raise UsageError(scene.doubt)
    if not (np.isfinite(margin) and margin >= 0.0):
        raise UsageError(f"margin is {margin}, not a distance in metres")
    against, among = pairs_without(robot, scene, tuple(skip), itself)
    return Queries(
        robot, scene, margin, solids, PoseBatch(robot, scene, against, among)
    )


class Queries:
    """Answers about configurations qs, (n, joints), in the order of the robot's joints.

    Surfaces are asked by the exact test. Round shapes are asked as polyhedra round
    them, as in `first_contacts`: what touches may be free by the width of that band.

    Attributes:
        pairs: Names of what is asked: part and obstacle, then part and part.
        with_obstacles: How many of them are of part and obstacle.
        margin: Clearance to obstacles that counts as touching, [m].
    """

    def __init__(
        self, robot: Robot, scene: Scene, margin: float, solids: bool, batch: PoseBatch
    ) -> None:
        self._robot, self._scene = robot, scene
        self.margin = margin
        self._solids = solids
        self._batch = batch
        parts = [part.mesh.name for part in robot.parts]
        others = [obstacle.name for obstacle in scene.obstacles]
        self.pairs: tuple[Names, ...] = (
            *((parts[a], others[b]) for a, b in batch.obstacles.pairs),
            *((parts[a], parts[b]) for a, b in batch.itself.pairs),
        )
        self.with_obstacles = len(batch.obstacles.pairs)
        excess = np.array([part.mesh.excess for part in robot.parts])
        standing = np.array([o.mesh.excess for o in scene.obstacles])
        a, b = batch.obstacles.pairs.T
        # By how much the polyhedra of each pair with an obstacle are too large.
        self._excess = excess[a] + standing[b] if len(a) else np.zeros(0)

    def __repr__(self) -> str:
        return (
            f"<Queries {self._robot.name} in {self._scene.name}: {len(self.pairs)} "
            f"pairs, margin {1e3 * self.margin:g} mm>"
        )

    def beyond_limits(self, qs: ArrayLike) -> NDArray[np.bool_]:
        """Which configurations break a joint limit, of mimic joints too, (n,)."""
        configurations = as_configurations(self._robot, qs)
        return self._robot.model.beyond_limits(configurations)

    def touches(self, qs: ArrayLike, *, threads: int = 1) -> NDArray[np.bool_]:
        """Whether anything touches or comes within the margin, (n,).

        True also beyond limits, and where nothing can tell that it does not.
        """
        return self.touching_pair(qs, threads=threads) != -1

    def touching_pair(self, qs: ArrayLike, *, threads: int = 1) -> NDArray[np.int64]:
        """The first of `pairs` that touches or comes within the margin, (n,).

        -1 where none does, -2 beyond limits.
        """
        configurations = as_configurations(self._robot, qs)
        states, which, _ = self._batch.ask(
            configurations, solids=self._solids, threads=threads
        )
        which = np.where(states == BEYOND_LIMITS, -2, which)
        if self.margin > 0.0:
            _, nearest = self._near(configurations, states, self.margin)
            which = np.where(which == -1, nearest, which)
        return which

    def nearer_than(self, qs: ArrayLike, distance: float) -> NDArray[np.int8]:
        """Whether the robot is nearer to an obstacle than that [m], (n,).

        YES (1), NO (0), or CANNOT_TELL (2): the distance differs from the one asked by
        less than its error, a shape is round and known less well, or the configuration
        is beyond limits. Parts of the robot are not asked against each other, unless
        they touch: then YES.
        """
        if not (np.isfinite(distance) and distance >= 0.0):
            raise UsageError(f"distance is {distance}, not a distance in metres")
        configurations = as_configurations(self._robot, qs)
        states, which, _ = self._batch.ask(configurations, solids=self._solids)
        near, pair = self._near(configurations, states, distance)
        near[states == TOUCHES] = YES
        near[(states == BEYOND_LIMITS) | (states == MIGHT_TOUCH)] = CANNOT_TELL
        rows = np.where(states == TOUCHES, which, pair)
        excess = np.append(self._excess, 0.0)[np.minimum(rows, len(self._excess))]
        for i in np.flatnonzero((near == YES) & (excess > 0.0)):
            if not self.clearance(configurations[i : i + 1])[0, 1] <= distance:
                near[i] = CANNOT_TELL
        return near

    def clearance(self, qs: ArrayLike, within: float = 0.0) -> Array:
        """Certified bounds of the distance to the nearest obstacle, (n, 2), [m].

        (0, 0) in contact, infinite without a pair to ask, NaN beyond limits; from 0 on
        where a solid might hold another and nothing can tell.

        Args:
            qs: Configurations.
            within: Relative width of the bounds that is good enough; 0.1 is several
                times cheaper than 0.
        """
        if not within >= 0.0:
            raise UsageError(f"within is {within}, not a share of 0 or more: 0.1")
        configurations = as_configurations(self._robot, qs)
        return self._nearest(configurations, within)[0]

    def clearances(
        self, qs: ArrayLike, each: str = "link", within: float = 0.0
    ) -> Array:
        """Bounds of the distance to obstacles, one by one, (n, k, 2), [m].

        Args:
            qs: Configurations.
            each: "link": of every part to its nearest obstacle, in the order of the
                robot's parts; "pair": of every part and obstacle, in that of `pairs`.
            within: As in `clearance`.
        """
        if each not in ("link", "pair"):
            raise UnknownNameError("each", each, ("link", "pair"))
        configurations = as_configurations(self._robot, qs)
        placements = self._batch.placements(configurations)
        bounds = self._batch.obstacles.pair_clearances(placements, within)
        bounds[..., 1] += np.where(bounds[..., 1] > 0.0, self._excess, 0.0)
        if self._solids:
            held = self._batch.held(placements)
            held[bounds[..., 1] == 0.0] = FREE  # surfaces meet: nothing to ask
            bounds[held == TOUCHES] = 0.0
            bounds[held == MIGHT_TOUCH, 0] = 0.0
        bounds[self._robot.model.beyond_limits(configurations)] = np.nan
        if each == "pair":
            return bounds
        links = np.full((len(bounds), len(self._robot.parts), 2), np.inf)
        for k, (a, _) in enumerate(self._batch.obstacles.pairs):
            links[:, a] = np.minimum(links[:, a], bounds[:, k])
        return links

    def clearances_to_itself(self, qs: ArrayLike, within: float = 0.0) -> Array:
        """Bounds of the distance of surfaces of every pair of parts, (n, k, 2), [m].

        In the order of `pairs`, those with obstacles left out. Whether one holds the
        other is asked by `touches`.

        Args:
            qs: Configurations.
            within: As in `clearance`.
        """
        configurations = as_configurations(self._robot, qs)
        placements = self._batch.placements(configurations)
        return self._batch.itself.pair_clearances(placements, within)

    def gradient(self, qs: ArrayLike) -> Array:
        """Derivative of the clearance by every joint, (n, joints), [m/rad] or [1].

        Of the nearest points that `clearance` finds; where two pairs are equally near,
        of one of them. NaN where there is none: in contact, beyond limits, without
        obstacles.
        """
        configurations = as_configurations(self._robot, qs)
        bounds, _ = self._nearest(configurations, 0.0)
        gradients = np.full(configurations.shape, np.nan)
        batch = self._batch
        for i in np.flatnonzero(np.isfinite(bounds[:, 1]) & (bounds[:, 0] > 0.0)):
            placed = batch.chain.placements(configurations[i : i + 1])
            row, found = batch.obstacles.closest(placed[:, batch.frames])
            assert found is not None  # an obstacle is at that distance
            gradients[i] = of_distance(
                batch.chain,
                placed[0],
                int(batch.frames[batch.obstacles.pairs[row, 0]]),
                found.point_self,
                found.point_other,
            )
        return gradients

    def moved(
        self,
        obstacles: Mapping[str, ArrayLike] | None = None,
        base: ArrayLike | None = None,
    ) -> "Queries":
        """The same queries with obstacles or the robot's base elsewhere.

        Nothing is loaded or built again: couch, tilt or base may change in every call.

        Args:
            obstacles: By name a placement (4, 4), on top of where it is in the scene.
            base: T_scene_base (4, 4); default: where it is.

        Raises:
            UnknownNameError: No such obstacle.
            GeometryError: A placement that is no rigid transform.
        """
        names = [obstacle.name for obstacle in self._scene.obstacles]
        placed = {}
        for name, T in (obstacles or {}).items():
            if name not in names:
                raise UnknownNameError("obstacle", name, names)
            placed[names.index(name)] = check_transform(T, f"obstacle {name}")
        root = None
        if base is not None:
            robot = self._robot
            T_base_root = np.linalg.inv(robot.T_scene_base) @ robot.T_scene_root
            root = check_transform(base, "base") @ T_base_root
        batch = self._batch.moved(placed, root)
        return Queries(self._robot, self._scene, self.margin, self._solids, batch)

    def _near(
        self, configurations: Array, states: NDArray[np.int8], distance: float
    ) -> tuple[NDArray[np.int8], NDArray[np.int64]]:
        placements = self._batch.placements(configurations)
        settled = states != FREE
        return self._batch.obstacles.comes_near(placements, distance, settled)

    def _nearest(
        self, configurations: Array, within: float
    ) -> tuple[Array, NDArray[np.int64]]:
        """Bounds of the least distance to obstacles, and the row of its pair, (n,)."""
        placements = self._batch.placements(configurations)
        bounds, rows = self._batch.obstacles.nearest_pairs(placements, within)
        apart = np.flatnonzero((bounds[:, 1] > 0.0) & (rows >= 0))
        bounds[apart, 1] += self._excess[rows[apart]]
        if self._solids and len(apart):
            # A solid in another: in contact, however far its surface is from there.
            held = self._batch.held(placements[apart])
            for i, row in zip(apart, held, strict=True):
                if (row == TOUCHES).any():
                    bounds[i], rows[i] = 0.0, int(np.argmax(row == TOUCHES))
                elif (row == MIGHT_TOUCH).any():
                    bounds[i, 0] = 0.0
        bounds[self._robot.model.beyond_limits(configurations)] = np.nan
        return bounds, rows
