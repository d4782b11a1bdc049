"""What is rebuilt from files for a certificate rests on two kinematics that agree."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.binding import expected
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Obstacle, Scene
from tests.places import ROBOTS


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOTS / "two_link.urdf")


def scene_of(x):
    mesh = box("far", (0.1, 0.1, 0.1))
    moved = TriangleMesh("far", mesh.vertices + [x, 0, 0], mesh.triangles)
    return Scene(
        "s", None, {}, "t", (Obstacle("far", "other", moved, "t"),), {}, (), ()
    )


POINTS = np.array([[0.1], [0.4], [-0.2]])


@pytest.mark.parametrize(("off", "told"), [(0.0, False), (1e-10, False), (1e-8, True)])
@pytest.mark.parametrize("where", [0, 2])
def test_a_link_that_pinocchio_places_elsewhere_is_a_doubt(
    arm, monkeypatch, off, told, where
):
    """At the first or the last waypoint alone."""
    plain = Robot.placements

    def shifted(self, q):
        placed = dict(plain(self, q))
        if abs(float(q[0]) - POINTS[where, 0]) < 1e-9:
            T = placed["arm"].copy()
            T[1, 3] += off
            placed["arm"] = T
        return placed

    monkeypatch.setattr(Robot, "placements", shifted)
    found = expected(arm, scene_of(5.0), POINTS, 0.01)
    assert (found.doubt is not None) == told
    if told:
        assert found.doubt.startswith("arm: chain and Pinocchio place it")


def test_axes_are_brought_to_length_1():
    for axis in ([0.0, 0.0, 2.0], [0.0, 0.0, 1e-3], [0.0, 0.0, 1.0 + 1e-9]):
        chain = JointChain(
            parent=np.array([-1]),
            origin=np.eye(4)[None],
            kind=np.array([SLIDES]),
            axis=np.array([axis]),
            source=np.array([0]),
            factor=np.ones(1),
            offset=np.zeros(1),
        )
        np.testing.assert_array_equal(chain.axis, [[0.0, 0.0, 1.0]])
