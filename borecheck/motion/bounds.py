"""How far can a point of a link move between two configurations: proven bounds.

A chain of frames is followed from one frame a to another frame b; its placement is
T_a_b(theta) = E_1(theta_1) E_2(theta_2) ... E_k(theta_k), each factor a fixed
transform and a turn or a shift along an axis. Joints below a are crossed backwards,
which turns theta into -theta. Between two waypoints every theta is a linear function
of time, mimic joints included (theta = factor * q + offset).

First derivative. Changing theta_j alone moves a point p of b by |d theta_j| if j
slides, and by a turn about the axis of j otherwise: at most |d theta_j| times the
distance of p from that axis, because a chord is shorter than its arc. All distances
between p and the axis of j depend on the joints behind j only, so changing the joints
one after the other gives, for any two configurations of the path,

    |x(t) - x(s)| <= sum_j g_j |theta_j(t) - theta_j(s)|,   g_j = 1 or reach_j.

Second derivative. With i before j in the chain, d2x / d theta_i d theta_j is the axis
of i (a unit vector) times dx / d theta_j if i turns, and 0 if i slides; with i = j it
is the axis times dx / d theta_j for a turn, and 0 for a slide. Hence, over an interval
in which theta_j changes linearly by D_j,

    |x''| h^2 <= C = sum_j g_j |D_j| ([j turns] |D_j| + 2 sum_{i<j, i turns} |D_i|),

and x(t) stays within C / 8 of the chord from x(t_0) to x(t_1): the error of linear
interpolation of a curve whose second derivative is bounded. Over a run of waypoints
the joints leave the straight line between its ends by at most bends b_j (largest at a
waypoint, as both are linear between waypoints); by the first bound x(t) then stays
within C / 8 + sum_j g_j b_j of the chord.

Reach. reach_j bounds the distance of any vertex of b's mesh from the origin of joint
j, which lies on its axis: the sum of the fixed offsets behind j, of the largest
slides that the path uses, and of the mesh's largest distance from its frame's origin.
The path's own largest slides are used, so limits wider than the path do not loosen
the bound, and a path beyond the limits is still bounded truthfully.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS, WORLD

Array = NDArray[np.float64]


# How far an origin may be from a rotation: lengths must survive a whole chain.
_ROTATION_TOLERANCE = 1e-12


def refuse_skewed(chain: JointChain) -> None:
    """Refuses a chain whose origins change lengths: the bounds would not hold.

    Raises:
        GeometryError: An origin that is a rotation to a few digits only.
    """
    R = chain.origin[:, :3, :3]
    skew = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2), initial=0.0)
    if (skew > _ROTATION_TOLERANCE).any():
        joint = int(np.argmax(skew > _ROTATION_TOLERANCE))
        raise GeometryError(f"chain: origin of joint {joint} is not quite a rotation")


@dataclass(frozen=True, eq=False)
class Route:
    """The way through the chain from one frame to another.

    Attributes:
        joints: Joints on the way in their order from a to b, fixed ones included.
        forward: Whether each is crossed towards its child, (k,).
    """

    joints: NDArray[np.int64]
    forward: NDArray[np.bool_]


def route(chain: JointChain, a: int, b: int) -> Route:
    """The route from frame a (or WORLD) to frame b."""
    up, down = _to_common_ancestor(chain, a, b)
    joints = np.array([*up, *down], dtype=np.int64)
    forward = np.array([False] * len(up) + [True] * len(down), dtype=np.bool_)
    return Route(joints, forward)


def _to_common_ancestor(
    chain: JointChain, a: int, b: int
) -> tuple[list[int], list[int]]:
    """Joints from a up to the common frame, and from there down to b."""
    above_a, above_b = _ancestors(chain, a), _ancestors(chain, b)
    common = set(above_a) & set(above_b)
    up = [j for j in above_a if j not in common]
    down = [j for j in above_b if j not in common]
    return up, down[::-1]


def _ancestors(chain: JointChain, frame: int) -> list[int]:
    """The frame and those before it, without the world."""
    found = []
    while frame != WORLD:
        found.append(frame)
        frame = int(chain.parent[frame])
    return found


def gains(chain: JointChain, way: Route, radius: float, largest: Array) -> Array:
    """g_j of every joint of a route, (k,): a reach [m], 1, or 0 for fixed joints.

    Args:
        chain: The chain.
        way: The route.
        radius: Largest distance of the points followed from the origin of b, [m].
        largest: Largest |theta| of every joint along the path, (n,).
    """
    gain = np.zeros(len(way.joints))
    reach = radius
    for k in range(len(gain) - 1, -1, -1):
        j = way.joints[k]
        if not way.forward[k]:  # the fixed offset lies behind the joint
            reach += chain.length[j]
        if chain.kind[j] == TURNS:
            gain[k] = reach
        elif chain.kind[j] == SLIDES:
            gain[k] = 1.0
            reach += largest[j]
        if way.forward[k]:
            reach += chain.length[j]
    return gain


def displacement(way: Route, gain: Array, change: Array) -> Array:
    """Bound on |x(t) - x(s)| for joint changes (..., n) between t and s, [m]."""
    return np.abs(change[..., way.joints]) @ gain


def chord_slack(chain: JointChain, way: Route, gain: Array, change: Array) -> Array:
    """Bound on the distance from the chord for changes (..., n) over it, [m]."""
    step = np.abs(change[..., way.joints])
    turn = np.where(chain.kind[way.joints] == TURNS, step, 0.0)
    before = np.cumsum(turn, axis=-1) - turn
    return (gain * step * (turn + 2.0 * before)).sum(axis=-1) / 8.0


def mesh_radius(vertices: ArrayLike) -> float:
    """Largest distance of a vertex from the frame's origin, rounded up, [m]."""
    return float(np.linalg.norm(vertices, axis=-1).max()) * (1.0 + 1e-12)
