"""A needle's tip and direction as functions of q, and their descent towards a target.

Five numbers are asked of an arm: where the tip is and which way the needle points. The
turn about the needle is free.

Levenberg-Marquardt on many starts at once: in every step joints that stand at a limit
and would go beyond are held, so limits bound the search itself and nothing is clipped
after it. The damping falls with the square of what is left, so the last steps are
Newton's; it is taken in the space of the task, where it suits arms of any number of
joints. Chosen over `scipy.optimize.least_squares` (one start at a time, and its
interior steps never reach a limit) and pink (a step of differential kinematics per
quadratic program, for tracking): both take 20 to 100 times as long for the same poses.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS, WORLD

Array = NDArray[np.float64]

# A turn of the needle by 1 rad counts as this much of a shift of its tip, [m].
ARM = 0.3
# A descent ends where both are reached to rounding, or where it no longer gains.
SOLVED = 1e-13
STEPS = 30
# No joint goes farther in one step, [rad] or [m].
STRIDE = 0.7
# Damping in proportion to the task's own size: far below what it is near singularities.
FLOOR = 1e-10


@dataclass(frozen=True, eq=False)
class NeedleTask:
    """Where a needle is, of one chain.

    Attributes:
        chain: The robot's joints.
        frame: The frame at the tip.
        axis: The way the needle points, in it, (3,).
        lower: Of every entry of q, mimic joints' limits included, (n,); or -inf.
        upper: Likewise.
        held: Entries of q that stay as they are.
        turning: How much direction counts, [m]; 0: the tip alone is asked.
        floor: Least damping, in proportion to the task's own size.
    """

    chain: JointChain
    frame: int
    axis: Array
    lower: Array
    upper: Array
    held: tuple[int, ...] = ()
    turning: float = ARM
    floor: float = FLOOR

    @cached_property
    def way(self) -> NDArray[np.int64]:
        """Frames that joints move, from the root to the tip, and the tip's, (k,)."""
        found, frame = [self.frame], self.frame
        while frame != WORLD:
            if self.chain.kind[frame] != FIXED and frame != self.frame:
                found.append(frame)
            frame = int(self.chain.parent[frame])
        return np.array(found[::-1], dtype=np.int64)

    @cached_property
    def active(self) -> NDArray[np.int64]:
        """Entries of q that move the needle and are not held, sorted."""
        moving = self.way[self.chain.kind[self.way] != FIXED]
        sources = {
            int(self.chain.source[j]) for j in moving if self.chain.factor[j] != 0.0
        }
        return np.array(sorted(sources - set(self.held)), dtype=np.int64)

    @cached_property
    def _drives(self) -> Array:
        """How much of each active entry of q each joint on the way takes, (k, a)."""
        chain, way = self.chain, self.way
        drives = (chain.source[way][:, None] == self.active) * chain.factor[way][
            :, None
        ]
        return np.where(chain.kind[way][:, None] == FIXED, 0.0, drives)

    @property
    def is_redundant(self) -> bool:
        """Whether solutions come in families, not one by one."""
        return len(self.active) > 5

    def of_tip_alone(self) -> "NeedleTask":
        """The same, with any direction."""
        return replace(self, turning=0.0)

    def for_singular(self) -> "NeedleTask":
        """The same, with next to no damping: for what is nearly there."""
        return replace(self, floor=1e-5 * FLOOR)

    def without_limits(self) -> "NeedleTask":
        """The same, with joints that go anywhere."""
        n = len(self.lower)
        return replace(self, lower=np.full(n, -np.inf), upper=np.full(n, np.inf))

    def needles(self, qs: Array) -> tuple[Array, Array]:
        """Tips (k, 3) and directions (k, 3) at configurations (k, n)."""
        T = self.chain.placements(qs, [self.frame])[:, 0]
        return T[:, :3, 3], T[:, :3, :3] @ self.axis

    def descend(
        self, qs: Array, tips: Array, directions: Array, steps: int = STEPS
    ) -> tuple[Array, Array]:
        """Configurations as near to their needles as a descent brings them.

        Args:
            qs: Where to start, within limits, (k, n).
            tips: A tip for each, (k, 3), [m].
            directions: A unit vector for each, (k, 3).
            steps: At most.

        Returns:
            Configurations (k, n), and what is left of both, (k,), [m].
        """
        qs = qs.copy()
        rest = np.full(len(qs), np.inf)
        rows = np.arange(len(qs))
        damping = np.full(len(qs), 0.1)
        r, J = self._linear(qs, tips, directions)
        rest = np.linalg.norm(r, axis=1)
        for _ in range(steps):
            going = (rest[rows] > SOLVED) & (damping[rows] < 1e8)
            rows, r, J = rows[going], r[going], J[going]
            if len(rows) == 0:
                break
            q = self._stepped(qs[rows], r, J, damping[rows])
            r_new, J_new = self._linear(q, tips[rows], directions[rows])
            left = np.linalg.norm(r_new, axis=1)
            better = left < rest[rows]
            kept = rows[better]
            # what gains next to nothing has come to a valley's floor, or to rounding
            stuck = better & (left > (1.0 - 1e-4) * rest[rows]) & (damping[rows] < 1.0)
            qs[kept], rest[kept] = q[better], left[better]
            damping[rows] *= np.where(better, 0.2, 8.0)
            damping[rows[stuck]] *= 100.0
            r = np.where(better[:, None], r_new, r)
            J = np.where(better[:, None, None], J_new, J)
        return qs, rest

    def _stepped(self, q: Array, r: Array, J: Array, damping: Array) -> Array:
        """The next configurations, within limits."""
        lower, upper = self.lower[self.active], self.upper[self.active]
        at = q[:, self.active]
        downhill = -np.einsum("kij,ki->kj", J, r)
        out = ((at <= lower) & (downhill < 0.0)) | ((at >= upper) & (downhill > 0.0))
        J = np.where(out[:, None, :], 0.0, J)
        A = J @ J.transpose(0, 2, 1)
        size = np.trace(A, axis1=1, axis2=2)
        least = damping * np.einsum("ki,ki->k", r, r) + self.floor * size + 1e-30
        A += least[:, None, None] * np.eye(6)
        step = -np.einsum("kij,ki->kj", J, np.linalg.solve(A, r[:, :, None])[:, :, 0])
        longest = np.abs(step).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, STRIDE / np.maximum(longest, 1e-30))[:, None]
        q = q.copy()
        q[:, self.active] = np.clip(at + step, lower, upper)
        return q

    def _linear(self, qs: Array, tips: Array, directions: Array) -> tuple[Array, Array]:
        """What is left of tip and direction, (k, 6) [m], and its Jacobian (k, 6, a)."""
        placed = self.chain.placements(qs, self.way)
        T = placed[:, -1]
        tip, axis = T[:, :3, 3], T[:, :3, :3] @ self.axis
        r = np.hstack([tip - tips, self.turning * (axis - directions)])
        along = (placed[:, :, :3, :3] @ self.chain.axis[self.way][:, :, None])[..., 0]
        lever = tip[:, None] - placed[:, :, :3, 3]
        kind = self.chain.kind[self.way][:, None]
        slides, turns = kind == SLIDES, kind == TURNS
        moves = np.where(slides, along, np.where(turns, _cross(along, lever), 0.0))
        turned = np.where(turns, _cross(along, axis[:, None]), 0.0)
        both = np.concatenate([moves, self.turning * turned], axis=2)
        return r, both.transpose(0, 2, 1) @ self._drives


def _cross(u: Array, v: Array) -> Array:
    """As `np.cross` along the last axis, which takes several times as long."""
    a, b, c = u[..., 0], u[..., 1], u[..., 2]
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=-1)
