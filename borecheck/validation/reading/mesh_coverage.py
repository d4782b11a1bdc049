"""How far the collision geometry of a link covers what is drawn of it.

By sampling, the same points every time: the visual's surface against the collision's
solid (primitives exactly, meshes by their surface and the box around them).
"""

from dataclasses import dataclass

import numpy as np

from borecheck.core.se3 import Array, inverse
from borecheck.geometry.mesh.sampling import directions_on_sphere, points_on_triangles
from borecheck.robots.urdf.attributes import number, numbers, placement
from borecheck.robots.urdf.draft_elements import DraftLink, DraftShape
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.extents import shape_extent
from borecheck.validation.reading.mesh_reading import mesh_of

POINTS = 300  # per kind: enough for a share to 5 %
ROOM = 0.05  # of the visual's size: simplified shapes cut corners


@dataclass(frozen=True)
class Coverage:
    """Visual against collision of one link.

    Attributes:
        share: Share of the visual's surface that is inside or near the collision.
        farthest: Largest distance of a visual point from the collision, [m].
        beyond: Largest distance of a collision point from the visual's box, [m].
        visual_size: Diagonal of the box around the visual, [m].
        is_elsewhere: Whether next to nothing is covered, and the middles lie apart.
    """

    share: float
    farthest: float
    beyond: float
    visual_size: float
    is_elsewhere: bool


def coverage_of(robot: CheckedUrdf, link: DraftLink) -> Coverage | None:
    """The coverage of a link; None if a shape is missing or unknown. Remembered."""
    found: Coverage | None = robot.remembered(  # two links may have one name
        "coverage", link.element, lambda: _coverage(robot, link)
    )
    return found


def _coverage(robot: CheckedUrdf, link: DraftLink) -> Coverage | None:
    visuals, collisions = link.of_kind("visual"), link.of_kind("collision")
    if not visuals or not collisions or _same_shapes(visuals, collisions):
        return None
    drawn = [surface_points(robot, shape) for shape in visuals]
    solid = [surface_points(robot, shape) for shape in collisions]
    if any(p is None for p in (*drawn, *solid)):
        return None
    points = np.concatenate([p for p in drawn if p is not None])
    others = np.concatenate([p for p in solid if p is not None])
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if size == 0.0 or not np.isfinite(size):
        return None
    distance = np.min([_outside(robot, shape, points) for shape in collisions], axis=0)
    share = float((distance <= ROOM * size).mean())
    low, high = points.min(axis=0), points.max(axis=0)
    over = np.linalg.norm(
        np.maximum(0.0, np.maximum(low - others, others - high)), axis=1
    )
    apart = np.linalg.norm(0.5 * (low + high) - 0.5 * (others.min(0) + others.max(0)))
    elsewhere = bool(share < 0.02 and apart > 0.25 * size)
    return Coverage(share, float(distance.max()), float(over.max()), size, elsewhere)


def _same_shapes(visuals: list[DraftShape], collisions: list[DraftShape]) -> bool:
    """Whether each visual has a collision written exactly alike."""

    def written(shape: DraftShape) -> tuple[object, ...]:
        origin = shape.element.find("origin")
        attributes = () if shape.shape is None else sorted(shape.shape.attrib.items())
        where = [] if origin is None else sorted(origin.attrib.items())
        return (shape.tag, tuple(attributes), tuple(where))

    return {written(v) for v in visuals} == {written(c) for c in collisions}


def surface_points(robot: CheckedUrdf, shape: DraftShape) -> Array | None:
    """Points on the surface of a shape in the link's frame, (n, 3)."""
    T, local = placement(shape.element), _local_points(robot, shape)
    if T is None or local is None:
        return None
    return local @ T[:3, :3].T + T[:3, 3]


def _local_points(robot: CheckedUrdf, shape: DraftShape) -> Array | None:
    mesh = mesh_of(robot, shape)
    if mesh is not None:
        return points_on_triangles(mesh.corners * np.array(shape.scale), POINTS)
    extent = None if shape.tag == "mesh" else shape_extent(robot, shape)
    if extent is None:
        return None
    directions = directions_on_sphere(POINTS)
    if shape.tag == "box":
        scaled = directions / np.abs(directions).max(axis=1, keepdims=True)
        return scaled * extent.high
    if shape.tag == "sphere":
        return directions * extent.high
    flat = np.hypot(directions[:, 0], directions[:, 1])
    scale = np.minimum(1.0 / np.maximum(flat, 1e-9), 1.0 / np.abs(directions[:, 2]))
    return directions * scale[:, None] * extent.high


def _outside(robot: CheckedUrdf, shape: DraftShape, points: Array) -> Array:
    """How far points are outside of one collision shape, (n,); 0 inside."""
    T = placement(shape.element)
    if T is None:
        return np.full(len(points), np.inf)
    T = inverse(T)
    local = points @ T[:3, :3].T + T[:3, 3]
    if shape.tag == "box":
        half = 0.5 * np.array(numbers(shape.shape, "size", 3))
        return np.linalg.norm(np.maximum(0.0, np.abs(local) - half), axis=1)
    radius = number(shape.shape, "radius") or 0.0
    if shape.tag == "sphere":
        return np.maximum(0.0, np.linalg.norm(local, axis=1) - radius)
    half_length = 0.5 * (number(shape.shape, "length") or 0.0)
    along = np.maximum(0.0, np.abs(local[:, 2]) - half_length)
    across = np.hypot(local[:, 0], local[:, 1])
    if shape.tag == "cylinder":
        return np.hypot(np.maximum(0.0, across - radius), along)
    if shape.tag == "capsule":
        return np.maximum(0.0, np.hypot(across, along) - radius)
    return _outside_mesh(robot, shape, local)


def _outside_mesh(robot: CheckedUrdf, shape: DraftShape, local: Array) -> Array:
    extent, surface = shape_extent(robot, shape), _local_points(robot, shape)
    if extent is None or surface is None:
        return np.full(len(local), np.inf)
    within = ((local >= extent.low) & (local <= extent.high)).all(axis=1)
    gaps = local[:, None, :] - surface[None, :, :]
    near = np.sqrt((gaps**2).sum(axis=2).min(axis=1))
    # The samples are about this far apart, so a point on the surface seems so far.
    spacing = extent.diagonal / POINTS**0.5
    return np.where(within, 0.0, np.maximum(0.0, near - spacing))
