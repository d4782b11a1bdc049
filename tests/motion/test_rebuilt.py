"""What is rebuilt from files for a certificate rests on two kinematics that agree."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion import binding
from borecheck.motion.binding import expected
from borecheck.plans.corridor import Corridor
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Obstacle, Scene
from tests.chains import slider
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


MOTIONS = {"waypoints": POINTS, "plans": [object()]}


@pytest.mark.parametrize("lacking", ["robot", "scene", "motion"])
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_certificate_is_bound_to_all_or_to_nothing(arm, monkeypatch, lacking, motion):
    """Robot, scene and a motion; nothing of the certificate is read before."""
    monkeypatch.setattr(binding, "verify_alone", lambda *given: 1 / 0)
    given = {"robot": arm, "scene": scene_of(5.0), motion: MOTIONS[motion]}
    del given[motion if lacking == "motion" else lacking]
    with pytest.raises(UsageError, match="robot, scene, and either"):
        binding.verify({}, **given)


def test_a_certificate_is_of_a_path_or_of_a_plan(arm, monkeypatch):
    monkeypatch.setattr(binding, "verify_alone", lambda *given: 1 / 0)
    with pytest.raises(UsageError, match="give one"):
        binding.verify({}, arm, scene_of(5.0), **MOTIONS)
    with pytest.raises(UsageError, match="robot, scene, and either"):
        binding.verify({}, arm, scene_of(5.0), plans=[])


def test_it_is_handed_to_the_verifier_with_what_it_must_state(arm, monkeypatch):
    kept, scene = [], scene_of(5.0)
    monkeypatch.setattr(binding, "verify_alone", lambda *given: kept.append(given))
    for name in ("_of_plan", "_of_path"):
        monkeypatch.setattr(binding, name, lambda *given, name=name: (name, *given))
    binding.verify("file", meshes="meshes")
    assert kept == [("file", "meshes")]
    plan = object.__new__(NeedlePlan)
    for plans in (plan, (plan,)):
        binding.verify("file", arm, scene, plans=plans, margin=0.25)
        certificate, meshes, expect = kept[-1]
        assert (certificate, meshes) == ("file", None)
        assert expect("stated") == ("_of_plan", arm, scene, [plan], 0.25, "stated")
    binding.verify("file", arm, scene, waypoints=POINTS, margin=0.25, meshes="meshes")
    certificate, meshes, expect = kept[-1]
    assert meshes == "meshes"
    name, robot, of, points, margin, corridor, stated = expect("stated")
    assert (name, robot, of, margin, stated) == ("_of_path", arm, scene, 0.25, "stated")
    assert corridor is None
    np.testing.assert_array_equal(points, POINTS)
    corridor = Corridor(np.zeros(3), np.ones(3), 0.001)
    binding.verify("file", arm, scene, waypoints=POINTS, corridor=corridor)
    assert kept[-1][2]("stated")[-2] is corridor


def test_a_corridor_is_of_a_path(arm, monkeypatch):
    monkeypatch.setattr(binding, "verify_alone", lambda *given: 1 / 0)
    corridor = Corridor(np.zeros(3), np.ones(3), 0.001)
    for given in (
        {},
        {"robot": arm, "scene": scene_of(5.0), "plans": MOTIONS["plans"]},
    ):
        with pytest.raises(UsageError, match="corridor goes with waypoints"):
            binding.verify({}, corridor=corridor, **given)


def test_axes_are_brought_to_length_1():
    for axis in ([0.0, 0.0, 2.0], [0.0, 0.0, 1e-3], [0.0, 0.0, 1.0 + 1e-9]):
        np.testing.assert_array_equal(slider(axis).axis, [[0.0, 0.0, 1.0]])
