"""Of several ways to a needle the one with most room is taken."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.motion.needle_motion import needle_motion
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import plan_motion
from borecheck.robots.scene import Scene

# Two links and a needle in the plane y = 0: the elbow is above, or it is below.
JOINT = (
    '<joint name="{name}" type="revolute"><parent link="{above}"/>'
    '<child link="{below}"/><origin xyz="{xyz}"/><axis xyz="0 1 0"/>'
    '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
)
BAR = (
    '<link name="{name}"><collision><origin xyz="{middle} 0 0"/><geometry>'
    '<box size="{length} {wide} {wide}"/></geometry></collision></link>'
)
ARM = "".join(
    [
        '<robot name="elbow"><link name="base"/>',
        BAR.format(name="upper", middle=0.2, length=0.3, wide=0.04),
        BAR.format(name="fore", middle=0.17, length=0.26, wide=0.04),
        BAR.format(name="needle", middle=0.1, length=0.2, wide=0.001),
        '<link name="tip"/>',
        JOINT.format(name="shoulder", above="base", below="upper", xyz="0 0 0.5"),
        JOINT.format(name="elbow", above="upper", below="fore", xyz="0.4 0 0"),
        JOINT.format(name="wrist", above="fore", below="needle", xyz="0.35 0 0"),
        '<joint name="end" type="fixed"><parent link="needle"/><child link="tip"/>',
        '<origin xyz="0.2 0 0"/></joint></robot>',
    ]
)
PLAN = NeedlePlan("down", (0.45, 0.0, 0.1), (0.45, 0.0, 0.04))


def elbow(arm, waypoints):
    return arm.placements(waypoints[len(waypoints) // 2])["fore"][:3, 3]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("elbow")
    (made / "arm.urdf").write_text(ARM)
    write_stl(made / "block.stl", box("block", (0.1, 0.1, 0.1)))
    return made


@pytest.fixture(scope="module")
def arm(folder):
    return bc.load_robot(folder / "arm.urdf", needle="needle", tip="tip:x")


@pytest.fixture(scope="module")
def elbows(arm):
    """Where the elbow is half-way on either way, (2, 3)."""
    middles = [
        plan_motion(arm, PLAN, room=lambda qs, s=sign: s * qs[:, 1]).waypoints
        for sign in (1.0, -1.0)
    ]
    places = [elbow(arm, waypoints) for waypoints in middles]
    assert np.linalg.norm(places[0] - places[1]) > 0.3  # the premise: two ways
    return places


@pytest.mark.parametrize("blocked", [0, 1])
def test_the_way_that_is_not_blocked(folder, arm, elbows, blocked):
    x, y, z = elbows[blocked]
    scene = bc.load_scene(f"{folder / 'block.stl'}:m@{x},{y},{z}")
    waypoints = needle_motion(arm, scene, PLAN).waypoints
    np.testing.assert_allclose(elbow(arm, waypoints), elbows[1 - blocked], atol=0.02)
    assert bc.check_path(arm, scene, waypoints).clear


def test_a_patient_is_no_wall_to_the_needle(folder, arm, elbows):
    """The needle touches it on either way; still the one with more room is taken."""
    usual = elbow(arm, plan_motion(arm, PLAN).waypoints)
    other = max(elbows, key=lambda place: np.linalg.norm(place - usual))
    x, _, z = usual
    scene = bc.load_scene(
        f"{folder / 'block.stl'}:m@{x},0.15,{z}",
        patients=[f"{folder / 'block.stl'}:m@0.45,0,0.05"],
    )
    found = needle_motion(arm, scene, PLAN).waypoints
    np.testing.assert_allclose(elbow(arm, found), other, atol=0.02)


def test_without_obstacles_the_nearest_to_home(arm):
    empty = Scene("empty", None, {}, "as given", (), {}, (), ())
    found = needle_motion(arm, empty, PLAN).waypoints
    np.testing.assert_array_equal(found, plan_motion(arm, PLAN).waypoints)
