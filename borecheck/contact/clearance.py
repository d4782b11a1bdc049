"""Distance between robot and surroundings: the smallest one, and where it is."""

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.verdict import Closest
from borecheck.geometry.surfaces import surface
from borecheck.geometry.tree.mesh_tree import NearestPoints
from borecheck.geometry.triangles.placing import placed_bounds
from borecheck.plans.corridor import Corridor
from borecheck.robots.parts import Part
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Obstacle, Scene

Array = NDArray[np.float64]

WORLD = np.eye(4)


def to_obstacles(
    robot: Robot,
    scene: Scene,
    placements: dict[str, Array],
    corridor: Corridor | None = None,
    *,
    every_link: bool = False,
) -> tuple[Closest | None, dict[str, float] | None]:
    """The nearest points of robot and obstacles, and every part's clearance if asked.

    With a corridor the needle's distance to the patient is left out: it is meant to
    be there, and `contact.check` sees to it that it stays within the corridor.

    Returns:
        The closest pair (None without obstacles), and {part: clearance [m]}.
    """
    best: Closest | None = None
    links: dict[str, float] = {}
    for bound, index, obstacle in _by_bound(robot, scene, placements, corridor):
        part = robot.parts[index]
        name = part.mesh.name
        limit = links.get(name, np.inf) if every_link else _distance(best)
        if bound > limit:
            continue
        a, b = surface(part.mesh), surface(obstacle.mesh)
        found = a.tree.closest(b.tree, placements[part.link], WORLD)
        closest = closest_of(part, obstacle, found)
        links[name] = min(links.get(name, np.inf), closest.distance)
        if best is None or closest.distance < best.distance:
            best = closest
    return best, (links if every_link else None)


def closest_of(part: Part, obstacle: Obstacle, found: NearestPoints) -> Closest:
    """Nearest points of a part and an obstacle, with their names.

    Of round shapes the upper bound grows by how far their polyhedra lie outside them.
    """
    return Closest(
        link=part.mesh.name,
        obstacle=obstacle.name,
        role=obstacle.role,
        distance=found.lower,
        upper=found.upper + part.mesh.excess + obstacle.mesh.excess,
        points=(_point(found.point_self), _point(found.point_other)),
        triangles=(int(found.triangle_self), int(found.triangle_other)),
    )


def _by_bound(
    robot: Robot,
    scene: Scene,
    placements: dict[str, Array],
    corridor: Corridor | None,
) -> list[tuple[float, int, Obstacle]]:
    """Pairs of part and obstacle, those whose boxes are nearest first."""
    pairs = []
    for index, part in enumerate(robot.parts):
        low, high = placed_bounds(placements[part.link], part.mesh.bounds)
        for number, obstacle in enumerate(scene.obstacles):
            if corridor is not None and robot.may_enter(part.link, obstacle.role):
                continue
            box = obstacle.mesh.bounds
            gap = np.maximum(0.0, np.maximum(low - box[1], box[0] - high))
            pairs.append((float(np.linalg.norm(gap)), index, number))
    pairs.sort()
    return [(bound, index, scene.obstacles[number]) for bound, index, number in pairs]


def _distance(best: Closest | None) -> float:
    return np.inf if best is None else best.upper


def _point(values: Array) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
