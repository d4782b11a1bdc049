"""The part of a URDF that is calibrated: the revolute joints from a world to a tip."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines
from borecheck.calibration.link_parameters import (
    LinkForms,
    choose_forms,
    lines_to_parameters,
)
from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.urdf.tree import Joint, UrdfTree

Array = NDArray[np.float64]

REVOLUTE = ("revolute", "continuous")


@dataclass(frozen=True, eq=False)
class SerialArm:
    """The revolute joints on the way from a world link to a tip link, at zero.

    Attributes:
        name: The robot's name.
        world_link: The link in whose frame points are measured.
        tip_link: The link that carries the target.
        joint_names: Revolute joints on the way, (k,).
        T_world_joint: Their frames at zero, (k, 4, 4).
        lines: Their nominal axes at zero.
        lower: Lower limits, (k,), [rad]; -pi for a continuous joint.
        upper: Upper limits, (k,), [rad].
        T_world_tip: The tip link at zero, (4, 4).
        held: Prismatic joints on the way and the position they are held at, [m].
    """

    name: str
    world_link: str
    tip_link: str
    joint_names: tuple[str, ...]
    T_world_joint: Array
    lines: Lines
    lower: Array
    upper: Array
    T_world_tip: Array
    held: Mapping[str, float]

    @cached_property
    def forms(self) -> LinkForms:
        """DH or Hayati for every link, by the nominal axes."""
        return choose_forms(self.lines.points, self.lines.directions)

    @cached_property
    def nominal(self) -> dict[str, float]:
        """The nominal parameters by name, [m] and [rad]."""
        return self.parameters(self.lines)

    def parameters(self, lines: Lines) -> dict[str, float]:
        """Parameters of other axes in the same forms, [m] and [rad]."""
        found = lines_to_parameters(self.forms, lines.points, lines.directions)
        return {name: float(value) for name, value in found.items()}

    def resting(self) -> Array:
        """Zero, or the middle of the range of a joint that cannot stand at zero."""
        reaches = (self.lower <= 0.0) & (self.upper >= 0.0)
        return np.where(reaches, 0.0, 0.5 * (self.lower + self.upper))

    def random(self, rng: np.random.Generator, count: int, share: float = 1.0) -> Array:
        """Configurations within a share of every joint's range, (count, k)."""
        middle, half = 0.5 * (self.lower + self.upper), 0.5 * (self.upper - self.lower)
        spread = share * rng.uniform(-1.0, 1.0, (count, len(middle)))
        return np.asarray(middle + half * spread)


def serial_arm(
    tree: UrdfTree,
    world: str | None = None,
    tip: str | None = None,
    held: Mapping[str, float] = MappingProxyType({}),
) -> SerialArm:
    """The arm of a robot.

    Args:
        tree: The robot.
        world: Link in whose frame points are measured; the root by default.
        tip: Link that carries the target; by default the end of the way with the most
            revolute joints, if there is one such way.
        held: Positions of prismatic joints on the way, 0 by default, [m].

    Raises:
        UnknownNameError: No such link.
        UsageError: No single way, no revolute joint, a mimic joint on the way.
        GeometryError: Two axes that follow each other coincide.
    """
    world = world or tree.root.name
    for link in (world, tip):
        if link is not None and link not in {item.name for item in tree.links}:
            known = [item.name for item in tree.links]
            raise UnknownNameError("link", link, known)
    tip = tip or _longest_way(tree, world)
    way = _way(tree, world, tip)
    frames, names, T = [], [], np.eye(4)
    axes, limits, stands = [], [], {}
    for joint in way:
        T = T @ joint.origin
        if joint.type in REVOLUTE:
            frames.append(T)
            names.append(joint.name)
            axes.append(T[:3, :3] @ joint.axis)
            limits.append(_limits(joint))
        elif joint.type == "prismatic":
            stands[joint.name] = float(held.get(joint.name, 0.0))
            T = T.copy()
            T[:3, 3] += stands[joint.name] * (T[:3, :3] @ joint.axis)
    if not names:
        raise UsageError(_nothing_to_identify(world, tip, stands))
    T_world_joint = np.array(frames)
    lines = Lines(T_world_joint[:, :3, 3].copy(), np.array(axes))
    lower, upper = np.array(limits).T
    return SerialArm(
        tree.name,
        world,
        tip,
        tuple(names),
        T_world_joint,
        lines,
        lower,
        upper,
        T,
        stands,
    )


def _nothing_to_identify(world: str, tip: str, held: Iterable[str]) -> str:
    sliding = ", ".join(held)
    if sliding:
        return (
            f"only prismatic joints between {world} and {tip} ({sliding}): prismatic "
            "joints are not identified"
        )
    return f"no revolute joint between {world} and {tip}"


def _way(tree: UrdfTree, world: str, tip: str) -> list[Joint]:
    above = {joint.child: joint for joint in tree.joints}
    way: list[Joint] = []
    link = tip
    while link != world:
        if link not in above:
            raise UsageError(f"{tip} is not reached from {world} going outwards")
        way.append(above[link])
        link = above[link].parent
    for joint in way:
        if joint.mimic is not None:
            raise UsageError(
                f"joint {joint.name} follows {joint.mimic.joint}: only joints that "
                "move by themselves can be calibrated"
            )
    return way[::-1]


def _longest_way(tree: UrdfTree, world: str) -> str:
    """The link behind the most revolute joints; fixed frames do not matter."""
    ways = {}
    for joint in tree.joints:
        try:
            way = _way(tree, world, joint.child)
        except UsageError:
            continue
        revolute = tuple(j.name for j in way if j.type in REVOLUTE)
        ways[joint.child] = (revolute, len(way))
    if not ways:
        raise UsageError(f"no joint moves anything that starts at {world}")
    most = max(len(names) for names, _ in ways.values())
    longest = {link: w for link, w in ways.items() if len(w[0]) == most}
    if len({names for names, _ in longest.values()}) > 1:
        raise UsageError(
            f"several arms of {most} joints; name the link that carries the target "
            f"with --tip: {_listed(sorted(longest))}"
        )
    return min(longest, key=lambda link: longest[link][1])


def _listed(names: Sequence[str], most: int = 8) -> str:
    return ", ".join(names[:most]) + (" ..." if len(names) > most else "")


def _limits(joint: Joint) -> tuple[float, float]:
    if joint.type == "continuous" or joint.limits is None:
        return -np.pi, np.pi
    return joint.limits.lower, joint.limits.upper
