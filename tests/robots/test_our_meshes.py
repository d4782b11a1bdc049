"""Shapes and Zerobot's meshes: closed, outward, sound, of the promised sizes."""

import subprocess
import sys
from itertools import combinations
from math import cos, pi

import numpy as np
import pytest

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.exact import exact
from borecheck_models.mass import mass_properties
from borecheck_models.shapes import (
    Detail,
    box,
    cylinder,
    joined,
    lofted,
    refined,
    revolved,
    signed_volume,
)
from tests.places import PROJECT
from zerobot.meshes import NEEDLE_DIAMETER, build

# Of the whole robot, per level: the sizes that were asked for, 15 % either way.
TRIANGLES = {"coarse": 2_000, "middle": 20_000, "fine": 100_000}
SHARE = 0.15

# Longest edge over height: below this a triangle is no sliver. Coarse bodies are
# drawn with as few triangles as possible, slivers included.
MEDIAN_ASPECT = 8.0
WORST_ASPECT = 25.0

DETAILS = (Detail(), Detail(0.05, 12, 2), Detail(0.01, 24, 3))


def assert_sound(mesh):
    assert mesh.is_closed
    assert signed_volume(mesh) > 0.0
    assert smallest_height(mesh) > 1e-6  # float32 in STL resolves 1e-7 m at 1 m


def sides(mesh):
    corners = mesh.corners
    edges = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    a, b, c = np.moveaxis(corners, 1, 0)
    return edges.max(axis=1), np.linalg.norm(np.cross(b - a, c - a), axis=1)


def smallest_height(mesh):
    longest, doubled_area = sides(mesh)
    return float((doubled_area / longest).min())


def bodies(mesh):
    """The connected surfaces of a mesh, as meshes."""
    label = np.arange(len(mesh.vertices))
    while True:
        lowest = label[mesh.triangles].min(axis=1)
        new = label.copy()
        for k in range(3):
            np.minimum.at(new, mesh.triangles[:, k], lowest)
        if np.array_equal(new, label):
            break
        label = new
    of_triangle = label[mesh.triangles[:, 0]]
    return [
        TriangleMesh(mesh.name, mesh.vertices, mesh.triangles[of_triangle == one])
        for one in np.unique(of_triangle)
    ]


@pytest.mark.parametrize("detail", DETAILS)
@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_box_is_sound_and_fills_its_bounds(detail, radius):
    low, high = np.array([-0.1, 0.2, -0.3]), np.array([0.3, 0.35, 0.1])
    mesh = box(low, high, detail, radius)
    assert_sound(mesh)
    np.testing.assert_allclose(mesh.bounds, [low, high], atol=1e-15)
    full = float(np.prod(high - low))
    if radius == 0.0:
        assert signed_volume(mesh) == pytest.approx(full)
    else:
        edges = 4.0 * float((high - low).sum())
        assert full - edges * radius**2 < signed_volume(mesh) < full


@pytest.mark.parametrize("detail", DETAILS)
def test_cylinder_contains_the_true_one(detail):
    start, end, radius = np.array([0.1, 0.2, 0.3]), np.array([0.1, 0.5, 0.7]), 0.04
    mesh = cylinder(start, end, radius, detail)
    assert_sound(mesh)
    axis = (end - start) / np.linalg.norm(end - start)
    side = mesh.corners.mean(axis=1) - start
    along = side @ axis
    outward = side - along[:, None] * axis
    on_mantle = (along > 1e-6) & (along < np.linalg.norm(end - start) - 1e-6)
    normals = np.cross(
        mesh.corners[:, 1] - mesh.corners[:, 0], mesh.corners[:, 2] - mesh.corners[:, 0]
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    distance = np.einsum("ij,ij->i", outward, normals)[on_mantle]
    assert on_mantle.any()
    np.testing.assert_allclose(distance, radius, atol=1e-12)  # flats touch the circle
    exact_volume = pi * radius**2 * 0.5
    assert exact_volume < signed_volume(mesh) < exact_volume / cos(pi / 8) ** 2


def test_polygon_within_the_circle():
    profile = [(0.0, 0.0), (0.1, 0.0), (0.1, 0.2), (0.0, 0.2)]
    mesh = revolved(profile, Detail(segments=8), around=False)
    assert_sound(mesh)
    assert np.hypot(*mesh.vertices[:, :2].T).max() == pytest.approx(0.1)


def test_loft_without_ends_is_a_torus():
    turn = np.arange(12) * (2 * pi / 12)
    circle = np.column_stack([1.0 + 0.2 * np.cos(turn), 0 * turn, 0.2 * np.sin(turn)])
    rings = []
    for angle in np.arange(40) * (2 * pi / 40):
        c, s = np.cos(angle), np.sin(angle)
        rings.append(circle @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    torus = lofted(np.array(rings))
    assert_sound(torus)
    assert len(torus.triangles) == 2 * 12 * 40
    backwards = lofted(np.array(rings[::-1]))  # outward whatever the order of rings
    assert signed_volume(backwards) == pytest.approx(signed_volume(torus))


def test_refined_keeps_the_corners_and_the_step():
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.25]])
    points = refined(corners, 0.1)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= 0.1 + 1e-12
    for corner in corners:
        assert (np.abs(points - corner).sum(axis=1) < 1e-12).any()


def test_mass_properties_of_bodies_from_the_textbook():
    a, b, c, density = 0.2, 0.3, 0.4, 500.0
    found = mass_properties(box((1, 2, 3), (1 + a, 2 + b, 3 + c), Detail()), density)
    m = density * a * b * c
    assert found.mass == pytest.approx(m)
    np.testing.assert_allclose(found.com, (1 + a / 2, 2 + b / 2, 3 + c / 2))
    expected = m / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    np.testing.assert_allclose(found.inertia, expected, atol=1e-9)

    r, length = 0.1, 0.5
    rod = cylinder((0, 0, 0), (0, 0, length), r, Detail(segments=400))
    found = mass_properties(rod, density)
    m = density * pi * r * r * length
    assert found.mass == pytest.approx(m, rel=1e-4)
    assert found.inertia[2, 2] == pytest.approx(m * r * r / 2, rel=2e-4)
    side = m * (3 * r * r + length * length) / 12
    assert found.inertia[0, 0] == pytest.approx(side, rel=2e-4)


@pytest.mark.parametrize("level", TRIANGLES)
def test_robot_has_the_promised_number_of_triangles(level):
    total = sum(
        len(m.triangles) for m in build(level, {"needle_length": "0.12"}).values()
    )
    assert total == pytest.approx(TRIANGLES[level], rel=SHARE)


@pytest.mark.parametrize("level", TRIANGLES)
def test_every_part_is_sound(level):
    for name, mesh in build(level, {"needle_length": "0.12"}).items():
        assert mesh.name == name
        for body in bodies(mesh):
            assert_sound(body)
        assert mesh.is_closed


@pytest.mark.parametrize("level", ["middle", "fine"])
def test_triangles_of_finer_levels_are_no_slivers(level):
    for name, mesh in build(level, {"needle_length": "0.12"}).items():
        longest, doubled_area = sides(mesh)
        aspect = longest**2 / doubled_area
        assert np.median(aspect) < MEDIAN_ASPECT, name
        assert aspect.max() < WORST_ASPECT, name


def test_bodies_of_a_part_do_not_cut_each_other():
    pairs = 0
    for name, mesh in build("coarse", {"needle_length": "0.12"}).items():
        for a, b in combinations(bodies(mesh), 2):
            near = (a.bounds[0] < b.bounds[1] + 1e-3).all()
            if not (near and (b.bounds[0] < a.bounds[1] + 1e-3).all()):
                continue
            pairs += 1
            i, j = np.indices((len(a.triangles), len(b.triangles))).reshape(2, -1)
            assert not exact(a.corners[i], b.corners[j]).any(), name
    assert pairs > 20  # premise: there were bodies next to each other


@pytest.mark.parametrize("level", TRIANGLES)
def test_needle_is_as_thick_as_published_and_as_long_as_asked(level):
    needle = build(level, {"needle_length": "0.15"})["needle"]
    low, high = needle.bounds
    assert low[2] == 0.0
    assert high[2] == pytest.approx(0.15, abs=1.1e-4)  # 0.1 mm short of the clamp
    shaft = needle.vertices[needle.vertices[:, 2] > 0.01]
    thickest = np.hypot(shaft[:, 0], shaft[:, 1]).max()
    assert NEEDLE_DIAMETER == 1.1e-3
    assert 0.55e-3 <= thickest <= 0.55e-3 / cos(pi / 6) + 1e-12


def test_a_coarse_part_is_not_far_from_the_fine_one():
    """Bounds agree within 4 mm (motors of the stages), 1 mm near the needle."""
    coarse, fine = (
        build(level, {"needle_length": "0.12"}) for level in ("coarse", "fine")
    )
    for name in coarse:
        far = np.abs(coarse[name].bounds - fine[name].bounds).max()
        near_needle = name in (
            "holder",
            "carriage",
            "needle",
            "rod_a",
            "rod_b",
            "crank",
        )
        assert far < (1e-3 if near_needle else 4e-3), name


def test_joined_keeps_every_triangle():
    first, second = (
        box((0, 0, 0), (1, 1, 1), Detail()),
        box((2, 0, 0), (3, 1, 1), Detail()),
    )
    both = joined("both", [first, second])
    np.testing.assert_array_equal(
        both.corners, np.concatenate([first.corners, second.corners])
    )


def test_shipped_meshes_are_those_of_the_generator():
    script = PROJECT / "scripts" / "make_meshes.py"
    run = subprocess.run(
        [sys.executable, script, "--check", "zerobot", "ct_gantry"],
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr
