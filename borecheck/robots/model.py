"""Placements of a robot's links by Pinocchio; the only importer of pinocchio.

Pinocchio ignores `<mimic>` by default and refuses chains of them when asked, orders
joints by its own rules and hands out live references. This module hides all of it:
joints are free joints of the URDF in the file's order, mimic joints are expanded
here, and what is returned is a copy.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import JointLimitError, UnknownNameError, UsageError
from borecheck.robots.pinocchio_model import MOVING, PinocchioModel
from borecheck.robots.urdf.mimic import resolve
from borecheck.robots.urdf.parse import build
from borecheck.robots.urdf.schema import FREE_TYPES
from borecheck.robots.urdf.source import Source, read
from borecheck.robots.urdf.tree import Joint, UrdfTree

Array = NDArray[np.float64]

# A limit typed in degrees and one computed in radians differ in the last digits.
LIMIT_TOLERANCE = 1e-9
# So many times a joint's largest position are no slip, but degrees or millimetres.
FAR_BEYOND = 4.0


@dataclass(frozen=True)
class FreeJoint:
    """A joint that the user sets.

    Attributes:
        name: As in the URDF.
        type: revolute, continuous or prismatic.
        lower: Lower limit, [rad] or [m]; -inf for continuous.
        upper: Upper limit.
    """

    name: str
    type: str
    lower: float
    upper: float

    @property
    def is_angle(self) -> bool:
        """Whether the position is an angle."""
        return self.type != "prismatic"


class RobotModel:
    """A robot built from URDF text: names, limits, and placements of its links.

    Attributes:
        tree: Its links and joints; floating and planar joints stand fixed in it.
        standing: Names of the floating and planar joints that stand at their origin.

    Args:
        urdf: The URDF, xacro expanded: its text, or already read.
        file: What to call a text in errors.

    Raises:
        UrdfError: No robot can be built from it; one line with the element.
    """

    def __init__(self, urdf: str | Source, file: str = "robot") -> None:
        source = read(urdf, file) if isinstance(urdf, str) else urdf
        self.tree, self.standing = _with_free_joints_fixed(build(source))
        self._moving = [j for j in self.tree.joints if j.type in MOVING]
        self._follows = resolve(self.tree.joints, source.file)
        self.free_joints = tuple(
            FreeJoint(j.name, j.type, *_limits(j))
            for j in self._moving
            if j.name not in self._follows
        )
        self._pinocchio = PinocchioModel(self.tree)

    @property
    def name(self) -> str:
        """The robot's name in the URDF."""
        return self.tree.name

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Free joints in the order of q."""
        return tuple(joint.name for joint in self.free_joints)

    @property
    def link_names(self) -> tuple[str, ...]:
        """All links in the file's order."""
        return tuple(link.name for link in self.tree.links)

    @cached_property
    def lower(self) -> Array:
        """Lower limits in the order of q, [rad] or [m]."""
        return np.array([joint.lower for joint in self.free_joints])

    @cached_property
    def upper(self) -> Array:
        """Upper limits in the order of q, [rad] or [m]."""
        return np.array([joint.upper for joint in self.free_joints])

    def configuration(self, values: Mapping[str, float]) -> Array:
        """Q from positions by joint name; joints that are not named stand at 0.

        Raises:
            UnknownNameError: A name that is no free joint.
            UsageError: A position that is no number.
        """
        q = np.zeros(len(self.free_joints))
        for name, value in values.items():
            if name not in self.joint_names:
                raise UnknownNameError("joint", name, self.joint_names)
            try:
                q[self.joint_names.index(name)] = value
            except (TypeError, ValueError):
                raise UsageError(
                    f"joint {name} is {value!r}, no number: give [m] or [rad]"
                ) from None
        return q

    def check_configuration(self, q: ArrayLike) -> Array:
        """A copy of q as (n,) float64, if it has the right length and is finite.

        Raises:
            UsageError: Wrong length or a number that is not finite.
        """
        try:
            q = np.array(q, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise UsageError(f"q is no list of numbers: {error}") from None
        if q.shape != (len(self.free_joints),):
            raise UsageError(
                f"q has shape {q.shape}, but {self.name} has "
                f"{len(self.free_joints)} joints: {', '.join(self.joint_names)}"
            )
        if not np.isfinite(q).all():
            raise UsageError("q holds a number that is not finite")
        return q

    def check_limits(self, q: ArrayLike) -> Array:
        """A copy of q, if every joint, mimic joints included, is within its limits.

        Raises:
            JointLimitError: Names every joint that is beyond its limit.
        """
        q = self.check_configuration(q)
        positions = self.positions(q)
        broken = []
        for joint in self._moving:
            lower, upper = _limits(joint)
            value = positions[joint.name]
            if not lower - LIMIT_TOLERANCE <= value <= upper + LIMIT_TOLERANCE:
                unit = "m" if joint.type == "prismatic" else "rad"
                limits = f"[{lower:.6g}, {upper:.6g}]{_other_unit(joint, value)}"
                told = f"{value:.6g}"
                if told in (f"{lower:.6g}", f"{upper:.6g}"):  # beyond by less
                    told = f"{value:.12g}"
                broken.append(f"{joint.name} = {told} {unit} is outside {limits}")
        if broken:
            raise JointLimitError(f"{self.name}: " + "; ".join(broken))
        return q

    def beyond_limits(self, qs: Array) -> NDArray[np.bool_]:
        """Which configurations (n, joints) break a limit, of mimic joints too, (n,)."""
        beyond = np.zeros(len(qs), dtype=bool)
        for joint in self._moving:
            lower, upper = _limits(joint)
            source, factor, offset = self.driver(joint.name, joint.type)
            value = factor * qs[:, source] + offset
            beyond |= value < lower - LIMIT_TOLERANCE
            beyond |= value > upper + LIMIT_TOLERANCE
        return beyond

    def many_turns(self, qs: Array) -> tuple[str, ...]:
        """Continuous joints that stand beyond a turn, which degrees taken for rad do.

        It is no error: such a joint has no limits.

        Args:
            qs: Configurations, (n, joints).

        Returns:
            One sentence for each.
        """
        told = []
        for k, joint in enumerate(self.free_joints):
            if joint.type != "continuous":
                continue
            value = float(qs[np.argmax(np.abs(qs[:, k])), k])
            if abs(value) > 2.0 * math.pi:
                told.append(
                    f"{joint.name}, a continuous joint, stands at {value:.6g} rad, "
                    f"more than a turn{_as_degrees(value)}"
                )
        return tuple(told)

    def moving_limits(self) -> Iterator[tuple[Joint, tuple[float, float]]]:
        """Joints that can move, mimic joints too, with their limits, [rad] or [m]."""
        for joint in self._moving:
            yield joint, _limits(joint)

    def driver(self, name: str, kind: str) -> tuple[int, float, float]:
        """Which entry of q drives a joint, with factor and offset.

        (-1, 1, 0) for a fixed joint. A joint that mimics one that cannot move stands
        still: factor 0.
        """
        if kind == "fixed":
            return -1, 1.0, 0.0
        leader, factor, offset = self._follows.get(name, (name, 1.0, 0.0))
        if leader not in self.joint_names:
            return 0, 0.0, offset
        return self.joint_names.index(leader), factor, offset

    def positions(self, q: ArrayLike) -> dict[str, float]:
        """Position of every moving joint, mimic joints expanded, [rad] or [m]."""
        q = self.check_configuration(q)
        free = {joint.name: float(q[i]) for i, joint in enumerate(self.free_joints)}
        return {joint.name: self._position(joint.name, free) for joint in self._moving}

    def _position(self, name: str, free: Mapping[str, float]) -> float:
        if name not in self._follows:
            return free[name]
        leader, multiplier, offset = self._follows[name]
        return multiplier * free.get(leader, 0.0) + offset

    def placements(self, q: ArrayLike) -> dict[str, Array]:
        """T_root_link (4, 4) of every link at q; copies."""
        return self._pinocchio.placements(self.positions(q))

    def random_configurations(self, rng: np.random.Generator, count: int) -> Array:
        """Configurations (count, n) drawn evenly within the limits.

        A continuous joint is drawn within one turn. Mimic joints keep theirs by
        rejection.
        """
        lower = np.where(np.isfinite(self.lower), self.lower, -np.pi)
        upper = np.where(np.isfinite(self.upper), self.upper, np.pi)
        drawn: list[Array] = []
        for _ in range(1000 * count):
            if len(drawn) == count:
                break
            q = rng.uniform(lower, upper)
            try:
                drawn.append(self.check_limits(q))
            except JointLimitError:
                continue
        if len(drawn) < count:
            raise JointLimitError(f"{self.name}: mimic joints leave no configuration")
        return np.array(drawn).reshape(count, len(self.free_joints))


def _limits(joint: Joint) -> tuple[float, float]:
    if joint.type == "continuous" or joint.limits is None:
        return -np.inf, np.inf
    return joint.limits.lower, joint.limits.upper


def _other_unit(joint: Joint, value: float) -> str:
    """A hint where a value far beyond its limits lies within them in another unit."""
    lower, upper = _limits(joint)
    slides = joint.type == "prismatic"
    other = 1e-3 * value if slides else math.radians(value)
    far = abs(value) > FAR_BEYOND * max(abs(lower), abs(upper))
    if not (far and lower <= other <= upper):
        return ""
    if not slides:
        return _as_degrees(value)
    return (
        f" (are these millimetres? Numbers are metres: {other:.6g}, or '{value:g}mm')"
    )


def _as_degrees(value: float) -> str:
    other = math.radians(value)
    return f" (are these degrees? Numbers are radians: {other:.6g}, or '{value:g}deg')"


def _with_free_joints_fixed(tree: UrdfTree) -> tuple[UrdfTree, tuple[str, ...]]:
    """The tree with floating and planar joints fixed at their origin, and which.

    Such a joint carries the whole robot (all else is refused): where the root is
    placed decides where it stands.
    """
    free = tuple(joint.name for joint in tree.joints if joint.type in FREE_TYPES)
    joints = tuple(
        replace(joint, type="fixed") if joint.name in free else joint
        for joint in tree.joints
    )
    return replace(tree, joints=joints), free
