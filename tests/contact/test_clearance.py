"""The nearest pair is the nearest of all pairs: asked one by one, and of boxes."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.clearance import to_obstacles
from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box, sphere
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.plans.corridor import Corridor
from borecheck.robots.scene import Obstacle, Scene

# distances of some 1 m in float64
ROUNDING = 1e-12
SIZES = {"base": (0.2, 0.2, 0.2), "arm": (0.6, 0.05, 0.05), "hand": (0.1, 0.1, 0.02)}


def link(name):
    size = " ".join(map(str, SIZES[name]))
    shape = f'<collision><geometry><box size="{size}"/></geometry></collision>'
    return f'<link name="{name}">{shape}</link>'


JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>
<origin xyz="{4}"/><axis xyz="{5}"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>"""


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    file = tmp_path_factory.mktemp("robot") / "boxes.urdf"
    joints = JOINT.format("turn", "revolute", "base", "arm", "0.4 0 0.3", "0.3 0.5 1")
    joints += JOINT.format("push", "prismatic", "arm", "hand", "0.4 0 0.1", "0 0 1")
    file.write_text(f'<robot name="b">{"".join(map(link, SIZES))}{joints}</robot>')
    return bc.load_robot(file)


def scene_of(*bodies):
    """Obstacles from (name, role, mesh)."""
    obstacles = tuple(Obstacle(name, role, mesh, "t") for name, role, mesh in bodies)
    return Scene("s", None, {}, "t", obstacles, {}, (), ())


def turned(name, size, T):
    return box(name, size).moved(T)


def one_by_one(robot, scene, placements):
    """{(part, obstacle): (lower, upper)} of every pair."""
    return {
        (part.mesh.name, other.name): surface(part.mesh).tree.clearance(
            surface(other.mesh).tree, placements[part.link], np.eye(4)
        )
        for part in robot.parts
        for other in scene.obstacles
    }


def test_the_least_of_all_pairs_is_found(robot, rng):
    """Slender boxes at a slant: boxes around them meet long before they do."""
    nearest = set()
    for _ in range(25):
        bodies = [
            (
                f"o{k}",
                "other",
                turned(
                    f"o{k}",
                    (0.9, 0.03, 0.03),
                    transform(
                        rng.uniform(-1, 1, 3) * [1, 1, 0.4], rng.uniform(-3, 3, 3)
                    ),
                ),
            )
            for k in range(4)
        ]
        scene = scene_of(*bodies)
        placements = robot.placements([rng.uniform(-3, 3), rng.uniform(0, 0.5)])
        every = one_by_one(robot, scene, placements)
        pair = min(every, key=lambda names: every[names][0])
        best, none = to_obstacles(robot, scene, placements)
        again, links = to_obstacles(robot, scene, placements, every_link=True)
        assert none is None
        for found in (best, again):
            assert found.distance == pytest.approx(every[pair][0], abs=ROUNDING)
            assert found.upper == pytest.approx(every[pair][1], abs=ROUNDING)
        if every[pair][0] > 0.0:
            assert (best.link, best.obstacle) == pair
            first, second = np.array(best.points)
            assert np.linalg.norm(second - first) == pytest.approx(best.upper)
        for name in SIZES:
            least = min(low for (part, _), (low, _) in every.items() if part == name)
            assert links[name] == pytest.approx(least, abs=ROUNDING)
        nearest.add(pair)
    assert len(nearest) > 6


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_boxes_along_an_axis(robot, axis, side):
    """Known by subtraction: the base's face and the nearest of two obstacles."""
    shift = np.zeros(3)
    shift[axis] = side
    bodies = [
        (f"at {d}", "couch", turned(f"at {d}", (0.1,) * 3, transform(d * shift)))
        for d in (0.9, 0.7, 0.8)
    ]
    placements = {**robot.placements([0.0, 0.0])}
    for name in ("arm", "hand"):  # out of the way
        placements[name] = transform(-20.0 * shift)
    best, links = to_obstacles(robot, scene_of(*bodies), placements, every_link=True)
    assert (best.link, best.obstacle, best.role) == ("base", "at 0.7", "couch")
    assert best.distance == pytest.approx(0.7 - 0.05 - 0.1, abs=ROUNDING)
    assert links["hand"] == pytest.approx(20.7 - 0.05 - SIZES["hand"][axis] / 2)
    points = np.array(best.points)
    assert points[:, axis] == pytest.approx([0.1 * side, 0.65 * side])
    triangles = (robot.parts[0].mesh.corners, bodies[1][2].corners)
    for mesh, number, point in zip(triangles, best.triangles, points, strict=True):
        assert mesh[number][:, axis] == pytest.approx([point[axis]] * 3)


def test_without_obstacles_there_is_none(robot):
    assert to_obstacles(robot, scene_of(), robot.placements([0, 0])) == (None, None)


def test_the_needle_and_the_patient_are_left_out_with_a_corridor_only(zerobot):
    """Of the needle the couch counts, and of the patient every other link does."""
    placements = zerobot.placements(zerobot.home)
    needle = zerobot.description.needle_link
    tip = zerobot.placements(zerobot.home)[zerobot.description.tool_frame]
    at_tip = transform(tip[:3, 3] - [0.0, 0.0, 0.06])
    mesh = turned("belly", (0.1,) * 3, at_tip)
    corridor = Corridor(tip[:3, 3], tip[:3, 3] - [0, 0, 0.05], 5e-4)
    patient, couch = (scene_of(("belly", r, mesh)) for r in ("patient", "couch"))
    names = {p.mesh.name for p in zerobot.parts if p.link == needle}
    for scene, asked, found in (
        (patient, None, True),
        (patient, corridor, False),
        (couch, corridor, True),
    ):
        best, links = to_obstacles(zerobot, scene, placements, asked, every_link=True)
        assert (best.link in names) == found
        assert bool(names & set(links)) == found


def test_round_shapes_widen_the_upper_bound_alone(robot, tmp_path):
    """The polyhedron lies round the shape: nearer it is not, and farther by so much."""
    urdf = tmp_path / "ball.urdf"
    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    urdf.write_text(f'<robot name="ball"><link name="b">{ball}</link></robot>')
    round_robot = bc.load_robot(urdf)
    mesh = turned("wall", (0.1, 0.4, 0.4), transform([0.35, 0.0, 0.0]))
    best, _ = to_obstacles(
        round_robot, scene_of(("w", "other", mesh)), {"b": np.eye(4)}
    )
    assert best.distance <= 0.2 <= best.upper
    assert best.upper - best.distance < 1e-3


def test_of_a_round_obstacle_too(robot):
    """0.3 m of true gap lie between both bounds, less than the shape's excess apart."""
    ball = sphere("ball", 0.1).moved(transform([-0.5, 0.0, 0.0]))
    assert ball.excess > 0.0
    placements = {**robot.placements([0.0, 0.0])}
    for name in ("arm", "hand"):
        placements[name] = transform([20.0, 0.0, 0.0])
    best, _ = to_obstacles(robot, scene_of(("ball", "other", ball)), placements)
    assert best.distance <= 0.3 <= best.upper
    assert best.upper - best.distance == pytest.approx(ball.excess, abs=ROUNDING)


def test_a_part_of_many_names_keeps_its_least(robot):
    """One obstacle far, one near, in either order of their boxes."""
    near = TriangleMesh(
        "n", box("n", (0.1,) * 3).vertices + [0, 0.3, 0], box("n", (0.1,) * 3).triangles
    )
    far = TriangleMesh(
        "f", box("f", (0.1,) * 3).vertices + [0, -0.6, 0], near.triangles
    )
    placements = {**robot.placements([0.0, 0.0])}
    for bodies in ([near, far], [far, near]):
        scene = scene_of(*((m.name, "other", m) for m in bodies))
        _, links = to_obstacles(robot, scene, placements, every_link=True)
        assert links["base"] == pytest.approx(0.3 - 0.05 - 0.1, abs=ROUNDING)
