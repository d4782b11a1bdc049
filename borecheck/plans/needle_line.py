"""Where the needle is by the URDF, held against where a plan wants it.

Inverse kinematics is a closed form that somebody typed, or a search; bodies are placed
by the URDF. If the two disagree, another motion is checked than the plan asks for.

Between stations the joints move in straight lines, and the tip leaves its own a little.
How far is bounded: the second derivative of the tip by time is at most

    C = sum_j g_j |D_j| ([j turns] |D_j| + 2 sum_{i<j, i turns} |D_i|)

over a step with joint changes D_j, g_j the reach behind joint j or 1 (`motion.bounds`
derives it), and that of the direction at most the square of all turns together. Looked
at in m parts, the tip is nowhere farther off than where it was looked at by C / 8 m^2.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import UsageError
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS, WORLD
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.needle import Needle
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]

# Closed forms and URDFs agree to 1e-9 m where both are right; a dimension typed with
# six digits is off by a micrometre or two.
TIP_TOLERANCE = 1e-5
# Of the unit vector along the needle.
TURN_TOLERANCE = 1e-4
# Into so many parts a step is divided to look at it.
PARTS = 8


class NeedleLine:
    """The line of a plan, and the frame of the URDF that is to follow it.

    Args:
        robot: The robot.
        needle: Its needle, with a frame at the tip.
        name: Of the plan.
        entry: A point of the line, scanner's frame, (3,) [m].
        direction: Unit vector along it, (3,).

    Raises:
        UsageError: There is no frame at the needle's tip.
    """

    def __init__(
        self,
        robot: Robot,
        needle: Needle | None,
        name: str,
        entry: Array,
        direction: Array,
    ) -> None:
        frame = None if needle is None else needle.tip
        if needle is None or frame is None or frame not in robot.model.link_names:
            said = (
                "no tool_frame" if frame is None else f"no link {frame!r} (tool_frame)"
            )
            raise UsageError(
                f"{robot.name} has inverse kinematics and {said}: where it brings the "
                "needle's tip cannot be held against the URDF"
            )
        self._robot, self._name, self._frame = robot, name, frame
        self._axis = needle.axis
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
        turned = float(np.linalg.norm(T[:3, :3] @ self._axis - self._direction))
        if off <= TIP_TOLERANCE and turned <= TURN_TOLERANCE:
            return
        raise UsageError(
            f"plan {self._name}: by the URDF of {self._robot.name} the needle's tip "
            f"({self._frame}) is {1e3 * off:.3f} mm from where inverse kinematics "
            f"is to bring it, {1e3 * distance:.1f} mm from the entry along its line, "
            f"and turned by {turned:.3g}: that motion is not the plan's"
        )

    def hold_some(self, waypoints: Array, distances: Array) -> None:
        """Holds the first, a middle and the last waypoint by Pinocchio; see `hold`."""
        for k in (0, len(waypoints) // 2, -1):
            self.hold(waypoints[k], float(distances[k]))

    def distance(self, q: Array) -> float:
        """How far along the line the tip is, from the entry, [m]."""
        T = self._robot.placements(q)[self._frame]
        return float((T[:3, 3] - self._entry) @ self._direction)

    def strays(self, waypoints: Array, distances: Array) -> tuple[float, float]:
        """How far tip and direction leave the line at any instant; see `steps`."""
        off, turned = self.steps(waypoints, distances)
        return float(off.max()), float(turned.max())

    def steps(self, waypoints: Array, distances: Array) -> tuple[Array, Array]:
        """How far tip and direction leave the line in each step, proven.

        Args:
            waypoints: Configurations, (k, n); straight in each joint between them.
            distances: How far along the line each is to be, (k,); between them the tip
                is to be in proportion.

        Returns:
            At no instant of a step more than this, (k - 1,) each: [m], and of the unit
            vector along the needle.
        """
        frame_of, chain = chain_of(self._robot)
        frame = frame_of[self._frame]
        shares = np.arange(PARTS) / PARTS
        steps, along = np.diff(waypoints, axis=0), np.diff(distances)
        qs = (waypoints[:-1, None] + shares[:, None] * steps[:, None]).reshape(
            -1, waypoints.shape[1]
        )
        wanted = (distances[:-1, None] + shares * along[:, None]).ravel()
        T = chain.placements(np.vstack([qs, waypoints[-1:]]), [frame])[:, 0]
        places = self._entry + np.outer([*wanted, distances[-1]], self._direction)
        off = np.linalg.norm(T[:, :3, 3] - places, axis=1)
        turned = np.linalg.norm(T[:, :3, :3] @ self._axis - self._direction, axis=1)
        shift, turn = _curvature(chain, frame, waypoints)
        between = 8.0 * PARTS**2
        return _each(off) + shift / between, _each(turned) + turn / between


def _each(seen: Array) -> Array:
    """The largest of what was seen in each step, both its ends included."""
    inside = seen[:-1].reshape(-1, PARTS).max(axis=1)
    return np.asarray(np.maximum(inside, seen[PARTS::PARTS]))


def _curvature(chain: JointChain, frame: int, waypoints: Array) -> tuple[Array, Array]:
    """Bounds on the second derivatives of a frame's place [m] and directions.

    Of every step, which is taken as one unit of time, (k - 1,) each.
    """
    thetas = chain.thetas(waypoints)
    changes, largest = np.abs(np.diff(thetas, axis=0)), np.abs(thetas).max(axis=0)
    reach = 0.0
    shift, turns = np.zeros(len(changes)), np.zeros(len(changes))
    while frame != WORLD:
        step = changes[:, frame]
        if chain.kind[frame] == TURNS:
            shift += reach * step**2
            turns += step
        gain = 1.0 if chain.kind[frame] == SLIDES else reach
        if chain.kind[frame] != FIXED:
            shift += 2.0 * gain * step * _turns_before(chain, frame, changes)
        if chain.kind[frame] == SLIDES:
            reach += float(largest[frame])
        reach += float(chain.length[frame])
        frame = int(chain.parent[frame])
    return shift, turns**2


def _turns_before(chain: JointChain, frame: int, changes: Array) -> Array:
    """Sum of the turns of all joints before one, of every step, (k,)."""
    total = np.zeros(len(changes))
    frame = int(chain.parent[frame])
    while frame != WORLD:
        if chain.kind[frame] == TURNS:
            total += changes[:, frame]
        frame = int(chain.parent[frame])
    return total
