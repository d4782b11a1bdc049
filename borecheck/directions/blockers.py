"""Who blocks the directions that are in contact, and by how much a needle is short."""

from dataclasses import dataclass

import numpy as np

from borecheck.directions.direction_map import DirectionMap
from borecheck.directions.leaves import IS_CONTACT
from borecheck.directions.setup import MapSetup


@dataclass(frozen=True)
class Blocker:
    """A pair that is in contact in some directions, proven.

    Attributes:
        part: Part of the robot.
        obstacle: What it meets.
        share: Of the chart's solid angle, where this pair proves it.
        deepest: Largest depth of the needle there, [m].
        needle_short: By how much less than that depth of the needle is free, [m], where
            what drives it meets the patient; None where something else is in the way.
    """

    part: str
    obstacle: str
    share: float
    deepest: float
    needle_short: float | None


def blockers(found: DirectionMap) -> tuple[Blocker, ...]:
    """The pairs in contact, the one that blocks most first."""
    leaves, setup = found.leaves, found.setup
    whole = float(found.solid_angle.sum())
    proven = (leaves.state == IS_CONTACT) & (leaves.witness[:, 0] >= 0)
    listed = []
    for part, obstacle in np.unique(leaves.witness[proven, :2], axis=0).tolist():
        rows = proven & (leaves.witness[:, :2] == (part, obstacle)).all(axis=1)
        deepest = float(leaves.depth[rows, 1].max())
        meets = setup.scene.obstacles[obstacle]
        short = None
        if setup.inserted[part] and meets.role == "patient":
            short = max(deepest - free_needle(setup), 0.0)
        share = float(found.solid_angle[rows].sum()) / whole
        name = setup.robot.parts[part].mesh.name
        listed.append(Blocker(name, meets.name, share, deepest, short))
    return tuple(sorted(listed, key=lambda blocker: -blocker.share))


def free_needle(setup: MapSetup) -> float:
    """From the tip along the needle to the first of what is driven with it, [m]."""
    robot, needle = setup.robot, setup.robot.needle_with_tip()
    T = robot.placements(robot.home)
    tip = T[needle.tip or ""]
    back = -(tip[:3, :3] @ needle.axis)
    free = np.inf
    for part, inserted in zip(robot.parts, setup.inserted, strict=True):
        if inserted and part.link != needle.link:
            at = part.mesh.vertices @ T[part.link][:3, :3].T + T[part.link][:3, 3]
            free = min(free, float(((at - tip[:3, 3]) @ back).min()))
    return free
