"""Does one solid hold another along a motion: asked where every clear stretch begins.

A closed surface that nothing crosses keeps inside what is inside it, so one instant of
a clear stretch answers for all of it, and one corner for every connected part. The
corner's ray is followed through the tree, not past every triangle. An open surface has
no inside; there only boxes that stay apart all the way answer. Where crossings of the
ray cancel, `solid` is asked, which knows when they may.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.tree.boxes import motion_of
from borecheck.geometry.tree.build import WIDTH
from borecheck.geometry.tree.rays import placed_crossings
from borecheck.geometry.triangles.placing import place_mesh, place_point, placed_bounds
from borecheck.geometry.triangles.solid import Enclosure, contained
from borecheck.geometry.triangles.winding import ON_SURFACE
from borecheck.motion.bounds import Route, displacement, gains
from borecheck.motion.outcome import Timeline
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import WORLD

if TYPE_CHECKING:
    from borecheck.motion.problem import Body, Motion, Pair

Array = NDArray[np.float64]

_WHERE_IT_IS = np.eye(4)[:3].copy()

# Instants at which boxes of open meshes are compared.
INSTANTS = 129


def examine_containment(
    chain: JointChain, pair: "Pair", way: Route, motion: "Motion", timeline: Timeline
) -> None:
    """Adds stretches in which one body of a pair holds the other.

    Surfaces must have been examined: clear stretches are those not on the timeline.
    Where another pair is in contact, nothing needs to be added.
    """
    a, b = pair.moving, pair.standing
    if not (a.topology.is_closed and b.topology.is_closed):
        if not _boxes_stay_apart(chain, pair, way, motion):
            names = [x.mesh.name for x in (a, b) if not x.topology.is_closed]
            reason = f"{' and '.join(names)}: open, what it holds cannot be told"
            timeline.add_unknown(pair.names, reason)
        return
    for start, end in left_of_path(timeline.not_clear_for(pair.names)):
        # A stretch is proven clear with its ends, so any instant of it will do.
        found = held_at(chain, pair, motion, start * timeline.span)
        if found.kind == "unknown":
            timeline.add_unknown(pair.names, found.reason)
        elif found.kind != "none":
            timeline.add_contained(pair.names, found.reason, start, end)


def left_of_path(
    taken: list[tuple[float, float]], whole: float = 1.0
) -> list[tuple[float, float]]:
    """What is left of a path from 0 to its whole length, in order."""
    left, begin = [], 0.0
    for start, end in sorted(taken):
        if start > begin:
            left.append((begin, start))
        begin = max(begin, end)
    if begin < whole:
        left.append((begin, whole))
    return left


def held_at(
    chain: JointChain, pair: "Pair", motion: "Motion", time: float
) -> Enclosure:
    """As `held`, of a pair at a time in waypoints."""
    placed = motion.place(chain, time)
    a, b = pair.moving, pair.standing
    T_b = b.T_frame_mesh if b.frame == WORLD else placed[b.frame]
    return held(a, placed[a.frame], b, T_b)


def held(a: "Body", T_a: Array, b: "Body", T_b: Array) -> Enclosure:
    """Whether one of two bodies, surfaces apart, holds a part of the other."""
    doubt = False
    for kind, inner, T_inner, outer, T_outer in (
        ("a_in_b", a, T_a, b, T_b),
        ("b_in_a", b, T_b, a, T_a),
    ):
        tree = outer.tree
        winding, crossed = _inside(
            inner.one_corner_each, T_inner, T_outer, outer.mesh.bounds,
            tree.nodes, tree.frames, tree.depth, tree.corners,
        )  # fmt: skip
        if winding == ON_SURFACE:
            return Enclosure(kind, f"{inner.name} touches {outer.name}")
        if winding != 0:
            return Enclosure(kind, f"{inner.name} is inside {outer.name}")
        doubt = doubt or (crossed and not outer.topology.winding_tells)
    if not doubt:
        return Enclosure("none", "no ray crosses anything")
    placed = place_mesh(T_a, a.mesh), place_mesh(T_b, b.mesh)
    return contained(*placed, a.topology, b.topology)


@kernel
def _inside(points, T_inner, T_outer, bounds, nodes, frames, depth, corners):  # type: ignore[no-untyped-def]
    """Winding number of the first of the points that is not outside, or 0.

    And whether a ray of those with 0 crosses anything. Points are given in the frame of
    the inner mesh; both placements are rigid up to what `check_transform` lets pass, so
    the way back is a true inverse.
    """
    at, doubt = np.zeros(3), False
    children, stack = nodes.view(np.int32), np.empty(WIDTH * (depth + 2), np.int64)
    for k in range(len(points)):
        x, y, z = place_point(T_inner, points[k, 0], points[k, 1], points[k, 2])
        at[0], at[1], at[2] = _taken_back(T_outer, x, y, z)
        if (at < bounds[0]).any() or (at > bounds[1]).any():
            continue
        winding, count = placed_crossings(
            (at[0], at[1], at[2]), nodes, children, corners, frames, 0,
            _WHERE_IT_IS, motion_of(_WHERE_IT_IS), True, stack,
        )  # fmt: skip
        if winding != 0:
            return winding, True
        doubt |= count > 0
    return 0, doubt


@kernel
def _taken_back(T, x, y, z):  # type: ignore[no-untyped-def]
    """The point that T takes to (x, y, z), by Cramer's rule."""
    d = (x - T[0, 3], y - T[1, 3], z - T[2, 3])
    u, v, w = T[:3, 0], T[:3, 1], T[:3, 2]
    size = _triple(u, v, w)
    return _triple(d, v, w) / size, _triple(u, d, w) / size, _triple(u, v, d) / size


@kernel
def _triple(u, v, w):  # type: ignore[no-untyped-def]
    return (
        u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
    )


def _boxes_stay_apart(
    chain: JointChain, pair: "Pair", way: Route, motion: "Motion"
) -> bool:
    """Whether a's box, or the sphere round it, stays outside b's box all the way."""
    a, b = pair.moving, pair.standing
    gain = gains(chain, way, a.radius, motion.largest)
    steps = displacement(way, gain, np.diff(motion.theta, axis=0))
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    count = INSTANTS if travelled[-1] > 0.0 else 1  # what stands still is seen once
    times = np.linspace(0.0, len(motion.theta) - 1.0, count)
    at = np.interp(times, np.arange(len(travelled)), travelled)
    low_a, high_a = a.mesh.bounds
    middle, radius = 0.5 * (low_a + high_a), float(np.linalg.norm(high_a - low_a)) / 2
    low, high = b.mesh.bounds
    for time, until in zip(times, np.diff(at, append=at[-1]), strict=True):
        placed = motion.place(chain, float(time))
        undo = b.undo if b.frame == WORLD else np.linalg.inv(placed[b.frame])
        T_b_a = undo @ placed[a.frame]
        centre = T_b_a @ np.append(middle, 1.0)
        outside = np.maximum(np.maximum(low - centre[:3], centre[:3] - high), 0.0)
        near = np.linalg.norm(outside) <= radius + until + 1e-6
        low_a, high_a = placed_bounds(T_b_a, a.mesh.bounds)
        if near and np.maximum(low - high_a, low_a - high).max() <= until + 1e-6:
            return False
    return True
