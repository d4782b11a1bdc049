"""What a robot and a scene are to the certified search is made once, and let go."""

import gc
import weakref

import pytest

import borecheck as bc
from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.tree import kept_trees
from borecheck.motion.robot_problem import path_problem
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.obstacle_files import Obstacle
from borecheck.robots.scene import Scene
from tests.places import ROBOTS


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOTS / "two_link.urdf")


def scene_of(*meshes):
    obstacles = tuple(Obstacle(m.name, "other", m, "t") for m in meshes)
    return Scene("s", None, {}, "t", obstacles, {}, (), ())


def far_box():
    return box("far", (0.1, 0.1, 0.1)).moved(transform((9.0, 0.0, 0.0)))


def test_a_planner_builds_nothing_twice(arm, monkeypatch):
    scene, built = scene_of(far_box()), []
    real = kept_trees.build
    monkeypatch.setattr(
        kept_trees, "build", lambda *given: built.append(1) or real(*given)
    )
    for k in range(3):
        assert bc.check_path(arm, scene, [[0.0], [0.1 * k]]).verdict == "clear"
    meshes = {*(part.mesh for part in arm.parts), scene.obstacles[0].mesh}
    assert 0 < len(built) <= len(meshes)
    assert path_problem(arm, scene) is path_problem(arm, scene)
    assert path_problem(arm, scene, 0.01).margin == 0.01
    assert path_problem(arm, scene).margin == 0.0
    assert chain_of(arm) is chain_of(arm)


def test_scenes_made_in_a_loop_do_not_pile_up(arm):
    """Their meshes, trees and problems go at once, without the collector."""
    gc.collect()
    gc.disable()
    try:
        seen = []
        for _ in range(20):
            scene = scene_of(far_box())
            bc.check_path(arm, scene, [[0.0], [0.1]])
            bc.first_contacts(arm, scene, [[0.0]])
            bc.check(arm, scene, [0.0])
            seen.append(weakref.ref(path_problem(arm, scene).obstacles[0].tree))
            seen.append(weakref.ref(scene.obstacles[0].mesh))
        assert sum(reference() is not None for reference in seen) == 2
    finally:
        gc.enable()


def test_robots_made_in_a_loop_do_not_pile_up():
    scene, seen = scene_of(far_box()), []
    for _ in range(5):
        arm = bc.load_robot(ROBOTS / "two_link.urdf")
        bc.check_path(arm, scene, [[0.0], [0.1]])
        seen.append(weakref.ref(arm.parts[0].mesh))
    del arm
    gc.collect()
    assert [reference() for reference in seen] == [None] * 5


def test_a_robot_without_joints_stands_still(tmp_path):
    """It has no entry of q to read: this ended in a traceback."""
    file = tmp_path / "post.urdf"
    file.write_text(
        '<robot name="post"><link name="post"><collision><geometry>'
        '<box size="0.2 0.2 0.2"/></geometry></collision></link></robot>'
    )
    post, near = bc.load_robot(file), scene_of(box("near", (0.1, 0.1, 0.1)))
    assert bc.check_path(post, scene_of(far_box()), [[], []]).verdict == "clear"
    assert bc.check_path(post, near, [[], []]).verdict == "contact"
