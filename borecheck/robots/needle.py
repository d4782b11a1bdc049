"""Which link of a robot is its needle, and where the needle's tip is.

A description says so of its robot; of a stranger's URDF its user does. What is stated
is held against the geometry: a needle is thin, and ends at its tip. Names and shapes
make a proposal for an error message; nothing is ever taken from them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import inverse
from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.description import RobotDescription
from borecheck.robots.model import RobotModel
from borecheck.robots.needle_shape import FOREMOST, half_width
from borecheck.robots.parts import Part
from borecheck.robots.urdf.tree import UrdfTree

Array = NDArray[np.float64]

AXES = {
    f"{sign}{name}": (-1.0 if sign else 1.0) * np.eye(3)[k]
    for sign in ("", "-")
    for k, name in enumerate("xyz")
}
# Nothing thicker is a needle: half its width, [m]; certificates allow no more.
WIDEST = 5e-3
# The tip is where the geometry ends, up to this, [m]: what a corridor leaves.
AT_TIP = 2e-3
_WORDS = ("needle", "probe", "trocar", "cannula", "electrode", "tip", "tool")


@dataclass(frozen=True, eq=False)
class Needle:
    """A robot's needle.

    Attributes:
        link: The link that may enter the patient along a corridor.
        tip: The frame at its tip; None where nobody said so.
        axis: The way it points, in that frame, (3,), length 1.
        insertion: The joint that drives it along itself, or None.
        radius: Half its width, [m], where that is stated; else it is measured.
    """

    link: str
    tip: str | None = None
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    insertion: str | None = None
    radius: float | None = None

    @property
    def says(self) -> str:
        """The options that state it."""
        names = [k for k, axis in AXES.items() if np.array_equal(axis, self.axis)]
        name = names[0] if names else str(self.axis.tolist())
        tip = "" if self.tip is None else f" --tip {self.tip}:{name}"
        more = "" if self.insertion is None else f" --insertion {self.insertion}"
        return f"--needle {self.link}{tip}{more}"

    def is_same(self, other: "Needle | None") -> bool:
        """Whether another one is the same link, tip, axis and drive, however wide."""
        return (
            other is not None
            and (self.link, self.tip) == (other.link, other.tip)
            and self.insertion == other.insertion
            and np.array_equal(self.axis, other.axis)
        )


def described(description: RobotDescription) -> Needle | None:
    """The needle that a description names, if it does."""
    if description.needle_link is None and description.tool_frame is None:
        return None
    return Needle(
        description.needle_link or "",
        description.tool_frame,
        insertion=description.insertion_joint,
        radius=description.needle_radius,
    )


def stated(
    model: RobotModel,
    parts: Sequence[Part],
    link: str,
    tip: str | None = None,
    insertion: str | None = None,
) -> Needle:
    """The needle that a user states.

    Args:
        model: The robot's.
        parts: Its geometry.
        link: The needle's link.
        tip: `FRAME` or `FRAME:axis`: a link whose frame is at the tip, and which of its
            axes, x, y, z, -x, -y or -z, points forward (z).
        insertion: A sliding joint that drives the needle along itself.

    Raises:
        UnknownNameError: No such link, axis or joint.
        UsageError: The link has no geometry, or is no needle that ends at the tip.
    """
    _known("link", link, model.link_names)
    if not any(part.link == link for part in parts):
        raise UsageError(f"--needle {link}: the link has no geometry")
    if insertion is not None:
        _check_insertion(model, insertion)
    if tip is None:
        if insertion is not None:
            raise UsageError(f"--insertion {insertion} needs --tip as well")
        return Needle(link, insertion=insertion)
    frame, _, name = tip.partition(":")
    _known("link", frame, model.link_names)
    _known("axis", name or "z", AXES)
    needle = Needle(link, frame, AXES[name or "z"], insertion)
    problem = _problem(model, parts, needle)
    if problem is None:
        return needle
    others = [n.says for n in _that_fit(model, parts, [link])]
    hint = f"; {others[0]} would fit" if others else ""
    raise UsageError(f"{needle.says}: {problem}{hint}")


def proposal(model: RobotModel, parts: Sequence[Part]) -> str:
    """Options that may state the needle, for an error message; found by shape."""
    found = next(_that_fit(model, parts, _likely(model, parts)), None)
    if found is None:
        return (
            "no link looks like one: a thin link with a frame at its tip is needed, "
            "for --needle LINK --tip FRAME[:axis]"
        )
    return f"{found.says} would be a thin link and the frame at its end"


def _known(kind: str, name: str, known: Sequence[str] | dict[str, Array]) -> None:
    if name not in known:
        raise UnknownNameError(kind, name, known)


def _check_insertion(model: RobotModel, name: str) -> None:
    sliding = [j.name for j in model.free_joints if not j.is_angle]
    _known("joint", name, model.joint_names)
    if name not in sliding:
        listed = ", ".join(sliding) or "none"
        raise UsageError(f"--insertion {name} does not slide (those that do: {listed})")


def _problem(model: RobotModel, parts: Sequence[Part], needle: Needle) -> str | None:
    """Why it is no needle that ends at its tip; None if it is one."""
    if needle.tip not in _rigid_with(model.tree, needle.link):
        return f"a joint moves {needle.tip} against {needle.link}"
    corners = _in_tip(model, parts, needle)
    ends = float((corners @ needle.axis).max())
    if abs(ends) > AT_TIP:
        where = "beyond" if ends > 0.0 else "before"
        return (
            f"the geometry of {needle.link} ends {1e3 * abs(ends):.1f} mm {where} "
            f"{needle.tip} along that axis"
        )
    width = half_width(corners, needle.axis, FOREMOST)
    if width > WIDEST:
        return (
            f"it is {2e3 * width:.1f} mm thick at its tip, and nothing over "
            f"{2e3 * WIDEST:g} mm may enter a patient"
        )
    flat = corners.reshape(-1, 3)
    front = flat[flat @ needle.axis > ends - FOREMOST]
    aside = np.linalg.norm(front - np.outer(front @ needle.axis, needle.axis), axis=1)
    if aside.min() > WIDEST:
        return f"its end is {1e3 * aside.min():.1f} mm aside of {needle.tip}"
    return None


def _in_tip(model: RobotModel, parts: Sequence[Part], needle: Needle) -> Array:
    """Corners of the needle's triangles in its tip's frame, (m, 3, 3)."""
    placed = model.placements(np.zeros(len(model.free_joints)))
    T = inverse(placed[needle.tip or needle.link]) @ placed[needle.link]
    corners = [part.mesh.corners for part in parts if part.link == needle.link]
    return np.asarray(np.concatenate(corners) @ T[:3, :3].T + T[:3, 3])


def _rigid_with(tree: UrdfTree, link: str) -> list[str]:
    """Links that no joint moves against this one, itself first."""
    near: dict[str, list[str]] = {}
    for joint in tree.joints:
        if joint.type == "fixed":
            near.setdefault(joint.parent, []).append(joint.child)
            near.setdefault(joint.child, []).append(joint.parent)
    found = [link]
    for one in found:
        found += [other for other in near.get(one, ()) if other not in found]
    return found


def _likely(model: RobotModel, parts: Sequence[Part]) -> list[str]:
    """Links with geometry: those named like a needle, then from the chain's end."""
    shaped = {part.link for part in parts}
    names = [name for name in reversed(model.link_names) if name in shaped]

    def rank(name: str) -> int:
        words = [k for k, word in enumerate(_WORDS) if word in name.lower()]
        return min(words, default=len(_WORDS))

    return sorted(names, key=rank)


def _that_fit(
    model: RobotModel, parts: Sequence[Part], links: Sequence[str]
) -> Iterator[Needle]:
    """What could be stated of these links."""
    for link in links:
        frames = _rigid_with(model.tree, link)
        named = sorted(frames, key=lambda name: "tip" not in name.lower())
        for frame in named:
            for axis in AXES.values():
                needle = Needle(link, frame, axis)
                if _problem(model, parts, needle) is None and _is_long(
                    model, parts, needle
                ):
                    yield needle


def _is_long(model: RobotModel, parts: Sequence[Part], needle: Needle) -> bool:
    """Whether it is at least eight times as long as it is wide at its tip."""
    corners = _in_tip(model, parts, needle)
    long = float(np.ptp(corners @ needle.axis))
    return long > 16.0 * half_width(corners, needle.axis, FOREMOST)
