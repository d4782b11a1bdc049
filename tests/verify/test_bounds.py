"""What a certificate may state just so, and what it may not: every bound, both sides.

A cube of 0.1 m slides along x beside a wall, 0.1 m of clear gap all the way: all
numbers of the certificate are known by hand.
"""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.certificate import certificate, digest
from borecheck.motion.problem import Body, PathProblem
from borecheck.motion.search import search
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES
from borecheck.verify.check import verify

Array = NDArray[np.float64]
Document = dict[str, Any]

GAP, WAY, MARGIN = 0.1, 0.25, 0.02
# What `verify` keeps beyond margin and displacement, and takes for rounding, [m].
RESERVE, ROUNDING = 1e-9, 1e-10


def bar(name: str, size: Any, at: Any) -> TriangleMesh:
    return box(name, size).moved(transform(at))


PART = bar("part", [0.1] * 3, [0, 0, 0])
WALL = bar("wall", [2.0, 0.1, 1.0], [0, GAP + 0.1, 0])


def problem(*parts: TriangleMesh, wall: TriangleMesh = WALL) -> PathProblem:
    """The first part slides along x, the second, if there is one, on it along z."""
    n = len(parts)
    chain = JointChain(
        parent=np.arange(n) - 1,
        origin=np.tile(np.eye(4), (n, 1, 1)),
        kind=np.full(n, SLIDES),
        axis=np.array([[1.0, 0, 0], [0, 0, 1.0], [0, 0, 1.0]][:n]),
        source=np.arange(n),
        factor=np.ones(n),
        offset=np.zeros(n),
    )
    bodies = tuple(Body(mesh.name, mesh, k) for k, mesh in enumerate(parts))
    pairs = ((2, 0),) if n == 3 else ()
    return PathProblem(chain, bodies, (Body("wall", wall),), pairs, margin=MARGIN)


def meshes_of(given: PathProblem) -> list[tuple[Array, NDArray[np.int64]]]:
    bodies = (*given.parts, *given.obstacles)
    return [(body.mesh.vertices, body.mesh.triangles) for body in bodies]


def written(given: PathProblem, waypoints: Any) -> Document:
    outcome = search(given, waypoints)
    assert outcome.verdict == "clear", outcome.reason
    document = certificate(given, waypoints, outcome)
    assert document is not None
    return document


@pytest.fixture(scope="module")
def document() -> Document:
    """One interval for all of it; the cube goes 25 mm either way of its middle."""
    made = written(problem(PART), [[0.0], [0.05]])
    made["pairs"][0]["intervals"] = [[0.0, 1.0, 0.5, 0.09, 0.025]]
    return made


def asked(changed: Document, meshes: Any = None) -> tuple[str, ...]:
    """Why it is rejected; nothing if it is accepted."""
    content = {name: value for name, value in changed.items() if name != "sha256"}
    found = verify(
        {**content, "sha256": digest(content)}, meshes or meshes_of(problem(PART))
    )
    assert found.accepted == (found.problems == ())
    return found.problems


def row_of(document: Document, *row: float) -> Document:
    changed = copy.deepcopy(document)
    changed["pairs"][0]["intervals"] = [list(row)]
    return changed


def test_it_holds(document: Document) -> None:
    assert asked(document) == ()


@pytest.mark.parametrize(
    ("clearance", "moved", "accepted"),
    [
        # the surfaces are 0.1 m apart, up to rounding
        (GAP, 0.025, True),
        (GAP + 0.5 * ROUNDING, 0.025, True),
        (GAP + 2.0 * ROUNDING, 0.025, False),
        # the way is 25 mm, up to rounding; more may be stated
        (0.09, 0.025 - 0.5 * ROUNDING, True),
        (0.09, 0.025 - 2.0 * ROUNDING, False),
        (0.09, 0.05, True),
        # clearance exceeds way and margin by the reserve
        (0.025 + MARGIN + 1.1 * RESERVE, 0.025, True),
        (0.025 + MARGIN + 0.9 * RESERVE, 0.025, False),
        (0.025 + MARGIN, 0.025, False),
        (0.06 + MARGIN + 0.5 * RESERVE, 0.06, False),
        (0.06 + MARGIN + 1.5 * RESERVE, 0.06, True),
        # stated less than it is, within rounding: what it is counts
        (0.025 + MARGIN + 1.02 * RESERVE, 0.025 - 0.9 * ROUNDING, True),
        (0.025 + MARGIN + 0.95 * RESERVE, 0.025 - 0.9 * ROUNDING, False),
    ],
)
def test_clearance_and_way(
    document: Document, clearance: float, moved: float, accepted: bool
) -> None:
    problems = asked(row_of(document, 0.0, 1.0, 0.5, clearance, moved))
    assert (problems == ()) == accepted


@pytest.mark.parametrize(
    ("pair", "whole", "accepted"),
    [
        (MARGIN, MARGIN, True),
        (0.03, MARGIN, True),
        (0.0, 0.0, True),
        (0.01, MARGIN, False),
    ],
)
def test_no_pair_has_less_than_the_margin(
    document: Document, pair: float, whole: float, accepted: bool
) -> None:
    changed = copy.deepcopy(document)
    changed["margin_m"] = whole
    changed["pairs"][0]["margin_m"] = pair
    assert (asked(changed) == ()) == accepted


@pytest.mark.parametrize(
    ("rows", "accepted"),
    [
        ([[0.0, 0.5, 0.25], [0.5, 1.0, 1.0]], True),
        ([[0.0, 0.5, 0.0], [0.5, 1.0, 0.5]], True),
        ([[0.1, 0.5, 0.25], [0.5, 1.0, 1.0]], False),
        ([[0.0, 0.5, 0.25], [0.5, 0.9, 0.75]], False),
        ([[0.0, 0.5, 0.25], [0.6, 1.0, 0.75]], False),
        ([[0.0, 0.5, 0.25], [0.4, 1.0, 0.75]], False),
        ([[0.0, 0.5, 0.6], [0.5, 1.0, 0.75]], False),
        ([[0.0, 0.5, 0.25], [0.5, 1.0, 0.4]], False),
        ([[0.0, 0.0, 0.0], [0.0, 1.0, 0.5]], False),
        ([[0.0, 1.0, 0.5], [1.0, 1.0, 1.0]], False),
    ],
)
def test_intervals_cover_the_motion_and_hold_their_instant(
    document: Document, rows: list[list[float]], accepted: bool
) -> None:
    changed = copy.deepcopy(document)
    changed["pairs"][0]["intervals"] = [[*row, 0.099, 0.05] for row in rows]
    assert (asked(changed) == ()) == accepted


def test_a_waypoint_within_an_interval_counts() -> None:
    """There and back: at both ends the cube is where the instant sees it."""
    given = problem(PART)
    document = written(given, [[0.0], [0.05], [0.0]])
    for moved, accepted in ((0.05, True), (0.049, False), (0.0, False)):
        changed = row_of(document, 0.0, 2.0, 0.0, 0.09, moved)
        assert (asked(changed) == ()) == accepted


TUBE = np.array([0.6, 0.6, 0.6])


@pytest.mark.parametrize("inner", [0, 1])
def test_neither_may_hold_the_other(inner: int) -> None:
    """Surfaces far apart, one solid in the other: nothing but containment is wrong."""
    small, large = bar("s", [0.1] * 3, [0, 0, 0]), bar("l", [0.6] * 3, [0, 0, 0])
    part, wall = (small, large) if inner == 0 else (large, small)
    clear = problem(part, wall=bar("wall", [0.1] * 3, [0.0, 2.0, 0.0]))
    made = written(clear, [[0.0], [0.05]])
    held = problem(part, wall=wall)
    content = made["bodies"][1]
    content["mesh_sha256"] = wall.sha256
    changed = row_of(made, 0.0, 1.0, 0.5, 0.2, 0.025)
    (told,) = asked(changed, meshes_of(held))
    assert "is inside" in told


@pytest.mark.parametrize("which", [0, 1])
def test_neither_may_be_open(document: Document, which: int) -> None:
    meshes = meshes_of(problem(PART))
    vertices, triangles = meshes[which]
    opened = TriangleMesh("o", vertices, triangles[:-1])
    meshes[which] = (opened.vertices, opened.triangles)
    changed = copy.deepcopy(document)
    changed["bodies"][which]["mesh_sha256"] = opened.sha256
    (told,) = asked(changed, meshes)
    assert "is open" in told


def _drop(document: Document) -> None:
    document["pairs"] = document["pairs"][1:]


def _drop_last(document: Document) -> None:
    document["pairs"] = document["pairs"][:-1]


def _twice(document: Document) -> None:
    document["pairs"].append(copy.deepcopy(document["pairs"][0]))


def _turned_round(document: Document) -> None:
    """The self pair once more, the other way round."""
    again = copy.deepcopy(document["pairs"][-1])
    again["moving"], again["standing"] = again["standing"], again["moving"]
    document["pairs"].append(again)


def _of_itself(document: Document) -> None:
    again = copy.deepcopy(document["pairs"][-1])
    again["standing"] = again["moving"]
    document["pairs"].append(again)


def _allowed(document: Document) -> None:
    """The pair of parts by the writer's word alone."""
    del document["pairs"][-1]
    document["allowed"] = [{"first": 0, "second": 2, "reason": "they may"}]


@pytest.mark.parametrize(
    "change", [_drop, _drop_last, _twice, _turned_round, _of_itself, _allowed]
)
def test_every_pair_is_stated_once(change: Callable[[Document], None]) -> None:
    high = bar("high", [0.05] * 3, [0, 0, 0.6])
    given = problem(PART, bar("middle", [0.05] * 3, [0, 0, 0.3]), high)
    document = written(given, [[0.0] * 3, [0.01, 0.005, 0.0]])
    assert len(document["pairs"]) == 4
    assert asked(document, meshes_of(given)) == ()
    change(document)
    assert asked(document, meshes_of(given)) != ()


def test_margins_are_for_obstacles_not_among_parts() -> None:
    near = bar("near", [0.05] * 3, [0, 0, 0.085])  # 10 mm above the cube
    given = problem(PART, bar("middle", [0.01] * 3, [0.5, 0, 0]), near)
    document = written(given, [[0.0] * 3, [0.001, 0.001, 0.0]])
    assert asked(document, meshes_of(given)) == ()
    own = document["pairs"][-1]
    assert own["margin_m"] == 0.0
    assert max(row[3] for row in own["intervals"]) < MARGIN


def test_what_just_reaches_the_reserve_does_not_exceed_it(document: Document) -> None:
    """In the very numbers: the way is stated a little less than it is, and allowed."""
    clearance = 0.025 + MARGIN + RESERVE
    row = (0.0, 1.0, 0.5, clearance, 0.025 - 0.5 * ROUNDING)
    assert asked(row_of(document, *row)) != ()
    above = float(np.nextafter(clearance, 1.0))
    assert asked(row_of(document, 0.0, 1.0, 0.5, above, row[4])) == ()
