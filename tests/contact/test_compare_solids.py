"""What no checker of surfaces sees is told beside their answers."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.scene import Obstacle, Scene
from tests.places import ROBOTS


def at(name, size, x):
    mesh = box(name, (size,) * 3)
    return TriangleMesh(name, mesh.vertices + [x, 0.0, 0.6], mesh.triangles)


@pytest.mark.parametrize(
    ("meshes", "contained", "touched"),
    [
        ([at("room", 9.0, 0.0)], {"base, room", "arm, room"}, []),
        ([at("speck", 0.01, 0.0)], {"arm, speck"}, []),
        ([at("wall", 0.2, 0.14)], set(), [0]),
        ([at("far", 0.2, 9.0), at("room", 9.0, 0.0)], {"base, room", "arm, room"}, []),
        ([at("far", 0.2, 9.0)], set(), []),
    ],
)
def test_solids_in_solids(meshes, contained, touched):
    robot = bc.load_robot(ROBOTS / "two_link.urdf")
    obstacles = tuple(Obstacle(m.name, "other", m, "t") for m in meshes)
    scene = Scene("s", None, {}, "t", obstacles, {}, (), ())
    found = bc.compare(robot, scene, np.zeros((1, 1)))
    assert {text.partition(":")[0] for text in found.contained[0]} == contained
    for name, summary in found.checkers.items():
        assert summary.contact_poses == tuple(touched) or name.startswith("paper")
        assert found.pose_verdicts[0][name] == (0 in summary.contact_poses)
    pairs = sum(len(p.mesh.triangles) for p in robot.parts) * 12 * len(meshes)
    exact = found.checkers["exact"]
    assert exact.pairs_examined + exact.pairs_pruned == pairs
