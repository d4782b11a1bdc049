"""A robot's chart of needle directions about one target, in the scanner's frame.

The chart itself, with the bounds that it proves, is the robot's own: the hook
`about_target` of its description. Here it is placed in the scene, and its joints are
brought into the URDF's order.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import inverse
from borecheck.errors import UsageError
from borecheck.plans.plan_motion import has_closed_form
from borecheck.robots.description import hook, plugin_hook
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]


class AboutTarget(Protocol):
    """What the hook `about_target` gives; lengths in [m], in the robot's base frame.

    Attributes:
        axes: The two joints whose positions are the chart's coordinates.
    """

    axes: tuple[str, str]

    def direction(self, angles: Array) -> Array:
        """Unit vectors (k, 3) along the needle, for coordinates (k, 2)."""
        ...

    def angles(self, direction: Array) -> Array:
        """Coordinates (k, 2) of unit vectors (k, 3); NaN where there are none."""
        ...

    def spread(self, angles: Array, half: Array) -> Array:
        """Bound on the angle between a cell's directions and its centre's, (k,)."""
        ...

    def halves(self, angles: Array, angle: float) -> Array:
        """Half widths (2,) of a cell about one place that holds a cone; or infinite."""
        ...

    def configurations(
        self, target: Array, angles: Array, station: Array, insertion: float
    ) -> Array:
        """Configurations (k, joints), the tip at stations (k,) before the target."""
        ...

    def joint_changes(self, target: Array, q: Array, half: Array) -> Array:
        """Bounds on |q - the centre's| in a cell, same station, (k, joints)."""
        ...

    def displacements(
        self, link: str, points: Array, target: Array, q: Array, half: Array
    ) -> Array:
        """Bounds on how far points (k, n, 3) of a link move in a cell, (k, n)."""
        ...

    def speed(self, link: str, angles: Array) -> Array:
        """How a link moves with the station, (k, 3), without turning."""
        ...


@dataclass(frozen=True, eq=False)
class Chart:
    """A robot's directions about a target in the scene; angles are the chart's, (k, 2).

    Attributes:
        robot: The robot.
        target: Where needles end, (3,), scanner's frame, [m].
        about: The robot's own chart.
    """

    robot: Robot
    target: Array
    about: AboutTarget

    @classmethod
    def of(cls, robot: Robot, target: Array) -> "Chart":
        """The chart of a robot whose description has one.

        Raises:
            UsageError: It has none, or another needle is stated than its own.
        """
        description = robot.description
        if description is None or description.about_target is None:
            raise UsageError(
                f"{robot.name} has no chart of directions about a target (hook "
                "about_target of its description): ask single plans with check --plan"
            )
        if not has_closed_form(robot) or description.insertion_joint is None:
            raise UsageError(
                f"{robot.name}: directions are of the needle and the insertion joint "
                "that its description states; leave out --needle, --tip, --insertion"
            )
        make = plugin_hook(description, "about_target", hook, lambda _: None)
        names = description.closed_form_arguments
        about = make(**{name: robot.arguments[name] for name in names})
        return cls(robot, np.array(target, np.float64), about)

    @staticmethod
    def is_of(robot: Robot) -> bool:
        """Whether a robot has a chart of the needle that is asked."""
        described = robot.description
        known = described is not None and described.about_target is not None
        return known and has_closed_form(robot)

    @cached_property
    def insertion(self) -> str:
        """The joint that drives the needle."""
        assert self.robot.description is not None
        return str(self.robot.description.insertion_joint)

    @cached_property
    def travel(self) -> tuple[float, float]:
        """From where and how far that joint drives the needle, [m]."""
        k = self.robot.model.joint_names.index(self.insertion)
        start = float(self.robot.model.lower[k])
        return start, float(self.robot.model.upper[k]) - start

    @cached_property
    def limits(self) -> Array:
        """Lower and upper limits of the coordinates, (2, 2), [rad]."""
        at = [self.robot.model.joint_names.index(name) for name in self.about.axes]
        return np.array([self.robot.model.lower[at], self.robot.model.upper[at]])

    def directions(self, angles: Array) -> Array:
        """Unit vectors along the needle, (k, 3)."""
        return np.asarray(self.about.direction(angles) @ self._R.T)

    def angles(self, directions: Array) -> Array:
        """Coordinates of unit vectors (k, 3); NaN where there are none."""
        return self.about.angles(directions @ self._R)

    def own(self, angles: Array, stations: Array) -> Array:
        """Configurations (k, joints) in the description's order; needle drawn in."""
        return self.about.configurations(self._target, angles, stations, self.travel[0])

    def in_urdf(self, own: Array) -> Array:
        """The same in the URDF's joints."""
        q = np.zeros((len(own), len(self.robot.model.joint_names)))
        for k, (column, sign, offset) in enumerate(self._bridge):
            q[:, column] = sign * own[:, k] + offset
        return q

    def joint_changes(self, own: Array, half: Array) -> Array:
        """Bounds on changes of the URDF's joints in cells, (k, joints)."""
        changes = self.about.joint_changes(self._target, own, half)
        found = np.zeros((len(own), len(self.robot.model.joint_names)))
        for k, (column, sign, _) in enumerate(self._bridge):
            found[:, column] = abs(sign) * changes[:, k]
        return found

    def place(self, part: int, q: Array) -> Array:
        """T_scene_part (k, 4, 4) at configurations in the URDF's joints."""
        frame_of, chain = chain_of(self.robot)
        frame = frame_of[self.robot.parts[part].link]
        return chain.placements(q, [frame])[:, 0]

    def displacements(self, link: str, points: Array, own: Array, half: Array) -> Array:
        """Bounds on how far points (k, n, 3) in the scene move in cells, (k, n)."""
        in_base = (points - self._origin) @ self._R
        found = self.about.displacements(link, in_base, self._target, own, half)
        return np.asarray(found)

    def speed(self, link: str, angles: Array) -> Array:
        """How a link moves with the station, (k, 3), scanner's frame."""
        return np.asarray(self.about.speed(link, angles) @ self._R.T)

    def stands(self, link: str) -> bool:
        """Whether a link is where it is whatever the needle does."""
        return not self.speed(link, np.zeros((1, 2))).any()

    def is_inserted(self, link: str) -> bool:
        """Whether the insertion joint moves a link."""
        frame_of, chain = chain_of(self.robot)
        source = self.robot.model.joint_names.index(self.insertion)
        frame = frame_of[link]
        while frame >= 0:
            if chain.source[frame] == source:
                return True
            frame = int(chain.parent[frame])
        return False

    @cached_property
    def _R(self) -> Array:
        return np.asarray(self.robot.T_scene_base[:3, :3])

    @cached_property
    def _origin(self) -> Array:
        return np.asarray(self.robot.T_scene_base[:3, 3])

    @cached_property
    def _target(self) -> Array:
        """The target in the base frame."""
        T = inverse(self.robot.T_scene_base)
        return np.asarray(T[:3, :3] @ self.target + T[:3, 3])

    @cached_property
    def _bridge(self) -> tuple[tuple[int, float, float], ...]:
        """Column, sign and offset in the URDF of each of the description's joints."""
        assert self.robot.description is not None
        names = self.robot.model.joint_names
        return tuple(
            (names.index(j.name), j.sign, j.offset)
            for j in self.robot.description.joints
        )
