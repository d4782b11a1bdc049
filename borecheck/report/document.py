"""A result as one JSON document that holds everything its report needs."""

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from borecheck.core.result_file import SCHEMA_VERSION
from borecheck.core.version import __version__

if TYPE_CHECKING:
    from borecheck.contact.checked import Checked
    from borecheck.contact.verdict import Verdict
    from borecheck.motion.samples import MotionVerdict
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene

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


def about_block(
    robot: "Robot", scene: "Scene", about: "Checked | None" = None
) -> dict[str, Any]:
    """What a result is about: robot, scene, what was checked, what is odd."""
    told = {} if about is None else {"checked": about.to_json()}
    odd = () if about is None else about.warnings
    return {
        "robot": robot_block(robot),
        "scene": scene_block(scene),
        **told,
        "warnings": [*robot.warnings, *scene.warnings, *odd],
    }


def robot_block(robot: "Robot") -> dict[str, Any]:
    """The robot as it was checked: arguments, joints, hashes."""
    from borecheck.geometry.surfaces import surface

    model = robot.model
    return {
        "name": robot.name,
        "arguments": dict(robot.arguments),
        "level": robot.level,
        "file": str(robot.file),
        "urdf_sha256": sha256(robot.urdf_text.encode()).hexdigest(),
        "srdf": _srdf(robot),
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


def _srdf(robot: "Robot") -> dict[str, Any] | None:
    """The SRDF that was read, if any."""
    if robot.allowances.srdf is None:
        return None
    return {
        "file": str(robot.allowances.srdf),
        "sha256": robot.srdf_sha256,
        "trust_never": robot.allowances.trust_never,
    }


def allowed_block(robot: "Robot", itself: Mapping[str, Any]) -> dict[str, Any]:
    """Pairs of links that may touch, and how to allow those that do.

    Args:
        robot: The robot.
        itself: What was found about it.
    """
    from borecheck.robots.allowed import hints

    unexamined = {pair.links for pair in robot.unexamined}
    return {
        "allowed": [
            {**asdict(pair), "skips_check": pair.links in unexamined}
            for pair in robot.allowed_contacts
        ],
        "hints": hints(robot.file, robot.allowances, itself.get("pairs", ())),
    }


def scene_block(scene: "Scene") -> dict[str, Any]:
    """The scene as it was checked: arguments, roles, hashes, points."""
    from borecheck.geometry.surfaces import surface

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
    del block["allowed"]  # they are the robot's, at every pose
    block["q"] = dict(zip(joint_names, verdict.q, strict=True))
    return block


def motion_block(motion: "MotionVerdict", joint_names: Sequence[str]) -> dict[str, Any]:
    """A motion's answer: the worst pose's fields, and `path` with every sample.

    `clearance_m`, `clearance_upper_m`, `closest` and `q` are those of the certified
    least clearance of the whole motion, or null: what samples say has no such name.
    """
    poses = [verdict_block(pose, joint_names) for pose in motion.poses]
    worst = poses[motion.worst]
    return {
        **worst,
        **_least_block(motion, joint_names),
        "verdict": motion.verdict,
        "reason": motion.reason,
        "qualifiers": list(motion.qualifiers),
        "obstacles": motion.obstacles.to_json(),
        "itself": motion.itself.to_json(),
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
            "contact_begins": _stretch(motion.begins),
            "worst": {
                "fraction": motion.fractions[motion.worst],
                "sampled_clearance_m": worst["clearance_m"],
                "closest": worst["closest"],
            },
            "least": _least_instant(motion),
            "fractions": list(motion.fractions),
            "poses": poses,
            "waypoints": [
                dict(zip(joint_names, q, strict=True)) for q in motion.waypoints
            ],
        },
    }


def _least_block(motion: "MotionVerdict", joint_names: Sequence[str]) -> dict[str, Any]:
    """The certified least clearance; a single pose has its own."""
    if len(motion.waypoints) == 1 or motion.least is None:
        pose = motion.poses[0].closest if len(motion.waypoints) == 1 else None
        return {
            "clearance_m": motion.poses[0].clearance_m if pose else None,
            "clearance_upper_m": pose.upper if pose else None,
            "closest": None if pose is None else asdict(pose),
        }
    least = motion.least
    import numpy as np

    from borecheck.motion.samples import configurations_at

    q = configurations_at(np.array(motion.waypoints), np.array([least.at]))[0]
    return {
        "clearance_m": least.lower,
        "clearance_upper_m": least.upper,
        "closest": None if motion.closest is None else asdict(motion.closest),
        "q": dict(zip(joint_names, q.tolist(), strict=True)),
    }


def _stretch(ends: tuple[float, float] | None) -> dict[str, float] | None:
    return None if ends is None else {"from": ends[0], "to": ends[1]}


def _least_instant(motion: "MotionVerdict") -> dict[str, Any] | None:
    """At which instant the motion comes nearest, and how sharp that is."""
    least = motion.least
    if least is None:
        return None
    return {
        "fraction": least.at,
        "clearance_m": least.lower,
        "clearance_upper_m": least.upper,
        "within_tolerance": least.within_tolerance,
    }


def dumps(document: Mapping[str, Any]) -> str:
    """The document as text, the same for the same content; NaN is refused."""
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _finite(value: float) -> float | None:
    return None if value in (float("inf"), float("-inf")) else float(value)
