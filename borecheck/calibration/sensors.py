"""What a measuring device makes of the true place of the target.

Cameras that threshold an image always answer the same for the same place: rounding,
not noise. [Heikkila2010] section 4 adds small random motions for this reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import rpy_matrix
from borecheck.errors import GeometryError

Array = NDArray[np.float64]


class Sensor(Protocol):
    """Something that measures places."""

    def measure(self, points: Array, rng: np.random.Generator) -> Array:
        """Measured places of true places, (..., 3) -> (..., 3), [m]."""


@dataclass(frozen=True)
class Exact:
    """Measures the truth."""

    def measure(self, points: Array, rng: np.random.Generator) -> Array:
        """The places themselves."""
        return np.array(points)


@dataclass(frozen=True)
class VoxelGrid:
    """Thresholding: the place is rounded to the middle of its voxel.

    Attributes:
        cell: Edge of a voxel [m]; "+/- 0.5 mm" is a cell of 1 mm.
        rpy: How the grid is turned against the world (roll, pitch, yaw), [rad].
    """

    cell: float
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def measure(self, points: Array, rng: np.random.Generator) -> Array:
        """The nearest corner of the grid."""
        R = rpy_matrix(*self.rpy)
        result: Array = np.round(points @ R / self.cell) * self.cell @ R.T
        return result


@dataclass(frozen=True)
class VoxelNoise:
    """The other reading of a voxel accuracy: independent errors, even over one cell.

    Attributes:
        cell: Edge of a voxel [m].
    """

    cell: float

    def measure(self, points: Array, rng: np.random.Generator) -> Array:
        """The places with an error within half a cell in every direction."""
        half = 0.5 * self.cell
        return np.asarray(points + rng.uniform(-half, half, np.shape(points)))


@dataclass(frozen=True)
class LaserTracker:
    """An absolute accuracy, as "+/- 0.036 mm".

    Attributes:
        accuracy: The printed figure [m].
        sigmas: How many standard deviations it is; 0 reads it as an even distribution.
    """

    accuracy: float = 36e-6
    sigmas: float = 3.0

    def measure(self, points: Array, rng: np.random.Generator) -> Array:
        """The places with independent errors in every direction."""
        if self.sigmas == 0.0:
            error = rng.uniform(-self.accuracy, self.accuracy, np.shape(points))
        else:
            error = rng.normal(0.0, self.accuracy / self.sigmas, np.shape(points))
        return np.asarray(points + error)


@dataclass(frozen=True, eq=False)
class Camera:
    """A pin-hole camera with radial distortion.

    Attributes:
        T_world_camera: Its pose, z the optical axis, x to the right, (4, 4).
        focal: Focal length over pixel pitch [pixel].
        size: Width and height of the image [pixel].
        distortion: Radial displacement in the corner of the image as a share of the
            distance from its centre; 0.005 is the paper's 0.5 %.
    """

    T_world_camera: Array
    focal: float
    size: tuple[int, int]
    distortion: float = 0.005

    def pixels(self, points: Array) -> Array:
        """Where points appear, (n, 2), not rounded, distortion included.

        Raises:
            GeometryError: A point is behind the camera or outside the image.
        """
        p = (points - self.T_world_camera[:3, 3]) @ self.T_world_camera[:3, :3]
        if (p[:, 2] <= 0.0).any():
            raise GeometryError("the target is behind a camera")
        ideal = self.focal * p[:, :2] / p[:, 2:]
        seen = ideal * (1.0 + self._k * (ideal**2).sum(axis=1, keepdims=True))
        if (np.abs(seen) > 0.5 * np.array(self.size)).any():
            raise GeometryError("the target leaves the image of a camera")
        return np.asarray(seen)

    def rays(self, pixels: Array) -> Array:
        """Unit directions in the world of corrected pixels, (n, 3)."""
        ideal = pixels.copy()
        for _ in range(20):  # contracts by 0.015 a round
            ideal = pixels / (1.0 + self._k * (ideal**2).sum(axis=1, keepdims=True))
        ray = np.column_stack([ideal / self.focal, np.ones(len(ideal))])
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        return np.asarray(ray @ self.T_world_camera[:3, :3].T)

    @property
    def _k(self) -> float:
        corner = 0.5 * float(np.hypot(*self.size))
        return self.distortion / corner**2


@dataclass(frozen=True, eq=False)
class Cameras:
    """Several cameras, whole pixels, distortion corrected, rays brought together.

    Attributes:
        cameras: At least two, not in one line with the target.
        thresholded: Whether pixels are whole numbers.
    """

    cameras: tuple[Camera, ...]
    thresholded: bool = True

    def measure(self, points: Array, rng: np.random.Generator) -> Array:
        """The points nearest to the rays of all cameras."""
        flat = np.reshape(points, (-1, 3))
        rays = []
        for camera in self.cameras:
            pixels = camera.pixels(flat)
            rays.append(camera.rays(np.round(pixels) if self.thresholded else pixels))
        origins = [camera.T_world_camera[:3, 3] for camera in self.cameras]
        return triangulate(origins, rays).reshape(np.shape(points))


def triangulate(origins: Sequence[ArrayLike], rays: Sequence[Array]) -> Array:
    """Points nearest to rays from several cameras, (n, 3), in least squares.

    Args:
        origins: Where the cameras are, each (3,).
        rays: Unit directions, each (n, 3).
    """
    A = np.zeros((len(rays[0]), 3, 3))
    b = np.zeros((len(rays[0]), 3))
    for origin, ray in zip(origins, rays, strict=True):
        across = np.eye(3) - ray[:, :, None] * ray[:, None, :]
        A += across
        b += across @ np.asarray(origin, dtype=np.float64)
    return np.asarray(np.linalg.solve(A, b[..., None])[..., 0])


def looking_at(place: ArrayLike, target: ArrayLike) -> Array:
    """Pose of a camera at a place that looks at a target, its x axis level, (4, 4)."""
    place = np.asarray(place, dtype=np.float64)
    z = np.asarray(target, dtype=np.float64) - place
    z = z / np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x = x / np.linalg.norm(x) if np.linalg.norm(x) > 1e-9 else np.array([1.0, 0, 0])
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    T[:3, 3] = place
    return T
