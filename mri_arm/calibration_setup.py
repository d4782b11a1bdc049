"""How the paper measures the MRI arm: cameras, laser tracker, encoders, target."""

from math import radians

import numpy as np

from borecheck.calibration.sensors import (
    Camera,
    Cameras,
    LaserTracker,
    Sensor,
    VoxelGrid,
    VoxelNoise,
    looking_at,
)
from borecheck.calibration.setup import FOCAL, IMAGE_SIZE, CalibrationSetup
from mri_arm.dimensions import ENCODER_DEG

# Where the tool is at zero, in the paper's world W on the floor under axis 1.
TOOL = np.array([0.0, 1.25, 1.05])

# [Heikkila2010] section 4: two cameras behind the robot, 2 m from the tool, their axes
# at 90 deg; one on the other side at 1.5 m; heights and the place of the fourth, which
# section 4 only names, are assumed.
_DIAGONAL = 2.0 / np.sqrt(2.0)
CAMERA_PLACES = (
    TOOL + np.array([_DIAGONAL, -_DIAGONAL, 0.0]),
    TOOL + np.array([-_DIAGONAL, -_DIAGONAL, 0.0]),
    TOOL + np.array([0.0, 1.5, 0.1]),
    TOOL + np.array([1.2, 0.6, 1.5]),
)

# Cells of "+/- 0.5 mm for observing joints 1 and 2, and +/- 1.0 to +/- 1.4 mm for other
# joints": twice the figure, the middle of the second.
VOXEL_NEAR, VOXEL_FAR = 1.0e-3, 2.4e-3


def cameras(count: int = 3, thresholded: bool = True) -> Cameras:
    """The paper's cameras; three were real, a fourth was simulated."""
    poses = [looking_at(place, TOOL) for place in CAMERA_PLACES[:count]]
    seen = tuple(Camera(T, FOCAL, IMAGE_SIZE) for T in poses)
    return Cameras(seen, thresholded)


def voxels(
    scale: float = 1.0,
    *,
    noise: bool = False,
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> dict[str, Sensor]:
    """Voxel accuracies by joint, as rounding or (`noise`) as independent errors."""
    cells = scale * VOXEL_NEAR, scale * VOXEL_FAR
    near, far = (VoxelNoise(c) if noise else VoxelGrid(c, rpy) for c in cells)
    return {"q1": near, "q2": near, "": far}


SETUP = CalibrationSetup(
    world_link="W",
    tip_link="6",
    target=(0.06, 0.15, -0.08),
    pulses={f"q{i + 1}": radians(deg) for i, deg in enumerate(ENCODER_DEG)},
    sensors={
        "cameras": {"": cameras(3)},
        "cameras4": {"": cameras(4)},
        "voxels": voxels(),
        "voxel-noise": voxels(noise=True),
        "laser": {"": LaserTracker()},
    },
    # further out the target leaves the image of one of the cameras
    visible={"q1": radians(30.0)},
    source="[Heikkila2010] section 4; target and lens are assumed",
)
