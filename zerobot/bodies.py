"""Where Zerobot's bodies are, in closed form: stages, arm, holder, parallel mechanism.

The body frames are ours (x forward along the arm, y left, z up at q = 0); the paper
has only its Denavit-Hartenberg frames. Everything is written out from two triads:

    level   x = (s, 0, 0)            y = (0, s C4, S4)   z = (0, -s S4, C4)
    tilted  x = C5 x - S5 z (level)  y as level          z = S5 x + C5 z (level)

Crank and holder are tilted, arm and rods are level: that is the parallelogram.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zerobot.dimensions import Dimensions

Array = NDArray[np.float64]

LEVEL_PARTS = ("parallelogram", "frame4")

BODIES = (
    "base",
    "lift",
    "slide",
    "cross",
    "arm",
    "holder",
    "carriage",
    "needle",
    "crank",
    "rod_a",
    "loop_a_rod",
    "loop_a_holder",
    "rod_b",
    "loop_b_rod",
    "loop_b_holder",
)


class Origins(NamedTuple):
    """Origins (..., 3) of the paper's frames that bodies hang on, in W."""

    stage_1: Array
    stage_2: Array
    stage_3: Array
    pivot_4: Array
    pivot_5: Array
    slide_6: Array
    tip: Array


def place_bodies(
    d: Dimensions, q4: Array, q5: Array, at: Origins, level_parts: str
) -> dict[str, Array]:
    """Placement of every body in the world frame W, (..., 4, 4).

    Args:
        d: The dimensions.
        q4: Turn about the long arm, offset included, (...,), [rad].
        q5: Turn of the needle holder, offset included, (...,), [rad].
        at: Origins of the paper's frames.
        level_parts: "parallelogram", or "frame4": the rods placed with the whole of
            W_T_4, as [Matsuno2020] section 3.2 can be read.

    Raises:
        ValueError: Another word for `level_parts`.
    """
    if level_parts not in LEVEL_PARTS:
        raise ValueError(f"level_parts {level_parts!r} is none of {LEVEL_PARTS}")
    s, S4, C4, S5, C5 = d.mount_sign, np.sin(q4), np.cos(q4), np.sin(q5), np.cos(q5)
    side = _vector(0, s * C4, S4)
    level_x, level_z = _vector(s + 0 * S4, 0, 0), _vector(0, -s * S4, C4)
    tilted_x = _vector(s * C5, s * S4 * S5, -C4 * S5)
    tilted_z = _vector(s * S5, -s * S4 * C5, C4 * C5)
    upright = (_vector(s, 0, 0), _vector(0, s, 0), _vector(0, 0, 1))
    level = (level_x, side, level_z)
    tilted = (tilted_x, side, tilted_z)
    crank = at.pivot_5 - d.rod_length * level_x
    placed = {
        "base": _place(upright, _vector(-d.l4 + 0 * S4, 0, d.l6)),
        "lift": _place(upright, at.stage_1 + _vector(0, d.l3, 0)),
        "slide": _place(upright, at.stage_2 + _vector(0, d.l3, 0)),
        "cross": _place(upright, at.stage_3),
        "arm": _place(level, at.pivot_4),
        "holder": _place(tilted, at.pivot_5),
        "carriage": _place(tilted, at.slide_6),
        "needle": _place(tilted, at.tip),
        "crank": _place(tilted, crank),
    }
    for name, sign in (("a", 1.0), ("b", -1.0)):
        pin = sign * (d.rod_side * side + d.rod_lever * tilted_z)
        still = sign * (d.rod_side * side + d.rod_lever * level_z)
        near = crank + (still if level_parts == "frame4" else pin)
        placed[f"rod_{name}"] = _place(level, near)
        placed[f"loop_{name}_rod"] = _place(level, near + d.rod_length * level_x)
        placed[f"loop_{name}_holder"] = _place(level, at.pivot_5 + pin)
    return placed


def _vector(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Array:
    return np.stack(
        np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (x, y, z))),
        axis=-1,
    )


def _place(axes: tuple[Array, Array, Array], origin: Array) -> Array:
    T = np.zeros((*origin.shape[:-1], 4, 4))
    for column, axis in enumerate((*axes, origin)):
        T[..., :3, column] = axis
    T[..., 3, 3] = 1.0
    return T
