"""Balls that lie within a robot's parts, and points of their surfaces.

Where such a ball is in an obstacle, or nearer than allowed, the part is: from these few
a bound holds for a whole box of configurations.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from borecheck.core.once import once_per_record
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.robot import Robot
from borecheck.setup.field import inside, sampled

Array = NDArray[np.float64]

# Candidates for middles of balls lie so far apart, [m]; so many balls of a part.
LATTICE, MOST_BALLS, MOST_NODES = 6e-3, 12, 60
# Parts that fewer joints move stand before the bore: points of theirs will do.
MANY_JOINTS = 4
# Samples of a part's own surface, [m].
SPACING = 3e-3
# No ball is smaller, [m]; a part too thin for one has points alone.
SMALLEST = 3e-3
_WAYS = np.array(
    [
        (x, y, z)
        for x in (-1, 0, 1)
        for y in (-1, 0, 1)
        for z in (-1, 0, 1)
        if x or y or z
    ]
)


@dataclass(frozen=True, eq=False)
class Witnesses:
    """Of one part, in its link's frame.

    Attributes:
        points: Middles of balls, then points of the surface, (n, 3), [m].
        radii: Of the balls; 0 of points, (n,), [m].
    """

    points: Array
    radii: Array


@once_per_record
def witnesses(robot: Robot) -> tuple[Witnesses, ...]:
    """Of every part of a robot; of those that no joint moves, none."""
    none = Witnesses(np.zeros((0, 3)), np.zeros(0))
    moved = zip(robot.parts, joints_above(robot), strict=True)
    return tuple(
        _of(part.mesh, balls=count >= MANY_JOINTS) if count else none
        for part, count in moved
    )


def joints_above(robot: Robot) -> list[int]:
    """How many joints move each part."""
    frame_of, chain = chain_of(robot)
    found = []
    for part in robot.parts:
        frame, count = frame_of[part.link], 0
        while frame >= 0:
            count += int(chain.source[frame] >= 0)
            frame = int(chain.parent[frame])
        found.append(count)
    return found


def _of(mesh: TriangleMesh, balls: bool) -> Witnesses:
    vertices = mesh.vertices
    outer = vertices[np.unique((vertices @ _WAYS.T).argmax(axis=0))]
    middles, radii = _balls(mesh) if balls else (np.zeros((0, 3)), np.zeros(0))
    return Witnesses(
        np.concatenate([middles, outer]), np.concatenate([radii, np.zeros(len(outer))])
    )


def _balls(mesh: TriangleMesh) -> tuple[Array, Array]:
    """Large balls inside, apart from each other; certified by the surface's samples."""
    low, high = mesh.bounds
    steps = np.clip(np.ceil((high - low) / LATTICE), 1, MOST_NODES).astype(int)
    size = (high - low) / steps
    axes = [
        a + (np.arange(n) + 0.5) * h for a, n, h in zip(low, steps, size, strict=True)
    ]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    samples, cover = sampled(mesh, max(SPACING, float((high - low).max()) / 200.0))
    radii = cKDTree(samples).query(nodes.reshape(-1, 3))[0].reshape(steps) - cover
    surely_off = radii > max(SMALLEST, 0.5 * float(size.max()))
    within = inside([mesh], nodes, surely_off)
    nodes, radii = nodes[within], radii[within]
    order = np.argsort(-radii, kind="stable")
    nodes, radii = nodes[order], radii[order]
    apart = max(float((high - low).max()) / MOST_BALLS, LATTICE)
    return _spread_out(nodes, radii, apart)


def _spread_out(nodes: Array, radii: Array, apart: float) -> tuple[Array, Array]:
    """Of balls in order the first ones that are so far apart."""
    kept: list[int] = []
    free = np.ones(len(nodes), bool)
    while free.any() and len(kept) < MOST_BALLS:
        k = int(np.argmax(free))
        kept.append(k)
        free &= np.linalg.norm(nodes - nodes[k], axis=1) >= apart
    return nodes[kept], radii[kept]
