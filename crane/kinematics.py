"""CRANE's kinematics in closed form; numpy only.

[CRANE] Table IV in Craig's form, T(i-1, i) = Rx(alpha) Tx(a) Rz(theta) Tz(d), frame 0
after a fixed Rx(90 deg) of the base: p(0, 0, q1, 0), p(-90, 0, q2, 90),
p(90, 0, q3, 0), r(0, 0, 0, q4 + 90), r(90, 0, 0, q5 + 90), r(90, a6, 0, q6),
r(-90, a7, d7, q7 - 90), then the guide (-90, a8, d8 + q8, 0).

Nothing here multiplies those rows: the axes they imply are written out. The arm lies
along x of the base, q4 rolls it about x, q5 and q7 pitch, q6 yaws, the needle is z of
frame 8. S4 is sin(q4), C4 is cos(q4).
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck_models.closed_form import Solutions as Solutions
from crane.branches import times
from crane.dimensions import Dimensions as Dimensions
from crane.dimensions import dimensions as dimensions
from crane.dimensions import from_arguments
from crane.inverse import inverse as inverse

Array = NDArray[np.float64]

FRAMES = ("I", "W", *"012345678", "needle_tip")

# Every body is drawn in the frame it moves with.
BODIES: Mapping[str, str] = MappingProxyType(
    {
        **{"portal": "W", "trolley": "1", "mast": "2", "slide": "3", "tube": "4"},
        **{"back": "5", "mid": "6", "tip": "7", "carriage": "8", "needle": "8"},
    }
)

REVOLUTE = ("4", "5", "6", "7")
JOINTS = tuple(f"q{i}" for i in range(1, 9))

_NOTHING: Mapping[str, float] = MappingProxyType({})


def forward(
    q: ArrayLike, *, perturbed: Mapping[str, float] = _NOTHING, **arguments: str | float
) -> dict[str, Array]:
    """Placement of every frame of CRANE in the scanner's frame I (isocentre).

    Args:
        q: q1..q8, (8,) or (n, 8), [m], q4 to q7 [rad].
        perturbed: Added to dimensions by name, to show that each of them is seen.
        **arguments: As of the xacro file: base_x, base_y, base_z, base_yaw and
            needle_ahead.

    Returns:
        {frame: T_I_frame}, (4, 4) or (n, 4, 4): I, W (the base), 0 to 8 of Table IV,
        needle_tip, and the bodies by their links' names.
    """
    d = from_arguments(arguments, perturbed)
    q1, q2, q3, q4, q5, q6, q7, q8 = _joint_values(q)
    one = np.ones_like(q1)
    x, y, z = (times(one, axis) for axis in _base_axes(d))
    origin = np.array([d.base_x, d.base_y, d.base_z])
    p1 = origin - times(q1, y)
    p2 = p1 + times(q2, z)
    p4 = p2 + times(q3, x)
    x4, z5 = _turned(-q4, z, y)
    x5, z6 = _turned(-q5, x, x4)
    x6, z7 = _turned(q6, x5, z5)
    n, x7 = _turned(-q7, x6, z6)
    p6 = p4 + d.a6 * x5
    p7 = p6 + d.a7 * x6 + d.d7 * z7
    p8 = p7 + d.a8 * x7 + times(d.d8 + q8, n)
    placed = {
        "I": _frame(times(one, np.eye(3)[0]), times(one, np.eye(3)[2]), 0 * p1),
        "W": _frame(x, z, origin + 0 * p1),
        "0": _frame(x, -y, origin + 0 * p1),
        "1": _frame(x, -y, p1),
        "2": _frame(y, z, p2),
        "3": _frame(y, x, p4),
        "4": _frame(x4, x, p4),
        "5": _frame(x5, z5, p4),
        "6": _frame(x6, z6, p6),
        "7": _frame(x7, z7, p7),
        "8": _frame(x7, n, p8),
        "needle_tip": _frame(x7, n, p8 + d.ahead * n),
    }
    return placed | {body: placed[frame] for body, frame in BODIES.items()}


def jacobian(
    q: ArrayLike,
    frame: str = "8",
    *,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Array:
    """The body Jacobian: how a frame at the needle moves, seen in itself.

    Args:
        q: q1..q8, (8,) or (n, 8).
        frame: "8" (what a needle's pose constrains) or "needle_tip".
        perturbed: As for `forward`.
        **arguments: As for `forward`.

    Returns:
        (6, 8) or (n, 6, 8): rows velocity along x, y, z of the frame [m/..], then
        angular velocity about them [rad/..]; [CRANE] eq. (16).

    Raises:
        ValueError: Another frame.
    """
    if frame not in ("8", "needle_tip"):
        raise ValueError(f"a Jacobian is given for 8 and needle_tip, not for {frame!r}")
    T = forward(q, perturbed=perturbed, **arguments)
    J = _twists(T, T[frame][..., :3, 3])
    back = np.swapaxes(T[frame][..., :3, :3], -1, -2)
    return np.concatenate([back @ J[..., :3, :], back @ J[..., 3:, :]], axis=-2)


def space_jacobian(
    q: ArrayLike, *, perturbed: Mapping[str, float] = _NOTHING, **arguments: str | float
) -> Array:
    """The space Jacobian: each joint's twist in the scanner's frame I.

    Args:
        q: q1..q8, (8,) or (n, 8).
        perturbed: As for `forward`.
        **arguments: As for `forward`.

    Returns:
        (6, 8) or (n, 6, 8): rows velocity of the point that is at the isocentre, then
        angular velocity, both along the axes of I.
    """
    T = forward(q, perturbed=perturbed, **arguments)
    return _twists(T, np.zeros(3))


def manipulability(
    q: ArrayLike, *, perturbed: Mapping[str, float] = _NOTHING, **arguments: str | float
) -> Array:
    """How well the needle's direction can be changed: mu of [CRANE] eq. (25).

    mu is sqrt(det(J J^T)) of the roll and pitch rows of the body Jacobian. By Cauchy
    and Binet its square is the sum over pairs of revolute axes of (n . (z_i x z_j))^2,
    which takes no difference of large numbers.

    Args:
        q: q1..q8, (8,) or (n, 8).
        perturbed: As for `forward`.
        **arguments: As for `forward`.

    Returns:
        mu, () or (n,), without unit; 0 is singular.
    """
    T = forward(q, perturbed=perturbed, **arguments)
    n = T["8"][..., :3, 2]
    axes = [T[frame][..., :3, 2] for frame in REVOLUTE]
    total = np.zeros(n.shape[:-1])
    for i in range(len(axes)):
        for j in range(i):
            total += np.sum(n * np.cross(axes[i], axes[j]), axis=-1) ** 2
    return np.sqrt(total)


def _twists(T: Mapping[str, Array], point: Array) -> Array:
    """Velocity of a point fixed to the last link, and angular velocity, per joint."""
    J = np.zeros((*T["8"].shape[:-2], 6, 8))
    for column in range(8):
        axis = T[str(column + 1)][..., :3, 2]
        if str(column + 1) not in REVOLUTE:
            J[..., :3, column] = axis
            continue
        J[..., :3, column] = np.cross(axis, point - T[str(column + 1)][..., :3, 3])
        J[..., 3:, column] = axis
    return J


def _base_axes(d: Dimensions) -> Array:
    """Axes of the base in I, one a row."""
    c, s = np.cos(d.base_yaw), np.sin(d.base_yaw)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _turned(angle: Array, u: Array, v: Array) -> tuple[Array, Array]:
    """The perpendicular axes u and v, turned by an angle from u towards v."""
    C, S = np.cos(angle), np.sin(angle)
    return times(C, u) + times(S, v), times(C, v) - times(S, u)


def _frame(x: Array, z: Array, origin: Array) -> Array:
    T = np.zeros((*origin.shape[:-1], 4, 4))
    T[..., :3, 0], T[..., :3, 1], T[..., :3, 2] = x, np.cross(z, x), z
    T[..., :3, 3], T[..., 3, 3] = origin, 1.0
    return T


def _joint_values(q: ArrayLike) -> tuple[Array, ...]:
    q = np.asarray(q, dtype=np.float64)
    if q.shape[-1:] != (8,):
        raise ValueError(f"q has shape {q.shape}; its last axis is q1..q8")
    return tuple(q[..., i] for i in range(8))
