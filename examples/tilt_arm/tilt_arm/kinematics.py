"""The tilt arm in closed form: numpy only, nothing of borecheck.

Slide 1 runs along x, slide 2 along z, the tilt turns about y, the needle slides along
its own axis. All numbers are made up, and typed again in the URDF: that two hands wrote
the same number is what `borecheck fk` checks.
"""

import math
from dataclasses import dataclass

import numpy as np

HEIGHT = 0.22  # of the tilt axis above the isocentre at q = 0, [m], made up
NEEDLE = 0.15  # from the tilt axis to the tip at insertion 0, [m], made up

LIMITS = {
    "x": (-0.10, 0.10),
    "z": (-0.10, 0.10),
    "tilt": (-0.6, 0.6),
    "insertion": (0.0, 0.10),
}


@dataclass(frozen=True)
class Solutions:
    """Configurations within the limits, and why others are not."""

    configurations: tuple[np.ndarray, ...]
    rejected: tuple[str, ...]


def forward(q, **arguments):
    """Placement of every frame in the scanner's frame, {frame: T (..., 4, 4)}.

    Args:
        q: x, z [m], tilt [rad], insertion [m], (4,) or (n, 4).
        **arguments: None are used: the robot has no xacro arguments.
    """
    x, z, tilt, insertion = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    S, C, zero, one = np.sin(tilt), np.cos(tilt), 0.0 * x, 1.0 + 0.0 * x
    turned = np.stack([C, zero, S, zero, one, zero, -S, zero, C], axis=-1)
    turned = turned.reshape(*np.shape(x), 3, 3)
    pointing_down = np.diag([1.0, -1.0, -1.0])  # z of the tip is the needle's way
    reach = NEEDLE + insertion
    return {
        "base": _placement(np.eye(3), zero, zero + HEIGHT),
        "tilt": _placement(turned, x, HEIGHT + z),
        "tip": _placement(
            turned @ pointing_down, x - reach * S, HEIGHT + z - reach * C
        ),
    }


def inverse(tip, direction, insertion, **arguments):
    """Configurations that put the tip there; the needle must lie in the plane y = 0."""
    tip, direction = np.asarray(tip, float), np.asarray(direction, float)
    direction = direction / np.linalg.norm(direction)
    if abs(tip[1]) > 1e-9 or abs(direction[1]) > 1e-9:
        return Solutions((), ("the needle is not in the plane y = 0",))
    tilt = math.atan2(-direction[0], -direction[2])
    reach = NEEDLE + insertion
    x = tip[0] - reach * direction[0]
    z = tip[2] - reach * direction[2] - HEIGHT
    q = np.array([x, z, tilt, insertion])
    broken = [
        f"{name} = {value:.3f} is beyond {low:.3f} .. {high:.3f}"
        for value, (name, (low, high)) in zip(q, LIMITS.items(), strict=True)
        if not low <= value <= high
    ]
    return Solutions((), ("; ".join(broken),)) if broken else Solutions((q,), ())


def dimensions(**arguments):
    """Every number of the closed form by name, [m]."""
    return {"height": HEIGHT, "needle": NEEDLE}


def _placement(R, x, z):
    """T (..., 4, 4) with a rotation (..., 3, 3) and its origin in the plane y = 0."""
    T = np.zeros((*np.shape(x), 4, 4))
    T[..., :3, :3] = R
    T[..., 0, 3], T[..., 2, 3], T[..., 3, 3] = x, z, 1.0
    return T
