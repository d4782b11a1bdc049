"""Open and closed loop at the controller's pace: joints settle within each period.

Between two periods motors and joints come to rest (`motors.py` has their 1 kHz). In the
closed loop joints reach their setpoints, as encoders see stretch and play; what is left
is the tube, which the tracker alone sees. In the open loop nothing is looked at.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.control.controller import Gains, updated
from crane.control.plant import PERFECT, Plant, followed
from crane.kinematics import forward, jacobian
from crane.least_squares import TIGHT, Chain, needle_error, solve
from crane.refusals import refuse_no_numbers
from crane.transmission import transmission

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Run:
    """What the needle did, a row a period.

    Attributes:
        placed: True poses of frame 8, (steps, n, 4, 4).
        position: Distance to the target, [m], (steps, n).
        angle: Between the needle's axis and the target's, [rad], (steps, n).
        q: Joint positions, (steps, n, 8).
    """

    placed: Array
    position: Array
    angle: Array
    q: Array


def closed_loop(
    plant: Plant,
    targets: Array,
    q0: ArrayLike,
    gains: Gains,
    *,
    delay: int | NDArray[np.int_] = 0,
    rng: np.random.Generator | None = None,
) -> Run:
    """The tracker's pose is fed back, eqs. (27) to (29).

    Args:
        plant: The arm.
        targets: (steps + 1, 4, 4), one a period.
        q0: Where it begins, (8,), or (n, 8) for loops side by side; also q*.
        gains: K_ee may differ from loop to loop.
        delay: Periods by which the tracker is late; one number, or (n,).
        rng: Of the tracker's noise.

    Raises:
        ValueError: Poses, configurations, delays or gains that are none, or not as many
            as each other.
    """
    targets = poses(targets)
    q_sp, late = _side_by_side(q0, gains, delay)
    n = len(q_sp)
    preferred, rows = q_sp.copy(), np.arange(n)
    steps = len(targets) - 1
    seen = np.zeros((steps, n, 4, 4))
    placed, qs = np.zeros((steps, n, 4, 4)), np.zeros((steps, n, 8))
    for k in range(steps):
        placed[k], qs[k] = plant.placement(q_sp), q_sp
        seen[k] = plant.seen(placed[k], rng)
        T_hat = seen[np.maximum(k - late, 0), rows]
        T, T_next = (np.broadcast_to(t, (n, 4, 4)) for t in targets[k : k + 2])
        q_sp = updated(q_sp, q_sp, T_hat, T, gains, preferred, T_next)
    return as_run(placed, qs, targets)


def open_loop(plant: Plant, targets: Array, q0: ArrayLike) -> Run:
    """Motors go where the ideal coupling sends them; no one looks (section VI-B1).

    Args:
        plant: The arm; at `q0` its joints and its encoders were zeroed.
        targets: (steps + 1, 4, 4).
        q0: Where it begins, (8,).

    Raises:
        ValueError: Poses or a configuration that are none.
    """
    targets, q0 = poses(targets), begun_at(q0)
    wanted = ideal(targets[:-1], q0)
    ideal_C, true_C = transmission(), plant.true_coupling()
    pulled = true_C.joints(ideal_C.motors(wanted - q0)) + q0
    q = np.zeros_like(wanted)
    before = pulled[:1]
    for k in range(len(wanted)):
        before = followed(before, pulled[k : k + 1], plant.play)
        q[k] = before[0]
    q = plant.stretched(q)
    return as_run(plant.placement(q)[:, None], q[:, None], targets)


def ideal(targets: Array, q0: ArrayLike) -> Array:
    """Configurations of the undisturbed arm along the targets, (steps, 8)."""
    chain = Chain(lambda q: forward(q)["8"], jacobian)
    begun = solve(chain, targets[:1], q0, TIGHT).q
    follow = Gains(K_ee=1.0, feed_forward=True)
    near = closed_loop(PERFECT, np.append(targets, targets[-1:], 0), begun, follow)
    return solve(chain, targets, near.q[:, 0], TIGHT).q  # close by: the same arm


def poses(targets: ArrayLike) -> Array:
    """Targets, once it is sure that they are such.

    Raises:
        ValueError: They are not (steps + 1, 4, 4) finite numbers, of one step at least.
    """
    T = np.asarray(targets, float)
    if T.ndim != 3 or T.shape[1:] != (4, 4) or len(T) < 2:
        raise ValueError(
            f"targets {T.shape} must be (steps + 1, 4, 4), one step or more"
        )
    refuse_no_numbers(targets=T)
    return T


def begun_at(q0: ArrayLike) -> Array:
    """A configuration (8,), once it is sure that it is one.

    Raises:
        ValueError: It is not.
    """
    q = np.asarray(q0, float)
    if q.shape != (8,):
        raise ValueError(f"q0 {q.shape} must be (8,)")
    refuse_no_numbers(q0=q)
    return q


def _side_by_side(
    q0: ArrayLike, gains: Gains, delay: int | NDArray[np.int_]
) -> tuple[Array, NDArray[np.int_]]:
    """Beginnings (n, 8) and delays (n,) of all loops."""
    q = np.atleast_2d(np.asarray(q0, float))
    if q.ndim != 2 or q.shape[1] != 8 or len(q) == 0:
        raise ValueError(f"q0 {np.shape(q0)} must be (8,) or (n, 8)")
    refuse_no_numbers(q0=q)
    late = np.atleast_1d(np.asarray(delay))
    if late.ndim != 1 or late.dtype.kind not in "iu" or (late < 0).any():
        raise ValueError(f"delay = {delay!r}: whole periods, 0 or more")
    many = (len(q), len(late), np.size(gains.K_ee))
    n = max(many)
    if set(many) - {1, n}:
        raise ValueError(
            "{} beginnings, {} delays and {} gains are not as many".format(*many)
        )
    return np.array(np.broadcast_to(q, (n, 8))), np.broadcast_to(late, (n,))


def as_run(placed: Array, q: Array, targets: Array) -> Run:
    """A run from true poses and joints, a row a period, and its targets."""
    e = needle_error(placed, targets[: len(placed), None])
    at, turn = np.linalg.norm(e[..., :3], axis=-1), np.linalg.norm(e[..., 3:], axis=-1)
    return Run(placed, at, turn, q)
