"""A result for a scene of 3D Slicer: plans, contacts, nearest points, bodies, robot.

Everything is in the patient's LPS coordinates and says so: markups in mm, models as
binary STL whose header states the space, and the transform that moves what is in the
patient's coordinates into the scanner's frame.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import inverse
from borecheck.exchange.itk_transform import transform_text
from borecheck.exchange.markups import markup_json
from borecheck.geometry.mesh_files.slicer_stl import stl_for_slicer
from borecheck.report.touching import telling_pose

if TYPE_CHECKING:
    from borecheck.plans.patient_place import PatientPlace
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

# Green, red and amber are told apart without colour by the words beside them.
COLOURS = {
    "clear": (0.15, 0.65, 0.25),
    "contact": (0.85, 0.10, 0.10),
    "unknown": (0.90, 0.65, 0.05),
}

# A robot's surface is a megabyte: of more motions only the first have one.
MOST_ROBOTS = 20

VERDICT_FILE = "borecheck_verdict.txt"


def slicer_files(
    robot: "Robot", scene: "Scene", document: Mapping[str, Any], place: "PatientPlace"
) -> dict[str, str | bytes]:
    """Names and contents of the files that show a result in Slicer.

    Args:
        robot: The robot.
        scene: What stands around it.
        document: The result of `check`, contacts placed (`touching`).
        place: Where the patient's LPS coordinates lie in the scanner's frame.
    """
    files: dict[str, str | bytes] = {
        VERDICT_FILE: _words(document, place),
        # a .tfm goes from the fixed space, the scanner's, to the patient's
        "scanner_from_patient.tfm": transform_text(inverse(place.T_scanner_lps)),
    }
    for obstacle in scene.obstacles:
        name = _free(f"{obstacle.role}_{obstacle.name}", ".stl", files)
        shown = place.to_lps(obstacle.mesh.corners.reshape(-1, 3)).reshape(-1, 3, 3)
        files[name] = stl_for_slicer(shown)
    for k, block in enumerate(document.get("plans", [document])):
        whose = block.get("name", "result")
        for stem, content in _of_one(robot, block, place, k < MOST_ROBOTS):
            suffix = ".stl" if isinstance(content, bytes) else ".mrk.json"
            files[_free(f"{stem}_{whose}", suffix, files)] = content
    return files


def _of_one(
    robot: "Robot", block: Mapping[str, Any], place: "PatientPlace", shown: bool
) -> Iterator[tuple[str, str | bytes]]:
    """The files of one plan, path or pose; the robot's surface if it is shown."""
    verdict = block["verdict"]
    said = f"{verdict.upper()}: {block['reason']}"
    colour = COLOURS[verdict]
    if "entry" in block:
        ends = place.to_lps(np.array([block["entry"], block["target"]]))
        yield (
            "plan",
            markup_json(
                block["name"],
                "Line",
                ends,
                ["entry", "target"],
                descriptions=[said, said],
                colour=colour,
            ),
        )
    if not block.get("reachable", True):
        return
    if block.get("touching"):
        yield "contacts", _contacts(block["touching"], place)
    closest = block.get("closest")
    if closest is not None and verdict != "contact":
        points = place.to_lps(np.array(closest["points"]))
        labels = [closest["link"], closest["obstacle"]]
        text = f"least clearance: {1e3 * block['clearance_m']:.3f} mm or more"
        yield (
            "closest",
            markup_json(
                "least clearance",
                "Line",
                points,
                labels,
                descriptions=[text, text],
                colour=colour,
            ),
        )
    if shown:
        yield "robot", stl_for_slicer(_robot_corners(robot, telling_pose(block), place))


def _contacts(rows: Sequence[Mapping[str, Any]], place: "PatientPlace") -> str:
    points = place.to_lps(np.array([row["place_m"] for row in rows]))
    labels = [f"{row['link']} - {row['obstacle']}" for row in rows]
    said = [f"{row['pairs']} triangle pairs" for row in rows]
    red = COLOURS["contact"]
    return markup_json(
        "contacts", "Fiducial", points, labels, descriptions=said, colour=red
    )


def _robot_corners(
    robot: "Robot", pose: Mapping[str, Any], place: "PatientPlace"
) -> Array:
    """All triangles of the robot at a pose, in LPS, (n, 3, 3), [m]."""
    placed = robot.placements(robot.model.configuration(pose["q"]))
    corners = []
    for part in robot.parts:
        T = placed[part.link]
        corners.append(part.mesh.corners.reshape(-1, 3) @ T[:3, :3].T + T[:3, 3])
    return place.to_lps(np.concatenate(corners)).reshape(-1, 3, 3)


def _words(document: Mapping[str, Any], place: "PatientPlace") -> str:
    lines = [
        f"{document['verdict'].upper()}: {document['reason']}",
        f"patient: {place.stated}",
        "coordinates of all files: LPS, mm",
        "robot_*.stl: at the pose of a contact, or of least clearance; of the first "
        f"{MOST_ROBOTS} plans",
    ]
    for plan in document.get("plans", ()):
        lines.append(f"{plan['name']}: {plan['verdict'].upper()}: {plan['reason']}")
    lines += [f"warning: {text}" for text in document["warnings"]]
    lines += [f"not covered: {text}" for text in document["not_modelled"]]
    return "\n".join(lines) + "\n"


def _free(stem: str, suffix: str, taken: Mapping[str, object]) -> str:
    """A file's name that no other file has, on any file system."""
    plain = re.sub(r"[^A-Za-z0-9.-]+", "_", stem)[:100]
    used = {name.lower() for name in taken}
    name, count = f"{plain}{suffix}", 2
    while name.lower() in used:
        name, count = f"{plain}_{count}{suffix}", count + 1
    return name
