"""Where the needle is by the URDF, held against where a plan wants it.

Inverse kinematics is a closed form that somebody typed; bodies are placed by the URDF.
If the two disagree, another motion is checked than the one that the plan asks for.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import UsageError
from borecheck.robots.description import RobotDescription
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]

# Closed forms and URDFs agree to 1e-9 m where both are right; a dimension typed with
# six digits is off by a micrometre or two.
TIP_TOLERANCE = 1e-5
# Of the unit vector along the needle.
TURN_TOLERANCE = 1e-4


class NeedleLine:
    """The line of a plan, and the frame of the URDF that is to follow it.

    Args:
        robot: The robot.
        description: Its description, with a `tool_frame`.
        name: Of the plan.
        entry: A point of the line, scanner's frame, (3,) [m].
        direction: Unit vector along it, (3,).

    Raises:
        UsageError: The description names no frame at the needle's tip.
    """

    def __init__(
        self,
        robot: Robot,
        description: RobotDescription,
        name: str,
        entry: Array,
        direction: Array,
    ) -> None:
        frame = description.tool_frame
        if frame is None or frame not in robot.model.link_names:
            said = (
                "no tool_frame" if frame is None else f"no link {frame!r} (tool_frame)"
            )
            raise UsageError(
                f"{robot.name} has inverse kinematics and {said}: where it brings the "
                "needle's tip cannot be held against the URDF"
            )
        self._robot, self._name, self._frame = robot, name, frame
        self._entry, self._direction = entry, direction

    def hold(self, q: Array, distance: float) -> None:
        """Asks whether the tip is that far along the line at a configuration.

        Args:
            q: The configuration, (n,).
            distance: From the entry towards the target, [m].

        Raises:
            UsageError: By the URDF it is elsewhere, or the needle points elsewhere.
        """
        T = self._robot.placements(q)[self._frame]
        wanted = self._entry + distance * self._direction
        off = float(np.linalg.norm(T[:3, 3] - wanted))
        turned = float(np.linalg.norm(T[:3, 2] - self._direction))
        if off <= TIP_TOLERANCE and turned <= TURN_TOLERANCE:
            return
        raise UsageError(
            f"plan {self._name}: by the URDF of {self._robot.name} the needle's tip "
            f"({self._frame}) is {1e3 * off:.3f} mm from where inverse kinematics "
            f"is to bring it, {1e3 * distance:.1f} mm from the entry along its line, "
            f"and turned by {turned:.3g}: that motion is not the plan's"
        )
