"""Scenes to time: a ten-link needle arm that reaches into a bore, in three sizes.

The dimensions are assumed (a typical wide-bore scanner and an arm of 1.6 m); what
matters for timing is shape and triangle count, and those are free here.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import axis_rotation
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.problem import Body, PathProblem
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import TURNS

Array = NDArray[np.float64]

# Triangles of the whole arm and of the gantry.
SIZES = {"S": (2_000, 10_000), "M": (20_000, 100_000), "L": (100_000, 500_000)}

BORE_RADIUS = 0.38  # [m], assumed
LIP = 0.08  # radius of the flared rim of the bore [m], assumed
OUTER_RADIUS = 1.0  # [m], assumed
HALF_DEPTH = 0.45  # [m], assumed

# Radius [m], squareness (2: round, 8: a box with round edges), length [m]; assumed.
LINKS = (
    (0.075, 2, 0.22),
    (0.060, 8, 0.20),
    (0.055, 2, 0.26),
    (0.050, 8, 0.12),
    (0.045, 2, 0.24),
    (0.040, 8, 0.10),
    (0.035, 2, 0.12),
    (0.030, 8, 0.10),
    (0.020, 2, 0.08),
    (0.001, 2, 0.16),
)
Y, Z = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
AXES = (Z, Y, Y, Z, Y, Z, Y, Z, Y, Z)
BENT = np.array([0.3, 0.15, -0.25, 0.4, 0.2, -0.3, -0.2, 0.5, 0.15, 0.0])
STRAIGHT = np.zeros(10)
FOOT = np.array([0.02, 0.03, 1.25])  # in front of the bore, the arm points along -z


@dataclass(frozen=True)
class Scene:
    """An arm and a gantry.

    Attributes:
        size: "S", "M" or "L".
        links: One closed mesh per link, z along the link.
        gantry: Closed mesh, bore along z.
    """

    size: str
    links: tuple[TriangleMesh, ...]
    gantry: TriangleMesh


def make_scene(size: str) -> Scene:
    """The scene of that size; counts are met within a few per cent."""
    arm, gantry = SIZES[size]
    return Scene(size, arm_links(arm), gantry_mesh(gantry))


def placements(q: Array, foot: Array = FOOT) -> Array:
    """T_world_link of the ten links, (10, 4, 4)."""
    placed = np.zeros((len(LINKS), 4, 4))
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[:3, 3] = foot
    for k, (axis, (_, _, length)) in enumerate(zip(AXES, LINKS, strict=True)):
        T = T.copy()
        T[:3, :3] = T[:3, :3] @ axis_rotation(axis, float(q[k]))
        placed[k] = T
        T = T.copy()
        T[:3, 3] += T[:3, 2] * length
    return placed


def gantry_mesh(triangles: int) -> TriangleMesh:
    """A thick ring with a flared bore along z, about so many triangles."""
    profile = _gantry_profile()
    steps = np.linalg.norm(np.diff(profile, axis=0, append=profile[:1]), axis=1)
    around = 2.0 * np.pi * 0.5 * (BORE_RADIUS + OUTER_RADIUS)
    rows = max(12, round(np.sqrt(triangles / 2 * steps.sum() / around)))
    columns = max(12, round(triangles / 2 / rows))
    section = _evenly_spaced(profile, rows)
    angle = np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False)[:, None]
    grid = np.stack(
        [
            section[:, 0] * np.cos(angle),
            section[:, 0] * np.sin(angle),
            np.broadcast_to(section[:, 1], (columns, rows)),
        ],
        axis=2,
    )
    return TriangleMesh("gantry", grid.reshape(-1, 3), _torus_triangles(columns, rows))


def arm_links(triangles: int) -> tuple[TriangleMesh, ...]:
    """The ten links with about so many triangles together; the needle gets fewer."""
    share = np.array([1.0] * 9 + [0.3])
    counts = triangles * share / share.sum()
    return tuple(
        link_mesh(f"link{k}", radius, squareness, length, round(count))
        for k, ((radius, squareness, length), count) in enumerate(
            zip(LINKS, counts, strict=True)
        )
    )


def link_mesh(
    name: str, radius: float, squareness: int, length: float, triangles: int
) -> TriangleMesh:
    """A closed bar along z with a round or squarish section."""
    aspect = np.clip((length + radius) / (2.0 * np.pi * radius), 0.2, 20.0)
    around = max(6, round(np.sqrt(triangles / 2 / aspect)))
    along = max(3, round(triangles / 2 / around))
    cap = max(1, int(along * radius / (length + 2.0 * radius)))
    body = max(1, along - 2 * cap)
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    section = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    section *= radius / (np.abs(section) ** squareness).sum(axis=1, keepdims=True) ** (
        1.0 / squareness
    )
    grow = np.linspace(0.0, 1.0, cap + 1)[1:]
    scales = np.concatenate([grow, np.ones(body), grow[::-1][1:]])
    heights = np.concatenate(
        [
            np.zeros(cap),
            length * np.arange(1, body + 1) / body,
            np.full(cap - 1, length),
        ]
    )
    rings = [
        np.column_stack([section * s, np.full(around, h)])
        for s, h in zip(scales, heights, strict=True)
    ]
    tips = [[0.0, 0.0, 0.0], [0.0, 0.0, length]]
    vertices = np.concatenate([*rings, np.array(tips)])
    return TriangleMesh(name, vertices, _bar_triangles(len(rings), around))


def _bar_triangles(rings: int, around: int) -> NDArray[np.int64]:
    """Rings joined to a tube, both ends closed by a fan."""
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    after = (j + 1) % around
    a, b = i * around + j, i * around + after
    c, d = b + around, a + around
    first, last = rings * around, rings * around + 1
    k = np.arange(around)
    k1, top = (k + 1) % around, (rings - 1) * around
    return np.concatenate(
        [
            np.stack([a, b, c], axis=2).reshape(-1, 3),
            np.stack([a, c, d], axis=2).reshape(-1, 3),
            np.stack([np.full(around, first), k1, k], axis=1),
            np.stack([np.full(around, last), top + k, top + k1], axis=1),
        ]
    )


def _torus_triangles(columns: int, rows: int) -> NDArray[np.int64]:
    """A grid closed both ways, outward for a section that runs clockwise in (r, z)."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    i1, j1 = (i + 1) % columns, (j + 1) % rows
    a, b = i * rows + j, i1 * rows + j
    c, d = i1 * rows + j1, i * rows + j1
    return np.concatenate(
        [
            np.stack([a, c, b], axis=2).reshape(-1, 3),
            np.stack([a, d, c], axis=2).reshape(-1, 3),
        ]
    )


def _gantry_profile() -> Array:
    """Section of the ring as a closed polygon of (radius, z)."""
    turn = np.linspace(0.0, 0.5 * np.pi, 13)
    flare_r = BORE_RADIUS + LIP * (1.0 - np.cos(turn))
    flare_z = HALF_DEPTH - LIP * (1.0 - np.sin(turn))
    front = np.column_stack([flare_r, flare_z])
    back = np.column_stack([flare_r[::-1], -flare_z[::-1]])
    outer = np.array([[OUTER_RADIUS, HALF_DEPTH], [OUTER_RADIUS, -HALF_DEPTH]])
    return np.concatenate([front, outer, back])


def _evenly_spaced(polygon: Array, count: int) -> Array:
    """So many points along a closed polygon, evenly spaced."""
    closed = np.vstack([polygon, polygon[:1]])
    along = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))]
    )
    at = np.linspace(0.0, along[-1], count, endpoint=False)
    return np.column_stack([np.interp(at, along, closed[:, k]) for k in range(2)])


def arm_chain(foot: Array = FOOT) -> JointChain:
    """The joints of the arm; frame k is that of link k."""
    count = len(LINKS)
    origin = np.tile(np.eye(4), (count, 1, 1))
    origin[0] = np.diag([1.0, -1.0, -1.0, 1.0])
    origin[0, :3, 3] = foot
    for k in range(1, count):
        origin[k, 2, 3] = LINKS[k - 1][2]
    return JointChain(
        parent=np.arange(count) - 1,
        origin=origin,
        kind=np.full(count, TURNS),
        axis=np.array(AXES),
        source=np.arange(count),
        factor=np.ones(count),
        offset=np.zeros(count),
    )


def path_problem(scene: Scene, foot: Array = FOOT, margin: float = 0.0) -> PathProblem:
    """Every link of the arm against the gantry."""
    parts = tuple(Body(m.name, m, k) for k, m in enumerate(scene.links))
    obstacle = Body(scene.gantry.name, scene.gantry)
    return PathProblem(arm_chain(foot), parts, (obstacle,), margin=margin)
