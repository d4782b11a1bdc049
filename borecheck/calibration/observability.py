"""What samples can show of an arm before anything is measured, and better samples.

The figure of merit is the standard deviation of the needle tip (or any target) that
errors of a given size leave, over poses in which it matters.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines, jacobian
from borecheck.calibration.refinement import UNSEEN, scaled, shown_names
from borecheck.calibration.serial_arm import SerialArm

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Observability:
    """What samples show.

    Attributes:
        condition: Of the Jacobian with columns of length 1; infinite if something is
            not seen.
        unseen: Parameters that can change without any sample moving.
        weakest: Parameters that the weakest direction is made of, strongest first.
        tip_sigma: Standard deviation of the tip for errors of the given size, root mean
            square over the poses, [m]; infinite if something is not seen.
    """

    condition: float
    unseen: tuple[str, ...]
    weakest: tuple[str, ...]
    tip_sigma: float


def observe(
    arm: SerialArm,
    q: Array,
    target: Array,
    sigma: float,
    poses: Array,
    lines: Lines | None = None,
) -> Observability:
    """What samples at these joint values would show.

    Args:
        arm: The arm.
        q: Joint values of the samples, (n, k), [rad].
        target: The target at zero, (3,), [m].
        sigma: Standard deviation of a measured coordinate, [m].
        poses: Joint values at which the target's place matters, (m, k).
        lines: The axes; the nominal ones by default.
    """
    lines = arm.lines if lines is None else lines
    J = jacobian(lines, q, target).reshape(3 * len(q), -1)
    _, singular, Vt = np.linalg.svd(scaled(J), full_matrices=True)
    singular = np.pad(singular, (0, len(Vt) - len(singular)))
    blind = singular < UNSEEN * singular[0]
    weakest = tuple(shown_names(arm, lines, Vt[-1:]))
    if blind.any():
        unseen = tuple(shown_names(arm, lines, Vt[blind]))
        return Observability(np.inf, unseen, weakest, np.inf)
    tip = jacobian(lines, poses, target).reshape(3 * len(poses), -1)
    C = sigma**2 * np.linalg.inv(J.T @ J)
    variance = np.einsum("ij,jk,ik->", tip, C, tip) / len(poses)
    condition = float(singular[0] / singular[-1])
    return Observability(condition, (), weakest, float(np.sqrt(variance)))


def design(
    arm: SerialArm,
    candidates: Array,
    count: int,
    target: Array,
    poses: Array,
) -> NDArray[np.intp]:
    """The candidates that together leave the tip least uncertain, found greedily.

    Each step adds the candidate that lowers the tip's variance most, then weak ones are
    exchanged until nothing improves. Deterministic.

    Args:
        arm: The arm.
        candidates: Joint values that can be measured at, (n, k), [rad].
        count: How many to choose.
        target: The target at zero, (3,), [m].
        poses: Joint values at which the target's place matters, (m, k).

    Returns:
        Indices of the chosen candidates, (count,), sorted.
    """
    J = jacobian(arm.lines, candidates, target)
    tip = jacobian(arm.lines, poses, target).reshape(3 * len(poses), -1)
    M = tip.T @ tip / len(poses)
    # a weak prior makes the first steps defined; it is far below what samples say
    information = 1e-6 * np.diag(np.maximum((J**2).sum(axis=(0, 1)) / len(J), 1e-9))
    chosen: list[int] = []
    for _ in range(count):
        best = _best_addition(information, J, M, chosen)
        chosen.append(best)
        information = information + J[best].T @ J[best]
    _exchange(information, J, M, chosen)
    return np.array(sorted(chosen), dtype=np.intp)


def _best_addition(information: Array, J: Array, M: Array, taken: list[int]) -> int:
    """The sample that lowers trace(M C) most: C - C J' (I + J C J')^-1 J C."""
    C = np.linalg.inv(information)
    JC = J @ C
    inner = np.eye(3) + JC @ np.swapaxes(J, 1, 2)
    gain = np.einsum(
        "nij,nji->n", np.linalg.solve(inner, JC @ M @ C), np.swapaxes(J, 1, 2)
    )
    gain[taken] = -np.inf
    return int(np.argmax(gain))


def _exchange(information: Array, J: Array, M: Array, chosen: list[int]) -> None:
    """Exchanges chosen samples for better ones, in place."""
    for _ in range(2):
        changed = False
        for k in range(len(chosen)):
            old = chosen[k]
            without = information - J[old].T @ J[old]
            best = _best_addition(without, J, M, [c for c in chosen if c != old])
            if best != old:
                chosen[k] = best
                information = without + J[best].T @ J[best]
                changed = True
        if not changed:
            return
