"""The checks of the Python door: their verdicts are cards with a picture in a notebook.

What is drawn is worked out when a card is shown, not before.
"""

import warnings
from functools import partial, wraps
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.check import check as check_pose
from borecheck.contact.verdict import Verdict
from borecheck.motion.check import check_path as check_whole_path
from borecheck.motion.outcome import PathVerdict
from borecheck.motion.samples import configurations_at
from borecheck.report.card import picture_of
from borecheck.robots.given import Given, configurations, length
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


@wraps(check_pose)
def check(robot: Robot, scene: Scene, q: Given, **asked: Any) -> Verdict:  # noqa: D103
    verdict = check_pose(robot, scene, q, **asked)
    _tell_of_turns(robot, np.array([verdict.q]))
    draw = partial(
        picture_of,
        robot,
        scene,
        verdict.q,
        margin=verdict.margin_m,
        corridor=asked.get("corridor"),
    )
    return verdict.pictured(draw)


@wraps(check_whole_path)
def check_path(  # noqa: D103
    robot: Robot,
    scene: Scene,
    waypoints: ArrayLike,
    margin: float | str = 0.0,
    **asked: Any,
) -> PathVerdict:
    verdict = check_whole_path(robot, scene, waypoints, margin, **asked)
    points = configurations(robot, waypoints)
    _tell_of_turns(robot, points)
    draw = partial(
        picture_of,
        robot,
        scene,
        configurations_at(points, np.array([_worth_a_look(verdict)]))[0],
        margin=length(margin, "margin"),
        corridor=asked.get("corridor"),
    )
    return verdict.pictured(draw)


def _worth_a_look(verdict: PathVerdict) -> float:
    """Where contact begins, else where there is least room, as a fraction."""
    if verdict.first_contact is not None:
        return verdict.first_contact[1]
    if verdict.least is not None:
        return verdict.least.at
    return verdict.worst or 0.0


def _tell_of_turns(robot: Robot, points: Array) -> None:
    """Degrees taken for radians are no error of a joint without limits."""
    for text in robot.model.many_turns(points):
        warnings.warn(text, stacklevel=3)
