"""What holds for every configuration of a box of a family's coordinates.

A box in which no configuration keeps the constraints is known by its joints' ranges, by
the torques, and by witnesses of the parts: balls that are in an obstacle, or nearer
than the padding, wherever in the box the arm stands. Of the others the cost has a lower
bound.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.plans.needle_plan import NeedlePlan
from borecheck.setup.cone import rim
from borecheck.setup.family import Family, Spread
from borecheck.setup.mechanics import twists
from borecheck.setup.room import Padded, fields_of
from borecheck.setup.terms import CONE, FAR, LIMITS, NOTHING, TORQUE, Terms

Array = NDArray[np.float64]
Ids = NDArray[np.intp]
Codes = NDArray[np.int8]

# Around the entry so much is looked at, [m]: what is farther bounds nothing.
AROUND = 0.45
# Sums of rounding, far above: [m], [rad] and the cost.
ROUNDING = 1e-9
# Tilts of the cone that must be possible, evenly round; asked of boxes so small, [rad].
TILTS, TILTED = 8, 0.15
# Boxes in which nothing moves farther are asked of the certified distances, [m].
SMALL = 0.015


@dataclass(frozen=True, eq=False)
class Judged:
    """What is known of boxes (n,).

    Attributes:
        against: The constraint that no point of the box keeps; NOTHING where unknown.
        least: Lower bound of the cost of what keeps the constraints.
        q: Configurations in the middles, (n, joints).
    """

    against: Codes
    least: Array
    q: Array


class Boxes:
    """Judges boxes of one family for one needle.

    Args:
        terms: What is asked.
        family: The arm's configurations.
        plan: The needle.
    """

    def __init__(self, terms: Terms, family: Family, plan: NeedlePlan) -> None:
        self._terms, self._family, self._plan = terms, family, plan
        self._tilts = rim(plan.direction, terms.asked.cone, TILTS)
        self._padded = Padded.of(terms)
        self._fields = fields_of(terms.scene)

    def judge(self, x: Array, half: Array, best: float) -> Judged:
        """What is known of boxes with middles x (n, k) and half their sizes.

        Args:
            x: Middles.
            half: Half the sizes.
            best: Boxes that surely cost more need no more looking at.
        """
        spread = self._spread(x, half, None)
        against, least = self._joints(spread), np.full(len(x), -np.inf)
        rows = np.flatnonzero(against == NOTHING)
        if len(rows):
            self._ask_field(rows, x, half, against, least)
        rows = np.flatnonzero((against == NOTHING) & (least <= best))
        if len(rows):
            self._ask_distances(rows, x, half, against, least)
        small = half[:, 0] <= TILTED
        rows = np.flatnonzero((against == NOTHING) & (least <= best) & small)
        if len(rows) and self._terms.asked.cone > 0.0:
            self._ask_cone(rows, x, half, against)
        return Judged(against, least, spread.q)

    def _spread(self, x: Array, half: Array, turn: Array | None) -> Spread:
        plan = self._plan
        return self._family.spread_tilted(plan.entry, plan.direction, x, half, turn)

    def _joints(self, spread: Spread) -> Codes:
        """Boxes in which no joint position, or no torque, is allowed."""
        model, q = self._terms.robot.model, spread.q
        room = spread.joints + ROUNDING
        low, high = model.lower - q - room, q - room - model.upper
        turns = np.array([joint.is_angle for joint in model.free_joints])
        beyond = np.maximum(low, high)
        # an angle that can pass half a turn comes back from the other side
        beyond = np.where(turns & (np.abs(q) + room > np.pi), -1.0, beyond)
        codes = np.where((beyond > 0.0).any(axis=1), LIMITS, NOTHING).astype(np.int8)
        rows = np.flatnonzero(codes == NOTHING)
        if len(rows):
            least = least_torques(self._terms, spread, rows)
            codes[rows[(least > self._terms.efforts).any(axis=1)]] = TORQUE
        return codes

    def _ask_field(
        self, rows: Ids, x: Array, half: Array, against: Codes, least: Array
    ) -> None:
        """By witnesses of every part, and the fields of distances."""
        spread = self._spread(x[rows], half[rows], None)
        room = self._padded.room(spread, self._fields)
        against[rows] = self._padded.broken(room)
        least[rows] = least_cost(self._terms, spread, room.scanner, room.patient)

    def _ask_distances(
        self, rows: Ids, x: Array, half: Array, against: Codes, least: Array
    ) -> None:
        """By certified distances in the middle, where boxes are small."""
        spread = self._spread(x[rows], half[rows], None)
        small = spread.origins.max(axis=1) <= SMALL
        rows = rows[small]
        if not len(rows):
            return
        spread = self._spread(x[rows], half[rows], None)
        room = self._padded.measured(spread)
        against[rows] = self._padded.broken(room)
        cost = least_cost(self._terms, spread, room.scanner, room.patient)
        least[rows] = np.maximum(least[rows], cost)

    def _ask_cone(self, rows: Ids, x: Array, half: Array, against: Codes) -> None:
        """Boxes in which the needle can nowhere be tilted to one of the sides."""
        for turn in self._tilts:
            rows = rows[against[rows] == NOTHING]
            if not len(rows):
                return
            spread = self._spread(x[rows], half[rows], turn)
            bad = self._joints(spread) != NOTHING
            against[rows[bad]] = CONE
            rows = rows[~bad]
            if len(rows):
                spread = self._spread(x[rows], half[rows], turn)
                touched = self._padded.touched(spread, self._fields)
                against[rows[touched]] = CONE


def least_torques(terms: Terms, spread: Spread, rows: Ids) -> Array:
    """What the needle's forces ask of every joint at least, (rows, joints).

    Of F |n . (z x r)|: an axis turned by a and a point on it moved by b change it by no
    more than a |r| + b; M about the axis stays.
    """
    q, asked = spread.q[rows], terms.asked
    moved = twists(terms.robot, q)
    along = np.abs(np.einsum("njk,nk->nj", moved.linear, moved.axis))
    turning = np.linalg.norm(moved.angular, axis=2)
    turn, shift = spread.axes[rows], spread.origins[rows]
    change = np.where(turning > 0.5, turn * moved.reach + shift, turn)
    force = asked.force * np.maximum(along - change, 0.0)
    return force + asked.moment * turning - ROUNDING


def least_cost(terms: Terms, spread: Spread, scanner: Array, patient: Array) -> Array:
    """Lower bound of f over boxes, from upper bounds of the distances, (n,)."""
    w, robot = terms.asked.weights, terms.robot
    moved = twists(robot, spread.q)
    hinges = np.linalg.norm(moved.angular, axis=2).max(axis=0) > 0.5
    turn = spread.axes[:, hinges]
    both = (turn[:, :, None] + turn[:, None, :]) ** 2
    pairs = 0.5 * (both.sum(axis=(1, 2)) - np.einsum("nii->n", both))
    mu = np.minimum(moved.manipulability + np.sqrt(pairs), 0.5 * turn.shape[1])
    step = np.minimum(spread.joints, 2.0 * np.pi)
    angles = np.array([joint.is_angle for joint in robot.model.free_joints])
    wraps = angles & (np.abs(spread.q) + step > np.pi)
    step = np.linalg.norm(np.where(wraps, 2.0 * np.pi, step), axis=1)
    motion = np.maximum(np.linalg.norm(spread.q - robot.home, axis=1) - step, 0.0)
    total = w.motion * motion - w.dexterity * mu
    total = total - w.scanner * np.clip(scanner, 0.0, FAR)
    total = total - w.patient * np.clip(patient, 0.0, FAR)
    return np.asarray(total - ROUNDING)
