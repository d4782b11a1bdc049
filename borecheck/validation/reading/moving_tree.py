"""Where the links are at any configuration: a plain product of transforms.

Read leniently from the draft, mimic chains resolved; the third source beside the
libraries, and what remote centres, loops and self-contact are judged with.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from borecheck.core.se3 import Array, axis_rotation
from borecheck.robots.urdf import mimic as chains
from borecheck.robots.urdf.attributes import placement
from borecheck.robots.urdf.draft_elements import DraftJoint
from borecheck.validation.reading.checked_urdf import CheckedUrdf

TURNING = ("revolute", "continuous")
# A joint without usable limits is moved within half a turn, or 0.1 m.
FREE_RANGE = {"revolute": math.pi, "continuous": math.pi, "prismatic": 0.1}


@dataclass(eq=False)
class MovingTree:
    """The moving tree of a robot.

    Attributes:
        root: Name of the root link.
        steps: (link, joint, T_parent_joint) from the root outward.
        follows: Mimic relations down to free joints.
        ranges: Lower and upper position of every free joint.
    """

    root: str
    steps: tuple[tuple[str, DraftJoint, Array], ...]
    follows: Mapping[str, chains.Follow]
    ranges: Mapping[str, tuple[float, float]]

    def positions(self, free: Mapping[str, float]) -> dict[str, float]:
        """Positions of all turning and sliding joints, followers too."""
        found = dict(free)
        if not self.follows:
            return found
        for _, _, name, kind, _ in self._walk:
            follow = self.follows.get(name)
            if follow is not None and kind in FREE_RANGE:
                leader, multiplier, offset = follow
                found[name] = multiplier * free.get(leader, 0.0) + offset
        return found

    def placements(self, positions: Mapping[str, float]) -> dict[str, Array]:
        """T_root_link of every link; floating and planar joints stay at zero."""
        placed = {self.root: np.eye(4)}
        for link, parent, name, kind, T_parent_joint in self._walk:
            T = placed[parent] @ T_parent_joint
            value = positions.get(name, 0.0)
            if value and kind in FREE_RANGE:
                T = T @ _displaced(self.axes[name], kind, value)
            placed[link] = T
        return placed

    @cached_property
    def _walk(self) -> list[tuple[str, str, str, str, Array]]:
        """The steps as plain values: reading them from the XML each time is slow."""
        return [
            (link, joint.parent or "", joint.name, joint.type, T)
            for link, joint, T in self.steps
        ]

    @cached_property
    def axes(self) -> dict[str, Array]:
        """Unit axis of every joint in its own frame."""
        axes = {}
        for _, joint, _ in self.steps:
            axis = np.array(joint.axis or (1.0, 0.0, 0.0), dtype=float)
            length = float(np.linalg.norm(axis))
            axes[joint.name] = axis / length if length > 0.0 else axis
        return axes

    def configurations(self, rng: np.random.Generator, count: int) -> list[Array]:
        """Zero, both corners of the limits, and random positions of the free joints."""
        low = np.array([bounds[0] for bounds in self.ranges.values()])
        high = np.array([bounds[1] for bounds in self.ranges.values()])
        chosen = [np.clip(0.0, low, high), low, high]
        return chosen + [rng.uniform(low, high) for _ in range(count)]

    def named(self, q: Array) -> dict[str, float]:
        """Free joint positions by name."""
        return {name: float(v) for name, v in zip(self.ranges, q, strict=True)}

    def sampled(self, seed: int, count: int) -> list[dict[str, float]]:
        """Free positions by name: `configurations`, so many random ones among them."""
        rng = np.random.default_rng(seed)
        return [self.named(q) for q in self.configurations(rng, count)]

    def joints_to(self, link: str) -> list[DraftJoint]:
        """The joints from the root to a link."""
        into = {name: joint for name, joint, _ in self.steps}
        road: list[DraftJoint] = []
        while link in into:
            road.append(into[link])
            link = into[link].parent or ""
        return road[::-1]


def moving_tree_of(robot: CheckedUrdf) -> MovingTree | None:
    """The moving tree; None if it is no tree, or numbers are missing. Remembered."""
    found: MovingTree | None = robot.remembered("motion", None, lambda: _motion(robot))
    return found


def _motion(robot: CheckedUrdf) -> MovingTree | None:
    if len(robot.roots) != 1 or len(robot.joints) != len(robot.links) - 1:
        return None
    root = robot.roots[0].name
    steps = []
    for link, joint in robot.below(root):
        if joint is None:
            continue
        origin = placement(joint.element)
        if origin is None or joint.axis is None or not joint.name:
            return None
        if not np.isfinite(origin).all() or np.abs(origin).max() > 1e12:
            return None
        steps.append((link, joint, origin))
    names = {joint.name for _, joint, _ in steps}
    if len(steps) != len(robot.joints) or len(names) != len(steps):
        return None
    follows, problems = chains.try_resolve(robot.joint_named.values())
    if problems:
        return None
    ranges = {
        joint.name: _range(joint)
        for _, joint, _ in steps
        if joint.type in FREE_RANGE and joint.name not in follows
    }
    return MovingTree(root, tuple(steps), follows, ranges)


def _range(joint: DraftJoint) -> tuple[float, float]:
    free = FREE_RANGE[joint.type]
    lower, upper = joint.lower, joint.upper
    if joint.type == "continuous" or lower is None or upper is None:
        return -free, free
    if not lower <= upper or upper - lower > 1e4:
        return -free, free
    return lower, upper


def _displaced(axis: Array, kind: str, value: float) -> Array:
    T = np.eye(4)
    if kind in TURNING:
        T[:3, :3] = axis_rotation(axis, value)
    else:
        T[:3, 3] = axis * value
    return T
