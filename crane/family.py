"""CRANE's configurations for one needle by (psi, q7, q8), and bounds of their motion.

psi is the roll about the needle, measured as in `crane.inverse.roll_axes`. One
configuration everywhere but at |q5| = 90 deg; numpy only.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.branches import seen_from_base
from crane.dimensions import LIMITS, Dimensions, from_arguments
from crane.inverse import roll_axes, standing

Array = NDArray[np.float64]


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
