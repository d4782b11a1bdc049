"""Geometry for looking at: meshes of robot and scene, compressed, in a result.

For display only: meshes with very many triangles are thinned out (and the block says
so), numbers are rounded to micrometres. Verdicts always come from the full meshes, and
triangles in contact are sent as they were checked.
"""

import base64
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from borecheck.report.thinning import thinned

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene

Array = NDArray[np.float64]
Pose = dict[str, Any]

# More triangles of one mesh than a screen can show apart.
MOST_TRIANGLES = 70_000

# Triangle pairs lit per pose; the tables of the result hold all of them.
MOST_LIT = 300


def display_block(
    robot: "Robot", scene: "Scene", document: "Mapping[str, Any]"
) -> dict[str, Any]:
    """Meshes by name, where every link stands at every pose, and what is in contact.

    Args:
        robot: The robot.
        scene: The scene.
        document: The result so far: its poses say where the robot stands.

    Returns:
        `links` and `obstacles` (packed meshes), `frames` (names of all links), and
        `motions`: T_scene_frame of every pose (upper three rows, float32) and `lit`,
        the corners of triangle pairs in contact.
    """
    frames = list(robot.model.link_names)
    return {
        "links": [
            {"name": part.mesh.name, "link": part.link, **packed(part.mesh)}
            for part in robot.parts
        ],
        "obstacles": [
            {"name": o.name, "role": o.role, **packed(o.mesh)} for o in scene.obstacles
        ],
        "frames": frames,
        "needle": robot.needle.link if robot.needle else None,
        "motions": [
            _motion(robot, scene, frames, name, poses)
            for name, poses in poses_of(document)
        ],
    }


def poses_of(document: "Mapping[str, Any]") -> list[tuple[str, list[Pose]]]:
    """Name and poses of every motion (or single pose) of a result."""
    if "plans" in document:
        return [
            (plan["name"], plan["path"]["poses"])
            for plan in document["plans"]
            if "path" in plan
        ]
    if "path" in document:
        return [("path", document["path"]["poses"])]
    if "poses" in document:
        return [("poses", document["poses"])]
    return [("pose", [dict(document)])]


def _motion(
    robot: "Robot",
    scene: "Scene",
    frames: "Sequence[str]",
    name: str,
    poses: "Sequence[Pose]",
) -> dict[str, Any]:
    placements = np.zeros((len(poses), len(frames), 12), dtype="<f4")
    lit = []
    for k, pose in enumerate(poses):
        placed = robot.placements(robot.model.configuration(pose["q"]))
        for f, frame in enumerate(frames):
            placements[k, f] = placed[frame][:3].reshape(-1)
        pairs = [*pose.get("contacts", ()), *pose.get("self_contacts", ())]
        if pairs:
            corners = contact_corners(robot, scene, placed, pairs[:MOST_LIT])
            lit.append(
                {
                    "pose": k,
                    "shown": len(corners),
                    "of": len(pairs),
                    "corners": deflated(corners.astype("<f4")),
                }
            )
    return {
        "name": name,
        "poses": len(poses),
        "placements": deflated(placements),
        "lit": lit,
    }


def contact_corners(
    robot: "Robot",
    scene: "Scene",
    placed: "Mapping[str, Array]",
    pairs: "Sequence[Mapping[str, Any]]",
) -> Array:
    """Corners of both triangles of each pair as checked, (n, 2, 3, 3), [m].

    Args:
        robot: The robot.
        scene: What stands around it.
        placed: T_scene_link of its links.
        pairs: Records with parts and triangle numbers.
    """
    meshes = {part.mesh.name: (placed[part.link], part.mesh) for part in robot.parts}
    around = {o.name: (np.eye(4), o.mesh) for o in scene.obstacles}
    corners = np.zeros((len(pairs), 2, 3, 3))
    for k, pair in enumerate(pairs):
        first = meshes[pair["link"]]
        second = around.get(pair["obstacle"]) or meshes[pair["obstacle"]]
        corners[k, 0] = _placed_triangle(*first, pair["link_triangle"])
        corners[k, 1] = _placed_triangle(*second, pair["obstacle_triangle"])
    return corners


def _placed_triangle(T: Array, mesh: "TriangleMesh", triangle: int) -> Array:
    corners = mesh.vertices[mesh.triangles[triangle]]
    return corners @ T[:3, :3].T + T[:3, 3]


def packed(mesh: "TriangleMesh") -> dict[str, Any]:
    """A mesh as base64 of deflated arrays: 16-bit positions in its box, and indices.

    The position error is at most the box's size over 131,070 (micrometres for a
    link), and `moved_m` more where the mesh was thinned out.
    """
    vertices, triangles = _merged(mesh)
    moved = 0.0
    if len(triangles) > MOST_TRIANGLES:
        vertices, triangles, moved = thinned(vertices, triangles, MOST_TRIANGLES)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    step = np.maximum(high - low, 1e-12) / 65535.0
    positions = np.rint((vertices - low) / step).astype("<u2")
    return {
        "low": low.tolist(),
        "step": step.tolist(),
        "positions": deflated(positions),
        "indices": deflated(triangles.astype("<u4")),
        "triangles": len(triangles),
        "triangles_checked": len(mesh.triangles),
        "moved_m": moved,
    }


def unpacked(block: "Mapping[str, Any]") -> Array:
    """Corners of a packed mesh's triangles, (n, 3, 3), [m], in its own frame."""
    positions = inflated(block["positions"], "<u2").reshape(-1, 3)
    indices = inflated(block["indices"], "<u4").reshape(-1, 3)
    step, low = np.array(block["step"]), np.array(block["low"])
    corners: Array = (positions * step + low)[indices]
    return corners


def _merged(mesh: "TriangleMesh") -> tuple[Array, NDArray[np.int64]]:
    vertices, index = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return vertices, index.reshape(-1)[mesh.triangles]


# More than any page holds: a mesh of ten million triangles, [bytes].
MAX_INFLATED = 400_000_000


def deflated(array: NDArray[Any]) -> str:
    """The array's bytes, deflated (zlib), in base64."""
    return base64.b64encode(zlib.compress(array.tobytes(), 9)).decode("ascii")


def inflated(text: str, dtype: str) -> NDArray[Any]:
    """The flat array that `deflated` made into text."""
    unpacker = zlib.decompressobj()
    data = unpacker.decompress(base64.b64decode(text, validate=True), MAX_INFLATED)
    if unpacker.unconsumed_tail or not unpacker.eof:
        raise ValueError("packed numbers are cut short, or more than a page can hold")
    return np.frombuffer(data, dtype=dtype)
