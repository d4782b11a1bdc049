"""Solids wholly inside others, which no triangle test can see, for robot and scene."""

import numpy as np
from numpy.typing import NDArray

from borecheck.pair_search import Surface, surface
from borecheck.placing import place_mesh, placed_bounds
from borecheck.robot import Robot
from borecheck.scene import Scene
from borecheck.solid import contained
from borecheck.verdict import UNKNOWN, Containment

Array = NDArray[np.float64]


def all_contained(
    robot: Robot, scene: Scene, placements: dict[str, Array]
) -> list[Containment]:
    """Pairs of which one holds the other, or for which that cannot be told.

    Surfaces must be known not to meet. Open meshes give `unknown` unless the bounding
    boxes answer for them.
    """
    found = []
    for part in robot.parts:
        a = surface(part.mesh)
        for obstacle in scene.obstacles:
            b = surface(obstacle.mesh)
            found += _ask(part.mesh.name, obstacle.name, a, placements[part.link], b)
    for i, j in robot.self_pairs:
        first, second = robot.parts[i], robot.parts[j]
        T_a, T_b = placements[first.link], placements[second.link]
        a, b = surface(first.mesh), surface(second.mesh)
        found += _ask(first.mesh.name, second.mesh.name, a, T_a, b, T_b)
    return found


def _ask(
    name_a: str,
    name_b: str,
    a: Surface,
    T_a: Array,
    b: Surface,
    T_b: Array | None = None,
) -> list[Containment]:
    if boxes_apart(a, T_a, b, T_b):
        return []
    placed_a = place_mesh(T_a, a.mesh)
    placed_b = b.mesh if T_b is None else place_mesh(T_b, b.mesh)
    answer = contained(placed_a, placed_b, a.topology, b.topology)
    if answer.kind == "none":
        return []
    state = UNKNOWN if answer.kind == "unknown" else answer.kind
    return [Containment(name_a, name_b, state, answer.reason)]


def boxes_apart(a: Surface, T_a: Array, b: Surface, T_b: Array | None) -> bool:
    """Whether the boxes of the placed meshes surely do not meet (spares placing)."""
    low_a, high_a = placed_bounds(T_a, a.mesh.bounds)
    low_b, high_b = b.mesh.bounds if T_b is None else placed_bounds(T_b, b.mesh.bounds)
    return bool((low_a > high_b).any() or (low_b > high_a).any())
