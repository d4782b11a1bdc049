"""Solids wholly inside others, which no triangle test can see, for robot and scene."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.verdict import UNKNOWN, Containment
from borecheck.core.se3 import inverse
from borecheck.geometry.mesh.enlarge import Enlarged
from borecheck.geometry.surfaces import Surface, surface
from borecheck.geometry.triangles.placing import place_mesh, placed_bounds
from borecheck.geometry.triangles.solid import Enclosure, contained
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


def of_obstacles(
    robot: Robot,
    scene: Scene,
    placements: dict[str, Array],
    punctured: Collection[tuple[str, str]] = (),
    among: Collection[tuple[int, int]] | None = None,
) -> list[Containment]:
    """Parts and obstacles of which one holds the other, or of which none can tell.

    Surfaces must be known not to meet. Open meshes give `unknown` unless the bounding
    boxes answer for them.

    Args:
        robot: The robot.
        scene: The scene.
        placements: T_scene_link of every link.
        punctured: Names of part and obstacle whose surfaces meet as planned: what is
            inside there is the needle in its corridor.
        among: Numbers of the parts and obstacles to ask; of others it is known that
            nothing is held. None: all.
    """
    found = []
    for i, part in enumerate(robot.parts):
        a = surface(part.mesh)
        for j, obstacle in enumerate(scene.obstacles):
            if among is not None and (i, j) not in among:
                continue
            if (part.mesh.name, obstacle.name) in punctured:
                continue
            b = surface(obstacle.mesh)
            T, names = placements[part.link], (part.mesh.name, obstacle.name)
            found += _ask(*names, obstacle.role, a, T, b)
    return found


def of_itself(
    robot: Robot,
    placements: dict[str, Array],
    among: Collection[tuple[int, int]] | None = None,
) -> list[Containment]:
    """As `of_obstacles`, of parts that may not touch each other."""
    found = []
    for i, j in robot.self_pairs:
        if among is not None and (i, j) not in among:
            continue
        first, second = robot.parts[i], robot.parts[j]
        T_a, T_b = placements[first.link], placements[second.link]
        a, b = surface(first.mesh), surface(second.mesh)
        found += _ask(first.mesh.name, second.mesh.name, "self", a, T_a, b, T_b)
    return found


def lies_in_grown(grown: Enlarged, T_world_part: Array, obstacle: Surface) -> bool:
    """Whether a component of the obstacle lies in the grown part, surfaces apart.

    No triangle test sees it: a small obstacle between a part and the surface of what
    the part grew to. The surfaces must be known not to meet.
    """
    low, high = placed_bounds(T_world_part, grown.mesh.bounds)
    if not _has_component_within(obstacle, low, high):
        return False
    T_part_world = inverse(T_world_part)
    near = np.stack(placed_bounds(T_part_world, obstacle.mesh.bounds))
    return any(
        contained(
            place_mesh(T_world_part, solid), obstacle.mesh, None, obstacle.topology
        ).kind
        == "b_in_a"
        for solid in grown.solids(near)
    )


def _has_component_within(obstacle: Surface, low: Array, high: Array) -> bool:
    corners = obstacle.mesh.corners
    outside = ~((corners >= low) & (corners <= high)).all(axis=(1, 2))
    component = obstacle.topology.component
    return bool(np.unique(component[outside]).size < component.max() + 1)


def _ask(
    name_a: str,
    name_b: str,
    role: str,
    a: Surface,
    T_a: Array,
    b: Surface,
    T_b: Array | None = None,
) -> list[Containment]:
    if boxes_apart(a, T_a, b, T_b):
        return []
    answer = holds_or_might(a, T_a, b, T_b)
    if answer.kind == "none":
        return []
    state = UNKNOWN if answer.kind == "unknown" else answer.kind
    return [Containment(name_a, name_b, role, state, answer.reason)]


def holds_or_might(a: Surface, T_a: Array, b: Surface, T_b: Array | None) -> Enclosure:
    """Whether one of two placed surfaces that do not meet holds a part of the other.

    Args:
        a: One of them.
        T_a: Its placement, (4, 4).
        b: The other.
        T_b: Its placement; None: where it is.
    """
    placed_a = place_mesh(T_a, a.mesh)
    placed_b = b.mesh if T_b is None else place_mesh(T_b, b.mesh)
    return contained(placed_a, placed_b, a.topology, b.topology)


def boxes_apart(a: Surface, T_a: Array, b: Surface, T_b: Array | None) -> bool:
    """Whether the boxes of the placed meshes surely do not meet (spares placing)."""
    low_a, high_a = placed_bounds(T_a, a.mesh.bounds)
    low_b, high_b = b.mesh.bounds if T_b is None else placed_bounds(T_b, b.mesh.bounds)
    return bool((low_a > high_b).any() or (low_b > high_a).any())
