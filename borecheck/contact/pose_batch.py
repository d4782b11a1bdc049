"""A robot and a scene packed for many poses: what every compiled question starts from.

The placements come from the compiled chain, which agrees with Pinocchio to rounding
(tests hold it to 1e-12).
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.containment import holds_or_might
from borecheck.contact.pose_book import (
    FREE,
    IN_DOUBT_STILL,
    MIGHT_TOUCH,
    TOUCHES,
    Joints,
    Pairs,
    PoseBook,
    Solid,
)
from borecheck.contact.pose_limits import limits_of
from borecheck.contact.solid_pairs import SolidPairs, solids_of
from borecheck.core.once import once_per_pair
from borecheck.core.se3 import check_transform
from borecheck.errors import GeometryError
from borecheck.geometry.surfaces import surface
from borecheck.geometry.tree.holding import HELD, IN_DOUBT, MIGHT_HOLD, WITNESSES
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.packed import PackedTrees
from borecheck.geometry.tree.threads import in_threads
from borecheck.geometry.triangles.narrowphase import narrowphase_code
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# What `PoseBatch._lay_out` makes.
_LAID_OUT = ("_book", "_entries", "_solid_pairs")


class Asked(NamedTuple):
    """Answers of `PoseBatch.ask`.

    Attributes:
        states: FREE, TOUCHES, BEYOND_LIMITS, (n,) int8; MIGHT_TOUCH where a solid might
            hold another and nothing can tell.
        which: Row of the pair that touches, (n,): of `obstacles.pairs`, then of
            `itself.pairs`; -1 without one.
        beyond: How many are BEYOND_LIMITS.
    """

    states: NDArray[np.int8]
    which: Ids
    beyond: int


class PoseBatch:
    """Links, obstacles, and the pairs that are asked.

    Args:
        robot: The robot.
        scene: The scene.
        obstacle_pairs: Which part against which obstacle, (p, 2); default: all.
        self_pairs: Which part against which part, (s, 2); default: the robot's.

    Attributes:
        obstacles: Parts against obstacles.
        itself: Parts against parts.
        chain: Places the links.
        frames: The frame of every part in the chain, (parts,).
    """

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        obstacle_pairs: Ids | None = None,
        self_pairs: Ids | None = None,
    ) -> None:
        frame_of, self.chain = chain_of(robot)
        self.frames = np.array([frame_of[p.link] for p in robot.parts], np.int64)
        self._limits = limits_of(robot)
        parts = [surface(part.mesh) for part in robot.parts]
        others = [surface(obstacle.mesh) for obstacle in scene.obstacles]
        links = PackedTrees([part.tree for part in parts])
        against = MovingLinks.against(links, [other.tree for other in others])
        if obstacle_pairs is not None:
            against = replace(against, pairs=obstacle_pairs)
        if self_pairs is None:
            self_pairs = np.array(robot.self_pairs, np.int64).reshape(-1, 2)
        self.obstacles = against
        self.itself = MovingLinks.among(links, self_pairs)
        self._parts, self._others = parts, others
        self._links, self._standing = solids_of(parts), solids_of(others)
        self._lay_out()

    def _lay_out(self) -> None:
        """What kernels take, of chain and pairs as they are."""
        chain, against, among = self.chain, self.obstacles, self.itself
        joints = Joints(
            chain.parent,
            chain.kind,
            chain.source,
            chain.factor,
            chain.offset,
            chain.parts,
            self.frames,
        )
        assert against.T_world_others is not None  # they stand
        book = PoseBook(
            self._limits,
            joints,
            Pairs(against.book.entries, against.T_world_others),
            Pairs(among.book.entries, np.zeros((1, 0, 4, 4))),
            Solid(*self._links.arrays),
            Solid(*self._standing.arrays),
        )
        self._book, self._entries = book, book.entries
        self._solid_pairs = (
            SolidPairs(against, self._links, self._standing),
            SolidPairs(among, self._links, self._links),
        )

    def __getstate__(self) -> dict[str, Any]:
        """Without what was laid out: addresses of this object's arrays."""
        return {k: v for k, v in vars(self).items() if k not in _LAID_OUT}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._lay_out()

    def moved(
        self, T_world_obstacles: Mapping[int, Array], T_world_root: Array | None
    ) -> "PoseBatch":
        """The same with obstacles or the robot's root elsewhere; nothing is rebuilt.

        Args:
            T_world_obstacles: Placements by number, (4, 4), on top of where they are
                in the scene.
            T_world_root: Where the robot's root link stands; None: where it is.
        """
        other = object.__new__(PoseBatch)
        vars(other).update(vars(self))
        assert self.obstacles.T_world_others is not None
        placements = self.obstacles.T_world_others.copy()
        for number, T in T_world_obstacles.items():
            placements[0, number] = check_transform(T, f"obstacle {number}")
        other.obstacles = replace(self.obstacles, T_world_others=placements)
        if T_world_root is not None:
            origin = self.chain.origin.copy()
            origin[0] = check_transform(T_world_root, "T_world_root")
            other.chain = replace(self.chain, origin=origin)
        other._lay_out()
        return other

    def placements(self, qs: Array) -> Array:
        """T_scene_part of every configuration, (n, parts, 4, 4)."""
        return self.chain.placements(qs, self.frames)

    def ask(
        self,
        qs: Array,
        narrowphase: str = "exact",
        *,
        solids: bool = True,
        threads: int = 1,
    ) -> Asked:
        """What is known of every pose, and the first pair that touches.

        Args:
            qs: Configurations, (n, joints), contiguous.
            narrowphase: exact, two-sided, paper:robot or paper:scanner.
            solids: Whether to ask also if a solid holds another.
            threads: How many poses are worked on at once.
        """
        code = narrowphase_code(narrowphase)
        corners = 0 if not solids else WITNESSES if narrowphase == "exact" else 1
        states, which = np.empty(len(qs), np.int8), np.empty(len(qs), np.int64)
        counts: list[tuple[int, int]] = []

        def run(begin: int, end: int) -> None:
            part = slice(begin, end)
            counts.append(self._run(qs[part], code, corners, states[part], which[part]))

        in_threads(run, len(qs), threads)
        if sum(doubts for doubts, _ in counts):
            self._settle_doubts(qs, states, which)
        return Asked(states, which, sum(beyond for _, beyond in counts))

    def _run(
        self,
        qs: Array,
        code: int,
        corners: int,
        states: NDArray[np.int8],
        which: Ids,
    ) -> tuple[int, int]:
        """Fills states and which; how many poses are in doubt and beyond limits."""
        from borecheck.contact.pose_kernel import ask_poses  # a single pose needs none

        while True:
            bad, asks, doubts, beyond = ask_poses(
                self._entries, qs, code, corners, states, which
            )
            if bad >= 0:
                raise GeometryError(
                    f"pose {bad}: a link is placed by no rigid transform"
                )
            if not asks:
                return doubts, beyond
            self._links.answer()
            self._standing.answer()

    def _settle_doubts(self, qs: Array, states: NDArray[np.int8], which: Ids) -> None:
        for i in np.flatnonzero(states == IN_DOUBT_STILL):
            placements = self.placements(qs[i : i + 1])
            held = self.held(placements, itself=True)[0]
            states[i], which[i] = FREE, -1
            for state in (MIGHT_TOUCH, TOUCHES):  # the certain one stays
                if (held == state).any():
                    states[i], which[i] = state, int(np.argmax(held == state))

    def held(self, T_scene_parts: Array, *, itself: bool = False) -> NDArray[np.int8]:
        """Which pairs hold one another or might, (n, pairs): FREE, or as `ask` says.

        Surfaces must be known not to meet.

        Args:
            T_scene_parts: (n, parts, 4, 4).
            itself: Whether to ask also the pairs of parts, behind those with obstacles.
        """
        found = []
        for pairs, moving in (
            (self._solid_pairs[0], self.obstacles),
            (self._solid_pairs[1], self.itself),
        )[: 2 if itself else 1]:
            codes = pairs.codes(T_scene_parts)
            states = np.full(codes.shape, FREE, np.int8)
            states[codes == HELD] = TOUCHES
            states[codes == MIGHT_HOLD] = MIGHT_TOUCH
            for i, k in np.argwhere(codes == IN_DOUBT):
                states[i, k] = self._asked_singly(moving, int(k), T_scene_parts[i])
            found.append(states)
        return np.concatenate(found, axis=1)

    def may_hold(
        self, T_scene_parts: Array, *, itself: bool = False, unseen: bool = False
    ) -> set[tuple[int, int]]:
        """Pairs of which one may hold the other in one pose; surely none of the others.

        Args:
            T_scene_parts: (1, parts, 4, 4).
            itself: Of parts among each other; else of parts and obstacles.
            unseen: Whether surfaces may meet that the checker does not see.
        """
        moving = self.itself if itself else self.obstacles
        pairs = self._solid_pairs[1 if itself else 0]
        codes = pairs.codes(T_scene_parts, unseen=unseen)[0]
        if not codes.any():
            return set()
        return {(int(a), int(b)) for a, b in moving.pairs[codes > 0]}

    def _asked_singly(self, moving: MovingLinks, row: int, T_scene_parts: Array) -> int:
        """One pair whose rays leave a doubt."""
        a, b = moving.pairs[row].tolist()
        standing = moving.T_world_others
        others = self._parts if standing is None else self._others
        T_b = T_scene_parts[b] if standing is None else standing[0, b]
        found = holds_or_might(self._parts[a], T_scene_parts[a], others[b], T_b)
        return {"none": FREE, "unknown": MIGHT_TOUCH}.get(found.kind, TOUCHES)


@once_per_pair
def prepared(robot: Robot, scene: Scene) -> PoseBatch:
    """The packed form of a robot and a scene; the same records give the same one."""
    return PoseBatch(robot, scene)
