"""Zerobot's kinematics in closed form, element by element as [Matsuno2020] prints it.

Nothing here multiplies joint transforms: eqs. (2) and (3) and the products they imply
are written out, so that agreement with a URDF engine says something.
S4 is sin(q4), C4 is cos(q4), s is sin(alpha_3) = +1 or -1 (cos(alpha_3) is 0).
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck_models.closed_form import Solutions as Solutions
from zerobot.bodies import BODIES, LEVEL_PARTS, Origins, place_bodies
from zerobot.dimensions import Dimensions as Dimensions
from zerobot.dimensions import dimensions as dimensions
from zerobot.dimensions import from_arguments
from zerobot.inverse import inverse as inverse
from zerobot.inverse import remote_centre as remote_centre

Array = NDArray[np.float64]
Rotation = Sequence[Sequence[ArrayLike]]

PAPER_FRAMES = ("W", "0", "1", "2", "3", "4", "5", "6", "E")
FRAMES = (*PAPER_FRAMES, *BODIES)

_NOTHING: Mapping[str, float] = MappingProxyType({})


def forward(
    q: ArrayLike, *, perturbed: Mapping[str, float] = _NOTHING, **arguments: str | float
) -> dict[str, Array]:
    """Placement of every frame of the paper in the world frame W.

    Args:
        q: Joint positions q1..q6, (6,) or (n, 6), [m] (q4, q5: [rad]).
        perturbed: Added to dimensions by name, to show that each of them is seen.
        **arguments: As of the xacro file, see `dimensions.from_arguments`.

    Returns:
        {frame: T_W_frame}, (4, 4) or (n, 4, 4), for W, 0..6 and E,
        [Matsuno2020] eqs. (2), (3), and for the bodies that hang on them.
    """
    d = from_arguments(arguments, perturbed)
    q1, q2, q3, q4, q5, q6 = _joint_values(q, d)
    s, S4, C4, S5, C5 = d.mount_sign, np.sin(q4), np.cos(q4), np.sin(q5), np.cos(q5)
    # Sigma_1 to Sigma_3 and the origin of Sigma_4 follow from Table 1, as (2) does.
    x, y, z = -d.l4 - q2, d.l3 - q3 - d.l5, q1 + d.l6
    y5, z5 = y + d.l2 * S4 * s, z - d.l2 * C4
    x6, y6, z6 = x + s * d.l1 - q6 * S5 * s, y5 + q6 * S4 * C5 * s, z5 - q6 * C4 * C5
    needle: Rotation = [
        [-C5 * s, 0, -S5 * s],
        [-S4 * S5 * s, C4 * s, S4 * C5 * s],
        [C4 * S5, S4, -C4 * C5],
    ]
    holder: Rotation = [
        [-C5 * s, S5 * s, 0],
        [-S4 * S5 * s, -S4 * C5 * s, C4 * s],
        [C4 * S5, C4 * C5, S4],
    ]
    base: Rotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    frames = {
        "W": _stack([[1, 0, 0], [0, 1, 0], [0, 0, 1]], 0.0 * q1, 0, 0),
        "0": _stack(base, -d.l4 + 0.0 * q1, -d.l5, d.l6),
        "1": _stack(base, -d.l4, -d.l5, z),
        "2": _stack([[0, 0, -1], [0, 1, 0], [1, 0, 0]], x, -d.l5, z),
        "3": _stack([[0, -1, 0], [0, 0, -1], [1, 0, 0]], x, y, z),
        "4": _stack(_level_rotation(s, S4, C4), x + s * d.l1, y, z),
        "5": _stack(holder, x + s * d.l1, y5, z5),
        "6": _stack(needle, x6, y6, z6),
        "E": _stack(needle, *_tip(d, q1, q2, q3, q4, q5, q6)),
    }
    at = Origins(*(frames[name][..., :3, 3] for name in (*"123456", "E")))
    level_parts = str(arguments.get("level_parts", LEVEL_PARTS[0]))
    return frames | place_bodies(d, q4, q5, at, level_parts)


def level_part(
    q: ArrayLike,
    pivot: Sequence[float],
    *,
    perturbed: Mapping[str, float] = _NOTHING,
    **arguments: str | float,
) -> Array:
    """Placement of a part that the parallelogram keeps level, in the world frame W.

    The paper gives W_T_4 "for expressing posture" of the parts that do not incline with
    q5. That is the orientation; a part that hangs on the needle holder moves with its
    pivot there, which W_T_4 alone misses by 2 |pivot| sin(q5 / 2).

    Args:
        q: Joint positions, (6,) or (n, 6).
        pivot: Where the part turns on the needle holder, in frame 5, (3,), [m].
        perturbed: As for `forward`.
        **arguments: As for `forward`.

    Returns:
        T_W_part, (4, 4) or (n, 4, 4): origin at the pivot, axes of frame 4.
    """
    d = from_arguments(arguments, perturbed)
    q1, q2, q3, q4, q5, _ = _joint_values(q, d)
    s, S4, C4, S5, C5 = d.mount_sign, np.sin(q4), np.cos(q4), np.sin(q5), np.cos(q5)
    cx, cy, cz = (float(value) for value in pivot)
    # along the arm's drop (x_4), before q4 turns it
    drop = d.l2 - cx * S5 - cy * C5
    return _stack(
        _level_rotation(s, S4, C4),
        -q2 + s * d.l1 - d.l4 + s * (cy * S5 - cx * C5),
        d.l3 - q3 - d.l5 + s * (S4 * drop + C4 * cz),
        q1 + d.l6 - C4 * drop + S4 * cz,
    )


def jacobian(
    q: ArrayLike, *, perturbed: Mapping[str, float] = _NOTHING, **arguments: str | float
) -> Array:
    """How the needle tip moves with the joints, in the world frame W.

    Args:
        q: Joint positions, (6,).
        perturbed: As for `forward`.
        **arguments: As for `forward`.

    Returns:
        (6, 6): rows velocity of the tip x, y, z [m/..], then angular velocity [rad/..];
        columns q1..q6.
    """
    d = from_arguments(arguments, perturbed)
    _, _, _, q4, q5, q6 = _joint_values(q, d)
    s, S4, C4, S5, C5 = d.mount_sign, np.sin(q4), np.cos(q4), np.sin(q5), np.cos(q5)
    L, l7, ly = q6 + d.l9 + d.lE + d.tip_offset_z, d.l7 - d.tip_offset_x, d.tip_offset_y
    rho = d.l2 + L * C5 + l7 * S5
    g = l7 * C5 - L * S5
    return np.array(
        [
            [0, -1, 0, 0, -s * (L * C5 + l7 * S5), -s * S5],
            [0, 0, -1, s * (C4 * rho - S4 * ly), s * S4 * g, s * S4 * C5],
            [1, 0, 0, S4 * rho + C4 * ly, -C4 * g, -C4 * C5],
            [0, 0, 0, s, 0, 0],
            [0, 0, 0, 0, s * C4, 0],
            [0, 0, 0, 0, S4, 0],
        ]
    )


def _tip(
    d: Dimensions, q1: Array, q2: Array, q3: Array, q4: Array, q5: Array, q6: Array
) -> tuple[Array, Array, Array]:
    """Position of the needle tip in W: eq. (3), plus its calibration offset."""
    s, S4, C4, S5, C5 = d.mount_sign, np.sin(q4), np.cos(q4), np.sin(q5), np.cos(q5)
    L, l7, ly = q6 + d.l9 + d.lE + d.tip_offset_z, d.l7 - d.tip_offset_x, d.tip_offset_y
    rEx = d.l3 - q3 + d.l2 * S4 * s + L * S4 * C5 * s + l7 * S4 * S5 * s + ly * C4 * s
    rEy = L * S5 * s + q2 - d.l1 * s - l7 * s * C5
    rEz = q1 - d.l2 * C4 - L * C4 * C5 - l7 * S5 * C4 + ly * S4
    return -rEy - d.l4, rEx - d.l5, rEz + d.l6


def _level_rotation(s: float, S4: Array, C4: Array) -> Rotation:
    """Axes of frame 4, which the parts that q5 does not incline keep."""
    return [[0, 0, s], [S4 * s, C4 * s, 0], [-C4, S4, 0]]


def _joint_values(q: ArrayLike, d: Dimensions) -> tuple[Array, ...]:
    q = np.asarray(q, dtype=np.float64)
    if q.shape[-1:] != (6,):
        raise ValueError(f"q has shape {q.shape}; its last axis must be q1..q6")
    return tuple(q[..., i] + offset for i, offset in enumerate(d.offsets))


def _stack(rotation: Rotation, x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Array:
    """One (..., 4, 4) transform of elements that are numbers or equal-shaped arrays."""
    rows: Rotation = [
        [*rotation[0], x],
        [*rotation[1], y],
        [*rotation[2], z],
        [0, 0, 0, 1],
    ]
    elements = [np.asarray(e, dtype=np.float64) for row in rows for e in row]
    shape = np.broadcast_shapes(*(e.shape for e in elements))
    T = np.stack([np.broadcast_to(e, shape) for e in elements], axis=-1)
    return T.reshape(*shape, 4, 4)
