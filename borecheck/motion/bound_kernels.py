"""The bounds of `motion.bounds`, compiled: for one piece of a motion at a time."""

import numpy as np

from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.robots.kinematics.forward import SLIDES, TURNS


@kernel
def gains(joints, forward, kind, length, radius, largest):  # type: ignore[no-untyped-def]
    """g_j of `motion.bounds` for the joints of a route: reach [m], 1, or 0."""
    gain = np.zeros(len(joints))
    reach = radius
    for k in range(len(joints) - 1, -1, -1):
        j = joints[k]
        if not forward[k]:  # crossed backwards, the fixed offset lies behind the joint
            reach += length[j]
        if kind[j] == TURNS:
            gain[k] = reach
        elif kind[j] == SLIDES:
            gain[k] = 1.0
            reach += largest[j]
        if forward[k]:
            reach += length[j]
    return gain


@kernel
def bend_of_run(theta, first, last, bend):  # type: ignore[no-untyped-def]
    """How far joints are off the straight line of a run, at most: bend (n,)."""
    bend[:] = 0.0
    step = (theta[last] - theta[first]) / (last - first)
    for k in range(first + 1, last):
        for j in range(len(bend)):
            straight = theta[first, j] + (k - first) * step[j]
            bend[j] = max(bend[j], abs(theta[k, j] - straight))


@kernel(**INLINE)
def slack_and_motion(start, end, bend, joints, kind, gain):  # type: ignore[no-untyped-def]
    """Chord slack of a piece, and how far any point moves during it, [m]."""
    curvature, turned, off, way = 0.0, 0.0, 0.0, 0.0
    for k in range(len(joints)):
        j = joints[k]
        step = abs(end[j] - start[j])
        turn = step if kind[j] == TURNS else 0.0
        curvature += gain[k] * step * (turn + 2.0 * turned)
        turned += turn
        off += gain[k] * bend[j]
        way += gain[k] * (step + 2.0 * bend[j])
    return curvature / 8.0 + off, way
