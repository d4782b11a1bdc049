"""Geometry for looking at: meshes of robot and scene, compressed, in a result.

For display only: triangles may be thinned out (and the block says so); verdicts always
come from the full meshes.
"""

import base64
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Mapping

    from borecheck.mesh import TriangleMesh
    from borecheck.robot import Robot
    from borecheck.scene import Scene


def display_block(
    robot: "Robot", scene: "Scene", document: "Mapping[str, Any]"
) -> dict[str, Any]:
    """Meshes by name, and T_scene_link of every part at every pose of the result.

    Args:
        robot: The robot.
        scene: The scene.
        document: The result so far: its poses say where the robot stands.
    """
    return {
        "links": [
            {"name": part.mesh.name, "link": part.link, **packed(part.mesh)}
            for part in robot.parts
        ],
        "obstacles": [
            {"name": o.name, "role": o.role, **packed(o.mesh)} for o in scene.obstacles
        ],
        "motions": [
            {
                "name": name,
                "placements": [_placements(robot, q) for q in configurations],
            }
            for name, configurations in _motions(document)
        ],
    }


def _motions(
    document: "Mapping[str, Any]",
) -> list[tuple[str, list[dict[str, float]]]]:
    """Name and configurations of every motion (or single pose) of the result."""
    if "plans" in document:
        return [
            (plan["name"], [pose["q"] for pose in plan["path"]["poses"]])
            for plan in document["plans"]
            if "path" in plan
        ]
    if "path" in document:
        return [("path", [pose["q"] for pose in document["path"]["poses"]])]
    if "poses" in document:
        return [("poses", [pose["q"] for pose in document["poses"]])]
    return [("pose", [document["q"]])]


def _placements(robot: "Robot", q: dict[str, float]) -> dict[str, list[float]]:
    """The upper three rows of T_scene_link, row by row, of every link with a part."""
    placements = robot.placements(robot.model.configuration(q))
    links = dict.fromkeys(part.link for part in robot.parts)
    return {link: placements[link][:3].reshape(-1).tolist() for link in links}


def packed(mesh: "TriangleMesh") -> dict[str, Any]:
    """A mesh as base64 of deflated arrays: 16-bit positions in its box, and indices.

    The position error is at most the box's size over 131,070: micrometres for a link.
    """
    vertices, triangles = _merged(mesh)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    step = np.maximum(high - low, 1e-12) / 65535.0
    positions = np.rint((vertices - low) / step).astype("<u2")
    return {
        "low": low.tolist(),
        "step": step.tolist(),
        "positions": _deflated(positions),
        "indices": _deflated(triangles.astype("<u4")),
        "triangles": len(triangles),
        "triangles_checked": len(mesh.triangles),
    }


def _merged(mesh: "TriangleMesh") -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    vertices, index = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return vertices, index.reshape(-1)[mesh.triangles]


def _deflated(array: NDArray[Any]) -> str:
    return base64.b64encode(zlib.compress(array.tobytes(), 9)).decode("ascii")
