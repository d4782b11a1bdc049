"""Forward kinematics, compiled: where the frames of a chain are."""

import math

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import INLINE, kernel

# What a joint does with its variable.
FIXED, TURNS, SLIDES = 0, 1, 2
# The frame before the first.
WORLD = -1

Array = NDArray[np.float64]


def joint_parts(origin: Array, kind: NDArray[np.int64], axis: Array) -> Array:
    """Per joint the constants A, B, C, (n, 3, 3, 4), of its motion.

    Turning (Rodrigues, K the cross product matrix of the axis, O the origin): rotation
    A + sin(x) B + (1 - cos(x)) C with A = O, B = O K, C = O K^2, translation that of A.
    Sliding: rotation that of A, translation that of A plus x times that of B.

    Args:
        origin: T_parent_joint, (n, 4, 4).
        kind: FIXED, TURNS or SLIDES, (n,).
        axis: Unit vectors, (n, 3).
    """
    parts = np.zeros((len(kind), 3, 3, 4))
    parts[:, 0] = origin[:, :3]
    for k in np.flatnonzero(kind != FIXED):
        R = origin[k, :3, :3]
        x, y, z = axis[k]
        if kind[k] == SLIDES:
            parts[k, 1, :, 3] = R @ (x, y, z)
            continue
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        parts[k, 1, :, :3] = R @ K
        parts[k, 2, :, :3] = R @ K @ K
    return parts


@kernel(**INLINE)
def _local_row(parts, k, r, b, c):  # type: ignore[no-untyped-def]
    """Row r of T_parent_child of joint k: its constants weighed with 1, b and c."""
    return (
        parts[k, 0, r, 0] + b * parts[k, 1, r, 0] + c * parts[k, 2, r, 0],
        parts[k, 0, r, 1] + b * parts[k, 1, r, 1] + c * parts[k, 2, r, 1],
        parts[k, 0, r, 2] + b * parts[k, 1, r, 2] + c * parts[k, 2, r, 2],
        parts[k, 0, r, 3] + b * parts[k, 1, r, 3] + c * parts[k, 2, r, 3],
    )


@kernel(**INLINE)
def _place(k, theta, parent, kind, parts, placed):  # type: ignore[no-untyped-def]
    """Fills T_world_frame of frame k; the frame before it is placed."""
    # The two numbers by which the parts of a joint are weighed.
    b, c = theta, 0.0
    if kind[k] == TURNS:
        # Of the half angle: 1 - cos has no cancellation near 0.
        sine, cosine = math.sin(0.5 * theta), math.cos(0.5 * theta)
        b, c = 2.0 * sine * cosine, 2.0 * sine * sine
    u = _local_row(parts, k, 0, b, c)
    v = _local_row(parts, k, 1, b, c)
    w = _local_row(parts, k, 2, b, c)
    before = parent[k]
    if before == WORLD:
        for s in range(4):
            placed[k, 0, s], placed[k, 1, s], placed[k, 2, s] = u[s], v[s], w[s]
    else:
        for r in range(3):
            x, y, z = placed[before, r, 0], placed[before, r, 1], placed[before, r, 2]
            t = placed[before, r, 3]
            placed[k, r, 0] = x * u[0] + y * v[0] + z * w[0]
            placed[k, r, 1] = x * u[1] + y * v[1] + z * w[1]
            placed[k, r, 2] = x * u[2] + y * v[2] + z * w[2]
            placed[k, r, 3] = x * u[3] + y * v[3] + z * w[3] + t
    placed[k, 3, 0], placed[k, 3, 1], placed[k, 3, 2] = 0.0, 0.0, 0.0
    placed[k, 3, 3] = 1.0


@kernel
def place_all(theta, parent, kind, parts, placed):  # type: ignore[no-untyped-def]
    """Fills T_world_frame of every frame, (n, 4, 4), at one configuration.

    Args:
        theta: Joint values, (n,); 0 for fixed joints.
        parent: See `JointChain`, as the next two.
        kind: (n,).
        parts: (n, 3, 3, 4).
        placed: (n, 4, 4), filled.
    """
    for k in range(len(parent)):
        _place(k, theta[k], parent, kind, parts, placed)


@kernel
def place_many(  # type: ignore[no-untyped-def]
    parent, kind, source, factor, offset, parts, qs, wanted, placements
):
    """Fills placements (k, wanted, 4, 4); see `JointChain.placements`."""
    placed = np.zeros((len(parent), 4, 4))
    for i in range(len(qs)):
        for k in range(len(parent)):
            theta = 0.0
            if kind[k] != FIXED:
                theta = factor[k] * qs[i, source[k]] + offset[k]
            _place(k, theta, parent, kind, parts, placed)
        for f in range(len(wanted)):
            for r in range(4):
                for s in range(4):
                    placements[i, f, r, s] = placed[wanted[f], r, s]
