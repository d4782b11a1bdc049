"""A robot ready to be checked: description, model, geometry, and who may touch whom."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import frozen
from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.allowed import NONE, Allowances, AllowedPair, unasked
from borecheck.robots.description import RobotDescription
from borecheck.robots.model import RobotModel
from borecheck.robots.needle import Needle, described, proposal, stated
from borecheck.robots.neighbours import Joined
from borecheck.robots.parts import AS_DRAWN, Part, links_without_collision
from borecheck.robots.unseen import unseen
from borecheck.robots.urdf.reach import NO_ROOTS, Roots

Array = NDArray[np.float64]

# Of no robot and in no scene is this looked at, so every verdict says so.
NEVER_MODELLED = (
    "what the meshes do not show: cables, drapes, mounts",
    "bending of arm and needle, sag of the couch, breathing",
    "how accurately robot, scanner and patient stand as stated",
)


@dataclass(frozen=True, eq=False, repr=False)
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
        stated_needle: The needle that the user states, in place of the description's.
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
    stated_needle: Needle | None = None

    def __post_init__(self) -> None:
        """Freezes where it stands: chains and problems are made of it once."""
        object.__setattr__(self, "T_scene_root", frozen(self.T_scene_root.copy()))

    def __repr__(self) -> str:
        joints = ", ".join(self.model.joint_names)
        return f"<Robot {self.name}: {len(self.parts)} parts, joints {joints}>"

    def _repr_html_(self) -> str:
        """A card for a notebook."""
        return f"<p>{escape(repr(self)[1:-1])}</p>"

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

    @cached_property
    def needle(self) -> Needle | None:
        """Its needle, as the user or else its description states it."""
        if self.stated_needle is not None or self.description is None:
            return self.stated_needle
        return described(self.description)

    def with_needle(
        self, link: str | None, tip: str | None = None, insertion: str | None = None
    ) -> "Robot":
        """The same robot with the needle that is stated, if one is.

        A description's own needle stays its own: with its width, and its closed form.

        Args:
            link: The needle's link; its own where only the tip is stated.
            tip: See `needle.stated`.
            insertion: Likewise.

        Raises:
            UnknownNameError, UsageError: See `needle.stated`; a tip without a needle.
        """
        if link is None and tip is None and insertion is None:
            return self
        if link is None and (self.needle is None or not self.needle.link):
            raise UsageError(
                f"--tip goes with --needle; {proposal(self.model, self.parts)}"
            )
        own = self.needle
        if own is not None and link in (None, own.link):
            link, insertion = own.link, insertion or own.insertion
            if tip is None:
                tip = own.tip
        found = stated(self.model, self.parts, link or "", tip, insertion)
        return self if found.is_same(own) else replace(self, stated_needle=found)

    def needle_with_tip(self) -> Needle:
        """Its needle, with a frame at the tip.

        Raises:
            UsageError: It has none; the line proposes one.
            UnknownNameError: No link of its description's name is there.
        """
        if self.needle is not None and self.needle.tip is not None:
            if self.needle.tip not in self.model.link_names:
                raise UnknownNameError("link", self.needle.tip, self.model.link_names)
            return self.needle
        lacks = "no needle" if self.needle is None else "no frame at its needle's tip"
        raise UsageError(
            f"{self.name} has {lacks}; {proposal(self.model, self.parts)}; a motion "
            "without a needle is asked with --path"
        )

    def may_enter(self, link: str, role: str) -> bool:
        """Whether a plan may bring this link into an obstacle of this role."""
        return (
            role == "patient" and self.needle is not None and link == self.needle.link
        )
