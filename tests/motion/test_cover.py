"""Intervals that cover a motion: whole, in order, proven with something to spare."""

from itertools import pairwise

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.motion import cover as module
from borecheck.motion.cover import apart, beside_or_within, cover, keeps
from borecheck.motion.problem import Body, Passage, PathProblem, path_motion
from borecheck.plans.corridor import SLACK, Corridor
from tests.chains import slider

# what bounds of displacements add for rounding, of sizes near 1 m
ROUNDING = 1e-11


def motion_of(steps):
    """Of a cube that slides beside another one."""
    part = Body("part", box("part", [0.1] * 3), 0)
    wall = Body("wall", box("wall", [0.1] * 3), T_frame_mesh=transform([1.0, 0, 0]))
    problem = PathProblem(slider((1.0, 0.0, 0.0)), (part,), (wall,), margin=0.01)
    return problem, path_motion(problem, steps)


def short(most):
    """What proves intervals that are so short, and remembers what it was asked."""
    asked = []

    def proven(begin, middle, end):
        asked.append((begin, end))
        assert middle == 0.5 * (begin + end)
        return [begin, end] if end - begin <= most else None

    return proven, asked


@pytest.mark.parametrize("steps", [1, 3])
def test_intervals_cover_the_motion_in_order(steps):
    _, motion = motion_of([[0.1 * k] for k in range(steps + 1)])
    proven, asked = short(0.5)
    found = cover(motion, proven)
    assert (found[0][0], found[-1][1]) == (0.0, steps)
    assert all(a[1] == b[0] for a, b in pairwise(found))
    assert asked[0] == (0.0, steps)


@pytest.mark.parametrize(("most", "given_up"), [(7, False), (6, True)])
def test_so_many_are_tried_and_no_more(monkeypatch, most, given_up):
    """Four quarters take seven tries."""
    monkeypatch.setattr(module, "MOST_INTERVALS", most)
    _, motion = motion_of([[0.0], [0.1]])
    proven, asked = short(0.25)
    assert (cover(motion, proven) is None) == given_up
    assert len(asked) == most


# it stands; then it moves by as much to either side of the middle
with_something_to_spare = pytest.mark.parametrize(
    ("begin", "end", "spare", "accepted"),
    [
        (0.5, 0.5, 3e-8, True),
        (0.5, 0.5, 1e-8, False),
        (0.0, 1.0, 3e-8, True),
        (0.0, 1.0, 1e-8, False),
    ],
)


@with_something_to_spare
def test_what_is_apart_is_so_by_more_than_it_moves(begin, end, spare, accepted):
    moved = 0.2 * (end - begin) / 2
    gap = 0.01 + moved + spare  # at the middle, between faces
    start = 1.0 - 0.1 - gap - 0.1
    problem, motion = motion_of([[start], [start + 0.2]])
    pair, way = problem.pairs[0], problem.routes[0]
    found = apart(problem.chain, pair, way, motion, begin, 0.5 * (begin + end), end)
    assert (found is not None) == accepted
    if accepted:
        assert found[:3] == [begin, end, 0.5]
        assert found[3] <= gap + ROUNDING
        assert moved <= found[4] <= moved + ROUNDING
        assert found[3] - problem.margin > found[4]


LENGTH, RADIUS = 0.05, 0.0006
CORRIDOR = Corridor(np.zeros(3), np.array([0.0, 0.0, -LENGTH]), RADIUS)


def insertion(tips):
    """A thin needle along z, its tip at these heights; the skin is z = 0."""
    edge = 1.4 * RADIUS
    mesh = box("needle", [edge, edge, 0.2]).moved(transform([0.0, 0.0, 0.1]))
    body = box("body", [0.4, 0.4, 0.4]).moved(transform([0.0, 0.0, -0.2]))
    passage = Passage(0, 0, CORRIDOR)
    problem = PathProblem(
        slider((0.0, 0.0, 1.0)),
        (Body("needle", mesh, 0),),
        (Body("body", body),),
        passages=(passage,),
    )
    return problem, passage, path_motion(problem, [[z] for z in tips])


@with_something_to_spare
def test_a_needle_keeps_to_its_corridor_with_something_to_spare(
    begin, end, spare, accepted
):
    """So far above the deepest that is allowed; it goes in by a millimetre."""
    moved = 0.001 * (end - begin) / 2
    deepest = -LENGTH - SLACK + spare + moved
    problem, passage, motion = insertion([deepest + 5e-4, deepest - 5e-4])
    found = keeps(problem, passage, motion)(begin, 0.5, end)
    assert (found is not None) == accepted
    if accepted:
        assert found[:3] == [begin, end, 0.5]
        assert moved <= found[3] <= moved + ROUNDING


def test_beside_its_patient_a_needle_needs_no_corridor():
    """Of what is plainly clear the clearance is stated, of the rest its corridor."""
    for height, length in ((0.1, 5), (0.0015, 5), (-0.02, 4)):
        problem, passage, motion = insertion([height + 5e-4, height - 5e-4])
        proven = beside_or_within(problem, passage, motion)
        assert len(proven(0.5, 0.5, 0.5)) == len(proven(0.0, 0.5, 1.0)) == length
    # moves more than it is away: its halves need no corridor, or do
    problem, passage, motion = insertion([0.1, -0.03])
    assert beside_or_within(problem, passage, motion)(0.0, 0.5, 1.0) is None
    # at the skin it is in its corridor
    problem, passage, motion = insertion([0.002, 0.0])
    assert len(beside_or_within(problem, passage, motion)(0.0, 0.5, 1.0)) == 4
