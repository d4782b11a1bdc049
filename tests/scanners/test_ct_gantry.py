"""The CT gantry, its couch and torso: sizes, tilt, named points, and room to work."""

import numpy as np
import pytest

from borecheck.errors import UrdfError, UsageError
from borecheck.geometry.coal_engine.contact import CoalMesh, first_contact
from borecheck.plans.plan_file import read_plans
from borecheck.plans.plan_motion import plan_motion
from borecheck.robots.model import RobotModel
from borecheck.robots.robot import load_robot
from borecheck.robots.scene import load_scene
from borecheck.robots.urdf.xacro import expand
from borecheck_models.scanners.ct_gantry import DESCRIPTION, build
from borecheck_models.scanners.gantry import FLARE_LENGTH, FLARE_WIDTH
from borecheck_models.scanners.torso import half_axes
from borecheck_models.shapes import signed_volume

DEFAULTS = {name: a.default for name, a in DESCRIPTION.arguments.items()}
TRIANGLES = {"coarse": 10_000, "middle": 100_000, "fine": 500_000}
SHARE = 0.15

# How far the polygon of the bore lies within the circle: R (1 - cos(pi / n)).
AROUND = {"coarse": 64, "middle": 200, "fine": 448}
ON_SURFACE = 1e-6  # a point this far out is outside, this far in is inside, [m]
EXAMPLES = DESCRIPTION.xacro.parents[2] / "zerobot" / "examples"
TREES = {}  # Coal's tree of a mesh, built once


def frames(**arguments):
    text = expand(DESCRIPTION.xacro, arguments).text
    robot = RobotModel(text, "ct_gantry")
    return robot.placements(np.zeros(len(robot.joint_names)))


@pytest.mark.parametrize("level", TRIANGLES)
def test_number_of_triangles(level):
    total = sum(len(mesh.triangles) for mesh in build(level, DEFAULTS).values())
    assert total == pytest.approx(TRIANGLES[level], rel=SHARE)


@pytest.mark.parametrize("level", ["coarse", "middle"])
def test_meshes_are_closed_and_outward(level):
    for mesh in build(level, DEFAULTS).values():
        assert mesh.is_closed
        assert signed_volume(mesh) > 0.0
        a, b, c = np.moveaxis(mesh.corners, 1, 0)
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        assert areas.min() > 1e-9


@pytest.mark.parametrize("bore", DESCRIPTION.arguments["bore"].choices)
@pytest.mark.parametrize("depth", DESCRIPTION.arguments["depth"].choices)
def test_bore_and_depth_are_as_asked(bore, depth):
    gantry = build("coarse", {**DEFAULTS, "bore": bore, "depth": depth})["gantry"]
    radius, face = float(bore) / 2.0, float(depth) / 2.0
    np.testing.assert_allclose(gantry.bounds[:, 0], [-face, face], atol=1e-12)
    from_axis = np.hypot(gantry.vertices[:, 1], gantry.vertices[:, 2])
    throat = np.abs(gantry.vertices[:, 0]) < face - FLARE_LENGTH + 1e-9
    inside = throat & (from_axis < radius + 1e-3)
    assert inside.sum() > 300  # premise: there is a throat
    np.testing.assert_allclose(from_axis[inside], radius, atol=1e-12)
    assert from_axis.min() == pytest.approx(radius)
    mouth = np.abs(np.abs(gantry.vertices[:, 0]) - face) < 1e-9
    assert from_axis[mouth].min() == pytest.approx(radius + FLARE_WIDTH)


def test_a_coarse_bore_is_never_wider_than_a_fine_one():
    for level, n in AROUND.items():
        gantry = build(level, DEFAULTS)["gantry"]
        middle = gantry.corners[np.abs(gantry.corners[:, :, 0]).max(axis=1) < 0.3]
        edges = (middle + np.roll(middle, -1, axis=1)) / 2.0
        nearest = np.hypot(edges[..., 1], edges[..., 2]).min()
        assert 0.39 * np.cos(np.pi / n) - 1e-12 <= nearest < 0.39


def test_user_may_type_the_bore_in_millimetres():
    bore = DESCRIPTION.arguments["bore"]
    assert bore.value("bore", "700mm") == "0.70"
    with pytest.raises(UsageError, match="none of"):
        bore.value("bore", "0.5")


@pytest.mark.parametrize("bore", DESCRIPTION.arguments["bore"].choices)
@pytest.mark.parametrize("tilt", ["0", "0.4"])
def test_goal_points_lie_on_the_gantry(bore, tilt):
    placed = frames(bore=bore, tilt=tilt)
    gantry = build("coarse", {**DEFAULTS, "bore": bore})["gantry"].moved(
        placed["gantry"]
    )
    for name in DESCRIPTION.points:
        point, normal = placed[name][:3, 3], placed[name][:3, 2]
        assert not _inside(point + ON_SURFACE * normal, gantry), name
        assert _inside(point - ON_SURFACE * normal, gantry), name
        assert not _inside(point + 0.05 * normal, gantry), name


def test_points_stand_at_the_front():
    placed = frames()
    for name in DESCRIPTION.points:
        assert placed[name][0, 3] < -0.3
    assert placed["P1"][1, 3] > 0.0 > placed["P3"][1, 3]
    assert placed["P2"][2, 3] > 0.39 + FLARE_WIDTH


def test_tilt_turns_the_gantry_alone_about_the_isocentre():
    level, tilted = frames(), frames(tilt="0.3")
    np.testing.assert_allclose(tilted["gantry"][:3, 3], 0.0)
    c, s = np.cos(0.3), np.sin(0.3)
    expected = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    np.testing.assert_allclose(tilted["gantry"][:3, :3], expected, atol=1e-12)
    for other in ("stand", "couch", "torso", "couch_base"):
        np.testing.assert_allclose(tilted[other], level[other])


@pytest.mark.parametrize(
    ("name", "value"), [("tilt", "0.6"), ("girth", "0.1"), ("couch", "maybe")]
)
def test_impossible_arguments_are_refused(name, value):
    with pytest.raises(UrdfError, match=name):
        frames(**{name: value})


def test_couch_and_patient_can_be_left_out():
    assert {"couch", "torso"} <= set(frames())
    assert "torso" not in frames(patient="no")
    alone = frames(couch="no")
    assert "couch" not in alone
    np.testing.assert_allclose(alone["torso"], frames()["torso"])


def test_couch_joints_carry_the_patient():
    scene = load_scene("ct_gantry")
    moved = load_scene("ct_gantry", couch_travel="-200mm", couch_height="50mm")
    shift = _obstacle(moved, "torso").bounds - _obstacle(scene, "torso").bounds
    np.testing.assert_allclose(shift, [[-0.2, 0.0, 0.05]] * 2, atol=1e-12)
    shift = _obstacle(moved, "couch").bounds - _obstacle(scene, "couch").bounds
    np.testing.assert_allclose(shift, [[-0.2, 0.0, 0.05]] * 2, atol=1e-12)


def test_every_link_with_geometry_has_a_role():
    scene = load_scene("ct_gantry")
    assert {o.name: o.role for o in scene.obstacles} == DESCRIPTION.roles


@pytest.mark.parametrize("girth", [0.7, 0.95, 1.3])
def test_torso_has_the_girth(girth):
    width, depth = half_axes(girth)
    assert depth / width == pytest.approx(5.0 / 7.0)
    torso = build("fine", {**DEFAULTS, "girth": repr(girth)})["torso"]
    chest = torso.vertices[np.abs(torso.vertices[:, 0] - 0.21) < 1e-9]
    assert len(chest) == 208
    turn = np.arctan2(chest[:, 2] - depth, chest[:, 1])
    outline = chest[np.argsort(turn)]
    steps = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
    assert steps.sum() == pytest.approx(girth, rel=1e-3)  # drawn around: 0.01 % more
    assert torso.bounds[0, 2] == pytest.approx(0.0, abs=1e-3)


def test_obstacles_do_not_cut_each_other():
    """Lift and pedestal slide into each other, so that pair is left out."""
    obstacles = load_scene("ct_gantry").obstacles
    for i, a in enumerate(obstacles):
        for b in obstacles[i + 1 :]:
            if {a.name, b.name} != {"couch_base", "couch_lift"}:
                assert not _touch(a.mesh, b.mesh), f"{a.name} cuts {b.name}"


@pytest.mark.parametrize("mount", ["+90", "-90"])
@pytest.mark.parametrize("bore", DESCRIPTION.arguments["bore"].choices)
def test_home_of_zerobot_is_clear_in_every_bore(mount, bore):
    robot, scene = (
        load_robot("zerobot", mount=mount),
        load_scene("ct_gantry", bore=bore),
    )
    assert not _touching(robot, scene, robot.home)


@pytest.mark.parametrize("mount", ["+90", "-90"])
def test_example_plans_are_clear_but_for_the_steep_one(mount):
    robot, scene = load_robot("zerobot", mount=mount), load_scene("ct_gantry")
    plans = read_plans(EXAMPLES / "plans.csv")
    assert len(plans) == 6
    for plan in plans:
        touching = set()
        waypoints = plan_motion(robot, plan).waypoints
        for q in waypoints:
            touching |= _touching(robot, scene, q)
        expected = {("holder", "gantry")} if plan.name == "chest_flank" else set()
        entered = {("needle", "torso")}
        assert entered <= touching, plan.name  # premise: the needle goes in
        assert touching - entered == expected, plan.name


def _touching(robot, scene, q):
    placed = robot.placements(q)
    return {
        (part.link, obstacle.name)
        for part in robot.parts
        for obstacle in scene.obstacles
        if _touch(part.mesh, obstacle.mesh, placed[part.link])
    }


def _touch(a, b, T_world_a=None):
    T = np.eye(4) if T_world_a is None else T_world_a
    return first_contact(_tree(a), T, _tree(b), np.eye(4))


def _tree(mesh):
    if mesh.sha256 not in TREES:
        TREES[mesh.sha256] = CoalMesh(mesh)
    return TREES[mesh.sha256]


def _obstacle(scene, name):
    return next(o.mesh for o in scene.obstacles if o.name == name)


def _inside(point, mesh):
    """Parity of crossings along a direction that meets no edge (generic)."""
    direction = np.array([0.3141, 0.5926, 0.7421])
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    columns = np.stack([b - a, c - a, -np.broadcast_to(direction, a.shape)], axis=2)
    solvable = np.abs(np.linalg.det(columns)) > 1e-15
    u, v, t = np.linalg.solve(columns[solvable], (point - a[solvable])[..., None])[
        ..., 0
    ].T
    return bool(((u > 0) & (v > 0) & (u + v < 1) & (t > 0)).sum() % 2)
