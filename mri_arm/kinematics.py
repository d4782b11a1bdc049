"""The MRI arm's kinematics in closed form; numpy only.

[Heikkila2010] section 4: at zero every joint frame is parallel to the base; the joints
turn about z; x, x; y; x; y. S4 is sin(q4), C4 is cos(q4), C23 is cos(q2 + q3).
The paper's own chain of 24 parameters is in `mri_arm.parameters`.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck_models.closed_form import Solutions as Solutions
from mri_arm.dimensions import Dimensions as Dimensions
from mri_arm.dimensions import dimensions as dimensions
from mri_arm.dimensions import from_arguments
from mri_arm.inverse import inverse as inverse
from mri_arm.inverse import inverse_pose as inverse_pose

Array = NDArray[np.float64]

FRAMES = ("I", "W", "1", "2", "3", "4", "5", "6", "E")

# Every body is drawn in the frame it turns with (needle and carriage: with the tip).
BODIES: Mapping[str, str] = MappingProxyType(
    {
        **{"base": "W", "turret": "1", "upper_arm": "2", "elbow": "3"},
        **{"forearm": "4", "wrist": "5", "hand": "6", "carriage": "E", "needle": "E"},
    }
)

_NOTHING: Mapping[str, float] = MappingProxyType({})


def forward(
    q: ArrayLike, *, perturbed: Mapping[str, float] = _NOTHING, **arguments: str | float
) -> dict[str, Array]:
    """Placement of every frame of the arm in the scanner's frame I (image centre).

    Args:
        q: q1..q6 [rad] and the insertion [m], (7,) or (n, 7).
        perturbed: Added to dimensions by name, to show that each of them is seen.
        **arguments: As of the xacro file: base_x, base_y, base_yaw, needle_mount, ...

    Returns:
        {frame: T_I_frame}, (4, 4) or (n, 4, 4): I, W (the paper's world: on the floor
        under axis 1), 1..6 (turning with joints 1..6), E (the tip, z the needle), and
        the bodies by their links' names.
    """
    d = from_arguments(arguments, perturbed)
    q1, q2, q3, q4, q5, q6, insertion = _joint_values(q)
    zero = 0.0 * q1
    yaw = d.base_yaw + q1
    S1, C1, S2, C2 = np.sin(yaw), np.cos(yaw), np.sin(q2), np.cos(q2)
    S23, C23 = np.sin(q2 + q3), np.cos(q2 + q3)
    x1 = _vector(C1, S1, zero)
    z1 = _vector(zero, zero, 1.0 + zero)
    ahead = _vector(-S1, C1, zero)  # horizontal, the way the arm reaches out
    y2, z2 = _mix(C2, ahead, S2, z1), _mix(-S2, ahead, C2, z1)
    y3, z3 = _mix(C23, ahead, S23, z1), _mix(-S23, ahead, C23, z1)
    x4, z4 = _turned(q4, z3, x1)
    y5, z5 = _turned(-q5, z4, y3)
    x6, z6 = _turned(q6, z5, x4)
    base = np.array([d.base_x, d.base_y, d.base_z])
    shoulder = base + d.shoulder * z1
    elbow = shoulder + d.upper_arm * z2
    wrist = elbow + d.forearm * y3
    out, up = _needle(d, y5, z6)
    tip = wrist + d.flange * y5 + (d.needle + insertion)[..., None] * out
    cy, sy = np.cos(d.base_yaw), np.sin(d.base_yaw)
    placed = {
        "I": _frame(
            _vector(1 + zero, zero, zero), _vector(zero, 1 + zero, zero), 0 * base
        ),
        "W": _frame(_vector(cy + zero, sy, zero), _vector(-sy + zero, cy, zero), base),
        "1": _frame(x1, ahead, shoulder),
        "2": _frame(x1, y2, shoulder),
        "3": _frame(x1, y3, elbow),
        "4": _frame(x4, y3, elbow),
        "5": _frame(x4, y5, wrist),
        "6": _frame(x6, y5, wrist),
        "E": _frame(x6, up, tip),
    }
    return placed | {body: placed[frame] for body, frame in BODIES.items()}


def jacobian(
    q: ArrayLike, *, perturbed: Mapping[str, float] = _NOTHING, **arguments: str | float
) -> Array:
    """How the needle tip moves with the joints, in the scanner's frame I.

    Args:
        q: q1..q6 and the insertion, (7,).
        perturbed: As for `forward`.
        **arguments: As for `forward`.

    Returns:
        (6, 7): rows velocity of the tip x, y, z [m/..], then angular velocity [rad/..];
        columns q1..q6, insertion.
    """
    T = forward(q, perturbed=perturbed, **arguments)
    tip = T["E"][:3, 3]
    J = np.zeros((6, 7))
    for column, (frame, axis) in enumerate(
        zip("123456", (2, 0, 0, 1, 0, 1), strict=True)
    ):
        turn, origin = T[frame][:3, axis], T[frame][:3, 3]
        J[:3, column] = np.cross(turn, tip - origin)
        J[3:, column] = turn
    J[:3, 6] = T["E"][:3, 2]
    return J


def singularity(
    q: ArrayLike, *, perturbed: Mapping[str, float] = _NOTHING, **arguments: str | float
) -> dict[str, Array]:
    """How far the arm is from each of its singularities; 0 is singular, 1 is best.

    The determinant of the wrist centre's 6 x 6 Jacobian is their product times
    upper_arm * forearm * (upper_arm + forearm).

    Args:
        q: q1..q6 and the insertion, (7,) or (n, 7).
        perturbed: As for `forward`.
        **arguments: As for `forward`.

    Returns:
        wrist: |sin q5|, axes 4 and 6 in line; elbow: |cos q3|, arm stretched or folded;
        shoulder: horizontal distance of the wrist from axis 1 over the arm's length.
    """
    d = from_arguments(arguments, perturbed)
    _, q2, q3, _, q5, _, _ = _joint_values(q)
    reach = -d.upper_arm * np.sin(q2) + d.forearm * np.cos(q2 + q3)
    return {
        "wrist": np.abs(np.sin(q5)),
        "elbow": np.abs(np.cos(q3)),
        "shoulder": np.abs(reach) / (d.upper_arm + d.forearm),
    }


def _needle(d: Dimensions, y6: Array, z6: Array) -> tuple[Array, Array]:
    """Direction of the needle (z_E) and the axis y_E, by the way it is mounted.

    The needle leans over from y_6 towards -z_6: x_E stays x_6.
    """
    lean = 0.5 * np.pi * d.tool_square
    out = np.cos(lean) * y6 - np.sin(lean) * z6
    return out, -np.sin(lean) * y6 - np.cos(lean) * z6


def _mix(a: Array, u: Array, b: Array, v: Array) -> Array:
    return a[..., None] * u + b[..., None] * v


def _turned(angle: Array, u: Array, v: Array) -> tuple[Array, Array]:
    """The axes (v, u) after turning by the angle from u towards v."""
    C, S = np.cos(angle), np.sin(angle)
    return _mix(C, v, -S, u), _mix(S, v, C, u)


def _vector(x: Array, y: Array, z: Array) -> Array:
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def _frame(x: Array, y: Array, origin: Array) -> Array:
    shape = np.broadcast_shapes(x.shape, y.shape, origin.shape)[:-1]
    T = np.zeros((*shape, 4, 4))
    T[..., :3, 0], T[..., :3, 1], T[..., :3, 2] = x, y, np.cross(x, y)
    T[..., :3, 3], T[..., 3, 3] = origin, 1.0
    return T


def _joint_values(q: ArrayLike) -> tuple[Array, ...]:
    q = np.asarray(q, dtype=np.float64)
    if q.shape[-1:] != (7,):
        raise ValueError(f"q has shape {q.shape}; its last axis is q1..q6, insertion")
    return tuple(q[..., i] for i in range(7))
