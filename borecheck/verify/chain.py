"""The chain a certificate states: placements, ways, neighbours. Numpy only.

Displacement. Let the joints stand at q_m. Of a product of joint transforms change one
factor after the other from the standing side to the moving side: at each step what lies
behind the joint is still as at q_m, so a point moves on a circle about that joint's
axis whose radius is its distance from the axis at q_m, or straight along it. Steps add.

Rounding. Every step of the chain adds to the error of a placed point at most the size
of the scene times: a few units in the last place (a product of matrices), those of the
joint's own value, which a turn multiplies, and what a stated rotation or axis lacks of
being one. `rounding` adds this up, with room; it must stay far below the reserve.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WORLD = -1
# One rounding of float64, relative.
_UNIT = 2.0**-53


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint of the chain as the certificate states it.

    Its value is factor * q[source] + offset.
    """

    parent: int
    origin: Array
    kind: str
    axis: Array
    source: int
    factor: float
    offset: float


class Chain:
    """Joints with the values they take at the waypoints, (n, nq)."""

    def __init__(self, joints: Sequence[Joint], waypoints: Array) -> None:
        self.joints = joints
        self.values = np.zeros((len(waypoints), len(joints)))
        for k, joint in enumerate(joints):
            if joint.kind != "fixed":
                q = waypoints[:, joint.source]
                self.values[:, k] = joint.factor * q + joint.offset
        self._above = [self._all_above(k) for k in range(len(joints))]
        self._placed: tuple[float, list[Array]] | None = None

    def at(self, time: float) -> Array:
        """Joint values at a time that counts waypoints, (joints,)."""
        k = min(int(np.floor(time)), len(self.values) - 2)
        part = time - k
        moved = (1.0 - part) * self.values[k] + part * self.values[k + 1]
        return np.asarray(moved, dtype=np.float64)

    def placements(self, time: float) -> list[Array]:
        """T_world_frame of every frame at a time."""
        if self._placed is None or self._placed[0] != time:
            self._placed = (time, self.placed(self.at(time)))
        return self._placed[1]

    def placed(self, values: Array) -> list[Array]:
        """T_world_frame of every frame for joint values."""
        placed: list[Array] = []
        for joint, value in zip(self.joints, values, strict=True):
            T = joint.origin @ motion(joint, float(value))
            placed.append(T if joint.parent < 0 else placed[joint.parent] @ T)
        return placed

    def displacement(
        self, corners: Array, frames: tuple[int, int], times: tuple[float, float, float]
    ) -> float:
        """Largest way of any point of one body against another, [m].

        Args:
            corners: Of a box of the first body, placed at the instant, (8, 3).
            frames: Of both bodies.
            times: Begin and end of the interval, and the instant in it.
        """
        begin, end, at = times
        inside = self.values[int(np.floor(begin)) + 1 : int(np.ceil(end))]
        others = np.stack([self.at(begin), *inside, self.at(end)])
        change = np.abs(others - self.at(at)).max(axis=0)
        placed = self.placements(at)
        total = 0.0
        for k in self._between(*frames):
            joint = self.joints[k]
            if joint.kind == "slides":
                total += float(change[k])
            elif joint.kind == "turns":
                away = corners - placed[k][:3, 3]
                axis = placed[k][:3, :3] @ joint.axis
                beside = away - np.outer(away @ axis, axis)
                total += float(change[k] * np.linalg.norm(beside, axis=1).max())
        return total

    def extent(self) -> float:
        """No frame's origin is farther from the world's than this, [m]."""
        lengths = [np.linalg.norm(joint.origin[:3, 3]) for joint in self.joints]
        slides = [joint.kind == "slides" for joint in self.joints]
        return float(sum(lengths) + np.abs(self.values[:, slides]).max(axis=0).sum())

    def rounding(self, size: float, skew: float) -> float:
        """Bound on how far arithmetic puts a point of the scene astray, [m].

        Args:
            size: Of the scene, from the world's origin, [m].
            skew: How far the bodies' own placements are from rigid, the largest.
        """
        turns = [joint.kind == "turns" for joint in self.joints]
        angle = float(np.abs(self.values[:, turns]).max(initial=0.0))
        worst = max((len(above) for above in self._above), default=0)
        lacking = sum(skewness(j.origin) + _off_unit(j) for j in self.joints)
        steps = _UNIT * (worst + 4) * (40.0 + 4.0 * angle)
        return size * (steps + 3.0 * (lacking + 2.0 * skew))

    def required_pairs(self, frames: Sequence[int]) -> set[tuple[int, int]]:
        """Pairs of parts, by their frames, that must be examined, i < j.

        All but parts of one rigid body (joined by fixed joints) and of neighbours in
        the chain: bodies with no other body that has a part between them.
        """
        body = [self._rigid(frame) for frame in frames]
        neighbours = {frozenset((b, self._next(b, set(body)))) for b in body}
        return {
            (i, j)
            for j in range(len(frames))
            for i in range(j)
            if body[i] != body[j] and frozenset((body[i], body[j])) not in neighbours
        }

    def _rigid(self, frame: int) -> int:
        """The topmost frame that one is fixed to, or WORLD."""
        while frame >= 0 and self.joints[frame].kind == "fixed":
            frame = self.joints[frame].parent
        return frame

    def _next(self, body: int, with_part: set[int]) -> int | None:
        """The next body above that has a part, if there is one."""
        while body >= 0:
            body = self._rigid(self.joints[body].parent)
            if body in with_part:
                return body
        return None

    def _between(self, first: int, second: int) -> list[int]:
        """Joints that move one frame against another: above one, not above both."""
        above = [self._above[k] if k >= 0 else frozenset() for k in (first, second)]
        return sorted(above[0] ^ above[1])

    def _all_above(self, frame: int) -> frozenset[int]:
        found = set()
        while frame >= 0:
            found.add(frame)
            frame = self.joints[frame].parent
        return frozenset(found)


def motion(joint: Joint, value: float) -> Array:
    """Turn or shift of one joint by its value (Rodrigues' formula), (4, 4)."""
    T = np.eye(4)
    if joint.kind == "slides":
        T[:3, 3] = value * joint.axis
    elif joint.kind == "turns":
        n = joint.axis
        across = np.cross(np.eye(3), n)
        along = np.outer(n, n)
        cosine, sine = np.cos(value), np.sin(value)
        T[:3, :3] = cosine * np.eye(3) + (1.0 - cosine) * along + sine * across
    return T


def inverse(T: Array) -> Array:
    """The way back of a rigid placement."""
    back = np.eye(4)
    back[:3, :3] = T[:3, :3].T
    back[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return back


def skewness(T: Array) -> float:
    """How far a placement's rotation is from one."""
    R = T[:3, :3]
    return float(np.abs(R @ R.T - np.eye(3)).max())


def _off_unit(joint: Joint) -> float:
    if joint.kind == "fixed":
        return 0.0
    return 2.0 * abs(float(np.linalg.norm(joint.axis)) - 1.0)
