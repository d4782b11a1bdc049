"""A motion is clear only where what is nearest of each obstacle was seen."""

from dataclasses import replace

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.motion import unseen as module
from borecheck.motion.least_clearance import least_clearance
from borecheck.motion.problem import Body, PathProblem
from borecheck.motion.search import search
from borecheck.motion.unseen import without_unseen
from borecheck.robots.obstacle_files import Assumed, Obstacle
from borecheck.robots.scene import Scene
from tests.chains import slider

WAY = np.array([[0.0], [0.3]])
LEFT, RIGHT = "its face at the left", "its face at the right"


def stand(*places, assumed):
    """A cube that slides along x between others; what of these nobody has seen.

    Args:
        places: Middles of the others along x.
        assumed: For each +1 or -1, the face that nobody has seen, or 0.
    """
    obstacles = []
    for k, (x, side) in enumerate(zip(places, assumed, strict=True)):
        mesh = box(f"other{k}", [0.1] * 3).moved(transform([x, 0.0, 0.0]))
        face = (mesh.corners[:, :, 0] == mesh.bounds[(side + 1) // 2, 0]).all(axis=1)
        assert face.sum() == 2
        known = Assumed(face, RIGHT if side > 0 else LEFT) if side else None
        obstacles.append(Obstacle(mesh.name, "patient", mesh, "", None, known))
    scene = Scene("s", None, {}, "", tuple(obstacles), {}, (), ())
    bodies = tuple(Body(o.name, o.mesh) for o in obstacles)
    parts = (Body("part", box("part", [0.1] * 3), 0),)
    return scene, PathProblem(slider(), parts, bodies)


@pytest.mark.parametrize("measured", [False, True])
@pytest.mark.parametrize(
    ("places", "assumed", "why"),
    [
        ((0.45,), (0,), None),
        ((0.45,), (-1,), LEFT),  # the cube comes from the left
        ((0.45,), (1,), None),
        ((-0.2,), (-1,), None),
        ((-0.2,), (1,), RIGHT),
        # something else is nearer, or as unseen
        ((0.41, -0.2), (0, 1), RIGHT),
        ((0.41, -0.2), (0, -1), None),
        ((-0.2, 0.41), (1, 0), RIGHT),
        ((0.41, -0.2), (1, 1), RIGHT),
        ((0.41, -0.2), (-1, 1), LEFT),
    ],
)
def test_the_nearest_place_of_each_decides(measured, places, assumed, why):
    scene, problem = stand(*places, assumed=assumed)
    found = search(problem, WAY)
    assert found.clear
    if measured:
        found = replace(found, least=least_clearance(problem, WAY, found))
    told = without_unseen(scene, problem, WAY, found)
    assert told.verdict == ("clear" if why is None else "unknown")
    assert told.certified == (why is None)
    if why is None:
        assert told is found
    else:
        assert f"not seen: {why}; {found.reason}" in told.reason
        assert told.least is found.least


def test_where_that_cannot_be_told_nothing_is_clear(monkeypatch):
    scene, problem = stand(0.45, assumed=(1,))
    monkeypatch.setattr(module, "least_clearance", lambda *given: None)
    told = without_unseen(scene, problem, WAY, search(problem, WAY))
    assert told.unknown
    assert "where other0 is nearest" in told.reason


def test_what_is_not_clear_stays_what_it_is(monkeypatch):
    scene, problem = stand(0.35, assumed=(-1,))
    monkeypatch.setattr(module, "least_clearance", lambda *given: 1 / 0)
    found = search(problem, WAY)
    assert found.contact
    assert without_unseen(scene, problem, WAY, found) is found


def test_the_others_and_the_robot_itself_are_left_out():
    _, problem = stand(0.45, -0.2, assumed=(0, 1))
    both = replace(problem, parts=problem.parts * 2, self_pairs=((1, 0),))
    before = frozenset({(1, 1)})
    alone = module._with_only(replace(both, excluded=before), 1)
    assert [pair.names for pair in alone.pairs] == [("part", "other1")]
    assert alone.obstacles == both.obstacles
