"""Where a map must not say clear: wires, folds, open skins, lost targets, guesses."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.doubt import FileDoubt
from borecheck.robots.obstacle_files import Assumed, Obstacle

TARGET = np.array([0.0, 0.0, -0.05])
RNG = 20261128
LARGE = "4deg"


def at(mesh, place):
    return TriangleMesh(mesh.name, mesh.vertices + place, mesh.triangles)


def with_patient(scene, change):
    """The scene with another patient."""
    obstacles = tuple(
        replace(o, mesh=change(o.mesh)) if o.role == "patient" else o
        for o in scene.obstacles
    )
    return replace(scene, obstacles=obstacles)


def test_a_thin_wire_in_the_way_of_one_direction_is_never_missed(robot, scene):
    """Wires of 0.1 mm, each through a corner of a link in one pose of one direction."""
    free = bc.directions(robot, scene, TARGET, resolution=LARGE)
    chart, rng = free.setup.chart, np.random.default_rng(RNG)
    wires, blocked = [], []
    links = [part.link for part in robot.parts]
    for k in range(8):
        angles = rng.uniform(0.7 * chart.limits[0], 0.7 * chart.limits[1])
        part = links.index(("holder", "carriage", "arm", "needle")[k % 4])
        station = 0.05 + 0.05 * rng.uniform(0.2, 1.0)
        q = chart.in_urdf(chart.own(angles[None], np.array([station])))
        T = chart.place(part, q)[0]
        corners = robot.parts[part].mesh.vertices
        top = corners[np.argmax(corners[:, 2])]
        wire = box(f"wire_{k}", (1e-4, 1e-4, 0.004))
        wires.append(
            Obstacle(wire.name, "other", at(wire, T[:3, :3] @ top + T[:3, 3]), "")
        )
        blocked.append(chart.directions(angles[None])[0])
    assert [free.at(n).state for n in blocked].count("clear") >= 6
    found = bc.directions(robot, scene.with_obstacles(wires), TARGET, resolution=LARGE)
    for n in blocked:
        assert found.at(n).state != "clear"
    assert found.shares["clear"] > 0.05


def test_an_arm_beside_the_trunk_is_not_decided(robot, scene):
    """Above part of the trunk the line would cross skin three times."""
    arm = at(box("arm", (0.05, 0.05, 0.04)), (0.03, 0.05, 0.08))

    def with_arm(torso):
        vertices = np.concatenate([torso.vertices, arm.vertices])
        triangles = np.concatenate(
            [torso.triangles, arm.triangles + len(torso.vertices)]
        )
        return TriangleMesh(torso.name, vertices, triangles)

    apart = scene.with_obstacles([Obstacle("arm", "patient", arm, "")])
    towards = TARGET - np.array([0.03, 0.05, 0.08])
    for folded in (with_patient(scene, with_arm), apart):
        found = bc.directions(robot, folded, TARGET, resolution="4deg")
        cell = found.at(towards)
        assert cell.state == "undecided"
        assert "more than once" in cell.reason
        assert found.shares["clear"] > 0.1


def test_a_groove_beside_the_line_is_not_decided(robot, scene):
    """A spike of skin 0.5 mm beside the line, 20 mm high: the needle would graze it."""
    spike = at(box("spike", (0.0004, 0.0004, 0.02)), (0.0005, 0.0, 0.012))
    spiked = scene.with_obstacles([Obstacle("spike", "patient", spike, "")])
    found = bc.directions(robot, spiked, TARGET, resolution="2deg")
    assert found.at((0.0, 0.0, -1.0)).state == "undecided"
    assert bc.directions(robot, scene, TARGET, resolution="2deg").at((0, 0, -1)).clear


@pytest.mark.parametrize(
    ("change", "target", "said"),
    [
        (lambda m: TriangleMesh(m.name, m.vertices, m.triangles[1:]), TARGET, "open"),
        (lambda m: m, (0.0, 0.0, 0.3), "not in the patient"),
        (lambda m: m, (0.0, 0.0, -0.0022), "too near"),
        (
            lambda m: TriangleMesh(m.name, m.vertices, np.tile(m.triangles, (2, 1))),
            TARGET,
            "2 times",
        ),
    ],
)
def test_of_a_doubtful_patient_or_target_nothing_is_clear(
    robot, scene, change, target, said
):
    found = bc.directions(robot, with_patient(scene, change), target)
    assert found.verdict == "undecided"
    assert found.shares["undecided"] == pytest.approx(1.0)
    assert said in found.at((0.0, 0.0, -1.0)).reason
    assert found.plans() == ()


def test_a_skin_that_is_wound_inside_out_gives_the_same_map(robot, scene):
    turned = with_patient(
        scene, lambda m: TriangleMesh(m.name, m.vertices, m.triangles[:, ::-1])
    )
    first = bc.directions(robot, scene, TARGET, resolution=LARGE)
    second = bc.directions(robot, turned, TARGET, resolution=LARGE)
    assert first.leaves.state.tolist() == second.leaves.state.tolist()


def test_a_guessed_unit_leaves_nothing_clear(robot, scene):
    doubt = FileDoubt("block.stl", "mm", None, False, "block.stl:mm")
    block = at(box("block", (0.02, 0.02, 0.02)), (0.9, 0.9, 0.9))
    doubtful = scene.with_obstacles([Obstacle("block", "other", block, "", doubt)])
    found = bc.directions(robot, doubtful, TARGET, resolution=LARGE)
    assert found.shares["clear"] == 0.0
    assert "guessed" in found.at((0.0, 0.0, -1.0)).reason


def test_an_assumed_patient_leaves_nothing_clear(robot, scene):
    """What no scan saw is asked of single poses and motions, not of cells."""
    (patient,) = (o for o in scene.obstacles if o.role == "patient")
    triangles = np.zeros(len(patient.mesh.triangles), dtype=bool)
    triangles[0] = True
    guessed = replace(patient, assumed=Assumed(triangles, "beyond the scan"))
    others = scene.without_obstacles([patient])
    found = bc.directions(
        robot, others.with_obstacles([guessed]), TARGET, resolution=LARGE
    )
    assert found.shares["clear"] == 0.0
    assert any("beyond the scan" in text for _, text in found.reasons)


def test_a_robot_inside_a_solid_is_in_contact(robot, scene):
    """No surface meets another there: one solid holds the whole room."""
    room = box("room", (9.0, 9.0, 9.0))
    within = scene.with_obstacles([Obstacle("room", "other", room, "")])
    found = bc.directions(robot, within, TARGET, resolution=LARGE)
    assert found.shares["clear"] == 0.0
    assert "inside room" in found.at((0.0, 0.0, -1.0)).reason


def test_parts_that_may_meet_leave_nothing_clear(robot, scene, monkeypatch):
    settle = import_module("borecheck.directions.settle")
    monkeypatch.setattr(settle, "pairs_that_may_meet", lambda _: ((0, 4),))
    found = bc.directions(robot, scene, TARGET, resolution=LARGE)
    assert found.shares["clear"] == 0.0
    assert "not proven apart" in found.at((0.0, 0.0, -1.0)).reason
