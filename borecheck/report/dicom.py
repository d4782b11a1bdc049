"""A result as DICOM files: surfaces of what was checked, and the verdict as text."""

from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh.primitives import cylinder
from borecheck.geometry.mesh_files.slicer_stl import stl_for_slicer
from borecheck.patients.dicom_out import (
    Reference,
    encapsulated_stl,
    new_uid,
    text_report,
)
from borecheck.report.slicer import slicer_files

if TYPE_CHECKING:
    from borecheck.plans.patient_place import PatientPlace
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

# A plan's line is shown as a needle of this radius, [m].
SHOWN_RADIUS = 0.5e-3


def dicom_files(
    robot: "Robot",
    scene: "Scene",
    document: Mapping[str, Any],
    place: "PatientPlace",
    reference: Reference,
) -> dict[str, bytes]:
    """Names and contents of the files.

    Args:
        robot: The robot.
        scene: What stands around it.
        document: The result of `check`, contacts placed (`touching`).
        place: Where the patient's LPS coordinates lie in the scanner's frame.
        reference: The series whose coordinates these are.
    """
    surfaces = {
        name: content
        for name, content in slicer_files(robot, scene, document, place).items()
        if isinstance(content, bytes)
    }
    for k, plan in enumerate(document.get("plans", ()), 1):
        ends = place.to_lps(np.array([plan["entry"], plan["target"]]))
        surfaces[f"plan_{k}.stl"] = stl_for_slicer(_line(*ends))
    series = new_uid()
    files = {
        f"{name.removesuffix('.stl')}.dcm": encapsulated_stl(
            reference, content, name.removesuffix(".stl"), series, k
        )
        for k, (name, content) in enumerate(surfaces.items(), 1)
    }
    files["verdict.dcm"] = text_report(
        reference, list(_items(document, place)), new_uid()
    )
    return files


def _items(
    document: Mapping[str, Any], place: "PatientPlace"
) -> Iterator[tuple[str, str]]:
    """Heading and text of what is said."""
    yield "Verdict", f"{document['verdict']}: {document['reason']}"
    yield "Robot", str(document["robot"]["name"])
    for obstacle in document["scene"]["obstacles"]:
        words = f"{obstacle['role']} {obstacle['name']}, sha256 {obstacle['sha256']}"
        yield "Obstacle", words
    yield "Patient coordinates", place.stated
    for block in document.get("plans", [document]):
        whose = block.get("name", "pose or path")
        if "name" in block:
            yield "Plan", f"{whose}: {block['verdict']}: {block['reason']}"
        file = (block.get("certificate") or {}).get("file")
        if file is not None:
            hashed = sha256(Path(file).read_bytes()).hexdigest()
            yield "Certificate", f"{whose}: {Path(file).name}, sha256 {hashed}"
    for warning in document["warnings"]:
        yield "Warning", warning
    for phrase in document["not_modelled"]:
        yield "Not covered", phrase


def _line(entry: Array, target: Array) -> Array:
    """Triangles of a thin needle from entry to target, (n, 3, 3), [m]."""
    along = target - entry
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    R = np.column_stack([x, np.cross(z, x), z])
    needle = cylinder("plan", SHOWN_RADIUS, length)  # about its middle, along z
    return needle.corners @ R.T + (entry + target) / 2.0
