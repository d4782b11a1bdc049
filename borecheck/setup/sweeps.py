"""Proofs that every configuration between three keeps the constraints of a set-up.

Between corners q_1, q_2, q_3 the joints go straight: q = q_m + d, q_m the middle, d in
the hull of q_i - q_m. A point x moves by J d + R, |R| <= C / 2 with the bound C on the
second derivative of `motion.bounds`; J d is linear, so it is largest at a corner, where
it is x(q_i) - x(q_m) up to C / 2. Hence |x(q) - x(q_m)| <= max_i |x(q_i) - x(q_m)| + C.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.queries import NO
from borecheck.core.once import once_per_record
from borecheck.motion.bounds import (
    Route,
    chord_slack,
    gains,
    mesh_radius,
    refuse_skewed,
    route,
)
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS, WORLD
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.robot import Robot
from borecheck.setup.terms import NOTHING, Terms

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Ids = NDArray[np.intp]

# A joint's range is halved so often for pairs that it alone moves.
HALVINGS = 9
# Distances of pairs are known to such a share: enough to tell near from far.
_COARSE = 0.3


@dataclass(frozen=True, eq=False)
class _Follower:
    """A body whose points are followed as another frame sees them.

    Attributes:
        seen_from: The chain's frame, or WORLD.
        frame: The frame the body is fixed to.
        way: The route from the one to the other.
        corners: Points (k, 3) whose hull holds the body, in its frame, [m].
        radius: Largest distance of its points from the frame's origin, [m].
    """

    seen_from: int
    frame: int
    way: Route
    corners: Array
    radius: float


@once_per_record
def _bodies(robot: Robot) -> list[tuple[int, Array, float]]:
    """Frame, corners of the box, and radius of every part."""
    frame_of, chain = chain_of(robot)
    refuse_skewed(chain)
    found = []
    for part in robot.parts:
        low, high = part.mesh.bounds
        box = np.array(list(product(*zip(low, high, strict=True))))
        found.append((frame_of[part.link], box, mesh_radius(part.mesh.vertices)))
    return found


class Sweeps:
    """Asks triangles of configurations of one robot, in one scene.

    Args:
        terms: What is asked of every configuration.
        off: How far the tip may be from where it is at the corners, [m].

    Attributes:
        hopeless: Whether no smaller triangle will be proven either.
    """

    def __init__(self, terms: Terms, off: float) -> None:
        self._terms, self._most_off = terms, off
        self.hopeless = False
        self._ranges: dict[tuple[int, tuple[int, ...]], tuple[float, float]] = {}
        robot = terms.robot
        frame_of, self._chain = chain_of(robot)
        bodies, asked = _bodies(robot), terms.padded
        number = {part.mesh.name: k for k, part in enumerate(robot.parts)}
        named = asked.pairs[: asked.with_obstacles]
        self._against = np.array([number[a] for a, _ in named], int)
        among = [(number[a], number[b]) for a, b in asked.pairs[asked.with_obstacles :]]
        self._parts = [self._follower(WORLD, *body) for body in bodies]
        self._pairs = [self._follower(bodies[a][0], *bodies[b]) for a, b in among]
        tip = frame_of[terms.needle.tip or ""]
        self._tip = self._follower(WORLD, tip, np.zeros((1, 3)), 0.0)

    def _follower(
        self, seen_from: int, frame: int, corners: Array, radius: float
    ) -> _Follower:
        way = route(self._chain, seen_from, frame)
        return _Follower(seen_from, frame, way, corners, radius)

    def proven(self, qs: Array) -> tuple[Mask, Array]:
        """Which triangles (n, 3, joints) are proven, and the tip's way off, (n,), [m].

        Corners must keep the constraints or lie beside what is asked.
        """
        proven = np.zeros(len(qs), bool)
        offs = np.full(len(qs), np.inf)
        there = np.flatnonzero(np.isfinite(qs).all(axis=(1, 2)))
        if not len(there):
            return proven, offs
        moved = _Moved(self._chain, qs[there])
        offs[there] = moved.off(self._tip)
        good = (offs[there] <= self._most_off) & self._held(moved)
        free = self._terms.broken(moved.middle) == NOTHING
        left: Ids = np.flatnonzero(good & free)
        left = left[self._apart(moved, left)]
        proven[there[left[self._apart_itself(moved, left)]]] = True
        return proven, offs

    def _held(self, moved: "_Moved") -> Mask:
        """Whether joints stay within limits and hold the needle's forces throughout."""
        beyond = self._terms.robot.model.beyond_limits(moved.corners)
        within = ~beyond.reshape(len(moved.middle), -1).any(axis=1)
        asked = self._terms.asked
        more = moved.more_torque(self._tip, asked.force, asked.moment)
        needed = self._terms.torques(moved.middle) + more
        return np.asarray(within & (needed <= self._terms.efforts).all(axis=1))

    def _apart(self, moved: "_Moved", rows: Ids) -> Mask:
        """Whether every part keeps the padding to every obstacle."""
        asked, middle = self._terms.padded, moved.middle[rows]
        if not asked.with_obstacles or not len(middle):
            return np.ones(len(middle), bool)
        ways = moved.ways(self._parts)[rows]
        # one question for all at first: nothing is nearer than the farthest goes
        most = asked.margin + float(ways.max())
        apart = np.zeros(len(middle), bool)
        apart[asked.nearer_than(middle, most) == NO] = True
        near = np.flatnonzero(~apart)
        if len(near):
            room = asked.clearances(middle[near], "pair", _COARSE)[..., 0]
            needed = asked.margin + ways[near][:, self._against]
            apart[near[(room > needed).all(axis=1)]] = True
        return apart

    def _apart_itself(self, moved: "_Moved", rows: Ids) -> Mask:
        """Whether no two parts that must not touch can come together."""
        middle = moved.middle[rows]
        if not self._pairs or not len(middle):
            return np.ones(len(middle), bool)
        sources = [self._moving(pair, moved) for pair in self._pairs]
        many = np.flatnonzero([len(found) > 1 for found in sources])
        room = self._terms.padded.clearances_to_itself(middle, _COARSE)[..., 0]
        ways = moved.ways([self._pairs[k] for k in many])[rows]
        apart = np.array((room[:, many] > ways).all(axis=1), bool)
        for source in {found[0] for found in sources if len(found) == 1}:
            alone = [k for k, found in enumerate(sources) if found == [source]]
            if not self._apart_over(source, alone, moved.corners):
                self.hopeless = True
                apart[...] = False
        return apart

    def _moving(self, pair: _Follower, moved: "_Moved") -> list[int]:
        """Entries of q that change where one part is seen from the other."""
        chain = self._chain
        found = {
            int(chain.source[j]) for j in pair.way.joints if chain.factor[j] != 0.0
        }
        return sorted(k for k in found - {-1} if np.ptp(moved.corners[:, k]) > 0.0)

    def _apart_over(self, source: int, pairs: list[int], corners: Array) -> bool:
        """Whether pairs that depend on one joint stay apart over all of its range.

        A parallelogram's bars are many joints apart, whose bounds add up, and still
        move as one joint says: along a line there are few enough pieces to ask.
        """
        low, high = corners[:, source].min(), corners[:, source].max()
        known = self._ranges.get((source, tuple(pairs)))
        if known is not None and known[0] <= low and high <= known[1]:
            return True
        room = 0.1 * (high - low)
        low, high = low - room, high + room  # finer corners may lie a little outside
        ends = np.array([[low, high]])
        for _ in range(HALVINGS):
            qs = np.tile(corners[0], (len(ends), 3, 1))
            qs[:, :2, source] = ends
            qs[:, 2, source] = ends.mean(axis=1)
            piece = _Moved(self._chain, qs)
            asked = self._terms.padded.clearances_to_itself(piece.middle, _COARSE)
            ways = piece.ways([self._pairs[k] for k in pairs])
            ends = ends[~(asked[:, pairs, 0] > ways).all(axis=1)]
            if not len(ends):
                self._ranges[source, tuple(pairs)] = (low, high)
                return True
            middle = ends.mean(axis=1)
            ends = np.concatenate(
                [
                    np.stack([ends[:, 0], middle], axis=1),
                    np.stack([middle, ends[:, 1]], axis=1),
                ]
            )
        return False


class _Moved:
    """How far points go, within triangles of configurations, from their middles.

    Args:
        chain: The robot's joints.
        qs: Corners, (n, 3, joints).
    """

    def __init__(self, chain: JointChain, qs: Array) -> None:
        self._chain = chain
        n, k, joints = qs.shape
        self.corners = qs.reshape(n * k, joints)
        self.middle = qs.mean(axis=1)
        theta, at = chain.thetas(qs), chain.thetas(self.middle)
        self._change = np.abs(theta - at[:, None]).max(axis=1)
        self._edges = np.abs(theta - np.roll(theta, -1, axis=1)).max(axis=1)
        self._largest = np.abs(theta).max(axis=(0, 1))
        self._T = chain.placements(self.corners).reshape(n, k, -1, 4, 4)
        self._T_middle = chain.placements(self.middle)[:, None]

    @cached_property
    def _turning(self) -> Array:
        """All turns of all joints together, (n,), [rad]."""
        return self._change[:, self._chain.kind == TURNS].sum(axis=1)

    def ways(self, followers: list[_Follower]) -> Array:
        """Bound on how far any point of each body goes, (n, bodies), [m]."""
        found = np.zeros((len(self.middle), len(followers)))
        for k, body in enumerate(followers):
            gain = gains(self._chain, body.way, body.radius, self._largest)
            bend = 8.0 * chord_slack(self._chain, body.way, gain, self._change)
            found[:, k] = self._at_corners(body) + bend
        return found

    def off(self, tip: _Follower) -> Array:
        """Bound on the tip's distance from where it is at all three corners, (n,), [m].

        A point lies on a line from a corner to the opposite edge: C / 8 off the chord
        of the edge, and as much off that of the line, whose joints change no more.
        """
        gain = gains(self._chain, tip.way, tip.radius, self._largest)
        return 2.0 * chord_slack(self._chain, tip.way, gain, self._edges)

    def _at_corners(self, body: _Follower) -> Array:
        """How far the body's corners are from where they are in the middle, (n,)."""
        there, middle = self._T[:, :, body.frame], self._T_middle[:, :, body.frame]
        if body.seen_from != WORLD:
            there = _between(self._T[:, :, body.seen_from], there)
            middle = _between(self._T_middle[:, :, body.seen_from], middle)
        moved = (there - middle)[..., :3, :]
        shift = moved[..., :3] @ body.corners.T + moved[..., 3:]
        return np.asarray(np.linalg.norm(shift, axis=-2).max(axis=(1, 2)))

    def more_torque(self, tip: _Follower, force: float, moment: float) -> Array:
        """How much more torque than in the middle may be needed, (n, joints).

        Of F n . (z x r), seen from the joint: n turns by at most all later turns, r
        changes by at most what later joints move the tip; |r| is the joint's reach.
        """
        chain, way = self._chain, tip.way
        gain = gains(chain, way, 0.0, self._largest)
        steps = gain * self._change[:, way.joints]
        later = np.cumsum(steps[:, ::-1], axis=1)[:, ::-1]
        more = np.zeros((len(self.middle), chain.joint_count))
        for k, j in enumerate(way.joints):
            source, factor = int(chain.source[j]), abs(float(chain.factor[j]))
            if chain.kind[j] == SLIDES:
                more[:, source] += factor * force * self._turning
            elif chain.kind[j] == TURNS:
                push = force * (gain[k] * self._turning + later[:, k])
                more[:, source] += factor * (push + moment * self._turning)
        return more


def _between(T_a: Array, T_b: Array) -> Array:
    """T_a_b of rigid placements (..., 4, 4)."""
    R = np.swapaxes(T_a[..., :3, :3], -1, -2)
    found = np.zeros_like(T_b)
    found[..., :3, :3] = R @ T_b[..., :3, :3]
    found[..., :3, 3] = np.einsum(
        "...ij,...j->...i", R, T_b[..., :3, 3] - T_a[..., :3, 3]
    )
    return found
