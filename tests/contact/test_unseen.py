"""Where nobody has seen an obstacle nothing is clear, whatever else is nearer."""

import numpy as np
import pytest

from borecheck.contact import unseen as module
from borecheck.contact.unseen import why_unseen, why_unseen_at
from borecheck.contact.verdict import Closest
from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.robots.obstacle_files import Assumed, Obstacle
from borecheck.robots.scene import Scene

BEYOND = "cut by the scan"


def obstacle(name, x, assumed=None):
    """A cube along x; these of its triangles are assumed."""
    mesh = box(name, [0.1] * 3).moved(transform([x, 0.0, 0.0]))
    if assumed is not None:
        marks = np.zeros(len(mesh.triangles), bool)
        marks[assumed] = True
        assumed = Assumed(marks, BEYOND)
    return Obstacle(name, "patient", mesh, name, None, assumed)


def nearest(name, triangle):
    return Closest(
        "arm", name, "patient", 0.0125, 0.0126, ((0.0,) * 3,) * 2, (5, triangle)
    )


@pytest.mark.parametrize(
    ("assumed", "triangle", "told"),
    [(None, 2, False), ([2], 2, True), ([2], 5, False), ([0, 1, 3], 2, False)],
)
def test_the_triangle_of_the_obstacle_decides(assumed, triangle, told):
    said = why_unseen(obstacle("p", 1.0, assumed), nearest("p", triangle))
    assert (said is not None) == told
    if told:
        assert said == (
            f"arm is nearest to p, 12.5 mm, where that is assumed, not seen: {BEYOND}"
        )


def test_what_is_not_known_was_not_seen():
    said = why_unseen(obstacle("p", 1.0, [2]), None)
    assert said == "where p is nearest, and whether it was seen there, is not known"
    assert why_unseen(obstacle("p", 1.0), None) is None


def test_each_is_asked_alone_unless_it_is_nearest(monkeypatch):
    """What is known of the nearest is not asked again."""
    every = range(12)
    first, second, wall = (
        obstacle("first", 1.0, every),
        obstacle("second", 2.0, [7]),
        obstacle("wall", 0.5),
    )
    asked = []
    answers = {"first": nearest("first", 3), "second": nearest("second", 7)}

    def to_obstacles(robot, scene, placements, corridor):
        assert (robot, placements, corridor) == ("robot", "placements", "corridor")
        asked.append([o.name for o in scene.obstacles])
        return answers[scene.obstacles[0].name], None

    monkeypatch.setattr(module, "to_obstacles", to_obstacles)

    def said(closest, *obstacles):
        asked.clear()
        scene = Scene("s", None, {}, "", obstacles, {}, (), ())
        given = "robot", scene, "placements", "corridor", nearest(closest, 3)
        return why_unseen_at(*given)

    assert said("wall", wall) is None
    assert asked == []
    assert "nearest to first" in said("wall", wall, first)
    assert asked == [["first"]]
    assert "nearest to first" in said("first", wall, first)
    assert asked == []
    assert said("second", wall, second) is None  # seen at triangle 3
    assert asked == []
    assert "nearest to second" in said("wall", second, wall)
    answers["second"] = nearest("second", 6)
    assert said("wall", wall, second) is None
    assert "nearest to first" in said("second", second, first, wall)
    assert asked == [["first"]]
