"""How large a link is: the box around its geometry, meshes included once read."""

from dataclasses import dataclass

import numpy as np

from borecheck.core.se3 import Array
from borecheck.robots.urdf.attributes import number, numbers
from borecheck.robots.urdf.attributes import placement as placement_of
from borecheck.robots.urdf.draft_elements import DraftLink, DraftShape
from borecheck.validation.reading.checked_urdf import CheckedUrdf


@dataclass(frozen=True, eq=False)
class Extent:
    """An axis-aligned box in the link's frame, [m], and the volume of what is in it."""

    low: Array
    high: Array
    volume: float

    @property
    def diagonal(self) -> float:
        """Length of the box's diagonal."""
        return float(np.linalg.norm(self.high - self.low))

    def distance(self, point: Array) -> float:
        """How far a point is outside the box; 0 inside."""
        return float(
            np.linalg.norm(
                np.maximum(0.0, np.maximum(self.low - point, point - self.high))
            )
        )


def link_extent(robot: CheckedUrdf, link: DraftLink) -> Extent | None:
    """The box around all shapes of a link; None if one of them is not known."""
    extent: Extent | None = robot.remembered(  # two links may have one name
        "extents", link.element, lambda: _link_extent(robot, link)
    )
    return extent


def shape_extent(robot: CheckedUrdf, shape: DraftShape) -> Extent | None:
    """The box around one shape in its own frame; None if it is not known."""
    if shape.tag == "mesh":
        from borecheck.validation.reading.mesh_reading import mesh_of

        mesh = mesh_of(robot, shape)
        if mesh is None:
            return None
        corners = np.sort(mesh.bounds * np.array(shape.scale), axis=0)
        volume = float(np.prod(corners[1] - corners[0]))
        return Extent(corners[0], corners[1], volume)
    half = _half_size(shape)
    if half is None or min(half) <= 0.0:
        return None
    size = np.array(half)
    return Extent(-size, size, float(8.0 * np.prod(size)))


def _half_size(shape: DraftShape) -> tuple[float, ...] | None:
    if shape.tag == "box":
        size = numbers(shape.shape, "size", 3)
        return None if size is None else tuple(0.5 * s for s in size)
    radius = None if shape.shape is None else number(shape.shape, "radius")
    if radius is None:
        return None
    if shape.tag == "sphere":
        return (radius, radius, radius)
    length = number(shape.shape, "length")
    if length is None:
        return None
    ends = radius if shape.tag == "capsule" else 0.0
    return (radius, radius, 0.5 * length + ends)


def _link_extent(robot: CheckedUrdf, link: DraftLink) -> Extent | None:
    """Around the visuals, or the collisions where nothing is drawn."""
    shapes = link.of_kind("visual") or link.of_kind("collision")
    boxes = []
    for shape in shapes:
        box, T = shape_extent(robot, shape), placement_of(shape.element)
        if box is None or T is None:
            return None
        boxes.append(_moved(box, T))
    if not boxes:
        return None
    low = np.min([box.low for box in boxes], axis=0)
    high = np.max([box.high for box in boxes], axis=0)
    return Extent(low, high, sum(box.volume for box in boxes))


def _moved(box: Extent, T: Array) -> Extent:
    centre = T[:3, :3] @ (0.5 * (box.low + box.high)) + T[:3, 3]
    half = np.abs(T[:3, :3]) @ (0.5 * (box.high - box.low))
    return Extent(centre - half, centre + half, box.volume)
