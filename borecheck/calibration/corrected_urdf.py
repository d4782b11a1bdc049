"""The URDF of the arm as it was found to be: only joint origins change."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.calibration.axes_motion import Lines
from borecheck.calibration.serial_arm import SerialArm
from borecheck.core.se3 import inverse, matrix_rpy
from borecheck.errors import UrdfError
from borecheck.robots.urdf import source as urdf_source
from borecheck.robots.urdf.tree import UrdfTree

Array = NDArray[np.float64]


def corrected_urdf(
    text: str,
    tree: UrdfTree,
    arm: SerialArm,
    lines: Lines,
    mesh_folders: tuple[Path, Path] | None = None,
) -> str:
    """URDF text in which the arm's joints turn about the found axes.

    A joint's frame is moved as little as possible: turned by the smallest rotation onto
    the found axis and shifted across it. Place along and angle about an axis are not
    seen by its own motion; what lies above has taken them up already. Links, meshes,
    limits and inertias stay as they are.

    Args:
        text: The URDF text (xacro expanded) that `tree` was read from.
        tree: The robot.
        arm: The calibrated part of it.
        lines: The found axes at zero, in the arm's world frame.
        mesh_folders: Where relative mesh names start, and where the text is written:
            meshes that are not below it get absolute names. None leaves all names.
    """
    from lxml import etree

    try:
        root = etree.fromstring(text.encode())
    except etree.XMLSyntaxError as error:
        raise UrdfError(tree.source, f"is no XML: {error}") from error
    elements = {e.get("name"): e for e in urdf_source.children(root, "joint")}
    for name, origin in corrected_origins(tree, arm, lines).items():
        _set_origin(elements[name], origin)
    if mesh_folders is not None:
        for mesh in root.iter("mesh"):
            mesh.set("filename", _renamed(mesh.get("filename", ""), *mesh_folders))
    note = f" joint origins of {arm.name} corrected by calibration "
    root.insert(0, etree.Comment(note))
    return etree.tostring(root, encoding="unicode", pretty_print=True) + "\n"


def _renamed(name: str, old: Path, new: Path) -> str:
    if "://" in name or Path(name).is_absolute():
        return name
    mesh, folder = (old / name).resolve(), new.resolve()
    # a name that climbs out of the folder is refused by careful readers
    return str(mesh.relative_to(folder) if mesh.is_relative_to(folder) else mesh)


def corrected_origins(tree: UrdfTree, arm: SerialArm, lines: Lines) -> dict[str, Array]:
    """T_parent_child at zero of every corrected joint, (4, 4)."""
    above = {joint.child: joint for joint in tree.joints}
    T_world_found = {arm.world_link: np.eye(4)}  # joint frame = its child link at zero
    origins = {}
    for i, name in enumerate(arm.joint_names):
        joint = tree.joint(name)
        T_found = moved_onto(arm.T_world_joint[i], arm.lines, lines, i)
        T_base_parent, base = np.eye(4), joint.parent
        while base not in T_world_found:
            step = above[base]
            T_step = step.origin
            if step.name in arm.held:
                T_step = T_step.copy()
                T_step[:3, 3] += arm.held[step.name] * (T_step[:3, :3] @ step.axis)
            T_base_parent, base = T_step @ T_base_parent, step.parent
        origins[name] = inverse(T_world_found[base] @ T_base_parent) @ T_found
        T_world_found[joint.child] = T_found
    return origins


def moved_onto(T: ArrayLike, nominal: Lines, found: Lines, i: int) -> Array:
    """A joint's frame moved onto its found axis, as little as possible, (4, 4)."""
    T = np.array(T, dtype=np.float64)
    u0, u1 = nominal.directions[i], found.directions[i]
    T[:3, :3] = smallest_rotation(u0, u1) @ T[:3, :3]
    away = T[:3, 3] - found.points[i]
    T[:3, 3] = found.points[i] + (away @ u1) * u1
    return T


def smallest_rotation(a: Array, b: Array) -> Array:
    """The rotation (3, 3) that turns unit vector a onto b and nothing else."""
    cross = np.cross(a, b)
    x, y, z = cross
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + K + K @ K / (1.0 + a @ b))


def _set_origin(joint: Any, T: Array) -> None:
    from lxml import etree

    found = urdf_source.children(joint, "origin")
    origin = found[0] if found else etree.SubElement(joint, "origin")
    origin.set("xyz", " ".join(repr(float(x)) for x in T[:3, 3]))
    origin.set("rpy", " ".join(repr(float(x)) for x in matrix_rpy(T[:3, :3])))
