"""What stands around the robot: scanner, couch, patient, obstacles, by role."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.core.units import LENGTH_UNITS, parse_joint_value, parse_pose
from borecheck.errors import MeshError, UnknownNameError, UrdfError, UsageError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import read_mesh_in_unit, states_unit
from borecheck.geometry.mesh_files.units import GuessedUnit, guess_unit, unit_mistake
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.robots.description import (
    ROLES,
    ScannerDescription,
    installed,
    installed_names,
)
from borecheck.robots.model import RobotModel
from borecheck.robots.parts import AS_DRAWN, collision_parts, links_without_collision
from borecheck.robots.robot import (
    build_installed,
    complete_arguments,
    exists,
    read_urdf,
)

Array = NDArray[np.float64]

# Whatever stands in or around a scanner is about this large, [m]; a strange mesh
# without a unit is read so that its size comes nearest to it.
REFERENCE_SIZE = 1.0

URDF_SUFFIXES = (".urdf", ".xacro")


@dataclass(frozen=True)
class Obstacle:
    """A surface that the robot must not touch.

    Attributes:
        name: The link or file it comes from.
        role: scanner, couch, patient or other.
        mesh: Triangles in the scanner's frame, [m].
        source: File or description it was read from.
        guessed_unit: Set when nobody stated the unit of its file; then nothing is
            clear of it.
    """

    name: str
    role: str
    mesh: TriangleMesh
    source: str
    guessed_unit: GuessedUnit | None = None


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


@dataclass(frozen=True, eq=False)
class Scene:
    """All obstacles in the scanner's frame.

    Attributes:
        name: Scanner's name, or the files.
        description: Of an installed scanner.
        arguments: Its xacro arguments and joint positions, complete.
        level: Level of detail of its meshes.
        obstacles: What stands there.
        points: Named points, T_scene_point (4, 4).
        not_modelled: What no verdict in this scene covers.
        warnings: What the user should know about how files were read.
    """

    name: str
    description: ScannerDescription | None
    arguments: Mapping[str, str]
    level: str
    obstacles: tuple[Obstacle, ...]
    points: Mapping[str, Array]
    not_modelled: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def doubt(self) -> str | None:
        """Why nothing may be called clear in this scene: units that were guessed."""
        guesses = (o.guessed_unit for o in self.obstacles)
        doubts = dict.fromkeys(guess.doubt for guess in guesses if guess is not None)
        return "; ".join(doubts) or None

    def with_obstacles(
        self,
        more: Iterable[Obstacle],
        warnings: Iterable[str] = (),
        not_modelled: Iterable[str] = (),
    ) -> "Scene":
        """The scene with further obstacles; names are kept apart by a number."""
        obstacles = list(self.obstacles)
        for obstacle in more:
            taken = {o.name for o in obstacles}
            name = obstacle.name
            count = 2
            while name in taken:
                name = f"{obstacle.name}#{count}"
                count += 1
            obstacles.append(replace(obstacle, name=name))
        return Scene(
            self.name,
            self.description,
            self.arguments,
            self.level,
            tuple(obstacles),
            self.points,
            (*self.not_modelled, *not_modelled),
            (*self.warnings, *warnings),
        )


def load_scene(
    name: str | Path | Sequence[str | Path],
    *,
    level: str = "coarse",
    obstacles: Sequence[str] = (),
    patients: Sequence[str] = (),
    package_paths: Sequence[Path] = (),
    **arguments: str,
) -> Scene:
    """A scene from an installed scanner's name or from mesh and URDF files.

    Args:
        name: For example "ct_gantry"; or files as `FILE[:unit][@x,y,z[,r,p,y]]`.
        level: Level of detail of an installed scanner's meshes.
        obstacles: Further files in the same form, in the role `other`.
        patients: Further files in the role `patient`.
        package_paths: Roots for `package://`.
        **arguments: xacro arguments and joint positions of the scanner.

    Raises:
        UnknownNameError: No such scanner, argument or joint.
        MeshError: A mesh that cannot be read, or whose unit is off by 1000.
    """
    return scene_with(name, arguments, level, obstacles, patients, package_paths)


def scene_with(
    name: str | Path | Sequence[str | Path],
    arguments: Mapping[str, str],
    level: str = "coarse",
    obstacles: Sequence[str] = (),
    patients: Sequence[str] = (),
    package_paths: Sequence[Path] = (),
) -> Scene:
    """As `load_scene`, for arguments of any name (`level`, `obstacles`, ...)."""
    names = [name] if isinstance(name, str | Path) else list(name)
    if len(names) == 1 and str(names[0]) in installed_names("scanners"):
        scene = _load_installed(str(names[0]), level, arguments)
    else:
        if arguments:
            raise UsageError("scene arguments go with an installed scanner only")
        if len(names) == 1:
            _refuse_unknown_scanner(str(names[0]))
        scene = _empty(" + ".join(map(str, names)))
        scene = _with_files(scene, [str(n) for n in names], "other", package_paths)
    scene = _with_files(scene, obstacles, "other", package_paths)
    return _with_files(scene, patients, "patient", package_paths)


def _refuse_unknown_scanner(name: str) -> None:
    """A bare word that names no file is a scanner's name, misspelt."""
    if re.fullmatch(r"[A-Za-z_]\w*", name) and not exists(Path(name)):
        raise UnknownNameError("scanner", name, installed_names("scanners"))


def _empty(name: str) -> Scene:
    return Scene(name, None, {}, "as given", (), {}, (), ())


def _with_files(
    scene: Scene, files: Sequence[str], role: str, package_paths: Sequence[Path]
) -> Scene:
    for text in files:
        found = read_obstacle(text, role, package_paths)
        scene = scene.with_obstacles(
            found.obstacles, found.warnings, found.not_modelled
        )
    return scene


def _load_installed(name: str, level: str, given: Mapping[str, str]) -> Scene:
    description: ScannerDescription = installed("scanners", "scanner", name)
    joints = {n: t for n, t in given.items() if n in description.joints}
    shape = {n: t for n, t in given.items() if n not in description.joints}
    _check_known(description, shape)
    arguments = complete_arguments(description, shape)
    model, _ = build_installed(description, level, arguments)
    positions = _joint_positions(model, description, joints)
    placements = model.placements(model.check_limits(model.configuration(positions)))
    obstacles = tuple(
        Obstacle(
            part.mesh.name,
            description.roles.get(part.link, "other"),
            place_mesh(placements[part.link], part.mesh),
            name,
        )
        for part in collision_parts(model.tree, description.xacro)
    )
    points = {point: placements[point] for point in description.points}
    values = {**arguments, **{n: repr(v) for n, v in positions.items()}}
    bare = links_without_collision(model.tree)
    not_modelled = (
        *description.not_modelled,
        *(f"{link} of {name}: {AS_DRAWN}" for link in bare),
    )
    return Scene(name, description, values, level, obstacles, points, not_modelled, ())


def _check_known(description: ScannerDescription, given: Mapping[str, str]) -> None:
    for name in given:
        if name not in description.arguments:
            known = [*description.arguments, *description.joints]
            raise UnknownNameError("scene argument", name, known)


def _joint_positions(
    model: RobotModel, description: ScannerDescription, given: Mapping[str, str]
) -> dict[str, float]:
    positions = dict(description.joints)
    for name, text in given.items():
        joint = model.free_joints[model.joint_names.index(name)]
        positions[name] = parse_joint_value(str(text), revolute=joint.is_angle)
    return positions


def read_obstacle(
    text: str, role: str, package_paths: Sequence[Path] = ()
) -> FileObstacles:
    """Obstacles from `FILE[:unit][@x,y,z[,r,p,y]]`.

    Raises:
        UsageError: An unknown unit or a pose that is none.
        MeshError: The file cannot be read, or its unit is off by 1000.
        UrdfError: A URDF from which no geometry can be had.
    """
    if role not in ROLES:
        raise UnknownNameError("role", role, ROLES)
    path, unit, pose = _split(text)
    T_scene_file = parse_pose(pose) if pose is not None else np.eye(4)
    if path.suffix in URDF_SUFFIXES:
        if unit is not None:
            raise UsageError(f"{path} is in metres as every URDF: leave out :{unit}")
        return _urdf_obstacles(path, role, T_scene_file, package_paths)
    if unit is not None:
        mesh, guessed, warning = _stated_mesh(path, unit), None, None
    else:
        mesh, guessed, warning = _unstated_mesh(path, pose)
    placed = place_mesh(T_scene_file, mesh)
    obstacle = Obstacle(path.stem, role, placed, str(path), guessed)
    return FileObstacles((obstacle,), (f"{path}: {warning}",) if warning else ())


def _split(text: str) -> tuple[Path, str | None, str | None]:
    """File, unit and pose; a file whose name holds : or @ is taken whole."""
    if exists(Path(text)):
        return Path(text), None, None
    whole = re.fullmatch(r"(.+):([A-Za-z]+)", text)
    if whole is not None and exists(Path(whole[1])):
        rest, pose = text, None
    else:
        rest, pose = _cut(text)
    match = re.fullmatch(r"(.+):([A-Za-z]+)", rest)
    if match is None:
        return Path(rest), None, pose
    file, unit = match.groups()
    if unit not in LENGTH_UNITS:
        raise UsageError(
            f"unit {unit!r} of {file} is none of {', '.join(LENGTH_UNITS)}"
        )
    return Path(file), unit, pose


def _cut(text: str) -> tuple[str, str | None]:
    """What stands before the last @, and the pose behind it."""
    rest, at, pose = text.rpartition("@")
    return (rest, pose) if at else (text, None)


def _stated_mesh(path: Path, unit: str) -> TriangleMesh:
    mesh = read_mesh_in_unit(path, unit)
    mistake = unit_mistake(mesh, REFERENCE_SIZE)
    if mistake is not None:
        raise MeshError(path, mistake)
    return mesh


def _unstated_mesh(
    path: Path, pose: str | None
) -> tuple[TriangleMesh, GuessedUnit | None, str | None]:
    """The mesh in the unit its size tells, and what was guessed about it."""
    raw = read_mesh_in_unit(path, "m")
    unit, warning = guess_unit(raw, REFERENCE_SIZE)
    if warning is None or (unit == "m" and states_unit(path)):
        return raw, None, None
    mesh = raw if unit == "m" else read_mesh_in_unit(path, unit)
    at = f"@{pose}" if pose is not None else ""
    guessed = GuessedUnit(str(path), unit, f"{path}:{unit}{at}")
    return mesh, guessed, warning


def _urdf_obstacles(
    path: Path, role: str, T_scene_root: Array, package_paths: Sequence[Path]
) -> FileObstacles:
    """The links of a URDF, standing at zero or at the limit nearest to it."""
    text, warnings = read_urdf(path, {}, package_paths)
    model = RobotModel(text, str(path))
    q = model.check_limits(np.clip(0.0, model.lower, model.upper))
    placements = model.placements(q)
    obstacles = tuple(
        Obstacle(
            part.mesh.name,
            role,
            place_mesh(T_scene_root @ placements[part.link], part.mesh),
            str(path),
        )
        for part in collision_parts(model.tree, path, package_paths)
    )
    if not obstacles:
        raise UrdfError(path, "no link has collision geometry: no obstacle")
    if len(q):
        at = ", ".join(f"{n}={v:g}" for n, v in zip(model.joint_names, q, strict=True))
        warnings = (*warnings, f"{path}: an obstacle that stands at {at}")
    bare = links_without_collision(model.tree)
    named = tuple(f"{link} of {path}: {AS_DRAWN}" for link in bare)
    return FileObstacles(obstacles, warnings, named)
