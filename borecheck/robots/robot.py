"""A robot ready to be checked: description, model, geometry, and who may touch whom."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import check_transform, frozen, inverse
from borecheck.core.units import check_near
from borecheck.robots.allowed import (
    NONE,
    Allowances,
    AllowedPair,
    Request,
    allowances_of,
    unasked,
)
from borecheck.robots.description import RobotDescription, installed, installed_names
from borecheck.robots.from_description import build_installed, complete_arguments
from borecheck.robots.model import RobotModel
from borecheck.robots.neighbours import Joined
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
        allowed_contacts: Pairs of links that may touch, with reason and source.
        warnings: What the user should know about how it was read.
        roots: Where files it names may lie beside its own folder tree.
        allowances: What the user gave of pairs that may touch.
        srdf_sha256: Hash of the SRDF among them.
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
    allowed_contacts: tuple[AllowedPair, ...]
    warnings: tuple[str, ...]
    roots: Roots = NO_ROOTS
    allowances: Allowances = NONE
    srdf_sha256: str | None = None

    def __post_init__(self) -> None:
        """Freezes where it stands: chains and problems are made of it once."""
        object.__setattr__(self, "T_scene_root", frozen(self.T_scene_root.copy()))

    @cached_property
    def home(self) -> Array:
        """Configuration that the description calls home; zero within limits else."""
        if self.description is not None and self.description.home:
            known = self.model.joint_names  # others are there under other arguments
            home = {n: v for n, v in self.description.home.items() if n in known}
            return self.model.configuration(home)
        return np.clip(0.0, self.model.lower, self.model.upper)

    @cached_property
    def not_modelled(self) -> tuple[str, ...]:
        """What no verdict about this robot covers."""
        known = self.description.not_modelled if self.description else ()
        bare = links_without_collision(self.model.tree)
        named = tuple(f"{link}: {AS_DRAWN}" for link in bare)
        seen = unseen(self.model.tree, self.parts, self.file, self.roots)
        return (*known, *named, *seen, *unasked(self.unexamined), *NEVER_MODELLED)

    @cached_property
    def self_pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs of parts that must not touch each other, as indices into `parts`.

        Left out are parts of one rigid body, of neighbours in the chain (no body with
        geometry between them), and of links listed in `allowed_contacts`.
        """
        allowed = {pair.links for pair in self.allowed_contacts}
        return tuple(
            (i, j)
            for i in range(len(self.parts))
            for j in range(i + 1, len(self.parts))
            if (pair := frozenset((self.parts[i].link, self.parts[j].link)))
            not in allowed
            and not self._joined.holds(pair)
        )

    @cached_property
    def unexamined(self) -> tuple[AllowedPair, ...]:
        """Allowed pairs that would be examined if they were not allowed.

        The others are neighbours, of one rigid body, or have no geometry.
        """
        shaped = {part.link for part in self.parts}
        return tuple(
            pair
            for pair in self.allowed_contacts
            if pair.links <= shaped and not self._joined.holds(pair.links)
        )

    @cached_property
    def _joined(self) -> Joined:
        return Joined(self.model, {part.link for part in self.parts})

    def allowing(self, allowances: Allowances) -> "Robot":
        """The same robot, in which these pairs may touch as well.

        Raises:
            UrdfError, UsageError: See `Allowances.of`.
        """
        if allowances == NONE:
            return self
        found = allowances.of(self.model.link_names, self.roots, self.model.name)
        own = {pair.links for pair in self.allowed_contacts}
        more = [pair for pair in found.pairs if pair.links not in own]
        robot = replace(
            self,
            allowed_contacts=(*self.allowed_contacts, *more),
            allowances=allowances,
            srdf_sha256=found.srdf_sha256,
        )
        odd = tuple(pair.odd for pair in robot.unexamined if pair.says_adjacent)
        return replace(robot, warnings=(*self.warnings, *found.notes, *odd))

    @cached_property
    def T_scene_base(self) -> Array:
        """Placement of the base frame (the root link without one)."""
        frame = self.description.base_frame if self.description else None
        if frame is None:
            return self.T_scene_root
        zero = np.zeros(len(self.model.free_joints))
        return frozen(self.T_scene_root @ self.model.placements(zero)[frame])

    def placements(self, q: ArrayLike) -> dict[str, Array]:
        """T_scene_link (4, 4) of every link."""
        in_root = self.model.placements(q)
        in_scene = self.T_scene_root @ np.array(list(in_root.values()))
        return dict(zip(in_root, in_scene, strict=True))

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
    srdf: str | Path | None = None,
    allow: Sequence[Request] = (),
    trust_never: bool = False,
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
        srdf: A file that says which links may touch each other.
        allow: Further pairs of links that may: `"finger:palm"`, or two names each.
        trust_never: Whether to take the SRDF's pairs that rest on statistics
            ("Never"), or on no reason that is known.
        **arguments: xacro arguments by name, for example mount="+90".

    Raises:
        UnknownNameError: No such robot, argument or level.
        UrdfError: The file describes no robot.
        MeshError: A mesh is missing or damaged.
        UsageError: A base that is metres away, as millimetres taken for metres are; a
            pair that is not of two links.
    """
    roots = Roots(tuple(map(Path, package_paths)), allow_outside)
    allowances = allowances_of(srdf, allow, trust_never)
    return robot_with(name, arguments, level, base, roots).allowing(allowances)


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
    return Robot(
        name=str(name),
        description=None,
        arguments=dict(arguments),
        level="as given",
        file=path,
        urdf_text=source.text,
        model=model,
        parts=parts,
        T_scene_root=_checked_base(base),
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
    model, text, warnings = build_installed(description, level, complete)
    parts = collision_parts(model.tree, description.xacro, ANYWHERE)
    refuse_nothing(parts, description.xacro)
    return Robot(
        name=name,
        description=description,
        arguments=complete,
        level=level,
        file=description.xacro,
        urdf_text=text,
        model=model,
        parts=parts,
        T_scene_root=_placed_by_base_frame(model, description.base_frame, base),
        allowed_contacts=tuple(
            AllowedPair(*pair, f"description of {name}")
            for pair in description.allowed_contacts
        ),
        warnings=warnings,
        roots=ANYWHERE,
    )


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
