"""The MRI arm as the paper calibrates it: a chain of 24 DH and Hayati parameters.

[Heikkila2010] section 4 and Appendix II: rot-trans-trans-rot between the joints, and
Hayati's rot-trans-rot-rot between the parallel axes 2 and 3. Numpy only.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mri_arm.dimensions import Dimensions

Array = NDArray[np.float64]

# One link after the other: world to axis 1 (al, be tilt it), then axis i to axis i + 1.
# The paper counts 24, "including the transformation from base (world) to the 1st axis".
LINKS: Mapping[str, tuple[tuple[str, str], ...]] = MappingProxyType(
    {
        "world to 1": (("x0", "Tx"), ("y0", "Ty"), ("al0", "Rx"), ("be0", "Ry")),
        "1 to 2": (("th1", "Rz"), ("d1", "Tz"), ("b1", "Ty"), ("be1", "Ry")),
        "2 to 3": (("al2", "Rx"), ("d2", "Tz"), ("th2", "Rz"), ("be2", "Ry")),
        "3 to 4": (("th3", "Rx"), ("d3", "Tx"), ("b3", "Tz"), ("be3", "Rz")),
        "4 to 5": (("th4", "Ry"), ("d4", "Ty"), ("b4", "Tz"), ("be4", "Rz")),
        "5 to 6": (("th5", "Rx"), ("d5", "Tx"), ("b5", "Tz"), ("be5", "Rz")),
    }
)

# Section 4: "rot-z for the joint 1, rot-x for joints 2,3 and 5, and rot-y for [4, 6]".
JOINT_TURNS = ("Rz", "Rx", "Rx", "Ry", "Rx", "Ry")

NAMES = tuple(name for link in LINKS.values() for name, _ in link)

ANGLES = tuple(name for link in LINKS.values() for name, step in link if step[0] == "R")

LENGTHS = tuple(name for name in NAMES if name not in ANGLES)


def nominal(d: Dimensions | None = None) -> dict[str, float]:
    """The parameters of the arm as drawn: all 0 but three lengths, [m] and [rad]."""
    d = Dimensions() if d is None else d
    values = dict.fromkeys(NAMES, 0.0)
    values.update(d1=d.shoulder, d2=d.upper_arm, d4=d.forearm)
    return values


def chain(q: ArrayLike, parameters: Mapping[str, ArrayLike]) -> Array:
    """The last joint's frame in the paper's world, T_W_6, (4, 4) or (n, 4, 4).

    Frame 6 has its origin where axis 6 passes axis 5 closest, the wrist centre of the
    nominal arm. What is fixed beyond it (the tool) is not among the 24.

    Args:
        q: q1..q6 [rad], (6,) or (n, 6).
        parameters: By name, all 24, numbers or (n,), [m] and [rad].
    """
    q = np.asarray(q, dtype=np.float64)
    T = np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))
    for joint, (link, turn) in enumerate(zip(LINKS.values(), JOINT_TURNS, strict=True)):
        for name, step in link:
            T = T @ elementary(step, parameters[name])
        T = T @ elementary(turn, q[..., joint])
    return T


def elementary(step: str, value: ArrayLike) -> Array:
    """Turn (`Rx`, [rad]) or shift (`Tx`, [m]) along one axis, (..., 4, 4)."""
    value = np.asarray(value, dtype=np.float64)
    axis = "xyz".index(step[1])
    T = np.zeros((*value.shape, 4, 4))
    T[..., range(4), range(4)] = 1.0
    if step[0] == "T":
        T[..., axis, 3] = value
        return T
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T[..., i, i] = T[..., j, j] = np.cos(value)
    T[..., j, i] = np.sin(value)
    T[..., i, j] = -np.sin(value)
    return T
