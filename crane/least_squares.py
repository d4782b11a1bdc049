"""The paper's numerical inverse: damped least squares for a needle, for any chain.

[CRANE] section V-B: Levenberg and Marquardt's method with the damped inverse of
eqs. (28), (29), position and axis errors of eqs. (18), (19), tolerances of eq. (20),
some joints held if wished. The error and the Jacobian stand in the frame of the needle,
five rows (x, y, z, w_x, w_y): its roll is free. Many problems are solved side by side.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ROWS = (0, 1, 2, 3, 4)  # of the body Jacobian: all but the roll about the needle

# Closer than this to opposite, rounding alone chooses the axis of eq. (19).
OPPOSITE = 1e-12


@dataclass(frozen=True)
class Chain:
    """What is asked of an arm.

    Attributes:
        forward: Pose of the needle's frame, z along it: (n, dof) to (n, 4, 4).
        jacobian: Body Jacobian of that frame, velocity first: (n, dof) to (n, 6, dof).
        lower: Limits (dof,), or None for joints without.
        upper: Likewise.
    """

    forward: Callable[[Array], Array]
    jacobian: Callable[[Array], Array]
    lower: Array | None = None
    upper: Array | None = None


@dataclass(frozen=True)
class Settings:
    """How far, how long, how damped.

    The tolerances are those of a public script of the paper's author, as eq. (20)'s are
    lost; all other numbers are assumed: they change the path taken, not the answer.

    Attributes:
        position: Tolerance, [m].
        angle: Tolerance, [rad].
        steps: The most steps that are tried.
        length: One radian counts as much as this length, [m]; a link of Table IV.
        damping: lambda^2 at the start, of rows measured in `length` and rad.
        pull: Gain of the null-space term, 0 for none.
    """

    position: float = 0.5e-3
    angle: float = 0.06
    steps: int = 200
    length: float = 0.07
    damping: float = 1e-2
    pull: float = 0.0

    def __post_init__(self) -> None:
        """Refuses numbers with which nothing is found, or which never end.

        Raises:
            ValueError: There is one.
        """
        for name in ("position", "angle", "length", "damping"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise ValueError(f"{name} = {value!r} must be positive and finite")
        if not 0.0 <= self.pull < np.inf:
            raise ValueError(f"pull = {self.pull!r} is not 0 or more")
        if not self.steps >= 1 or self.steps != int(self.steps):
            raise ValueError(f"steps = {self.steps!r}: a whole number from 1 up")


PAPER = Settings()
TIGHT = Settings(position=1e-10, angle=1e-10)

# Joints stopped by limits may leave J without full rank: never undamped.
LEAST = 1e-10
STALLED = 1e10  # damping beyond which no step that still helps is to be found


@dataclass(frozen=True)
class Found:
    """The answers, one row a problem.

    Attributes:
        q: (n, dof); where the search ended, whatever it found.
        converged: Within both tolerances, (n,).
        stalled: At a local minimum: no direction lessens the error, (n,).
        iterations: Steps that were tried, accepted or not, (n,).
        position: Remaining error, [m], (n,).
        angle: Remaining error of the axis, [rad], (n,).
    """

    q: Array
    converged: Mask
    stalled: Mask
    iterations: NDArray[np.int_]
    position: Array
    angle: Array


def axis_error(z1: ArrayLike, z2: ArrayLike) -> Array:
    """The turn that takes axis z1 to axis z2, [rad] about its direction; eq. (19).

    Args:
        z1: Unit axes, (..., 3).
        z2: Unit axes, (..., 3).

    Raises:
        ValueError: Two axes are opposite: every axis square to them would do, so eq.
            (19) names none.
    """
    turn, undefined = _axis_error(np.asarray(z1, float), np.asarray(z2, float))
    if undefined.any():
        raise ValueError(
            "the needle and its target point in exactly opposite directions: eq. (19) "
            "is undefined there; begin from another configuration"
        )
    return turn


def needle_error(T: ArrayLike, T_target: ArrayLike) -> Array:
    """What is missing to the target, seen in the needle's own frame; eqs. (18), (19).

    Args:
        T: Poses of the needle, (..., 4, 4), z along it.
        T_target: Poses asked for, (..., 4, 4); their roll does not matter.

    Returns:
        (..., 5): x, y, z [m], then the turn about x and y [rad]. The order of the
        arguments is that of a feedback: target minus what is.

    Raises:
        ValueError: Opposite axes, as for `axis_error`.
    """
    T, T_target = np.asarray(T, float), np.asarray(T_target, float)
    axis_error(T[..., :3, 2], T_target[..., :3, 2])
    return _needle_error(T, T_target)[0]


def solve(
    chain: Chain,
    targets: ArrayLike,
    starts: ArrayLike,
    settings: Settings = PAPER,
    *,
    held: Sequence[int] = (),
    preferred: ArrayLike | None = None,
) -> Found:
    """Brings the needle to its targets, many at once.

    A joint that stands at its limit and would be driven beyond does not take part in
    that step, and no step leaves the limits.

    Args:
        chain: The arm.
        targets: (n, 4, 4) or (4, 4).
        starts: (n, dof) or (dof,), within the limits.
        settings: Tolerances and the rest.
        held: Joints (from 0) that keep their start, as q5 and q6 do in the paper's
            nominal inverse.
        preferred: Configuration that the null-space term pulls to, (dof,); needs
            `settings.pull`.

    Raises:
        ValueError: A number is not finite, a shape is another, a start is beyond
            limits, or the axes at a start are opposite to their target's.
    """
    targets, q = _checked(chain, targets, starts)
    state = _State.begin(chain, targets, q, settings)
    free, pull_to = _free(q.shape[1], held), _wanted(q.shape[1], preferred)
    for _ in range(settings.steps):
        open_ = np.flatnonzero(~state.converged & ~state.stalled)
        if len(open_) == 0:
            break
        _step(chain, targets, state, open_, free, settings, pull_to)
    return Found(
        state.q,
        state.converged,
        state.stalled,
        state.iterations,
        np.linalg.norm(state.error[:, :3], axis=1),
        np.linalg.norm(state.error[:, 3:], axis=1),
    )


def damped_inverse(J: ArrayLike, damping: ArrayLike) -> Array:
    """J^T (J J^T + lambda^2 I)^-1 of eq. (29).

    Args:
        J: (..., m, n).
        damping: lambda^2, (...).
    """
    J = np.asarray(J, float)
    back = np.swapaxes(J, -1, -2)
    square = J @ back + np.asarray(damping)[..., None, None] * np.eye(J.shape[-2])
    return np.swapaxes(np.linalg.solve(square, J), -1, -2)


@dataclass
class _State:
    """Where every problem stands; rows are rewritten as steps are accepted."""

    q: Array
    error: Array
    damping: Array
    pull: Array
    converged: Mask
    stalled: Mask
    iterations: NDArray[np.int_]

    @classmethod
    def begin(
        cls, chain: Chain, targets: Array, q: Array, settings: Settings
    ) -> "_State":
        error = needle_error(chain.forward(q), targets)
        n = len(q)
        return cls(
            q,
            error,
            np.full(n, settings.damping),
            np.full(n, settings.pull),
            _within(error, settings),
            np.zeros(n, dtype=bool),
            np.zeros(n, dtype=np.int_),
        )


def _step(
    chain: Chain,
    targets: Array,
    state: _State,
    rows: NDArray[np.int_],
    free: Mask,
    settings: Settings,
    preferred: Array | None,
) -> None:
    """One step of all open problems; a step that does not help is not taken."""
    scale = np.array([1.0 / settings.length] * 3 + [1.0] * 2)
    q, e = state.q[rows], state.error[rows] * scale
    J = chain.jacobian(q)[:, ROWS, :] * scale[:, None]
    moving = _moving(chain, q, np.einsum("nij,ni->nj", J, e), free)
    J = J * moving[:, None, :]
    J_plus = damped_inverse(J, state.damping[rows])
    step = np.einsum("nji,ni->nj", J_plus, e)
    if preferred is not None:
        wish = state.pull[rows, None] * (preferred - q) * moving
        step += wish - np.einsum("nji,nik,nk->nj", np.linalg.pinv(J), J, wish)
    tried = _clamped(chain, q + step)
    error, undefined = _needle_error(chain.forward(tried), targets[rows])
    helps = (np.sum((error * scale) ** 2, axis=1) < np.sum(e**2, axis=1)) & ~undefined
    state.iterations[rows] += 1
    good, bad = rows[helps], rows[~helps]
    state.q[good], state.error[good] = tried[helps], error[helps]
    state.damping[good] *= 0.1
    state.damping[bad] *= 10.0
    state.damping[rows] = np.maximum(state.damping[rows], LEAST)
    state.pull[bad] *= 0.25
    state.converged[good] = _within(error[helps], settings)
    state.stalled[rows] = (state.damping[rows] > STALLED) & ~state.converged[rows]


def _moving(chain: Chain, q: Array, downhill: Array, free: Mask) -> Mask:
    """Which joints take part: free ones that no limit stops."""
    moving = np.broadcast_to(free, q.shape).copy()
    if chain.lower is not None:
        moving &= ~((q <= chain.lower) & (downhill < 0.0))
    if chain.upper is not None:
        moving &= ~((q >= chain.upper) & (downhill > 0.0))
    return moving


def _clamped(chain: Chain, q: Array) -> Array:
    if chain.lower is not None:
        q = np.maximum(q, chain.lower)
    return q if chain.upper is None else np.minimum(q, chain.upper)


def _within(error: Array, settings: Settings) -> Mask:
    """Eq. (20)."""
    at = np.linalg.norm(error[:, :3], axis=1) <= settings.position
    return np.asarray(at & (np.linalg.norm(error[:, 3:], axis=1) <= settings.angle))


def _axis_error(z1: Array, z2: Array) -> tuple[Array, Mask]:
    across = np.cross(z1, z2)
    sine = np.linalg.norm(across, axis=-1)
    cosine = np.sum(z1 * z2, axis=-1)
    angle = np.arctan2(sine, cosine)
    # for axes that coincide the angle is its own sine, and the quotient is 1
    per_sine = np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 1.0)
    undefined = (sine < OPPOSITE) & (cosine < 0.0)
    return per_sine[..., None] * across, np.asarray(undefined)


def _needle_error(T: Array, T_target: Array) -> tuple[Array, Mask]:
    away = T_target[..., :3, 3] - T[..., :3, 3]
    turn, undefined = _axis_error(T[..., :3, 2], T_target[..., :3, 2])
    R = T[..., :3, :3]
    at = np.einsum("...ji,...j->...i", R, away)
    # about z nothing is left: the turn is square to the needle by its making
    return np.concatenate([at, np.einsum("...ji,...j->...i", R, turn)[..., :2]], -1), (
        undefined
    )


def _checked(
    chain: Chain, targets: ArrayLike, starts: ArrayLike
) -> tuple[Array, Array]:
    T, q = np.asarray(targets, float), np.asarray(starts, float)
    T, q = T[None] if T.ndim == 2 else T, q[None] if q.ndim == 1 else q
    if T.ndim != 3 or T.shape[1:] != (4, 4) or q.ndim != 2:
        raise ValueError(
            f"targets {T.shape} must be (n, 4, 4) or (4, 4), starts {q.shape} (n, dof) "
            "or (dof,)"
        )
    n = max(len(T), len(q))
    if {len(T), len(q)} - {1, n}:
        raise ValueError(f"{len(T)} targets and {len(q)} starts are not as many")
    T = np.broadcast_to(T, (n, 4, 4))
    q = np.array(np.broadcast_to(q, (n, q.shape[1])))
    if not (np.isfinite(T).all() and np.isfinite(q).all()):
        raise ValueError("a target or a start is not finite")
    for side, limit in (("lower", chain.lower), ("upper", chain.upper)):
        if limit is not None and np.shape(limit) != q.shape[1:]:
            raise ValueError(
                f"{side} limits {np.shape(limit)} are not those of {q.shape[1]} joints"
            )
    if not np.array_equal(_clamped(chain, q), q):
        raise ValueError("a start is beyond the limits")
    return T, q


def _free(dof: int, held: Sequence[int]) -> Mask:
    """Which joints are not held, (dof,)."""
    wrong = [joint for joint in held if not 0 <= joint < dof]
    if wrong:
        raise ValueError(f"held joint {wrong[0]}: there are 0 to {dof - 1}")
    free = np.ones(dof, dtype=bool)
    free[list(held)] = False
    return free


def _wanted(dof: int, preferred: ArrayLike | None) -> Array | None:
    if preferred is None:
        return None
    q = np.asarray(preferred, float)
    if q.shape != (dof,) or not np.isfinite(q).all():
        raise ValueError(f"preferred {q.shape} is not ({dof},) finite numbers")
    return q
