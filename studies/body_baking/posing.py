"""Arms beside the body or above the head: linear blend skinning of rigid bones."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FINGERS = ("thumb", "index", "middle", "ring", "pinky")


def pose(
    skin: Array,
    joints: Mapping[str, Array],
    weights: Mapping[str, Array],
    arms: str,
    spread: float,
    rise: float,
) -> Array:
    """The skin with its arms there.

    Args:
        skin: Points of the skin as MakeHuman stands, arms half raised, (n, 3), [m].
        joints: Places of its joints.
        weights: Of the bones.
        arms: "side" or "up".
        spread: Angle of the upper arms from the body's axis, [rad].
        rise: How far their directions rise towards the front, as a tangent.
    """
    moved = skin.copy()
    for side, out in (("l", -1.0), ("r", 1.0)):  # right is +y
        places = {
            name: joints[f"{side}-{name}"]
            for name in ("clavicle", "shoulder", "elbow", "hand", "finger-3-4")
        }
        for bones, T in _moves(places, arms, spread, rise, out):
            share = sum(weights.get(f"{bone}_{side}", 0.0) for bone in bones)
            near = np.flatnonzero(share)
            shift = skin[near] @ (T[:3, :3] - np.eye(3)).T + T[:3, 3]
            moved[near] += share[near, None] * shift
    return moved


def _moves(places, arms, spread, rise, out):
    """What each bone of one arm does, as a transform of the skin's points."""
    shoulder, elbow, hand, tip = (
        places[n] for n in ("shoulder", "elbow", "hand", "finger-3-4")
    )
    c, s = np.cos(spread), np.sin(spread)
    if arms == "side":
        lift = np.eye(4)
        upper, lower = [-c, out * s, rise], [-1.0, out * 0.3 * s, rise]
    else:
        lift = _about(places["clavicle"], _turn([0, 0, 1], -out * 0.35))
        upper, lower = [c, out * s, rise], [1.0, -out * 0.45, rise]
    start = lift[:3, :3] @ shoulder + lift[:3, 3]
    R_upper = _onto(elbow - shoulder, upper)
    T_upper = _from_to(shoulder, start, R_upper)
    bend = T_upper[:3, :3] @ elbow + T_upper[:3, 3]
    R_lower = _onto(hand - elbow, lower)
    T_lower = _from_to(elbow, bend, R_lower)
    wrist = T_lower[:3, :3] @ hand + T_lower[:3, 3]
    T_hand = _from_to(hand, wrist, _onto(tip - hand, lower))
    fingers = [f"{finger}_0{k}" for finger in FINGERS for k in (1, 2, 3)]
    return (
        (["clavicle"], lift),
        (["upperarm"], T_upper),
        (["lowerarm"], T_lower),
        (["hand", *fingers], T_hand),
    )


def _onto(a, b) -> Array:
    """The least rotation that brings one direction onto another."""
    a, b = np.asarray(a) / np.linalg.norm(a), np.asarray(b) / np.linalg.norm(b)
    axis = np.cross(a, b)
    sine = np.linalg.norm(axis)
    return np.eye(3) if sine < 1e-9 else _turn(axis, np.arctan2(sine, a @ b))


def _turn(axis, angle) -> Array:
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def _about(centre, R) -> Array:
    return _from_to(centre, centre, R)


def _from_to(old, new, R) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, new - R @ old
    return T
