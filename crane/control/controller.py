"""The local controller: from the needle's error to joint setpoints, eqs. (28), (29)."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.kinematics import jacobian
from crane.least_squares import ROWS, damped_inverse, needle_error

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gains:
    """Of the loop; the printed ones are lost.

    Attributes:
        K_ee: Part of the error taken back in a period, one for the five rows, or (n,)
            for loops side by side; assumed 0.3.
        K_null: Part of the way back to the preferred configuration, in the null space;
            assumed 0.1.
        damping: lambda^2; assumed, small beside the singular values within limits.
        feed_forward: Whether the target's own motion is added.
    """

    K_ee: float | Array = 0.3
    K_null: float = 0.1
    damping: float = 1e-6
    feed_forward: bool = field(default=False)

    def __post_init__(self) -> None:
        """Refuses what is no gain; a loop beyond its limit may be wanted, and swings.

        Raises:
            ValueError: A gain is negative or not finite, or K_ee is no (n,).
        """
        for name in ("K_ee", "K_null", "damping"):
            value = np.asarray(getattr(self, name), float)
            if not (np.isfinite(value).all() and (value >= 0.0).all()):
                raise ValueError(f"{name} = {getattr(self, name)!r} is no gain")
        if np.ndim(self.K_ee) > 1:
            raise ValueError(f"K_ee {np.shape(self.K_ee)}: one number, or (n,)")


def updated(
    q_sp: Array,
    q_hat: Array,
    T_hat: Array,
    T_target: Array,
    gains: Gains,
    preferred: ArrayLike,
    T_next: Array | None = None,
) -> Array:
    """The next setpoints, (n, 8).

    Args:
        q_sp: Setpoints, (n, 8).
        q_hat: Estimated configurations, where the Jacobian is taken, (n, 8).
        T_hat: Poses of frame 8 by the tracker, (n, 4, 4).
        T_target: Poses asked for, (n, 4, 4).
        gains: Of the loop.
        preferred: q*, (8,): the configuration of the device's setup.
        T_next: Targets of the next period, for the feed-forward.
    """
    e = needle_error(T_hat, T_target)
    wish = np.atleast_1d(np.asarray(gains.K_ee, float))[:, None] * e
    if gains.feed_forward and T_next is not None:
        wish = wish + needle_error(T_target, T_next)
    J = jacobian(q_hat)[:, ROWS, :]
    J_plus = damped_inverse(J, np.full(len(J), gains.damping))
    back = gains.K_null * (np.asarray(preferred, float) - q_hat)
    null = back - np.einsum("nij,njk,nk->ni", J_plus, J, back)
    return np.asarray(q_sp + np.einsum("nij,nj->ni", J_plus, wish) + null)
