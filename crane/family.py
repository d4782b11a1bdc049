"""CRANE's configurations for one needle by (psi, q7, q8), and bounds of their motion.

psi is the roll about the needle, measured as in `crane.inverse.roll_axes`. One
configuration everywhere but at |q5| = 90 deg; numpy only.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.branches import seen_from_base, times
from crane.dimensions import LIMITS, Dimensions, from_arguments
from crane.inverse import roll_axes, standing
from crane.kinematics import BODIES

Array = NDArray[np.float64]

# Boxes that reach nearer to |q5| = 90 deg have no bounds, [rad]: more than joints go.
MOST_Q5, NO_BOUND = 1.5, 1e3


@dataclass(frozen=True)
class Family:
    """The family, see `borecheck.setup.family`.

    Attributes:
        dimensions: Of the arm.
        names: Of the coordinates.
        lower: Of the coordinates, [rad] and [m].
        upper: Likewise.
        periodic: psi comes back after a turn.
        insertion: Which coordinate drives the needle.
    """

    dimensions: Dimensions
    names: tuple[str, ...] = ("psi", "q7", "q8")
    lower: tuple[float, ...] = (0.0, LIMITS["q7"][0], LIMITS["q8"][0])
    upper: tuple[float, ...] = (2.0 * math.pi, LIMITS["q7"][1], LIMITS["q8"][1])
    periodic: tuple[bool, ...] = (True, False, False)
    insertion: int = 2

    def configurations(
        self,
        tip: ArrayLike,
        direction: ArrayLike,
        x: ArrayLike,
        turns: ArrayLike | None = None,
    ) -> Array:
        """Joint positions q1..q8 at coordinates x (n, 3); limits are not looked at.

        Args:
            tip: Needle tip in the scanner's frame I, (3,), [m].
            direction: Unit vector along the needle, (3,).
            x: psi, q7 [rad], q8 [m].
            turns: Rotation vectors, (m, 3), [rad], by which the needle is turned about
                its tip, and the roll with it.

        Returns:
            (n, 8), with turns (n, m, 8); NaN where |q5| would be 90 deg.
        """
        d, at = self.dimensions, np.asarray(x, float)
        given = np.asarray(direction, float)
        p8, n = seen_from_base(d, np.asarray(tip, float), given)
        e1, e2 = roll_axes(n)
        psi, q7, q8 = at.T
        x8 = np.outer(np.cos(psi), e1) + np.outer(np.sin(psi), e2)
        if turns is None:
            return standing(d, p8, n, x8, q7, q8)
        _, seen = seen_from_base(d, np.zeros(3), np.asarray(turns, float))
        R = rotations(seen)
        entry = p8 + d.ahead * n
        needles, rolled = R @ n, np.einsum("mij,nj->nmi", R, x8)
        return standing(
            d, entry - d.ahead * needles, needles, rolled, q7[:, None], q8[:, None]
        )

    def spread(
        self,
        tip: ArrayLike,
        direction: ArrayLike,
        x: ArrayLike,
        half: ArrayLike,
        turn: ArrayLike | None = None,
    ) -> "Spread":
        """How far anything can be from where it is in the middle of boxes.

        Args:
            tip: As for `configurations`.
            direction: Likewise.
            x: Middles of the boxes, (n, 3).
            half: Half their sizes, (n, 3).
            turn: A rotation vector, (3,), by which the needle is turned; or None.
        """
        return Spread.of(self, tip, direction, np.asarray(x), np.asarray(half), turn)


@dataclass(frozen=True, eq=False)
class Spread:
    """Bounds over boxes of (psi, q7, q8); rows are boxes, vectors are the base's.

    z6 turns by psi (times cos q7) and by q7, square to each other; its angle to the arm
    gives q5, its direction about the arm q4; x5 turns with both, faster than z6 by
    tan|q5| at most.

    Attributes:
        q: In the middle, (n, 8).
        joints: |q - q_middle| at most, (n, 8); `NO_BOUND` where there is none.
        axes: How far the axes of q1 to q8 turn at most, (n, 8), [rad].
        origins: How far a point on each axis moves at most, (n, 8), [m].
    """

    q: Array
    joints: Array
    axes: Array
    origins: Array
    _half: Array
    _lines: Mapping[str, Array]
    _turns: Mapping[str, Array]

    @staticmethod
    def of(
        family: Family,
        tip: ArrayLike,
        direction: ArrayLike,
        x: Array,
        half: Array,
        turn: ArrayLike | None,
    ) -> "Spread":
        """See `Family.spread`."""
        d = family.dimensions
        p8, n = seen_from_base(d, np.asarray(tip, float), np.asarray(direction, float))
        entry = p8 + d.ahead * n
        e1, e2 = roll_axes(n)
        if turn is not None:
            R = rotations(
                np.asarray(seen_from_base(d, np.zeros(3), np.asarray(turn, float))[1])[
                    None
                ]
            )[0]
            n, e1, e2 = R @ n, R @ e1, R @ e2
        lines = _lines(d, entry, n, (e1, e2), x)
        q = standing(d, entry - d.ahead * n, n, lines["x8"], x[:, 1], x[:, 2])
        turns = _turns(q, x, half)
        found = Spread(q, q, q, q, half, lines, turns)
        back = found.points("back", lines["p6"][:, None])[:, 0]
        p5 = back + d.a6 * turns["x5"]
        zero = 0.0 * p5
        axes = [zero] * 4 + [turns["q4"], turns["z6"], half[:, 0], zero]
        joints = [p5, p5, p5, turns["q4"], turns["z6"], turns["q6"], *half.T[1:]]
        p7 = found.points("tip", lines["p7"][:, None])[:, 0]
        origins = [p5, p5, p5, p5, p5, back, p7, zero]
        turns = {**turns, "p5": p5}
        return Spread(
            q,
            np.stack(joints, 1),
            np.stack(axes, 1),
            np.stack(origins, 1),
            half,
            lines,
            turns,
        )

    def points(self, body: str, at: Array) -> Array:
        """How far points of a body can be from `at`, (n, k), [m].

        Args:
            body: A link with geometry.
            at: Where they are in the middle, (n, k, 3), seen from the base.
        """
        frame, lines, turns = BODIES[body], self._lines, self._turns
        psi, _, q8 = (self._half[:, k, None] for k in range(3))
        if frame == "W":
            return np.zeros(at.shape[:2])
        if frame in "1234":
            p5 = turns["p5"][:, None] + np.zeros(at.shape[:2])
            if frame != "4":
                return p5
            off = at - lines["p5"][:, None]
            return p5 + np.linalg.norm(off[..., 1:], axis=2) * turns["q4"][:, None]
        aside = _aside(at, lines["tip"], lines["n"])
        if frame == "8":
            return aside * psi
        if frame == "7":
            return np.sqrt(q8**2 + (aside * psi) ** 2)
        if frame == "6":
            return self._mid(at)
        off = at - lines["p6"][:, None]
        along = np.einsum("nki,ni->nk", off, lines["x5"])
        across = np.sqrt(np.maximum((off**2).sum(axis=2) - along**2, 0.0))
        start = self._mid(lines["p6"][:, None])
        return (
            start + np.abs(along) * turns["x5"][:, None] + across * turns["q4"][:, None]
        )

    def _mid(self, at: Array) -> Array:
        """As if q7 turned first, then all of it about and along the needle."""
        lines = self._lines
        psi, q7, q8 = (self._half[:, k, None] for k in range(3))
        aside = _aside(at, lines["tip"], lines["n"])
        lever = np.linalg.norm(
            np.cross(at - lines["p7"][:, None], lines["z7"][:, None]), axis=2
        )
        far = aside + lever * q7
        return lever * q7 + np.sqrt(q8**2 + (far * psi) ** 2)


def _aside(at: Array, tip: Array, n: Array) -> Array:
    """Distances of points (n, k, 3) from the needle's line."""
    off = at - tip
    along = off @ n
    return np.sqrt(np.maximum((off**2).sum(axis=2) - along**2, 0.0))


def _lines(
    d: Dimensions, tip: Array, n: Array, axes: tuple[Array, Array], x: Array
) -> dict[str, Array]:
    """Places and directions in the middles, as in `inverse.standing`."""
    psi, q7, q8 = x.T
    x8 = np.outer(np.cos(psi), axes[0]) + np.outer(np.sin(psi), axes[1])
    x6 = times(np.sin(q7), x8) + np.outer(np.cos(q7), n)
    z6 = times(np.cos(q7), x8) - np.outer(np.sin(q7), n)
    z7 = np.cross(x8, n)
    S5, C5 = z6[:, 0], np.maximum(np.hypot(z6[:, 1], z6[:, 2]), 1e-12)
    x4 = np.stack([0.0 * S5, z6[:, 1] / C5, z6[:, 2] / C5], axis=1)
    x5 = times(C5, np.tile([1.0, 0.0, 0.0], (len(x), 1))) - times(S5, x4)
    p7 = tip - d.ahead * n - np.outer(d.d8 + q8, n) - d.a8 * x8
    p6 = p7 - d.d7 * z7 - d.a7 * x6
    return {
        **{"tip": tip, "n": n, "x8": x8, "z7": z7, "x5": x5},
        **{"p7": p7, "p6": p6, "p5": p6 - d.a6 * x5},
    }


def _turns(q: Array, x: Array, half: Array) -> dict[str, Array]:
    """Bounds of how far axes and angles turn over the boxes, [rad]."""
    psi, q7 = half[:, 0], half[:, 1]
    cosine = np.minimum(np.abs(np.cos(x[:, 1])) + q7, 1.0)
    sine = np.minimum(np.abs(np.sin(x[:, 1])) + q7, 1.0)
    z6 = np.hypot(psi * cosine, q7)
    farthest = np.abs(q[:, 4]) + z6
    none = ~(farthest < MOST_Q5)
    farthest = np.where(none, 0.0, farthest)
    bounds = {
        "z6": z6,
        "q4": z6 / np.cos(farthest),
        "x5": z6 * np.maximum(1.0, np.tan(farthest)),
        "q6": psi * sine + z6 * np.tan(farthest),
    }
    return {name: np.where(none, NO_BOUND, v) for name, v in bounds.items()}


def family(**arguments: str | float) -> Family:
    """The family of the arm that the robot's arguments ask for."""
    return Family(from_arguments(arguments))


def rotations(vectors: ArrayLike) -> Array:
    """Rotations (m, 3, 3) by rotation vectors (m, 3): Rodrigues, as in eq. (23)."""
    w = np.asarray(vectors, float)
    angle = np.linalg.norm(w, axis=1)
    axis = w / np.where(angle > 0.0, angle, 1.0)[:, None]
    K = np.zeros((len(w), 3, 3))
    K[:, 2, 1], K[:, 0, 2], K[:, 1, 0] = axis.T
    K -= np.swapaxes(K, 1, 2)
    s, v = np.sin(angle)[:, None, None], 2.0 * np.sin(0.5 * angle)[:, None, None] ** 2
    return np.asarray(np.eye(3) + s * K + v * (K @ K))
