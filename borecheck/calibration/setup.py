"""How an arm is measured: devices, target, encoders; from its package or assumed.

A robot's package says it in a module `calibration_setup` beside its description, as
`SETUP`; for any other arm cameras and a laser tracker are placed around it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.sensors import (
    Camera,
    Cameras,
    LaserTracker,
    Sensor,
    looking_at,
)
from borecheck.calibration.serial_arm import SerialArm

Array = NDArray[np.float64]

Devices = Mapping[str, Mapping[str, Sensor]]

# Camera of [Heikkila2010] section 4, 1392 x 1040 pixels of 6.45 um (its data sheet);
# the lens is not published: with 6 mm a pixel is 2.2 mm wide in 2 m
# distance, like the paper's +-1.0 to +-1.4 mm there, assumed.
IMAGE_SIZE = (1392, 1040)
FOCAL = 6e-3 / 6.45e-6

# Cameras about an arm without a set-up of its own: so many times its reach away that
# the whole reach is in the image (half of 1040 pixels over the focal length: 29 deg).
CAMERA_DISTANCE = 2.2


@dataclass(frozen=True)
class CalibrationSetup:
    """How an arm is measured: what a robot's package may say about itself.

    Attributes:
        world_link: Link in whose frame points are measured; None: the root.
        tip_link: Link that carries the target; None: the end of the arm.
        target: The target in the frame of that link, (x, y, z), [m].
        pulses: Encoder resolution by joint, [rad].
        sensors: Measuring devices by name and joint ("" for all others); "cameras" and
            "laser" are added if they are missing.
        visible: Largest angle from the middle of a joint's range that devices see, by
            joint, [rad].
        source: One line about where the numbers come from.
    """

    world_link: str | None = None
    tip_link: str | None = None
    target: tuple[float, float, float] = (0.06, 0.15, -0.08)
    pulses: Mapping[str, float] = field(default_factory=dict)
    sensors: Devices = field(default_factory=dict)
    visible: Mapping[str, float] = field(default_factory=dict)
    source: str = "assumed: a target off all axes of the wrist"


def setup_of(name: str) -> CalibrationSetup:
    """The set-up of an installed robot, or a general one."""
    for entry in entry_points(group="borecheck.robots", name=name):
        package = entry.module.rpartition(".")[0]
        module = f"{package}.calibration_setup"
        if package and find_spec(module) is not None:
            found: CalibrationSetup = import_module(module).SETUP
            return found
    return CalibrationSetup()


def sensors_of(
    arm: SerialArm, setup: CalibrationSetup
) -> dict[str, Mapping[str, Sensor]]:
    """All devices by name: those of the set-up, general ones for the others."""
    general: dict[str, Mapping[str, Sensor]] = {
        "cameras": {"": surrounding_cameras(arm, setup.target)},
        "laser": {"": LaserTracker()},
    }
    return {**general, **setup.sensors}


def target_at_zero(arm: SerialArm, target: Sequence[float]) -> Array:
    """The target in the world frame at zero, (3,), [m]."""
    T = arm.T_world_tip
    return np.asarray(T[:3, :3] @ np.array(target) + T[:3, 3])


def surrounding_cameras(arm: SerialArm, target: Sequence[float]) -> Cameras:
    """Four cameras around an arm's base, each seeing all of its reach."""
    joints = arm.T_world_joint[:, :3, 3]
    way = np.vstack([joints, target_at_zero(arm, target)])
    middle = joints[0]
    reach = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    poses = []
    for quarter in range(4):
        a = 0.5 * np.pi * (quarter + 0.5)
        away = CAMERA_DISTANCE * reach * np.array([np.cos(a), np.sin(a), 0.2])
        poses.append(looking_at(middle + away, middle))
    return Cameras(tuple(Camera(T, FOCAL, IMAGE_SIZE) for T in poses))
