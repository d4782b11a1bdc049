"""Bounds over cells, held against points of the robot placed anywhere in them."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.directions.chart import Chart

RNG = 20261128


@pytest.mark.parametrize(
    "arguments",
    [
        {"mount": "+90"},
        {"mount": "-90", "tip_offset_x": "0.003", "tip_offset_y": "-0.004"},
        {
            "mount": "+90",
            "q4_offset": "0.05",
            "q5_offset": "-0.03",
            "q1_offset": "0.01",
        },
    ],
)
def test_no_point_moves_farther_than_its_bound(arguments):
    """Placements are the URDF's; half of the places are at the ends of a cell."""
    robot = bc.load_robot("zerobot", **arguments)
    chart = Chart.of(robot, np.array([0.05, 0.06, -0.08]))
    rng = np.random.default_rng(RNG)
    shares = []
    for _ in range(25):
        half = np.radians(rng.uniform(0.2, 10.0, 2))
        centre = rng.uniform(chart.limits[0] + half, chart.limits[1] - half)
        offsets = np.vstack(
            [[0, 0], rng.choice([-1, 0, 1], (8, 2)), rng.uniform(-1, 1, (8, 2))]
        )
        station = np.full(len(offsets), rng.uniform(0.0, 0.25))
        own = chart.own(centre + offsets * half, station)
        q = chart.in_urdf(own)
        changes = chart.joint_changes(own[:1], half[None])
        assert (np.abs(q - q[0]) <= changes + 1e-12).all()
        for k, part in enumerate(robot.parts):
            T = chart.place(k, q)
            points = (
                part.mesh.vertices @ T[:, :3, :3].transpose(0, 2, 1) + T[:, None, :3, 3]
            )
            moved = np.linalg.norm(points - points[0], axis=2).max(axis=0)
            bound = chart.displacements(part.link, points[:1], own[:1], half[None])[0]
            assert (moved <= bound + 1e-12).all(), part.link
            if part.link != "base":
                shares.append(float((moved / bound).max()))
    # never below the truth, and not far above it: of what was met, half is this near
    assert np.median(shares) > 0.6


@pytest.mark.parametrize("mount", ["+90", "-90"])
def test_configurations_bring_the_needle_where_it_is_asked(mount):
    """By Pinocchio, of which the chart knows nothing."""
    robot = bc.load_robot("zerobot", mount=mount, base="0.01,0.02,-0.03,0.1,-0.05,0.2")
    target = np.array([0.02, -0.03, -0.06])
    chart = Chart.of(robot, target)
    rng = np.random.default_rng(RNG)
    angles = rng.uniform(chart.limits[0], chart.limits[1], (20, 2))
    stations = rng.uniform(0.0, 0.2, 20)
    directions = chart.directions(angles)
    for q, n, s in zip(
        chart.in_urdf(chart.own(angles, stations)), directions, stations, strict=True
    ):
        T = robot.placements(q)["E"]
        assert T[:3, 2] == pytest.approx(n, abs=1e-12)
        assert T[:3, 3] == pytest.approx(target - s * n, abs=1e-12)
    assert chart.angles(directions) == pytest.approx(angles, abs=1e-12)


def test_directions_of_a_cell_are_within_its_spread():
    chart = Chart.of(bc.load_robot("zerobot", mount="+90"), np.zeros(3))
    rng = np.random.default_rng(RNG)
    half = np.radians(rng.uniform(0.1, 15.0, (200, 2)))
    centre = rng.uniform(chart.limits[0], chart.limits[1], (200, 2))
    ends = centre + half * rng.choice([-1.0, 1.0, 0.3], (200, 2))
    cosine = np.einsum("kd,kd->k", chart.directions(centre), chart.directions(ends))
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    assert (angle <= chart.about.spread(centre, half) + 1e-7).all()


def test_links_shift_with_the_station_as_told():
    robot = bc.load_robot("zerobot", mount="-90")
    chart = Chart.of(robot, np.array([0.0, 0.05, -0.1]))
    angles = np.radians([[20.0, -12.0]])
    for k, part in enumerate(robot.parts):
        near, far = (
            chart.place(k, chart.in_urdf(chart.own(angles, np.array([s]))))[0]
            for s in (0.05, 0.15)
        )
        speed = chart.speed(part.link, angles)[0]
        assert far[:3, 3] - near[:3, 3] == pytest.approx(0.1 * speed, abs=1e-12)
        assert far[:3, :3] == pytest.approx(near[:3, :3], abs=1e-12)
