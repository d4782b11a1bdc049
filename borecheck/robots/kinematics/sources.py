"""Three sources on where a robot's frames are: closed form, Pinocchio, yourdfpy.

Each is a function q -> {frame: T_base_frame}, with q in the order of the URDF model, so
that the comparator in `kinematics.agreement` need not know which is which. Between the
closed form and the URDF stands only the bridge of the description: per joint a sign
and an offset, per frame a link's name.
"""

from collections.abc import Callable, Mapping
from functools import partial
from io import BytesIO
from typing import Any, Protocol
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import inverse
from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.description import RobotDescription, hook, plugin_hook
from borecheck.robots.model import RobotModel

Array = NDArray[np.float64]
Placements = Callable[[Array], Mapping[str, Array]]

SOURCES = ("analytic", "pinocchio", "yourdfpy")


class RobotLike(Protocol):
    """A loaded robot as far as its kinematics are concerned."""

    @property
    def description(self) -> RobotDescription | None:
        """Its description, or None for a stranger's URDF."""

    @property
    def model(self) -> RobotModel:
        """The model built from the URDF."""

    @property
    def urdf_text(self) -> str:
        """The URDF, xacro expanded."""

    @property
    def arguments(self) -> Mapping[str, str]:
        """The values of the xacro arguments."""


def compared_frames(robot: RobotLike) -> dict[str, str]:
    """{frame: link}: the paper's frames, or every link of a robot without a paper."""
    if robot.description is not None and robot.description.frames:
        return dict(robot.description.frames)
    return {name: name for name in robot.model.link_names}


def analytic(
    robot: RobotLike, perturbed: Mapping[str, float] | None = None
) -> Placements | None:
    """The closed form, or None if the robot has none.

    Args:
        robot: The loaded robot.
        perturbed: Added to dimensions of the closed form by name.
    """
    description = robot.description
    if description is None or description.forward is None:
        return None
    wrong = partial(_not_placements, frozenset(compared_frames(robot)))
    forward = plugin_hook(description, "forward", hook, wrong)
    arguments = closed_form_arguments(robot)
    if perturbed:
        arguments["perturbed"] = dict(perturbed)
    to_paper = _joint_bridge(robot)

    def placements(q: Array) -> Mapping[str, Array]:
        frames = forward(to_paper(q), **arguments)
        return {frame: np.asarray(T, dtype=np.float64) for frame, T in frames.items()}

    return placements


def _not_placements(frames: frozenset[str], result: Any) -> str | None:
    """What is wrong with what the forward hook returned."""
    if not isinstance(result, Mapping):
        return "it must be {frame: T (4, 4)}"
    for frame in sorted(frames ^ set(result)):
        if frame in frames:
            return f"it has no frame {frame!r}, which the field `frames` names"
        return f"it has a frame {frame!r}, which the field `frames` does not name"
    for frame, T in result.items():
        if not _is_placement(T):
            return f"frame {frame!r} has shape {np.shape(T)}, not numbers (4, 4)"
    return None


def _is_placement(T: Any) -> bool:
    try:
        return np.asarray(T, dtype=np.float64).shape == (4, 4)
    except (TypeError, ValueError):
        return False


def not_dimensions(result: Any) -> str | None:
    """What is wrong with what the dimensions hook returned."""
    if isinstance(result, Mapping) and all(
        isinstance(value, int | float) for value in result.values()
    ):
        return None
    return "it must be {name: number}"


def closed_form_arguments(robot: RobotLike) -> dict[str, Any]:
    """Those xacro arguments that the closed form takes too."""
    if robot.description is None:
        return {}
    names = robot.description.closed_form_arguments
    return {name: robot.arguments[name] for name in names if name in robot.arguments}


def pinocchio(robot: RobotLike, model: RobotModel | None = None) -> Placements:
    """Pinocchio's placements; `model` may be another model of the same robot."""
    chosen = robot.model if model is None else model
    frames = compared_frames(robot)
    _check_links(frames, chosen.link_names)
    base = _base_link(robot)

    def placements(q: Array) -> Mapping[str, Array]:
        placed = chosen.placements(q)
        T_base_root = inverse(placed[base])
        return {frame: T_base_root @ placed[link] for frame, link in frames.items()}

    return placements


def yourdfpy(robot: RobotLike) -> Placements:
    """Placements by yourdfpy, from the same text without meshes and mimic elements.

    yourdfpy sets a mimic joint from its own rules (no chains), so every moving joint is
    handed over by name with its position worked out from the mimic relations.
    """
    from yourdfpy import URDF  # 1 s, and only the cross-check needs it

    bare = URDF.load(BytesIO(_bare(robot.urdf_text)), load_meshes=False)
    frames = compared_frames(robot)
    base = _base_link(robot)

    def placements(q: Array) -> Mapping[str, Array]:
        bare.update_cfg(robot.model.positions(q))
        return {
            frame: np.array(bare.get_transform(link, base), dtype=np.float64)
            for frame, link in frames.items()
        }

    return placements


def _joint_bridge(robot: RobotLike) -> Callable[[Array], Array]:
    """The function that turns q of the URDF model into q of the paper."""
    description = robot.description
    if description is None or not description.joints:
        return lambda q: np.asarray(q, dtype=np.float64)
    names = list(robot.model.joint_names)
    for joint in description.joints:
        if joint.name not in names:
            raise UnknownNameError("joint", joint.name, names)
    if len(description.joints) != len(names):
        raise UsageError(
            f"{description.name}: the closed form has {len(description.joints)} "
            f"joints, the URDF has {len(names)} free ones: {', '.join(names)}"
        )
    order = [names.index(joint.name) for joint in description.joints]
    sign = np.array([joint.sign for joint in description.joints])
    offset = np.array([joint.offset for joint in description.joints])
    return lambda q: (np.asarray(q, dtype=np.float64)[order] - offset) / sign


def _base_link(robot: RobotLike) -> str:
    description = robot.description
    if description is not None and description.base_frame is not None:
        frames = compared_frames(robot)
        link = frames.get(description.base_frame, description.base_frame)
    else:
        link = robot.model.tree.root.name
    _check_links({"base": link}, robot.model.link_names)
    return link


def _check_links(frames: Mapping[str, str], links: tuple[str, ...]) -> None:
    for link in frames.values():
        if link not in links:
            raise UnknownNameError("link", link, links)


def _bare(urdf_text: str) -> bytes:
    """The URDF with nothing but links, joints, origins, axes and limits."""
    root = ElementTree.fromstring(urdf_text)
    for link in root.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    for joint in root.findall("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
    return ElementTree.tostring(root)
