"""Where the parts of a robot can get to at all: a bound, from lengths alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.robots.model import RobotModel
from borecheck.robots.robot import Robot
from borecheck.robots.urdf.tree import Joint

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ball:
    """A part is nowhere but in here, whatever the joints do.

    Attributes:
        centre: In the scanner's frame, (3,), [m].
        radius: Infinite for a part whose way nothing limits, [m].
    """

    centre: Array
    radius: float

    def room_to(self, low: Array, high: Array) -> float:
        """Least distance from the ball to a box, [m]; 0 where they meet."""
        aside = np.maximum(np.maximum(low - self.centre, self.centre - high), 0.0)
        return max(0.0, float(np.linalg.norm(aside)) - self.radius)


@dataclass(frozen=True, eq=False)
class _Frame:
    """Where a link's frame can be.

    Attributes:
        T: One of its placements: its origin is within `radius` of that one's.
        radius: See T, [m].
        turned: Whether its rotation can be another one.
    """

    T: Array
    radius: float
    turned: bool


def workspace(robot: Robot) -> tuple[Ball, ...]:
    """A ball about everything that each of the robot's parts can get to.

    A joint that turns keeps its child's origin where it is and turns what hangs on it
    about that; one that slides moves it along by its limits at most.
    """
    frames = _frames(robot)
    with np.errstate(over="ignore"):  # a box of 1e308 m reaches everywhere
        return tuple(
            _ball(frames[part.link], part.mesh.vertices) for part in robot.parts
        )


def _frames(robot: Robot) -> dict[str, _Frame]:
    model = robot.model
    below: dict[str, list[Joint]] = {}
    for joint in model.tree.joints:
        below.setdefault(joint.parent, []).append(joint)
    frames = {model.tree.root.name: _Frame(robot.T_scene_root, 0.0, False)}
    waiting = list(frames)
    while waiting:
        link = waiting.pop()
        for joint in below.get(link, ()):
            frames[joint.child] = _behind(model, joint, frames[link])
            waiting.append(joint.child)
    return frames


def _behind(model: RobotModel, joint: Joint, parent: _Frame) -> _Frame:
    """The frame behind a joint."""
    T, radius, turned = parent.T @ joint.origin, parent.radius, parent.turned
    if turned:  # the offset may point anywhere
        T = parent.T
        radius += float(np.linalg.norm(joint.origin[:3, 3]))
    if joint.type == "prismatic":
        radius += _longest_way(model, joint)
    elif joint.type in ("revolute", "continuous"):
        turned = True
    elif joint.type != "fixed":
        radius = np.inf
    return _Frame(T, radius, turned)


def _longest_way(model: RobotModel, joint: Joint) -> float:
    """How far a sliding joint gets from where it stands at 0, [m]."""
    source, factor, offset = model.driver(joint.name, joint.type)
    if factor == 0.0:
        return abs(offset)
    ends = (model.lower[source], model.upper[source])
    return float(max(abs(factor * end + offset) for end in ends))


def _ball(frame: _Frame, vertices: Array) -> Ball:
    if frame.turned:
        farthest = np.linalg.norm(vertices, axis=1).max()
        return Ball(frame.T[:3, 3], frame.radius + float(farthest))
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    farthest = np.linalg.norm(vertices - middle, axis=1).max()
    centre = frame.T[:3, :3] @ middle + frame.T[:3, 3]
    return Ball(centre, frame.radius + float(farthest))
