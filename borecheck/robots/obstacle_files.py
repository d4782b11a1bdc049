"""Obstacles from files: `FILE[:unit][:frame][@x,y,z[,r,p,y]]`, placed in the scene.

What is typed holds. What is not typed and matters (a unit told from the size, a frame
that the file states) is shown, warned of, and keeps every verdict from being clear.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.bodies.spec import PREFIX, body_spec
from borecheck.core.units import LENGTH_UNITS, parse_pose
from borecheck.errors import MeshError, UnknownNameError, UrdfError, UsageError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.doubt import Doubt, FileDoubt
from borecheck.geometry.mesh_files.frames import (
    AS_IT_STANDS,
    FRAMES,
    PATIENT_FRAMES,
    UP_AXES,
    rotation,
    spelt,
    without_position,
)
from borecheck.geometry.mesh_files.reading import MeshFile, read_mesh_file
from borecheck.geometry.mesh_files.units import (
    guess_unit,
    large_obstacle,
    unit_mistake,
)
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.robots.description import ROLES
from borecheck.robots.file_text import FileText, split_file_text
from borecheck.robots.model import RobotModel
from borecheck.robots.parts import AS_DRAWN, collision_parts, links_without_collision
from borecheck.robots.robot_file import read_urdf
from borecheck.robots.unseen import unseen
from borecheck.robots.urdf.reach import NO_ROOTS, Roots

Array = NDArray[np.float64]

# Whatever stands in or around a scanner is about this large, [m]; a strange mesh
# without a unit is read so that its size comes nearest to it.
REFERENCE_SIZE = 1.0

URDF_SUFFIXES = (".urdf", ".xacro")

_FAR_PATIENT_M = 2.0  # a couch at its end; a patient farther off is elsewhere
_SAME_UNIT = 1e-6  # relative; "0.0254" and "0.02540005" are an inch


@dataclass(frozen=True, eq=False)
class Assumed:
    """Part of an obstacle that nobody has seen: a patient beyond the scan.

    Attributes:
        triangles: Which of its triangles, (m,).
        reason: What was assumed.
    """

    triangles: NDArray[np.bool_]
    reason: str


@dataclass(frozen=True)
class Obstacle:
    """A surface that the robot must not touch.

    Attributes:
        name: The link or file it comes from.
        role: scanner, couch, patient or other.
        mesh: Triangles in the scanner's frame, [m].
        source: File or description it was read from.
        doubt: Set when the file leaves open how it is meant; then nothing is clear.
        assumed: Triangles that were assumed; where they are nearest nothing is clear.
    """

    name: str
    role: str
    mesh: TriangleMesh
    source: str
    doubt: Doubt | None = None
    assumed: Assumed | None = None


@dataclass(frozen=True)
class FileObstacles:
    """What a file adds to a scene.

    Attributes:
        obstacles: Its surfaces.
        warnings: What the user should know about how it was read.
        not_modelled: What no verdict covers.
    """

    obstacles: tuple[Obstacle, ...]
    warnings: tuple[str, ...] = ()
    not_modelled: tuple[str, ...] = ()


def read_obstacle(text: str, role: str, roots: Roots = NO_ROOTS) -> FileObstacles:
    """Obstacles from `FILE[:unit][:frame][@x,y,z[,r,p,y]]` or `body:...[@...]`.

    Raises:
        UsageError: An unknown unit, frame or a pose that is none.
        MeshError: The file cannot be read, its unit is off by 1000, or it states
            another unit or frame than is typed.
        UrdfError: A URDF from which no geometry can be had.
    """
    if role not in ROLES:
        raise UnknownNameError("role", role, ROLES)
    if text.startswith(PREFIX):
        return _body(text, role)
    typed = split_file_text(text)
    T_scene_file = parse_pose(typed.pose) if typed.pose is not None else np.eye(4)
    if typed.path.suffix in URDF_SUFFIXES:
        if typed.unit is not None or typed.frame is not None:
            word = typed.unit or typed.frame
            raise UsageError(
                f"{typed.path} is in metres and in its own frame as every URDF: "
                f"leave out :{word}"
            )
        return _urdf_obstacles(typed.path, role, T_scene_file, roots)
    return _mesh_obstacle(typed, role, T_scene_file)


def _body(text: str, role: str) -> FileObstacles:
    """A patient's body by sex, height and body mass index, `body:...[@pose]`."""
    words, at, pose = text.partition("@")
    from borecheck.bodies.body import NOT_MODELLED, make_body  # seldom needed

    spec = body_spec(words)
    T = parse_pose(pose) if at else np.eye(4)
    placed = place_mesh(T, make_body(spec).mesh)
    obstacle = Obstacle("body", role, placed, str(spec))
    return FileObstacles((obstacle,), not_modelled=(NOT_MODELLED,))


def _mesh_obstacle(typed: FileText, role: str, T_scene_pose: Array) -> FileObstacles:
    found, guessed, warnings = _in_metres(typed)
    R, unheard, said = _orientation(typed, found)
    T_pose_file = np.eye(4)
    T_pose_file[:3, :3] = R
    placed = place_mesh(T_scene_pose @ T_pose_file, found.mesh)
    doubt = None
    if guessed is not None or unheard is not None:
        text = typed.completed(guessed, unheard)
        implied = found.frame_is_implied
        doubt = FileDoubt(str(typed.path), guessed, unheard, implied, text)
    if doubt is not None and unheard is not None:
        said = (*said, f"{doubt.reason}; until then nothing is called clear")
    far = far_patient(placed) if role == "patient" else ()
    lines = (*warnings, *said, *far, *found.warnings)
    obstacle = Obstacle(typed.path.stem, role, placed, str(typed.path), doubt)
    return FileObstacles((obstacle,), tuple(f"{typed.path}: {line}" for line in lines))


def _in_metres(typed: FileText) -> tuple[MeshFile, str | None, tuple[str, ...]]:
    """The mesh, the unit that was guessed for it, and what to say about its size."""
    found = read_mesh_file(typed.path)
    if typed.unit is not None:
        scale = _scale(typed, typed.unit, found)
        if scale != 1.0:
            found = read_mesh_file(typed.path, scale)
    elif found.unit_m is None:
        unit, warning = guess_unit(found.mesh, REFERENCE_SIZE)
        if unit != "m":
            found = read_mesh_file(typed.path, LENGTH_UNITS[unit])
        if warning is not None:
            return found, unit, (warning,)
    mistake = unit_mistake(found.mesh, REFERENCE_SIZE)
    if mistake is not None:
        raise MeshError(typed.path, mistake)
    large = large_obstacle(found.mesh)
    return found, None, (large,) if large else ()


def _scale(typed: FileText, unit: str, found: MeshFile) -> float:
    """What the numbers are still to be multiplied by; the file may state its unit."""
    metres = LENGTH_UNITS[unit]
    if found.unit_m is None:
        return metres
    if abs(found.unit_m / metres - 1.0) > _SAME_UNIT:
        raise MeshError(
            typed.path, f"states its unit, {found.unit_m:g} m: leave out :{unit}"
        )
    return 1.0


def _orientation(
    typed: FileText, found: MeshFile
) -> tuple[Array, str | None, tuple[str, ...]]:
    """Rotation R with p_scene = R p_file, the frame nobody acknowledged, warnings."""
    stated = found.frame
    if stated is not None and stated not in FRAMES:
        raise MeshError(
            typed.path,
            f"states the frame {spelt(stated)}, which is none of "
            f"{', '.join(FRAMES)}: export it in LPS or RAS",
        )
    if typed.frame is None:
        unheard = stated if stated != AS_IT_STANDS else None
        return np.eye(3), unheard, ()
    _refuse_contradiction(typed, found)
    return rotation(typed.frame), None, _frame_warnings(typed, found)


def _refuse_contradiction(typed: FileText, found: MeshFile) -> None:
    """Another frame than the file states; only `z-up`, as it stands, is a choice."""
    frame = without_position(str(typed.frame))
    stated = found.frame
    both_axes = frame in UP_AXES and stated in UP_AXES
    if stated in (None, frame) or frame == AS_IT_STANDS:
        return
    if found.frame_is_implied and both_axes:
        return
    raise MeshError(
        typed.path,
        f"states {spelt(str(stated))}, but {spelt(frame)} was typed: type "
        f"{FileText(typed.path, typed.unit, None, typed.pose).completed(None, stated)}",
    )


def _frame_warnings(typed: FileText, found: MeshFile) -> tuple[str, ...]:
    frame = str(typed.frame)
    if frame == AS_IT_STANDS and found.frame not in (None, AS_IT_STANDS):
        if found.frame_is_implied:
            return ()
        stated = spelt(str(found.frame))
        return (f"states {stated}; its numbers are taken as they stand ({frame})",)
    if frame not in PATIENT_FRAMES:
        return ()
    name = spelt(frame)
    lines = [f"{name} is read as of a patient head first, supine ({frame}-hfs)"]
    if typed.pose is None:
        lines.append(f"the origin of {name} is taken to be the isocentre")
    return tuple(lines)


def far_patient(mesh: TriangleMesh) -> tuple[str, ...]:
    """A line about a patient who lies far from the isocentre, the scene's origin."""
    nearest = np.clip(0.0, mesh.bounds[0], mesh.bounds[1])
    distance = float(np.linalg.norm(nearest))
    if distance <= _FAR_PATIENT_M:
        return ()
    return (f"a patient {distance:.3g} m from the isocentre: is the pose right?",)


def _urdf_obstacles(
    path: Path, role: str, T_scene_root: Array, roots: Roots
) -> FileObstacles:
    """The links of a URDF, standing at zero or at the limit nearest to it."""
    source, warnings = read_urdf(path, {}, roots)
    model = RobotModel(source)
    q = model.check_limits(np.clip(0.0, model.lower, model.upper))
    placements = model.placements(q)
    parts = collision_parts(model.tree, path, roots)
    obstacles = tuple(
        Obstacle(
            part.mesh.name,
            role,
            place_mesh(T_scene_root @ placements[part.link], part.mesh),
            str(path),
        )
        for part in parts
    )
    if not obstacles:
        raise UrdfError(path, "no link has collision geometry: no obstacle")
    if len(q):
        at = ", ".join(f"{n}={v:g}" for n, v in zip(model.joint_names, q, strict=True))
        warnings = (*warnings, f"{path}: an obstacle that stands at {at}")
    remarks = dict.fromkeys(remark for part in parts for remark in part.remarks)
    warnings = (*warnings, *(f"{path}: {remark}" for remark in remarks))
    bare = links_without_collision(model.tree)
    named = (
        *(f"{link} of {path}: {AS_DRAWN}" for link in bare),
        *(f"{path}: {line}" for line in unseen(model.tree, parts, path, roots)),
    )
    return FileObstacles(obstacles, warnings, named)
