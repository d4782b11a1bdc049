"""The configurations of a redundant arm for one needle, by coordinates of its own.

A description's hook `family` gives them in closed form ([CRANE]: the roll about the
needle, q7 and q8). Here they are brought into the scene and to the URDF's joints.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import inverse
from borecheck.robots.description import RobotDescription, hook, plugin_hook
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Family:
    """All configurations of a robot that put its needle somewhere.

    Attributes:
        robot: The robot.
        closed_form: What the description's hook gave.
        lower: Of every coordinate, (k,).
        upper: Likewise; a turn beyond `lower` where it is periodic.
    """

    robot: Robot
    closed_form: Any
    lower: Array
    upper: Array

    @property
    def names(self) -> tuple[str, ...]:
        """What the coordinates are called."""
        return tuple(self.closed_form.names)

    @property
    def periodic(self) -> NDArray[np.bool_]:
        """Which coordinates come back after `upper`."""
        return np.array(self.closed_form.periodic, bool)

    def configurations(self, tip: Array, direction: Array, x: Array) -> Array:
        """Joint positions (n, joints) at coordinates x (n, k); NaN where there is none.

        Limits are not looked at.

        Args:
            tip: Needle tip, scene's frame, (3,), [m].
            direction: Unit vector along the needle.
            x: Coordinates.
        """
        p, n = self._seen(tip, direction)
        return self._in_urdf(self.closed_form.configurations(p, n, x))

    def tilted(self, tip: Array, direction: Array, x: Array, turns: Array) -> Array:
        """The same with the needle turned about its tip, (n, m, joints).

        The arm follows with its coordinates held: the roll is carried along, as a frame
        that is turned by the same rotation.

        Args:
            tip: As for `configurations`.
            direction: Likewise.
            x: Likewise.
            turns: Rotation vectors square to the needle, scene's frame, (m, 3), [rad].
        """
        p, n = self._seen(tip, direction)
        seen = turns @ self.robot.T_scene_base[:3, :3]
        return self._in_urdf(self.closed_form.configurations(p, n, x, seen))

    def spread(self, tip: Array, direction: Array, x: Array, half: Array) -> "Spread":
        """How far the arm can be from where it is in the middle of boxes.

        Args:
            tip: As for `configurations`.
            direction: Likewise.
            x: Middles, (n, k).
            half: Half the sizes, (n, k).
        """
        return self.spread_tilted(tip, direction, x, half, None)

    def spread_tilted(
        self, tip: Array, direction: Array, x: Array, half: Array, turn: Array | None
    ) -> "Spread":
        """The same with the needle turned about its tip by a rotation vector, (3,)."""
        p, n = self._seen(tip, direction)
        T = inverse(self.robot.T_scene_base)
        seen = None if turn is None else T[:3, :3] @ turn
        found = self.closed_form.spread(p, n, x, half, seen)
        description = self.robot.description
        assert description is not None
        order = [self.robot.model.joint_names.index(j.name) for j in description.joints]
        joints, axes, origins = (np.zeros((len(x), len(order))) for _ in range(3))
        joints[:, order] = found.joints
        axes[:, order], origins[:, order] = found.axes, found.origins
        return Spread(self._in_urdf(found.q), joints, axes, origins, found, T)

    def _seen(self, tip: Array, direction: Array) -> tuple[Array, Array]:
        T = inverse(self.robot.T_scene_base)
        return T[:3, :3] @ tip + T[:3, 3], T[:3, :3] @ direction

    def _in_urdf(self, q_paper: Array) -> Array:
        """By the description's bridge, joint by joint."""
        description = self.robot.description
        assert description is not None  # who has a family has a description
        names = self.robot.model.joint_names
        q = np.zeros((*q_paper.shape[:-1], len(names)))
        for k, joint in enumerate(description.joints):
            value = joint.sign * q_paper[..., k] + joint.offset
            q[..., names.index(joint.name)] = value
        return q


@dataclass(frozen=True, eq=False)
class Spread:
    """Bounds over boxes, in the URDF's joints and the scene's frame.

    Attributes:
        q: In the middles, (n, joints).
        joints: How far each joint can be from there, (n, joints).
        axes: How far each joint's axis can be turned, (n, joints), [rad].
        origins: How far a point on it can be moved, (n, joints), [m].
    """

    q: Array
    joints: Array
    axes: Array
    origins: Array
    _closed_form: Any
    _T_base_scene: Array

    def points(self, link: str, at: Array) -> Array:
        """How far points of a link at (n, k, 3) in the middles go, (n, k), [m]."""
        T = self._T_base_scene
        found = self._closed_form.points(link, at @ T[:3, :3].T + T[:3, 3])
        return np.asarray(found, dtype=np.float64)


def family_of(robot: Robot, deep: float) -> Family | None:
    """A robot's family in closed form, the needle able to be driven so deep; or None.

    Args:
        robot: The robot.
        deep: How far the insertion joint must be able to go on, [m].

    Raises:
        UsageError: The hook does not give what it must.
    """
    description = robot.description
    if description is None or description.family is None:
        return None
    if robot.stated_needle is not None:
        return None  # the closed form is of the description's needle
    arguments = {n: robot.arguments[n] for n in description.closed_form_arguments}
    found = _hook(description)(**arguments)
    lower, upper = (np.array(v, float) for v in (found.lower, found.upper))
    if found.insertion is not None:
        upper[found.insertion] -= deep
    return Family(robot, found, lower, upper)


_ASKED = ("names", "lower", "upper", "periodic", "insertion", "configurations")


def _hook(description: RobotDescription) -> Any:
    return plugin_hook(description, "family", hook, _wrong)


def _wrong(found: Any) -> str | None:
    """What a hook's result lacks."""
    missing = [name for name in _ASKED if not hasattr(found, name)]
    if missing:
        return f"it lacks {', '.join(missing)}"
    sizes = {len(getattr(found, n)) for n in ("names", "lower", "upper", "periodic")}
    if len(sizes) != 1:
        return "names, lower, upper and periodic are not of one length"
    return None


def rotated(vectors: Array, direction: Array) -> Array:
    """A direction turned by each rotation vector square to it, (m, 3)."""
    angle = np.linalg.norm(vectors, axis=1)[:, None]
    axis = vectors / np.where(angle > 0.0, angle, 1.0)
    return np.asarray(
        np.cos(angle) * direction + np.sin(angle) * np.cross(axis, direction)
    )
