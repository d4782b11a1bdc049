"""The arms of the study: DH tables as URDFs, with needles; reachable ones are found."""

import numpy as np
import pytest

import borecheck as bc
from studies.any_arm import dvrk
from studies.any_arm.arms import ARMS
from studies.any_arm.hulls import hull
from studies.any_arm.poses import solved

# a URDF's turns are written with 16 digits, along a chain of at most nine
ROUNDING = 1e-12


def about_x(angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, shift], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])


def about_z(angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, shift], [0, 0, 0, 1.0]])


def end(rows, modified, q):
    """The product of a DH table by its definition."""
    T, values = np.eye(4), iter(q)
    for row in rows:
        value = 0.0 if row.kind == "fixed" else next(values)
        turn = row.theta + (value if row.kind == "revolute" else 0.0)
        shift = row.d + (value if row.kind == "prismatic" else 0.0)
        joint, link = about_z(turn, shift), about_x(row.alpha, row.a)
        T = T @ link @ joint if modified else T @ joint @ link
    return T


@pytest.mark.parametrize(
    ("rows", "modified"), [(dvrk.PSM, True), (dvrk.MTM, False)], ids=["psm", "mtm"]
)
def test_a_dh_table_as_a_urdf_places_its_end_alike(rows, modified, tmp_path, rng):
    file = tmp_path / "arm.urdf"
    file.write_text(dvrk.urdf("arm", rows, modified))
    robot = bc.load_robot(file)
    for q in robot.model.random_configurations(rng, 20):
        T = robot.placements(q)[f"{rows[-1].name}_link"]
        np.testing.assert_allclose(T, end(rows, modified, q), atol=ROUNDING)


@pytest.mark.parametrize(
    "arm", [a for a in ARMS if "dVRK" in a.name], ids=lambda a: a.name
)
def test_reachable_needles_are_found(arm, tmp_path):
    robot = bc.load_robot(
        arm.written(tmp_path), needle="needle_link", tip="needle_tip:z"
    )
    row = solved(robot, 8, 5)
    assert (row.poses, row.found, row.false) == (8, 8, 0)
    assert row.tip < 1e-9


def test_a_hull_is_closed_and_outward(rng):
    points = rng.normal(size=(60, 3))
    from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

    found = hull(TriangleMesh("cloud", points, np.array([[0, 1, 2]])))
    assert found.is_closed
    a, b, c = found.corners.transpose(1, 0, 2)
    assert np.einsum("ij,ij->i", np.cross(a, b), c).sum() > 0.0
