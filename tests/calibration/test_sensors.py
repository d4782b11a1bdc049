"""Devices: what rounds, what scatters, what cameras make of a place."""

import numpy as np
import pytest

from borecheck.calibration.sensors import (
    Camera,
    Cameras,
    Exact,
    LaserTracker,
    VoxelGrid,
    VoxelNoise,
    looking_at,
)
from borecheck.calibration.setup import FOCAL, IMAGE_SIZE
from borecheck.errors import GeometryError
from mri_arm.calibration_setup import CAMERA_PLACES, TOOL, cameras

ROUNDING = 1e-12


@pytest.fixture
def places(rng):
    return TOOL + rng.uniform(-0.3, 0.3, (200, 3))


def test_exact_is_exact(places, rng):
    np.testing.assert_array_equal(Exact().measure(places, rng), places)


def test_thresholding_answers_the_same_for_the_same_place(places, rng):
    for device in (VoxelGrid(0.002), VoxelGrid(0.002, (0.5, 0.7, 0.9)), cameras()):
        first = device.measure(places, rng)
        np.testing.assert_array_equal(device.measure(places, rng), first)
    off = VoxelGrid(0.002).measure(places, rng) - places
    assert np.abs(off).max() <= 0.001
    assert np.abs(off).max() > 0.0009


def test_noise_has_the_stated_size(rng):
    at = np.zeros((40000, 3))
    even = VoxelNoise(0.002).measure(at, rng)
    assert np.abs(even).max() <= 0.001
    assert even.std() == pytest.approx(0.002 / np.sqrt(12), rel=0.02)
    assert LaserTracker().measure(at, rng).std() == pytest.approx(12e-6, rel=0.02)
    flat = LaserTracker(sigmas=0.0).measure(at, rng)
    assert np.abs(flat).max() <= 36e-6


@pytest.mark.parametrize("count", [2, 3, 4])
def test_cameras_without_whole_pixels_see_the_truth(places, rng, count):
    found = cameras(count, thresholded=False).measure(places, rng)
    np.testing.assert_allclose(found, places, atol=ROUNDING)


def test_whole_pixels_cost_about_a_millimetre(places, rng):
    """A pixel is 2.2 mm wide at 2 m; the paper states +-1.0 to +-1.4 mm."""
    off = np.abs(cameras(3).measure(places, rng) - places)
    assert 0.0005 < off.max() < 0.004
    better = np.abs(cameras(4).measure(places, rng) - places)
    assert better.mean() < off.mean()


def test_distortion_is_half_a_percent_in_the_corner():
    camera = Camera(np.eye(4), FOCAL, (3000, 3000), distortion=0.005)
    ideal = np.array([[750.0, 750.0]])
    point = np.column_stack([ideal / FOCAL, [[1.0]]])
    seen = camera.pixels(point)
    share = np.linalg.norm(seen) / np.linalg.norm(ideal) - 1.0
    assert share == pytest.approx(0.005 * 0.25, rel=1e-9)  # at half the corner's radius
    np.testing.assert_allclose(
        camera.rays(seen), point / np.linalg.norm(point), atol=ROUNDING
    )


def test_paper_places_of_the_cameras():
    """[Heikkila2010] section 4: two 2 m away at 90 deg, one 1.5 m on the other side."""
    a, b, c = (place - TOOL for place in CAMERA_PLACES[:3])
    assert np.linalg.norm(a) == pytest.approx(2.0)
    assert np.linalg.norm(b) == pytest.approx(2.0)
    assert a @ b == pytest.approx(0.0, abs=1e-12)
    assert a[1] < 0
    assert b[1] < 0
    assert c[1] == pytest.approx(1.5)


def test_a_target_out_of_sight_is_refused(rng):
    camera = Camera(looking_at([0, 0, 0], [1, 0, 0]), FOCAL, IMAGE_SIZE)
    both = Cameras((camera, camera))
    with pytest.raises(GeometryError, match="behind a camera"):
        both.measure(np.array([[-1.0, 0, 0]]), rng)
    with pytest.raises(GeometryError, match="leaves the image"):
        both.measure(np.array([[1.0, 5.0, 0]]), rng)
