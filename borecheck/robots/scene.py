"""What stands around the robot: scanner, couch, patient, obstacles, by role."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.core.units import parse_joint_value
from borecheck.errors import UnknownNameError, UsageError
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.robots.description import (
    ScannerDescription,
    installed,
    installed_names,
)
from borecheck.robots.from_description import build_installed, complete_arguments
from borecheck.robots.model import RobotModel
from borecheck.robots.obstacle_files import (
    REFERENCE_SIZE,
    URDF_SUFFIXES,
    FileObstacles,
    Obstacle,
    read_obstacle,
)
from borecheck.robots.parts import AS_DRAWN, collision_parts, links_without_collision
from borecheck.robots.robot_file import exists, refuse_misspelt, refuse_robot
from borecheck.robots.urdf.reach import ANYWHERE, NO_ROOTS, Roots

Array = NDArray[np.float64]

# Of many obstacles, so many are named.
_NAMED = 6

__all__ = [
    "REFERENCE_SIZE",
    "URDF_SUFFIXES",
    "FileObstacles",
    "Obstacle",
    "Scene",
    "load_scene",
    "read_obstacle",
    "scene_with",
]


@dataclass(frozen=True, eq=False, repr=False)
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

    def __repr__(self) -> str:
        named = ", ".join(o.name for o in self.obstacles[:_NAMED])
        more = ", ..." if len(self.obstacles) > _NAMED else ""
        return f"<Scene {self.name}: {len(self.obstacles)} obstacles, {named}{more}>"

    def _repr_html_(self) -> str:
        """A card for a notebook."""
        return f"<p>{escape(repr(self)[1:-1])}</p>"

    @cached_property
    def doubt(self) -> str | None:
        """Why nothing may be called clear in this scene: guessed units, lost frames."""
        doubts = (o.doubt for o in self.obstacles)
        reasons = dict.fromkeys(doubt.reason for doubt in doubts if doubt is not None)
        return "; ".join(reasons) or None

    @cached_property
    def unseen(self) -> dict[int, Obstacle]:
        """Obstacles of which something was assumed, by their place among all."""
        return {k: o for k, o in enumerate(self.obstacles) if o.assumed is not None}

    def without_obstacles(self, fewer: Iterable[Obstacle]) -> "Scene":
        """The scene without these obstacles."""
        gone = {id(obstacle) for obstacle in fewer}
        left = tuple(o for o in self.obstacles if id(o) not in gone)
        return replace(self, obstacles=left)

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
    allow_outside: bool = False,
    **arguments: str,
) -> Scene:
    """A scene from an installed scanner's name or from mesh and URDF files.

    Args:
        name: For example "ct_gantry"; or files as
            `FILE[:unit][:frame][@x,y,z[,r,p,y]]`.
        level: Level of detail of an installed scanner's meshes.
        obstacles: Further files in the same form, in the role `other`.
        patients: Further files in the role `patient`.
        package_paths: Roots for `package://`.
        allow_outside: Whether a URDF may read files beyond its own folder tree and
            the roots.
        **arguments: xacro arguments and joint positions of the scanner.

    Raises:
        UnknownNameError: No such scanner, argument or joint.
        MeshError: A mesh that cannot be read, or whose unit is off by 1000.
    """
    refuse_misspelt(load_scene, arguments, _arguments_of(name))
    roots = Roots(tuple(map(Path, package_paths)), allow_outside)
    return scene_with(name, arguments, level, obstacles, patients, roots)


def scene_with(
    name: str | Path | Sequence[str | Path],
    arguments: Mapping[str, str],
    level: str = "coarse",
    obstacles: Sequence[str] = (),
    patients: Sequence[str] = (),
    roots: Roots = NO_ROOTS,
) -> Scene:
    """As `load_scene`, for arguments of any name (`level`, `obstacles`, ...)."""
    if not isinstance(name, str | Path | Sequence):
        kind = type(name).__name__
        raise UsageError(f"scene is a {kind}: give a scanner's name, or files")
    names = [name] if isinstance(name, str | Path) else list(name)
    for what, files in (("obstacles", obstacles), ("patients", patients)):
        if isinstance(files, str | Path):
            raise UsageError(f"{what} is a string: give a list, [{str(files)!r}]")
    if len(names) == 1 and str(names[0]) in installed_names("scanners"):
        scene = _load_installed(str(names[0]), level, arguments)
    else:
        if arguments:
            raise UsageError("scene arguments go with an installed scanner only")
        if len(names) == 1:
            _refuse_unknown_scanner(str(names[0]))
        scene = _empty(" + ".join(map(str, names)))
        scene = _with_files(scene, [str(n) for n in names], "other", roots)
    scene = _with_files(scene, obstacles, "other", roots)
    return _with_files(scene, patients, "patient", roots)


def _arguments_of(name: object) -> list[str]:
    """What an installed scanner takes; nothing of files, and of names there are not."""
    if str(name) not in installed_names("scanners"):
        return []
    description: ScannerDescription = installed("scanners", "scanner", str(name))
    return [*description.arguments, *description.joints]


def _refuse_unknown_scanner(name: str) -> None:
    """A bare word that names no file is a scanner's name, misspelt, or a robot's."""
    refuse_robot(name)
    if re.fullmatch(r"[A-Za-z_]\w*", name) and not exists(Path(name)):
        raise UnknownNameError("scanner", name, installed_names("scanners"))


def _empty(name: str) -> Scene:
    return Scene(name, None, {}, "as given", (), {}, (), ())


def _with_files(scene: Scene, files: Sequence[str], role: str, roots: Roots) -> Scene:
    for text in files:
        found = read_obstacle(text, role, roots)
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
    model, _, warnings = build_installed(description, level, arguments)
    positions = _joint_positions(model, description, joints)
    placements = model.placements(model.check_limits(model.configuration(positions)))
    obstacles = tuple(
        Obstacle(
            part.mesh.name,
            description.roles.get(part.link, "other"),
            place_mesh(placements[part.link], part.mesh),
            name,
        )
        for part in collision_parts(model.tree, description.xacro, ANYWHERE)
    )
    # under other arguments there may be more of them
    points = {p: placements[p] for p in description.points if p in placements}
    values = {**arguments, **{n: repr(v) for n, v in positions.items()}}
    bare = links_without_collision(model.tree)
    not_modelled = (
        *description.not_modelled,
        *(f"{link} of {name}: {AS_DRAWN}" for link in bare),
    )
    return Scene(
        name, description, values, level, obstacles, points, not_modelled, warnings
    )


def _check_known(description: ScannerDescription, given: Mapping[str, str]) -> None:
    for name in given:
        if name not in description.arguments:
            known = [*description.arguments, *description.joints]
            raise UnknownNameError("scene argument", name, known)


def _joint_positions(
    model: RobotModel, description: ScannerDescription, given: Mapping[str, str]
) -> dict[str, float]:
    known = model.joint_names  # others are there under other arguments
    positions = {name: v for name, v in description.joints.items() if name in known}
    for name, text in given.items():
        if name not in known:
            raise UnknownNameError("joint", name, known)
        joint = model.free_joints[known.index(name)]
        positions[name] = parse_joint_value(str(text), revolute=joint.is_angle)
    return positions
