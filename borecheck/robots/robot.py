"""A robot ready to be checked: description, model, geometry, and who may touch whom."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import check_transform, inverse
from borecheck.core.units import check_near
from borecheck.errors import UnknownNameError
from borecheck.robots.description import (
    Description,
    RobotDescription,
    installed,
    installed_names,
)
from borecheck.robots.generated_meshes import mesh_folder
from borecheck.robots.model import RobotModel
from borecheck.robots.parts import (
    AS_DRAWN,
    Part,
    collision_parts,
    links_without_collision,
    refuse_nothing,
    without_size,
)
from borecheck.robots.robot_file import read_urdf, robot_path
from borecheck.robots.unseen import unseen
from borecheck.robots.urdf.reach import ANYWHERE, NO_ROOTS, Roots
from borecheck.robots.urdf.xacro.cache import expanded_text

Array = NDArray[np.float64]

# Of no robot and in no scene is this looked at, so every verdict says so.
NEVER_MODELLED = (
    "what the meshes do not show: cables, drapes, mounts",
    "bending of arm and needle, sag of the couch, breathing",
    "how accurately robot, scanner and patient stand as stated",
)


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot placed in a scanner's frame.

    Attributes:
        name: Installed name or file.
        description: Of an installed robot; None for a stranger's.
        arguments: The xacro arguments it was built with, complete.
        level: Level of detail of its meshes.
        file: The xacro or URDF file.
        urdf_text: The URDF it was built from.
        model: Names, limits, placements.
        parts: Collision geometry, in each link's frame.
        T_scene_root: Placement of the root link in the scanner's frame.
        allowed_contacts: Pairs of links that may touch, with the reason.
        warnings: What the user should know about how it was read.
        roots: Where files it names may lie beside its own folder tree.
    """

    name: str
    description: RobotDescription | None
    arguments: Mapping[str, str]
    level: str
    file: Path
    urdf_text: str
    model: RobotModel
    parts: tuple[Part, ...]
    T_scene_root: Array
    allowed_contacts: tuple[tuple[str, str, str], ...]
    warnings: tuple[str, ...]
    roots: Roots = NO_ROOTS

    @cached_property
    def home(self) -> Array:
        """Configuration that the description calls home; zero within limits else."""
        if self.description is not None and self.description.home:
            return self.model.configuration(self.description.home)
        return np.clip(0.0, self.model.lower, self.model.upper)

    @cached_property
    def not_modelled(self) -> tuple[str, ...]:
        """What no verdict about this robot covers."""
        known = self.description.not_modelled if self.description else ()
        bare = links_without_collision(self.model.tree)
        named = tuple(f"{link}: {AS_DRAWN}" for link in bare)
        seen = unseen(self.model.tree, self.parts, self.file, self.roots)
        return (*known, *named, *seen, *NEVER_MODELLED)

    @cached_property
    def self_pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs of parts that must not touch each other, as indices into `parts`.

        Left out are parts of one rigid body, of neighbours in the chain (no body with
        geometry between them), and of links listed in `allowed_contacts`.
        """
        body = _rigid_bodies(self.model)
        with_geometry = {body[part.link] for part in self.parts}
        neighbours = _neighbours(self.model, body, with_geometry)
        allowed = {frozenset(pair[:2]) for pair in self.allowed_contacts}
        return tuple(
            (i, j)
            for i in range(len(self.parts))
            for j in range(i + 1, len(self.parts))
            if (a := self.parts[i].link) != (b := self.parts[j].link)
            and body[a] != body[b]
            and frozenset((body[a], body[b])) not in neighbours
            and frozenset((a, b)) not in allowed
        )

    @cached_property
    def T_scene_base(self) -> Array:
        """Placement of the base frame (the root link without one)."""
        frame = self.description.base_frame if self.description else None
        if frame is None:
            return self.T_scene_root.copy()
        zero = np.zeros(len(self.model.free_joints))
        return self.T_scene_root @ self.model.placements(zero)[frame]

    def placements(self, q: ArrayLike) -> dict[str, Array]:
        """T_scene_link (4, 4) of every link."""
        return {
            link: self.T_scene_root @ T_root_link
            for link, T_root_link in self.model.placements(q).items()
        }

    def may_enter(self, link: str, role: str) -> bool:
        """Whether a plan may bring this link into an obstacle of this role."""
        needle = self.description.needle_link if self.description else None
        return role == "patient" and link == needle


def load_robot(
    name: str | Path,
    *,
    level: str = "coarse",
    base: ArrayLike | None = None,
    package_paths: Sequence[Path] = (),
    allow_outside: bool = False,
    **arguments: str,
) -> Robot:
    """A robot by its installed name or from a URDF or xacro file.

    Args:
        name: For example "zerobot", or a path.
        level: Level of detail of an installed robot's meshes: coarse, middle, fine.
        base: T_scene_base (4, 4): where the robot's base frame stands in the
            scanner's frame; the identity by default.
        package_paths: Roots for `package://` and `$(find ...)`.
        allow_outside: Whether the file may read files beyond its own folder tree and
            the roots.
        **arguments: xacro arguments by name, for example mount="+90".

    Raises:
        UnknownNameError: No such robot, argument or level.
        UrdfError: The file describes no robot.
        MeshError: A mesh is missing or damaged.
        UsageError: A base that is metres away, as millimetres taken for metres are.
    """
    roots = Roots(tuple(map(Path, package_paths)), allow_outside)
    return robot_with(name, arguments, level, base, roots)


def robot_with(
    name: str | Path,
    arguments: Mapping[str, str],
    level: str = "coarse",
    base: ArrayLike | None = None,
    roots: Roots = NO_ROOTS,
) -> Robot:
    """As `load_robot`, for xacro arguments of any name (`level`, `base`, ...)."""
    if str(name) in installed_names("robots"):
        return _load_installed(str(name), level, base, arguments)
    path = robot_path(str(name))
    source, warnings = read_urdf(path, arguments, roots)
    model = RobotModel(source)
    parts = collision_parts(model.tree, path, roots)
    refuse_nothing(parts, path)
    T_scene_root = _checked_base(base)
    return Robot(
        name=str(name),
        description=None,
        arguments=dict(arguments),
        level="as given",
        file=path,
        urdf_text=source.text,
        model=model,
        parts=parts,
        T_scene_root=T_scene_root,
        allowed_contacts=(),
        warnings=(*warnings, *_oddities(model, base is not None)),
        roots=roots,
    )


def _oddities(model: RobotModel, is_placed: bool) -> tuple[str, ...]:
    """What was read otherwise than it is written, and harms no verdict."""
    joints = () if is_placed else model.standing
    return (
        *(f"joint {name} stands at its origin: --base places it" for name in joints),
        *(
            f"link {name}: a drawn shape without size is left out"
            for name in without_size(model.tree)
        ),
    )


def _load_installed(
    name: str, level: str, base: ArrayLike | None, arguments: Mapping[str, str]
) -> Robot:
    description: RobotDescription = installed("robots", "robot", name)
    complete = complete_arguments(description, arguments)
    model, text = build_installed(description, level, complete)
    return Robot(
        name=name,
        description=description,
        arguments=complete,
        level=level,
        file=description.xacro,
        urdf_text=text,
        model=model,
        parts=collision_parts(model.tree, description.xacro, ANYWHERE),
        T_scene_root=_placed_by_base_frame(model, description.base_frame, base),
        allowed_contacts=description.allowed_contacts,
        warnings=(),
        roots=ANYWHERE,
    )


def complete_arguments(
    description: Description, given: Mapping[str, str]
) -> dict[str, str]:
    """All xacro arguments: the given ones checked, defaults for the others.

    Raises:
        UnknownNameError: An argument the description does not have.
        UsageError: A value that is no choice or no quantity.
    """
    complete = {name: a.default for name, a in description.arguments.items()}
    for name, text in given.items():
        if name not in description.arguments:
            raise UnknownNameError("argument", name, description.arguments)
        complete[name] = description.arguments[name].value(name, str(text))
    return complete


def build_installed(
    description: Description, level: str, arguments: Mapping[str, str]
) -> tuple[RobotModel, str]:
    """Model and URDF text of an installed description with meshes of that level."""
    folder = mesh_folder(description, level, arguments)
    complete = dict(arguments)
    if folder is not None:
        complete["mesh_dir"] = str(folder)
    text = expanded_text(description.xacro, complete)
    return RobotModel(text, str(description.xacro)), text


def _placed_by_base_frame(
    model: RobotModel, base_frame: str | None, base: ArrayLike | None
) -> Array:
    """T_scene_root such that the base frame stands at `base`."""
    T_scene_base = _checked_base(base)
    if base_frame is None:
        return T_scene_base
    T_root_base = model.placements(np.zeros(len(model.free_joints)))[base_frame]
    return T_scene_base @ inverse(T_root_base)


def _checked_base(base: ArrayLike | None) -> Array:
    if base is None:
        return np.eye(4)
    return check_near(check_transform(base, "base"), "base")


def _rigid_bodies(model: RobotModel) -> dict[str, str]:
    """For every link the topmost link it is fixed to."""
    fixed_to = {j.child: j.parent for j in model.tree.joints if j.type == "fixed"}
    bodies = {}
    for link in model.link_names:
        top = link
        while top in fixed_to:
            top = fixed_to[top]
        bodies[link] = top
    return bodies


def _neighbours(
    model: RobotModel, body: Mapping[str, str], with_geometry: set[str]
) -> set[frozenset[str]]:
    """Pairs of bodies with no other body with geometry between them in the chain."""
    parent = {
        body[joint.child]: body[joint.parent]
        for joint in model.tree.joints
        if joint.type != "fixed"
    }
    pairs = set()
    for start in with_geometry:
        above = parent.get(start)
        while above is not None and above not in with_geometry:
            above = parent.get(above)
        if above is not None:
            pairs.add(frozenset((start, above)))
    return pairs
