"""A live view of a small robot beside a block, and where it was started."""

import socket

import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.view.first_plan import first_plan
from borecheck.view.server import HOST, LiveView
from borecheck.view.session import Session
from tests.places import ROBOTS


@pytest.fixture(scope="module")
def small_view(tmp_path_factory):
    pytest.importorskip("viser", reason="viser is missing")
    folder = tmp_path_factory.mktemp("started")
    write_stl(folder / "block.stl", box("block", (0.2, 0.2, 0.2)))
    robot = bc.load_robot(ROBOTS / "two_link.urdf")
    scene = bc.load_scene(f"{folder / 'block.stl'}:m@0.5,0,0.6")
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        port = probe.getsockname()[1]
    view = LiveView(Session(robot, scene, first_plan(robot, scene)), port, folder)
    yield view
    view.stop()
