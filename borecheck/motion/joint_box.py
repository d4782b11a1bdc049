"""Parts of a robot that cannot meet, whatever its joints do within their limits.

The placement of one part against another depends on the joints between them alone. A
box of their positions is looked at in its middle: no point of the part moves farther
from there than the sum, over the joints, of half their range times 1 (sliding) or the
part's largest distance from the joint's axis (turning); `motion.bounds` says why. If
the certified distance in the middle is larger, the pair is apart in the whole box; else
the box is halved along the joint that moves the part most.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.core.once import once_per_record
from borecheck.geometry.surfaces import surface
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.motion.bounds import route
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# Boxes looked at of one pair before it is given up: a third of a second.
MOST_BOXES = 8192
# By how much the distance must exceed what the part can move: beyond rounding, [m].
RESERVE = 1e-9


@once_per_record
def pairs_that_may_meet(robot: Robot) -> tuple[tuple[int, int], ...]:
    """Those of a robot's self pairs that are not proven apart over the joints' limits.

    Containment is not asked: parts whose surfaces never meet hold one another always
    or never, so any one pose answers for all.
    """
    return tuple(pair for pair in robot.self_pairs if not _never_meet(robot, *pair))


@dataclass(frozen=True, eq=False)
class _Between:
    """The joints between two parts.

    Attributes:
        chain: The robot's joints.
        frames: Of both parts.
        joints: Those between that move, (j,).
        sources: The entries of q that move them, (s,).
        share: How joints follow the sources, (j, s), absolute.
        box: Corners of the moving part's box in its frame, (8, 3).
        trees: Both parts.
    """

    chain: JointChain
    frames: tuple[int, int]
    joints: Ids
    sources: Ids
    share: Array
    box: Array
    trees: MovingLinks

    @classmethod
    def of(cls, robot: Robot, standing: int, moving: int) -> "_Between":
        frame_of, chain = chain_of(robot)
        a, b = robot.parts[standing], robot.parts[moving]
        frames = frame_of[a.link], frame_of[b.link]
        on_the_way = route(chain, *frames).joints
        joints = on_the_way[np.isin(chain.kind[on_the_way], (TURNS, SLIDES))]
        sources = np.unique(chain.source[joints])
        share = np.abs(chain.factor[joints])[:, None] * (
            chain.source[joints][:, None] == sources
        )
        pick = np.array([(i >> 2 & 1, i >> 1 & 1, i & 1) for i in range(8)])
        box = b.mesh.bounds[pick, np.arange(3)]
        trees = [surface(a.mesh).tree, surface(b.mesh).tree]
        among = MovingLinks.among(trees, [(0, 1)])
        return cls(chain, frames, joints, sources, share, box, among)


def _never_meet(robot: Robot, standing: int, moving: int) -> bool:
    """Whether two parts are proven apart over the whole joint box."""
    between = _Between.of(robot, standing, moving)
    model = robot.model
    turn = np.where(np.isfinite(model.upper - model.lower), 0.0, np.pi)
    lower = np.where(turn > 0.0, -turn, model.lower)
    upper = np.where(turn > 0.0, turn, model.upper)
    q = 0.5 * (lower + upper)
    middle = q[between.sources][None]
    half = 0.5 * (upper - lower)[between.sources][None]
    looked = 0
    while len(middle):
        looked += len(middle)
        if looked > MOST_BOXES:
            return False
        near, moved = _near(between, q, middle, half)
        middle, half, moved = middle[near], half[near], moved[near]
        if not len(between.sources):
            return not near.any()
        widest = moved.argmax(axis=1)
        step = np.zeros_like(half)
        rows = np.arange(len(half))
        step[rows, widest] = 0.5 * half[rows, widest]
        middle = np.concatenate([middle - step, middle + step])
        half = np.tile(half - step, (2, 1))
    return True


def _near(
    between: _Between, q: Array, middle: Array, half: Array
) -> tuple[NDArray[np.bool_], Array]:
    """Which boxes are not proven, and how far each source moves the part in them."""
    chain = between.chain
    qs = np.tile(q, (len(middle), 1))
    qs[:, between.sources] = middle
    frames = [*between.frames, *between.joints.tolist()]
    placed = chain.placements(qs, frames)
    T = placed[:, 1]
    corners = between.box @ T[:, :3, :3].transpose(0, 2, 1) + T[:, None, :3, 3]
    arm = np.ones((len(qs), len(between.joints)))
    for k, joint in enumerate(between.joints.tolist()):
        if chain.kind[joint] == TURNS:
            axis = placed[:, 2 + k, :3, :3] @ chain.axis[joint]
            v = corners - placed[:, None, 2 + k, :3, 3]
            aside = np.cross(v, axis[:, None])
            arm[:, k] = np.linalg.norm(aside, axis=2).max(axis=1)
    moved = (arm @ between.share) * half
    total = moved.sum(axis=1) * (1.0 + 1e-12) + RESERVE
    bounds = between.trees.farther_than(placed[:, :2], total[:, None])
    return ~(bounds[:, 0, 0] > total), moved
