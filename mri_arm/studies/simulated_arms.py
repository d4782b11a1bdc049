"""Arms of the calibration study: as drawn, and each off its drawing."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines
from borecheck.calibration.link_parameters import (
    LinkForms,
    choose_forms,
    parameters_to_lines,
)
from borecheck.calibration.serial_arm import SerialArm
from mri_arm.dimensions import LIMITS
from mri_arm.parameters import ANGLES, NAMES, nominal

Array = NDArray[np.float64]
JOINTS = tuple(f"q{i}" for i in range(1, 7))

# Where the target is in frame 6 [m]: off all axes of the wrist; not published, assumed.
TARGET = (0.20, 0.25, -0.20)


@lru_cache(maxsize=1)
def nominal_arm() -> SerialArm:
    """The arm as drawn, from the closed form's numbers: no URDF is read."""
    points = np.zeros((6, 3))
    values = nominal()
    height = values["d1"] + values["d2"]
    points[1, 2] = values["d1"]
    points[2:, 2] = height
    points[4:, 1] = values["d4"]
    directions = np.eye(3)[[2, 0, 0, 1, 0, 1]]
    frames = np.broadcast_to(np.eye(4), (6, 4, 4)).copy()
    frames[:, :3, 3] = points
    lower, upper = np.array(list(LIMITS.values()))[:6].T
    tip = frames[5].copy()
    lines = Lines(points, directions)
    return SerialArm("mri_arm", "W", "6", JOINTS, frames, lines, lower, upper, tip, {})


@lru_cache(maxsize=1)
def forms() -> LinkForms:
    """The paper's DH and Hayati forms."""
    lines = nominal_arm().lines
    return choose_forms(lines.points, lines.directions)


def true_parameters(
    rng: np.random.Generator, length: float = 1.5e-3, angle: float = np.radians(0.25)
) -> Array:
    """An arm off its drawing: up to 1.5 mm, as the real one was (section 4), (24,)."""
    size = np.array([angle if n in ANGLES else length for n in NAMES])
    drawn = np.array([nominal()[n] for n in NAMES])
    return np.asarray(drawn + rng.uniform(-size, size))


def lines_of(values: Array) -> Lines:
    """Axes at zero of parameters in the order of `NAMES`, (24,)."""
    points, directions = parameters_to_lines(
        forms(), dict(zip(NAMES, values, strict=True))
    )
    return Lines(points, directions)
