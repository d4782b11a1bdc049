"""Where robot and surroundings touch: a row per pair of parts, with a place.

The place is a point of the contact for looking there, no measure of its depth: of the
points that triangles in contact have in common, the one in their midst. The way out
parts these two and says nothing of others.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.way_out import Placed, way_out
from borecheck.report.display import contact_corners

if TYPE_CHECKING:
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene

Array = NDArray[np.float64]
Record = Mapping[str, Any]

# Triangle pairs of one pair of parts that are looked at for a place.
MOST_LOOKED_AT = 500
# Pairs of parts whose way out is looked for: those that a text shows.
MOST_WAYS = 10


def touching(
    robot: "Robot", scene: "Scene", block: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Pairs of parts in contact, obstacles first, each with its place.

    Args:
        robot: The robot.
        scene: What stands around it.
        block: What is said of one pose, or of a motion: then of its worst sample.

    Returns:
        `link`, `obstacle`, `pairs` (how many of triangles) and `place_m`, scanner's
        frame; of the first rows `way_out_m`, a shift of the link that parts both, or
        null if none was found.
    """
    pose = telling_pose(block)
    rows: list[dict[str, Any]] = []
    for key in ("contacts", "self_contacts"):
        groups = _by_parts(pose[key])
        if not groups:
            continue
        placed = robot.placements(robot.model.configuration(pose["q"]))
        for names, pairs in groups:
            some = pairs[:: -(-len(pairs) // MOST_LOOKED_AT)]
            corners = contact_corners(robot, scene, placed, some)
            row = {
                "link": names[0],
                "obstacle": names[1],
                "pairs": len(pairs),
                "place_m": place(corners).tolist(),
            }
            if len(rows) < MOST_WAYS:
                margin = pose["margin_m"] if key == "contacts" else 0.0
                surfaces = _placed(robot, scene, placed, names)
                shift = way_out(*surfaces, corners, margin)
                row["way_out_m"] = None if shift is None else shift.tolist()
            rows.append(row)
    return rows


def _placed(
    robot: "Robot", scene: "Scene", placed: Mapping[str, Array], names: tuple[str, str]
) -> tuple[Placed, Placed]:
    """Two parts, or a part and an obstacle, where they stand."""
    there = {
        part.mesh.name: Placed(part.mesh, placed[part.link]) for part in robot.parts
    }
    around = {o.name: Placed(o.mesh, np.eye(4)) for o in scene.obstacles}
    return there[names[0]], around.get(names[1]) or there[names[1]]


def telling_pose(block: Mapping[str, Any]) -> Mapping[str, Any]:
    """The configuration whose contacts a result states."""
    if "path" not in block:
        return block
    path = block["path"]
    pose: Record = path["poses"][path["fractions"].index(path["worst"]["fraction"])]
    return pose


def _by_parts(pairs: Sequence[Record]) -> list[tuple[tuple[str, str], list[Record]]]:
    """Triangle pairs by the parts they are of, most of them first."""
    groups: dict[tuple[str, str], list[Record]] = {}
    for pair in pairs:
        groups.setdefault((pair["link"], pair["obstacle"]), []).append(pair)
    return sorted(groups.items(), key=lambda group: -len(group[1]))


def place(corners: Array) -> Array:
    """The point of a contact that lies in its midst, (3,), [m].

    Args:
        corners: Pairs of triangles in contact, (n, 2, 3, 3), [m].
    """
    first, second = corners[:, 0], corners[:, 1]
    points = np.concatenate([_through(first, second), _through(second, first)])
    if not len(points):  # flat on each other, or apart and within a margin
        return _between(first, second)
    middle = points.mean(axis=0)
    nearest: Array = points[np.argmin(((points - middle) ** 2).sum(axis=1))]
    return nearest


def _between(first: Array, second: Array) -> Array:
    """The middle between two nearest points of some triangles and others."""
    from borecheck.geometry.tree.mesh_tree import MeshTree

    trees = [
        MeshTree(c.reshape(-1, 3), np.arange(3 * len(c)).reshape(-1, 3), cached=False)
        for c in (first, second)
    ]
    found = trees[0].closest(trees[1], np.eye(4), np.eye(4))
    middle: Array = (found.point_self + found.point_other) / 2.0
    return middle


def _through(edges: Array, faces: Array) -> Array:
    """Where edges of triangles pass through the triangles they are paired with."""
    starts = edges.reshape(-1, 3)
    along = np.roll(edges, -1, axis=1).reshape(-1, 3) - starts
    a, b, c = np.repeat(faces, 3, axis=0).transpose(1, 0, 2)
    u, v = b - a, c - a
    normal = np.cross(u, v)
    down = (normal * along).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (normal * (a - starts)).sum(axis=1) / down
        points = starts + t[:, None] * along
        square = (normal**2).sum(axis=1)
        s = (normal * np.cross(points - a, v)).sum(axis=1) / square
        r = (normal * np.cross(u, points - a)).sum(axis=1) / square
        hit = (t >= 0) & (t <= 1) & (s >= 0) & (r >= 0) & (s + r <= 1)
    return points[hit & np.isfinite(points).all(axis=1)]
