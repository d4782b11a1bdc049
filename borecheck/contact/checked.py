"""What a verdict is about: robot, obstacles, patients with size and place, margin.

A unit or a place that is wrong makes a verdict about another room. It is correct for
the numbers given, so only who reads the numbers can tell; they come first.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from borecheck.contact.margin import Margin
from borecheck.core.se3 import matrix_rpy
from borecheck.geometry.surfaces import surface
from borecheck.geometry.triangles.topology import faces_inward
from borecheck.plans.corridor import SLACK, Corridor
from borecheck.plans.needle_corridor import needle_radius
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Obstacle, Scene
from borecheck.robots.workspace import workspace


@dataclass(frozen=True)
class CheckedBody:
    """An obstacle or a patient.

    Attributes:
        name: Its name.
        role: scanner, couch, patient or other.
        size_m: Edges of the box around it, along the scanner's axes, [m].
        centre_m: Where the middle of that box is, scanner's frame, [m].
    """

    name: str
    role: str
    size_m: tuple[float, float, float]
    centre_m: tuple[float, float, float]


@dataclass(frozen=True)
class Checked:
    """What was checked.

    Attributes:
        robot: Its name.
        arguments: Those of its arguments that tell one robot from another: what can be
            chosen, and what is not as usual.
        base_xyz_m: Where its base frame stands, scanner's frame, [m].
        base_rpy_rad: How it is turned, as in URDF, [rad].
        bodies: What stands around it.
        margin_m: Required clearance, [m].
        margin_kind: How it is taken.
        corridor_m: How far from its line the needle may be in the patient, [m]; None
            without plan or corridor.
        needle: The needle that was stated: link, frame at the tip, insertion joint;
            None for a robot's own, or without plan and corridor.
        warnings: What is odd about it.
    """

    robot: str
    arguments: Mapping[str, str]
    base_xyz_m: tuple[float, float, float]
    base_rpy_rad: tuple[float, float, float]
    bodies: tuple[CheckedBody, ...]
    margin_m: float
    margin_kind: str
    corridor_m: float | None
    needle: str | None
    warnings: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain values for `json.dumps`."""
        return asdict(self)


def checked(
    robot: Robot,
    scene: Scene,
    margin: Margin,
    *,
    with_plan: bool = False,
    corridor: Corridor | None = None,
) -> Checked:
    """What a verdict about robot and scene is about.

    Args:
        robot: The robot.
        scene: What stands around it.
        margin: What was asked for.
        with_plan: Whether the needle follows plans, with a corridor in the patient.
        corridor: Where a path may bring the needle into the patient.
    """
    T = robot.T_scene_base
    wide = needle_radius(robot) + SLACK if with_plan else None
    if corridor is not None:
        wide = corridor.radius + corridor.slack
    return Checked(
        robot=robot.name,
        arguments=_telling_arguments(robot),
        base_xyz_m=_three(T[:3, 3]),
        base_rpy_rad=_three(matrix_rpy(T[:3, :3])),
        bodies=tuple(_body(obstacle) for obstacle in scene.obstacles),
        margin_m=margin.size,
        margin_kind=margin.kind,
        corridor_m=wide,
        needle=_stated(robot) if wide is not None else None,
        warnings=(
            *_out_of_reach(robot, scene),
            *_without_patient(scene, wide),
            *_inside_out(scene),
        ),
    )


def _without_patient(scene: Scene, corridor: float | None) -> tuple[str, ...]:
    """A needle that goes nowhere: most often a patient who was not given as one."""
    if corridor is None or any(o.role == "patient" for o in scene.obstacles):
        return ()
    return (
        "a needle's way is asked and there is no patient: what it goes into is not "
        "looked at; give the body with --patient",
    )


def _inside_out(scene: Scene) -> tuple[str, ...]:
    """Closed surfaces whose triangles face inwards: the answer is the same."""
    return tuple(
        f"{o.name} is inside out: its triangles face inwards; it is taken as the solid "
        "that they enclose"
        for o in scene.obstacles
        if surface(o.mesh).topology.is_closed and faces_inward(o.mesh.corners)
    )


def _stated(robot: Robot) -> str | None:
    needle = robot.stated_needle
    return None if needle is None else needle.says.replace("--", "")


def _telling_arguments(robot: Robot) -> dict[str, str]:
    if robot.description is None:
        return dict(robot.arguments)
    usual = robot.description.arguments
    return {
        name: value
        for name, value in robot.arguments.items()
        if value != usual[name].default or name == "mount"
    }


def _body(obstacle: Obstacle) -> CheckedBody:
    low, high = obstacle.mesh.bounds
    return CheckedBody(
        obstacle.name, obstacle.role, _three(high - low), _three((low + high) / 2.0)
    )


def _out_of_reach(robot: Robot, scene: Scene) -> tuple[str, ...]:
    """A line where the robot surely reaches nothing: it, or they, stand elsewhere."""
    rooms = [
        ball.room_to(*obstacle.mesh.bounds)
        for ball in workspace(robot)
        for obstacle in scene.obstacles
    ]
    if not rooms or min(rooms) == 0.0:
        return ()
    out = math.floor(1e3 * min(rooms))
    return (
        f"{robot.name} reaches none of the obstacles, whatever its joints do: they are "
        f"at least {out} mm out of reach; are places and units right?",
    )


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
