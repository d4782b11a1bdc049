"""A part of the robot within another, which no surface shows; and who is asked."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.containment import (
    boxes_apart,
    lies_in_grown,
    of_itself,
    of_obstacles,
)
from borecheck.core.se3 import rpy_matrix, transform
from borecheck.geometry.mesh.enlarge import enlarge
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.robots.scene import Obstacle, Scene

LINK = (
    '<link name="{}"><collision><geometry><box size="{}"/></geometry></collision>'
    "</link>"
)
JOINT = """<joint name="{0}" type="prismatic"><parent link="{1}"/><child link="{2}"/>
<origin xyz="{3}"/><axis xyz="1 0 0"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>"""


def chain(folder, hull, bead):
    """A hull, a link far from both, and a bead that slides into the hull."""
    file = folder / "robot.urdf"
    parts = [
        LINK.format("hull", hull),
        LINK.format("between", "0.1 0.1 0.1"),
        LINK.format("bead", bead),
        JOINT.format("a", "hull", "between", "0 0 3"),
        JOINT.format("b", "between", "bead", "0 0 -3"),
    ]
    file.write_text(f'<robot name="r">{"".join(parts)}</robot>')
    return bc.load_robot(file)


def scene_of(*meshes, role="other"):
    obstacles = tuple(Obstacle(m.name, role, m, "t") for m in meshes)
    return Scene("s", None, {}, "t", obstacles, {}, (), ())


def shifted(mesh, x, y=0.0, z=0.0):
    return TriangleMesh(mesh.name, mesh.vertices + [x, y, z], mesh.triangles)


FAR = shifted(box("far", (0.1,) * 3), 9.0)


@pytest.mark.parametrize(
    ("hull", "bead", "state"),
    [("1 1 1", "0.1 0.1 0.1", "b_in_a"), ("0.1 0.1 0.1", "1 1 1", "a_in_b")],
)
def test_a_part_inside_another_is_contact(tmp_path, hull, bead, state):
    robot = chain(tmp_path, hull, bead)
    for q in ([0.0, 0.0], [0.3, -0.2]):
        found = bc.check(robot, scene_of(FAR), q)
        assert (found.verdict, found.qualifiers) == ("contact", ("contained",))
        ((pair),) = found.contained
        assert (pair.link, pair.obstacle) == ("hull", "bead")
        assert (pair.role, pair.state) == ("self", state)
        assert not found.self_contacts
        # a distance to obstacles there is nevertheless
        assert found.clearance_m == pytest.approx(
            8.95 - max(0.5, 0.05 + sum(q)), abs=0.6
        )
        assert bc.check_path(robot, scene_of(FAR), [q, q]).verdict == "contact"
    assert bc.check(robot, scene_of(FAR), [1.0, 1.0]).verdict == "clear"
    assert bc.check(robot, scene_of(FAR), [-2.0, 0.0]).verdict == "clear"
    batch = bc.first_contacts(robot, scene_of(FAR), [[0, 0], [1, 1], [-2.0, 0]])
    assert batch.tolist() == [True, False, False]


def test_only_the_punctured_pair_is_not_asked(tmp_path):
    robot = chain(tmp_path, "0.1 0.1 0.1", "0.1 0.1 0.1")
    rooms = scene_of(box("room", (8.0,) * 3), box("hall", (9.0,) * 3), role="patient")
    placements = robot.placements([0.5, 0.5])
    every = of_obstacles(robot, rooms, placements)
    assert of_itself(robot, placements) == []
    names = {(c.link, c.obstacle) for c in every}
    assert names == {
        (p, r) for p in ("hull", "between", "bead") for r in ("room", "hall")
    }
    assert {(c.role, c.state) for c in every} == {("patient", "a_in_b")}
    left = of_obstacles(robot, rooms, placements, {("bead", "room")})
    assert {(c.link, c.obstacle) for c in left} == names - {("bead", "room")}


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1, 1])
def test_boxes_apart(axis, side):
    """Apart by a hair, touching, and one within the other; either placed."""
    a, b = surface(box("a", (1.0,) * 3)), surface(box("b", (0.5,) * 3))
    for gap, apart in ((1e-6, True), (-1e-6, False), (-0.7, False)):
        shift = np.zeros(3)
        shift[axis] = side * (0.75 + gap)
        T = transform(shift)
        assert boxes_apart(b, T, a, None) == apart
        assert boxes_apart(a, transform(-shift), b, None) == apart
        moved = transform(np.array([3.0, 2.0, 1.0]))
        assert boxes_apart(b, moved @ T, a, moved) == apart
        assert boxes_apart(a, moved, b, moved @ T) == apart


def test_a_speck_between_a_part_and_what_it_grew_to():
    """Grown by 0.1 along its own axes; the part stands turned and shifted."""
    part = box("part", (1.0, 0.4, 0.4))
    grown = enlarge(part, 0.1)
    T = transform([0.3, -0.2, 0.5])
    T[:3, :3] = rpy_matrix(0.4, -0.7, 1.1)
    for along, inside in ((0.55, True), (0.65, False), (-0.55, True), (-0.65, False)):
        speck = box("speck", (0.02,) * 3).moved(T @ transform([along, 0.0, 0.0]))
        assert lies_in_grown(grown, T, surface(speck)) == inside
    # one component within is enough, wherever the others are
    near = box("speck", (0.02,) * 3).moved(T @ transform([0.0, 0.25, 0.0]))
    far = shifted(near, 5.0)
    both = TriangleMesh(
        "two",
        np.concatenate([near.vertices, far.vertices]),
        np.concatenate([near.triangles, far.triangles + len(near.vertices)]),
    )
    assert lies_in_grown(grown, T, surface(both))
    assert not lies_in_grown(grown, T, surface(far))
    around = box("around", (9.0,) * 3)  # holds the part, which is asked elsewhere
    assert not lies_in_grown(grown, T, surface(around))
