"""Contact at many configurations in one call: kinematics and search both compiled.

The placements come from the compiled chain, which agrees with Pinocchio to rounding
(tests hold it to 1e-12); a verdict with reasons for one pose is `contact.check`.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.containment import holds_or_might
from borecheck.contact.solid_pairs import SolidPairs, solids_of
from borecheck.core.once import once_per_pair
from borecheck.errors import JointLimitError, UsageError
from borecheck.geometry.surfaces import Surface, surface
from borecheck.geometry.tree.holding import IN_DOUBT, MIGHT_HOLD
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.packed import PackedTrees
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]
# A part, another surface, and which part that is; -1: an obstacle.
_Pair = tuple[int, Surface, int]


def first_contacts(
    robot: Robot,
    scene: Scene,
    qs: ArrayLike,
    *,
    narrowphase: str = "exact",
    containment: bool = True,
    threads: int = 1,
) -> NDArray[np.bool_]:
    """Whether the robot touches anything, itself included, at each configuration, (n,).

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        qs: Configurations, (n, joints), [m] and [rad].
        narrowphase: exact, two-sided, paper:robot or paper:scanner.
        containment: Whether to ask also if a solid holds another; most of the time
            goes there. A surface that is open, or whose parts cancel, and might hold
            something counts as contact.
            False: surfaces only, for who knows that nothing starts inside.
        threads: How many poses are worked on at once.

    Raises:
        UsageError: Wrong shape or numbers that are not finite; or the unit of an
            obstacle was guessed, and a bare "no contact" could not say so.
        JointLimitError: A configuration beyond a joint limit: which one.
    """
    if scene.doubt is not None:
        raise UsageError(scene.doubt)
    batch = prepared(robot, scene)
    placements = batch.placements(checked_configurations(robot, qs))
    found = batch.obstacles.first_contacts(placements, narrowphase, threads)
    if batch.itself is not None:
        found |= batch.itself.first_contacts(placements, narrowphase, threads)
    if containment:
        unseen = narrowphase != "exact"
        found |= batch.holds(placements, found, unseen=unseen)
    return found


def checked_configurations(robot: Robot, qs: ArrayLike) -> Array:
    """A copy of qs (n, joints), every one within the limits of free and mimic joints.

    Raises:
        UsageError: Wrong shape or numbers that are not finite.
        JointLimitError: Names the first configuration beyond a limit.
    """
    model = robot.model
    configurations = np.array(qs, dtype=np.float64, order="C")
    if configurations.ndim != 2 or configurations.shape[1] != len(model.free_joints):
        raise UsageError(
            f"qs have shape {configurations.shape}, not (n, {len(model.free_joints)})"
        )
    if not np.isfinite(configurations).all():
        raise UsageError("qs hold a number that is not finite")
    beyond = model.beyond_limits(configurations)
    if beyond.any():
        k = int(np.argmax(beyond))
        try:
            model.check_limits(configurations[k])
        except JointLimitError as error:
            raise JointLimitError(f"configuration {k}: {error}") from error
    return configurations


class PoseBatch:
    """Robot and scene packed for many poses."""

    def __init__(self, robot: Robot, scene: Scene) -> None:
        frame_of, self._chain = chain_of(robot)
        self._frames = [frame_of[part.link] for part in robot.parts]
        self._parts = [surface(part.mesh) for part in robot.parts]
        others = [surface(obstacle.mesh) for obstacle in scene.obstacles]
        links = PackedTrees([part.tree for part in self._parts])
        self.obstacles = MovingLinks.against(links, [o.tree for o in others])
        self.itself = (
            MovingLinks.among(links, np.array(robot.self_pairs))
            if robot.self_pairs
            else None
        )
        self._solids = self._solid_pairs(others)

    def _solid_pairs(
        self, others: list[Surface]
    ) -> list[tuple[SolidPairs, list[_Pair]]]:
        """The pairs as solids, and who they are."""
        links, standing = solids_of(self._parts), solids_of(others)
        pairs = SolidPairs(self.obstacles, links, standing)
        rows = self.obstacles.pairs.tolist()
        found = [(pairs, [(a, others[b], -1) for a, b in rows])]
        if self.itself is not None:
            pairs, rows = (
                SolidPairs(self.itself, links, links),
                self.itself.pairs.tolist(),
            )
            found.append((pairs, [(a, self._parts[b], b) for a, b in rows]))
        return found

    def placements(self, qs: Array) -> Array:
        """T_scene_part of every configuration, (n, parts, 4, 4)."""
        return self._chain.placements(qs, self._frames)

    def holds(
        self,
        T_scene_parts: Array,
        settled: NDArray[np.bool_],
        *,
        unseen: bool = False,
    ) -> NDArray[np.bool_]:
        """Whether a solid holds another or might, pose by pose, (n,).

        Args:
            T_scene_parts: (n, parts, 4, 4).
            settled: Poses to leave out.
            unseen: Whether surfaces may meet that the checker does not see.
        """
        found = np.zeros(len(T_scene_parts), np.bool_)
        for pairs, sides in self._solids:
            codes = pairs.codes(T_scene_parts, settled | found, unseen=unseen)
            found |= (codes >= MIGHT_HOLD).any(axis=1)
            for i, k in np.argwhere((codes == IN_DOUBT) & ~found[:, None]):
                found[i] |= self._asked_singly(T_scene_parts[i], sides[k])
        return found

    def _asked_singly(self, T_scene_parts: Array, pair: _Pair) -> bool:
        """Whether one of two holds the other or might, where rays leave a doubt."""
        a, b, j = pair
        T_b = T_scene_parts[j] if j >= 0 else None
        T_a, parts = T_scene_parts[a], self._parts
        return holds_or_might(parts[a], T_a, b, T_b).kind != "none"


@once_per_pair
def prepared(robot: Robot, scene: Scene) -> PoseBatch:
    """The packed form of a robot and a scene; the same records give the same one."""
    return PoseBatch(robot, scene)
