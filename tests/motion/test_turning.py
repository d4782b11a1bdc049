"""A continuous joint turns the way its numbers say, for all kinematics."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.kinematics.forward import WORLD
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.scene import Obstacle, Scene
from borecheck.verify.chain import Joint, motion
from tests.places import ROBOTS

# a few products of rotations
ROUNDING = 1e-12
ANGLES = [0.5, -0.5, 2.0, -2.5, 3.1]


@pytest.fixture(scope="module", params=["revolute", "continuous"])
def arm(request, tmp_path_factory):
    """The upright arm of two_link.urdf; +q about y leans it towards +x."""
    text = (ROBOTS / "two_link.urdf").read_text()
    text = text.replace('"revolute"', f'"{request.param}"')
    text = text.replace('lower="-2" upper="2"', 'lower="-3.2" upper="3.2"')
    file = tmp_path_factory.mktemp("arm") / "arm.urdf"
    file.write_text(text)
    return bc.load_robot(file)


def about_y(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


@pytest.mark.parametrize("angle", ANGLES)
def test_every_kinematics_turns_it_alike(arm, angle):
    expected = about_y(angle)
    seen = arm.placements([angle])["arm"][:3, :3]
    np.testing.assert_allclose(seen, expected, atol=ROUNDING)
    frame_of, chain = chain_of(arm)
    batch = chain.placements(np.array([[angle]]), [frame_of["arm"]])
    np.testing.assert_allclose(batch[0, 0, :3, :3], expected, atol=ROUNDING)
    one = chain.placed(chain.thetas(np.array([angle])))[frame_of["arm"]]
    np.testing.assert_array_equal(one, batch[0, 0])
    y = np.array([0.0, 1.0, 0.0])
    stated = motion(Joint(WORLD, np.eye(4), "turns", y, 0, 1.0, 0.0), angle)
    np.testing.assert_allclose(stated[:3, :3], expected, atol=ROUNDING)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_contact_is_on_the_side_it_leans_to(arm, side):
    mesh = box("wall", (0.2, 0.4, 0.4))
    moved = TriangleMesh("wall", mesh.vertices + [side * 0.75, 0, 0.2], mesh.triangles)
    obstacle = Obstacle("wall", "other", moved, "t")
    scene = Scene("s", None, {}, "t", (obstacle,), {}, (), ())
    for lean in (1.5, -1.5):
        expected = "contact" if lean * side > 0 else "clear"
        assert bc.check(arm, scene, [lean]).verdict == expected
        assert bc.first_contacts(arm, scene, [[lean]])[0] == (expected == "contact")
        path = bc.check_path(arm, scene, [[0.0], [lean]])
        assert path.verdict == expected
