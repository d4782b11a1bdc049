"""Motions of which it is known whether and when they touch, and random ones."""

from itertools import pairwise
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.contact.check import check
from borecheck.core.se3 import transform
from borecheck.errors import GeometryError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.certificate import certificate
from borecheck.motion.check import check_path
from borecheck.motion.problem import Body, PathProblem
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.search import search
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.verify.check import verify
from studies import paths
from tests.chains import hinge, slider

Array = NDArray[np.float64]

# A small part of the study in studies/paths.py, which runs 10,000.
STUDY_PATHS = 60


def _cube(name: str, edge: float = 0.1) -> TriangleMesh:
    return box(name, [edge] * 3)


def _at(mesh: TriangleMesh, x: float, y: float = 0.0, z: float = 0.0) -> Body:
    return Body(mesh.name, mesh, T_frame_mesh=transform([x, y, z]))


def _two_cubes(x: float, y: float = 0.0, margin: float = 0.0) -> PathProblem:
    """A cube of 0.1 m on a slider along x, and another that stands at x, y."""
    part = Body("part", _cube("part"), 0)
    return PathProblem(slider(), (part,), (_at(_cube("wall"), x, y),), margin=margin)


def test_first_contact_is_where_it_is_known_to_be() -> None:
    """Faces meet when the slider has gone 0.4 m of 0.8 m."""
    verdict = search(_two_cubes(0.5), [[0.0], [0.8]])
    assert verdict.verdict == "contact"
    assert not verdict.certified
    assert verdict.first_contact is not None
    start, end, names = verdict.first_contact
    assert start <= 0.5 + 1e-12
    assert end >= 0.5 - 1e-12
    assert end - start < 1e-5
    assert names == ("part", "wall")


def test_margin_brings_contact_forward() -> None:
    verdict = search(_two_cubes(0.5, margin=0.08), [[0.0], [0.8]])
    assert verdict.first_contact is not None
    start, end, _ = verdict.first_contact
    assert start <= 0.4 <= end
    assert end - start < 1e-5


@pytest.mark.parametrize("gap", [1e-2, 1e-5, 1e-7, 1e-8])
def test_sliding_along_a_wall_at_a_small_gap(gap: float) -> None:
    """Parallel to the wall all the way: clear, with few pieces, however small."""
    verdict = search(_two_cubes(0.5, 0.1 + gap), [[0.0], [1.0]])
    assert verdict.verdict == "clear"
    assert verdict.certified
    assert verdict.counts["pieces"] < 200
    touching = search(_two_cubes(0.5, 0.1 - 1e-7), [[0.0], [1.0]])
    assert touching.verdict == "contact"


@pytest.mark.parametrize("gap", [1e-4, 1e-6, -1e-6, -1e-4])
def test_a_swing_that_grazes(gap: float) -> None:
    """A tip on a circle of 0.5 m passes a wall; the ends alone see nothing."""
    tip = TriangleMesh("tip", [[0.1, 0, -0.1], [0.5, 0, 0], [0.1, 0, 0.1]], SHEET[:2])
    wall = box("wall", [0.2, 2.0, 2.0])
    problem = PathProblem(
        hinge(), (Body("tip", tip, 0),), (_at(wall, 0.5 + 0.1 + gap),)
    )
    verdict = search(problem, [[-1.0], [1.2]])
    assert verdict.verdict == ("clear" if gap > 0 else "contact")


def test_a_thin_sheet_between_samples_is_found() -> None:
    """Many waypoints, none in contact: the sheet stands between two of them."""
    sheet = TriangleMesh("sheet", SHEET_CORNERS, SHEET)
    needle = Body("needle", box("needle", [1e-3] * 3), 0)
    waypoints = np.linspace(0.0, 1.0, 101)[:, None]
    problem = PathProblem(slider(), (needle,), (_at(sheet, 0.505),))
    verdict = search(problem, waypoints)
    assert verdict.verdict == "contact"
    assert verdict.first_contact is not None
    assert verdict.first_contact[0] < 0.505
    aside = PathProblem(slider(), (needle,), (_at(sheet, 0.505, 0.2),))
    assert search(aside, waypoints).verdict == "clear"


SHEET_CORNERS = [[0, -0.1, -0.1], [0, 0.1, -0.1], [0, 0.1, 0.1], [0, -0.1, 0.1]]
SHEET = [[0, 1, 2], [0, 2, 1], [0, 2, 3], [0, 3, 2]]


def test_intervals_cover_the_path() -> None:
    """In, through, and out again: clear, contact, clear, without a gap."""
    verdict = search(_two_cubes(0.5), [[0.0], [1.0], [0.0]])
    ends = [(s.start, s.end) for s in verdict.intervals]
    assert ends[0][0] == 0.0
    assert ends[-1][1] == 1.0
    assert all(a[1] == b[0] for a, b in pairwise(ends))
    found = [s.verdict for s in verdict.intervals]
    assert found == ["clear", "contact", "clear", "contact", "clear"]


def test_dense_waypoints_and_few_give_the_same() -> None:
    problem = _two_cubes(0.5)
    few = search(problem, [[0.0], [0.8]])
    many = search(problem, np.linspace(0.0, 0.8, 1001)[:, None])
    assert few.first_contact is not None
    assert many.first_contact is not None
    assert few.first_contact[1] == pytest.approx(many.first_contact[1], abs=2e-5)


def test_a_zigzag_is_not_its_chord() -> None:
    """Waypoints that leave the straight line: the run between its ends would miss."""
    y_slider = slider((0.0, 1.0, 0.0))
    zigzag = np.array([[0.0], [0.3], [0.0], [0.3], [0.0]])
    part = Body("part", _cube("part"), 0)
    problem = PathProblem(y_slider, (part,), (_at(_cube("wall"), 0.0, 0.35),))
    assert search(problem, zigzag).verdict == "contact"
    assert search(problem, zigzag * 0.8).verdict == "clear"


def test_self_contact_of_two_moving_parts() -> None:
    """Two sliders on one rail, the second twice as fast by mimic: it catches up."""
    chain = JointChain(
        parent=np.array([-1, -1]),
        origin=np.array([transform([0.5, 0, 0]), transform([0.0, 0, 0])]),
        kind=np.array([SLIDES, SLIDES]),
        axis=np.array([[1.0, 0, 0], [1.0, 0, 0]]),
        source=np.array([0, 0]),
        factor=np.array([1.0, 2.0]),
        offset=np.zeros(2),
    )
    parts = (Body("front", _cube("front"), 0), Body("back", _cube("back"), 1))
    problem = PathProblem(chain, parts, (), ((1, 0),))
    verdict = search(problem, [[0.0], [0.8]])
    assert verdict.first_contact is not None
    assert verdict.first_contact[0] <= 0.5 <= verdict.first_contact[1] + 1e-12
    assert verdict.first_contact[2] == ("back", "front")
    assert search(problem, [[0.0], [0.39]]).verdict == "clear"


def test_inside_from_the_start() -> None:
    """Surfaces never meet, yet the part is in the wall all the way."""
    inner = Body("inner", _cube("inner", 0.01), 0)
    problem = PathProblem(slider(), (inner,), (_at(_cube("wall", 1.0), 0.0),))
    verdict = search(problem, [[0.0], [0.2]])
    assert verdict.verdict == "contact"
    assert verdict.qualifiers == ("contained",)
    around = PathProblem(
        slider(),
        (Body("shell", _cube("shell", 1.0), 0),),
        (_at(_cube("in", 0.01), 0),),
    )
    assert search(around, [[0.0], [0.2]]).qualifiers == ("contained",)


def test_inside_after_contact_of_another_pair() -> None:
    """A part breaks into a shell while another one touches, and is then inside."""
    small, long = _cube("small", 0.02), box("long", [0.7, 0.02, 0.02])
    parts = (
        Body("long", long.moved(transform([0.15, 1.0, 0])), 0),
        Body("small", small, 0),
    )
    shell = _at(_cube("shell", 0.4), 0.5)
    block = _at(_cube("block"), 0.5, 1.0)
    problem = PathProblem(slider(), parts, (block, shell))
    verdict = search(problem, [[0.0], [0.6], [-0.6], [0.6]])
    assert verdict.verdict == "contact"
    inside = 0.5 / 0.6 / 3.0  # the small part in the middle of the shell
    stretch = next(s for s in verdict.intervals if s.start <= inside <= s.end)
    assert stretch.verdict == "contact"


def test_open_surfaces_stay_unknown_unless_far() -> None:
    cup = _cube("cup", 1.0)
    cup = TriangleMesh("cup", cup.vertices, cup.triangles[:-2])
    part = Body("part", _cube("part", 0.01), 0)
    near = search(PathProblem(slider(), (part,), (_at(cup, 0.0),)), [[0.0], [0.2]])
    assert near.verdict == "unknown"
    assert "open" in near.reason
    far = search(PathProblem(slider(), (part,), (_at(cup, 3.0),)), [[0.0], [0.2]])
    assert far.verdict == "clear"


def test_a_limit_on_work_gives_unknown_with_the_reason() -> None:
    verdict = search(_two_cubes(0.5, 0.1), [[0.0], [1.0]], piece_limit=3)
    assert verdict.verdict in ("unknown", "contact")
    near_miss = _two_cubes(0.5, 0.1 + 1e-12)
    verdict = search(near_miss, [[0.0], [1.0]], piece_limit=100)
    assert verdict.verdict == "unknown"
    assert "gave up" in verdict.reason
    assert not verdict.certified


def test_standing_still() -> None:
    assert search(_two_cubes(0.5), [[0.0]]).verdict == "clear"
    assert search(_two_cubes(0.5), [[0.0], [0.0], [0.0]]).verdict == "clear"
    assert search(_two_cubes(0.05), [[0.0], [0.0]]).verdict == "contact"


def test_nothing_examined_is_not_clear() -> None:
    problem = PathProblem(slider(), (Body("part", _cube("part"), 0),), ())
    assert search(problem, [[0.0], [1.0]]).verdict == "unknown"


@pytest.mark.parametrize(
    ("waypoints", "words"),
    [([], "shape"), ([[0.0, 1.0]], None), ([[np.nan]], "not finite"), ([0.0], "shape")],
)
def test_waypoints_that_are_none(waypoints: list[object], words: str | None) -> None:
    if words is None:  # more numbers than joints are left alone
        assert search(_two_cubes(0.5), waypoints).verdict == "clear"
        return
    with pytest.raises(UsageError, match=words):
        search(_two_cubes(0.5), waypoints)


def test_beyond_the_rounding_bounds_is_refused() -> None:
    with pytest.raises(GeometryError, match="100 m"):
        search(_two_cubes(500.0), [[0.0], [1.0]])
    with pytest.raises(UsageError, match="margin"):
        _two_cubes(0.5, margin=-1.0)


@pytest.fixture(scope="module")
def study() -> ModuleType:
    return paths


def test_random_motions_against_dense_samples(study: ModuleType) -> None:
    """Never clear where a thousand times finer samples meet."""
    outcomes = study.run(STUDY_PATHS, seed=5)
    wrong = [name for name in outcomes if "WRONG" in name]
    assert wrong == []
    assert outcomes["clear"] > STUDY_PATHS // 4
    assert outcomes["contact"] > STUDY_PATHS // 4
    assert outcomes["contact that sparse samples miss"] > 0
    assert outcomes["unknown"] < STUDY_PATHS // 10


def test_every_reported_contact_is_there(study: ModuleType) -> None:
    """The pose at the end of the first stretch of contact meets, exactly."""
    rng = np.random.default_rng(6)
    seen = 0
    for _ in range(40):
        case = study.random_case(rng)
        verdict = search(case.problem, case.waypoints)
        if verdict.first_contact is None:
            continue
        start, end, names = verdict.first_contact
        pair = next(p for p in case.problem.pairs if p.names == names)
        times = np.array([start, end]) * (len(case.waypoints) - 1)
        q = np.column_stack(
            [np.interp(times, np.arange(len(case.waypoints)), c)
             for c in case.waypoints.T]
        )  # fmt: skip
        placed = study.placements(case.problem.chain, q)
        meets = []
        for T in placed:
            T_b = pair.standing.T_frame_mesh
            if pair.standing.frame >= 0:
                T_b = T[pair.standing.frame]
            near = pair.moving.tree.within(
                pair.standing.tree, T[pair.moving.frame], T_b, 1e-9
            )
            meets.append(near.verdict != "clear")
        assert any(meets)
        seen += 1
    assert seen > 10


# --- robots and scenes ---------------------------------------------------------------

# Two forward kinematics of some ten joints within two metres.
KINEMATICS_TOLERANCE = 1e-12


def test_the_chain_places_links_as_pinocchio_does(zerobot, rng) -> None:  # type: ignore[no-untyped-def]
    frame_of, chain = chain_of(zerobot)
    for q in zerobot.model.random_configurations(rng, 20):
        placed = chain.placed(chain.thetas(q))
        expected = zerobot.placements(q)
        for link, frame in frame_of.items():
            np.testing.assert_allclose(
                placed[frame], expected[link], atol=KINEMATICS_TOLERANCE
            )


def test_a_motion_of_zerobot_is_certified_and_verified(zerobot, ct_gantry) -> None:  # type: ignore[no-untyped-def]
    """From home a little way: clear, with a certificate that holds."""
    away = zerobot.home.copy()
    away[[0, 3, 4]] += (0.05, 0.2, 0.1)
    waypoints = np.array([zerobot.home, away])
    problem = path_problem(zerobot, ct_gantry)
    outcome = search(problem, waypoints)
    assert outcome.certified, outcome.reason
    assert outcome.counts["pairs"] > 60
    written = certificate(problem, waypoints, outcome)
    assert written is not None
    bodies = (*problem.parts, *problem.obstacles)
    surfaces = [(body.mesh.vertices, body.mesh.triangles) for body in bodies]
    assert verify(written, surfaces).problems == ()


def test_random_motions_of_zerobot_against_its_poses(zerobot, ct_gantry, rng) -> None:  # type: ignore[no-untyped-def]
    """No pose of a certified motion is anything but clear."""
    found = {"clear": 0, "contact": 0}
    for _ in range(6):
        goal = zerobot.model.random_configurations(rng, 1)[0]
        goal = zerobot.home + rng.choice([0.2, 1.0]) * (goal - zerobot.home)
        waypoints = np.array([zerobot.home, goal])
        verdict = check_path(zerobot, ct_gantry, waypoints)
        poses = dense_poses(waypoints, 15)
        seen = [check(zerobot, ct_gantry, q).verdict for q in poses]
        if verdict.certified:
            assert set(seen) == {"clear"}
        elif verdict.first_contact is not None:
            before = int(verdict.first_contact[0] * 14)
            assert "contact" not in seen[: before + 1]
        found[verdict.verdict] = found.get(verdict.verdict, 0) + 1
    assert found["clear"] > 0
    assert found["contact"] > 0


def dense_poses(waypoints: Array, count: int) -> Array:
    t = np.linspace(0.0, 1.0, count)[:, None]
    return (1.0 - t) * waypoints[0] + t * waypoints[-1]
