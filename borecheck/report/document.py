"""A result as one JSON document that holds everything its report needs."""

import json
import os
import platform
from collections.abc import Mapping, Sequence
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck import __version__
from borecheck.errors import BorecheckError
from borecheck.written_beside import written_beside

if TYPE_CHECKING:
    from borecheck.motion_check import MotionVerdict
    from borecheck.robot import Robot
    from borecheck.scene import Scene
    from borecheck.verdict import Verdict

SCHEMA_VERSION = "1"

_PACKAGES = {
    "numpy": "numpy",
    "numba": "numba",
    "pinocchio": "pin",
    "coal": "coal",
    "xacro": "xacro",
    "yourdfpy": "yourdfpy",
}


def header(command: str, argv: Sequence[str], date: str | None) -> dict[str, Any]:
    """What every result begins with: schema, command line, date, versions."""
    return {
        "schema_version": SCHEMA_VERSION,
        "command": command,
        "argv": ["borecheck", *argv],
        "date": date,
        "versions": versions(),
    }


def versions() -> dict[str, str]:
    """Versions of borecheck, Python and what the numbers depend on."""
    found = {"borecheck": __version__, "python": platform.python_version()}
    for name, package in _PACKAGES.items():
        try:
            found[name] = version(package)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def robot_block(robot: "Robot") -> dict[str, Any]:
    """The robot as it was checked: arguments, joints, hashes."""
    from borecheck.pair_search import surface

    model = robot.model
    return {
        "name": robot.name,
        "arguments": dict(robot.arguments),
        "level": robot.level,
        "file": str(robot.file),
        "urdf_sha256": sha256(robot.urdf_text.encode()).hexdigest(),
        "T_scene_root": robot.T_scene_root.tolist(),
        "joints": [
            {
                "name": joint.name,
                "type": joint.type,
                "lower": _finite(joint.lower),
                "upper": _finite(joint.upper),
            }
            for joint in model.free_joints
        ],
        "parts": [
            {
                "name": part.mesh.name,
                "link": part.link,
                "triangles": len(part.mesh.triangles),
                "closed": surface(part.mesh).topology.is_closed,
                "sha256": part.mesh.sha256,
            }
            for part in robot.parts
        ],
        "warnings": list(robot.warnings),
    }


def scene_block(scene: "Scene") -> dict[str, Any]:
    """The scene as it was checked: arguments, roles, hashes, points."""
    from borecheck.pair_search import surface

    return {
        "name": scene.name,
        "arguments": dict(scene.arguments),
        "level": scene.level,
        "obstacles": [
            {
                "name": obstacle.name,
                "role": obstacle.role,
                "source": obstacle.source,
                "triangles": len(obstacle.mesh.triangles),
                "closed": surface(obstacle.mesh).topology.is_closed,
                "sha256": obstacle.mesh.sha256,
            }
            for obstacle in scene.obstacles
        ],
        "points": {name: T.tolist() for name, T in scene.points.items()},
        "warnings": list(scene.warnings),
    }


def verdict_block(verdict: "Verdict", joint_names: Sequence[str]) -> dict[str, Any]:
    """One configuration's answer, q by joint name."""
    block = verdict.to_json()
    block["q"] = dict(zip(joint_names, verdict.q, strict=True))
    return block


def motion_block(motion: "MotionVerdict", joint_names: Sequence[str]) -> dict[str, Any]:
    """A motion's answer: the deciding pose's fields, and `path` with every sample."""
    poses = [verdict_block(pose, joint_names) for pose in motion.poses]
    worst = poses[motion.worst]
    return {
        **worst,
        "verdict": motion.verdict,
        "reason": motion.reason,
        "qualifiers": list(motion.qualifiers),
        "not_modelled": [*worst["not_modelled"], *motion.not_covered],
        "pairs_examined": sum(pose["pairs_examined"] for pose in poses),
        "pairs_pruned": sum(pose["pairs_pruned"] for pose in poses),
        "seconds": sum(pose["seconds"] for pose in poses),
        "path": {
            "certified": motion.certified,
            "sampled_clear": motion.sampled_clear,
            "samples": len(poses),
            "intervals": [interval.to_json() for interval in motion.intervals],
            "first_contact": motion.first_contact,
            "worst": {
                "fraction": motion.fractions[motion.worst],
                "clearance_m": worst["clearance_m"],
                "closest": worst["closest"],
            },
            "fractions": list(motion.fractions),
            "poses": poses,
            "waypoints": [
                dict(zip(joint_names, q, strict=True)) for q in motion.waypoints
            ],
        },
    }


def dumps(document: Mapping[str, Any]) -> str:
    """The document as text, the same for the same content; NaN is refused."""
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def check_writable(path: Path) -> None:
    """Refuses an output file before the work is done, not after.

    Raises:
        BorecheckError: The folder does not exist or cannot be written to.
    """
    folder = path.absolute().parent
    if path.is_dir():
        raise BorecheckError(f"{path} is a directory, not a file to write")
    if not folder.is_dir():
        raise BorecheckError(f"{path}: there is no folder {folder}")
    if not os.access(folder, os.W_OK):
        raise BorecheckError(f"{path}: no permission to write in {folder}")


def write_whole(path: Path, text: str) -> None:
    """Writes a file that appears whole or not at all.

    Raises:
        BorecheckError: It cannot be written.
    """
    path = path.absolute()
    try:
        temporary = written_beside(path, text.encode())
        try:
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise BorecheckError(f"{path} cannot be written: {error.strerror}") from error


def _finite(value: float) -> float | None:
    return None if value in (float("inf"), float("-inf")) else float(value)
