"""The calibration of section IV-B in simulation: what tracker and scanner would read.

The stages q1 to q3 move, the rest stands; the tracker sees the sensor at the guide. One
scan shows the fiducial spheres of its mount. Numpy only.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.kinematics import forward
from crane.registration import Registration, chained, pose_covariance, register
from crane.turning import turns

Array = NDArray[np.float64]

# trakSTAR's rated accuracy is lost from the text; 1.4 mm and 0.5 deg rms from memory of
# its data sheet, unverified.
TRACKER_SHIFT, TRACKER_TURN = 1.4e-3, np.radians(0.5)
# Assumed: a sphere's centroid in slices of 0.6 mm.
CENTROID = 0.2e-3
# Assumed: on the bench the spheres are known in the sensor's axes to this.
MOUNT = 0.05e-3

# Assumed: the sensor stands beside the guide bushing, square to it, on frame 8.
SENSOR_IN_8 = (0.0, 0.015, -0.005)

# CT-SPOT spheres in the sensor's frame, [m]; assumed, within the mount of section IV-B.
FIDUCIALS = (
    (0.012, 0.0, 0.0),
    (-0.012, 0.002, 0.004),
    (0.0, 0.014, -0.006),
    (0.002, -0.014, 0.008),
    (0.008, 0.010, 0.012),
    (-0.008, -0.008, -0.012),
    (0.010, -0.010, 0.002),
    (-0.004, 0.006, 0.014),
)


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a calibration found, each part and the whole.

    Attributes:
        tracker_robot: T_tracker_robot from the stages' trajectory.
        scanner_sensor: T_scanner_sensor from the fiducials' centroids.
        scanner_robot: T_scanner_robot, of all three errors (the sensor's pose too).
    """

    tracker_robot: Registration
    scanner_sensor: Registration
    scanner_robot: Registration


def stage_trajectory(side: int = 3, span: float = 0.2) -> Array:
    """A grid of q1 to q3, (side^3, 8), the arm bent as at home.

    Args:
        side: Points along each stage.
        span: Of the motion, [m].
    """
    steps = np.linspace(-0.5 * span, 0.5 * span, side)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    q = np.tile([0.0, 0.15, 0.3, 0.0, 0.0, 0.0, np.pi / 6, 0.0], (len(grid), 1))
    q[:, :3] += grid
    return q


def sensor_in_robot(q: ArrayLike) -> Array:
    """FK(q) T_EE_sensor, (n, 4, 4), in the robot's frame I."""
    T = np.eye(4)
    T[:3, 3] = SENSOR_IN_8
    return np.asarray(forward(np.asarray(q, float))["8"] @ T)


def noisy(points: ArrayLike, fle: float, rng: np.random.Generator) -> Array:
    """Points whose error has the rms length `fle`, [m]."""
    points = np.asarray(points, float)
    return points + rng.normal(scale=fle / np.sqrt(3.0), size=points.shape)


def calibrated(
    T_tracker_robot: ArrayLike,
    T_scanner_robot: ArrayLike,
    rng: np.random.Generator,
    *,
    side: int = 3,
    readings: int = 100,
) -> Calibration:
    """One calibration, with the noise of tracker, scan and mount.

    Args:
        T_tracker_robot: The truth, (4, 4).
        T_scanner_robot: The truth, (4, 4).
        rng: Of all noise.
        side: Of the stages' grid.
        readings: Of the tracker that are averaged at the scan; what it is off by at
            rest is taken as independent from one to the next (assumed).
    """
    T_tracker_robot = np.asarray(T_tracker_robot, float)
    q = stage_trajectory(side)
    seen = sensor_in_robot(q)[:, :3, 3]
    read = seen @ T_tracker_robot[:3, :3].T + T_tracker_robot[:3, 3]
    tracker = register(seen, noisy(read, TRACKER_SHIFT, rng), TRACKER_SHIFT)

    sensor = sensor_in_robot(q[len(q) // 2])
    T_scanner_sensor = np.asarray(T_scanner_robot, float) @ sensor
    spheres = np.array(FIDUCIALS)
    centroids = spheres @ T_scanner_sensor[:3, :3].T + T_scanner_sensor[:3, 3]
    fle = float(np.hypot(CENTROID, MOUNT))
    scanner = register(noisy(spheres, MOUNT, rng), noisy(centroids, CENTROID, rng), fle)
    pose = read_pose(T_tracker_robot @ sensor, readings, rng)
    whole = chained([scanner, pose.inverse(), tracker])
    return Calibration(tracker, scanner, whole)


def read_pose(T: ArrayLike, readings: int, rng: np.random.Generator) -> Registration:
    """T_tracker_sensor as the average of some readings tells it."""
    shift, turn = (s / np.sqrt(readings) for s in (TRACKER_SHIFT, TRACKER_TURN))
    off = np.eye(4)
    off[:3, :3] = turns(rng.normal(scale=turn / np.sqrt(3.0), size=(1, 3)))[0]
    T = np.array(T, float)
    T[:3, :3] = off[:3, :3] @ T[:3, :3]
    T[:3, 3] = noisy(T[:3, 3], shift, rng)
    return Registration(T, pose_covariance(T, shift, turn))
