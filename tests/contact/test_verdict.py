"""Every verdict answers by name: clear, contact or unknown; never as yes or no."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.settings import settings
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.samples import sample_motion
from borecheck.robots.scene import Obstacle, Scene
from tests.places import ROBOTS


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOTS / "two_link.urdf")


def beside(x):
    """A box whose near face is x from the arm's axis."""
    mesh = box("block", (0.2, 0.2, 0.2))
    shifted = mesh.vertices + np.array([x + 0.1, 0.0, 0.6])
    mesh = TriangleMesh("block", shifted, mesh.triangles)
    return Scene(
        "s", None, {}, "s", (Obstacle("block", "other", mesh, "s"),), {}, (), ()
    )


def pose(arm, scene):
    return bc.check(arm, scene, [0.0])


def path(arm, scene):
    return bc.check_path(arm, scene, [[0.0], [0.01]])


def motion(arm, scene):
    return sample_motion(arm, scene, [[0.0]], settings("exact", "bvh"))


@pytest.mark.parametrize("ask", [pose, path, motion])
@pytest.mark.parametrize(
    ("scene", "answer"),
    [(beside(0.4), "clear"), (beside(0.0), "contact"), (beside(-0.1), "contact")],
)
def test_exactly_one_of_three_answers_holds(arm, ask, scene, answer):
    verdict = ask(arm, scene)
    assert verdict.verdict == answer
    named = {name: getattr(verdict, name) for name in ("clear", "contact", "unknown")}
    assert named == {name: name == answer for name in named}


def test_what_cannot_be_decided_is_neither_clear_nor_contact(arm):
    sampled = sample_motion(
        arm, beside(0.4), [[0.0], [0.01]], settings("exact", "bvh"), samples=3
    )
    assert (sampled.clear, sampled.contact, sampled.unknown) == (False, False, True)


@pytest.mark.parametrize("ask", [pose, path, motion])
@pytest.mark.parametrize("x", [0.4, 0.0])
def test_a_verdict_taken_for_yes_or_no_says_what_to_ask(arm, ask, x):
    verdict = ask(arm, beside(x))
    with pytest.raises(TypeError, match=r"\.clear, \.contact or \.unknown"):
        bool(verdict)
    with pytest.raises(TypeError, match=verdict.verdict):
        assert not verdict
