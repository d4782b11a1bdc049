"""A needle's corridor in a certificate: it holds as written, and not when changed."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.cli import main
from borecheck.core.se3 import axis_rotation, transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.certificate import (
    certificate,
    corridor_record,
    digest,
    statement,
    write_certificate,
)
from borecheck.motion.passage import Approach, Slabs
from borecheck.motion.problem import Body, Passage, PathProblem
from borecheck.motion.search import search
from borecheck.plans.corridor import SLACK, Corridor
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS
from borecheck.verify.check import verify
from borecheck.verify.passage import StatedCorridor
from borecheck.verify.reading import mesh_hash
from borecheck.verify.statement import Passage as StatedPassage

Array = NDArray[np.float64]
Document = dict[str, Any]

RADIUS = 0.0007  # half a millimetre square, from its middle to a corner
LENGTH = 0.05
CORRIDOR = Corridor(np.zeros(3), np.array([0.0, 0.0, -LENGTH]), RADIUS)
# A stand-off, the entry, the target; with a small tilt about a point above the tip.
WAYPOINTS = np.array([[0.03, 0.02], [1e-4, 0.0], [-LENGTH, 0.005]])


def _block(low: Any, high: Any) -> TriangleMesh:
    low, high = np.array(low), np.array(high)
    return box("block", high - low).moved(transform((low + high) / 2))


def _joined(name: str, *parts: TriangleMesh) -> TriangleMesh:
    starts = np.cumsum([0, *(len(p.vertices) for p in parts)])
    triangles = [p.triangles + s for p, s in zip(parts, starts[:-1], strict=True)]
    vertices = np.concatenate([p.vertices for p in parts])
    return TriangleMesh(name, vertices, np.concatenate(triangles))


BODY = _block([-0.2, -0.2, -0.2], [0.2, 0.2, 0.0])
FOLD = _block([0.01, -0.05, 0.0], [0.1, 0.05, 0.02])
NEEDLE = _block([-5e-4, -5e-4, 0.0], [5e-4, 5e-4, 0.12])
HOLDER = _block([-0.01, -0.01, 0.1], [0.01, 0.01, 0.12])


@pytest.fixture(scope="module")
def problem() -> PathProblem:
    chain = JointChain(
        parent=np.array([-1, 0]),
        origin=np.array([np.eye(4), transform([0, 0, 0.02])]),
        kind=np.array([SLIDES, TURNS]),
        axis=np.array([[0.0, 0, 1], [0, 1, 0]]),
        source=np.array([0, 1]),
        factor=np.ones(2),
        offset=np.zeros(2),
    )
    down = transform([0, 0, -0.02])
    parts = (
        Body("needle", NEEDLE.moved(down), 1),
        Body("holder", HOLDER.moved(down), 1),
    )
    obstacles = (Body("body", _joined("body", BODY, FOLD), role="patient"),)
    return PathProblem(chain, parts, obstacles, passages=(Passage(0, 0, CORRIDOR),))


@pytest.fixture(scope="module")
def document(problem: PathProblem) -> Document:
    outcome = search(problem, WAYPOINTS)
    assert outcome.verdict == "clear", outcome.reason
    about = {"plan": {"name": "liver", **corridor_record(CORRIDOR)}}
    written = certificate(problem, WAYPOINTS, outcome, about)
    assert written is not None
    assert len(written["passages"][0]["intervals"]) > 8
    return written


@pytest.fixture(scope="module")
def meshes(problem: PathProblem) -> list[Any]:
    bodies = (*problem.parts, *problem.obstacles)
    return [(body.mesh.vertices, body.mesh.triangles) for body in bodies]


def test_it_holds_and_says_what_is_allowed(
    document: Document, meshes: list[Any]
) -> None:
    found = verify(document, meshes)
    assert found.accepted, found.problems
    assert found.pairs == 2
    assert found.not_covered == ()
    assert found.passages == (
        "needle in body from (0.0, 0.0, 0.0) to (0.0, 0.0, -50.0) mm, "
        "2.70 mm beside it and 2 mm beyond its ends; "
        "asked for waypoints 1 to 2, plainly clear of it elsewhere",
    )


def test_the_command_names_the_corridor(
    document: Document,
    problem: PathProblem,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / "plan.json"
    write_certificate(file, document, problem)
    assert main(["verify", str(file)]) == 0
    told = capsys.readouterr().out
    assert "ACCEPTED" in told
    assert "allowed: needle in body from (0.0, 0.0, 0.0)" in told
    assert main(["verify", str(file), "--format", "json"]) == 0
    stated = json.loads(capsys.readouterr().out)
    assert len(stated["passages"]) == 1
    assert stated["not_covered"] == []


def _passage(d: Document) -> dict[str, Any]:
    record: dict[str, Any] = d["passages"][0]
    return record


def _beside(d: Document) -> list[list[float]]:
    rows: list[list[float]] = _passage(d)["beside"]["intervals"]
    return rows


def _as_beside(row: list[float], clearance: float = 1.0) -> list[float]:
    """What is in the corridor, as if it were plainly clear of the patient."""
    return [*row[:3], clearance, row[3]]


def _beside_in_the_patient(d: Document) -> None:
    """The needle in its corridor is said to be far from the patient."""
    _beside(d).append(_as_beside(_passage(d)["intervals"].pop()))


def _all_beside(d: Document) -> None:
    rows = _passage(d)["intervals"]
    _passage(d)["intervals"] = []
    _beside(d).extend(_as_beside(row, row[3] + 1e-6) for row in rows)


def _beside_for_within(d: Document) -> None:
    """An interval of either list is stated in the other one, columns and all."""
    rows, others = _passage(d)["intervals"], _beside(d)
    rows[0], others[0] = others[0], rows[0]


def _beside_as_corridor(d: Document) -> None:
    """The way beside, tilted, is said to keep to the corridor."""
    row = _beside(d).pop(0)
    _passage(d)["intervals"].insert(0, [*row[:3], row[4]])
    d["waypoints"][0][1] = 1.5


def _times_swapped(d: Document) -> None:
    """Each list keeps its numbers, but speaks of the other's times."""
    first, second = _beside(d)[-1], _passage(d)["intervals"][0]
    first[:3], second[:3] = second[:3], first[:3]


def _gap_between_lists(d: Document) -> None:
    del _beside(d)[-1]


def _overlapping_lists(d: Document) -> None:
    _beside(d)[-1][1] += 1e-3


def _farther_beside(d: Document) -> None:
    _beside(d)[0][3] += 0.1


def _moves_less_beside(d: Document) -> None:
    _beside(d)[0][4] *= 0.9


def _greater_margin(d: Document) -> None:
    """What was shown without a margin is stated with one."""
    d["margin_m"] = 5e-3
    for pair in d["pairs"]:
        pair["margin_m"] = 5e-3


def _nothing_at_all(d: Document) -> None:
    _passage(d)["intervals"] = []
    _beside(d).clear()


def _margin_aside_of_the_line(d: Document) -> None:
    """The corridor's question alone, of a needle that is nearer than the margin."""
    d["waypoints"] = [[0.03, 0.2], [0.02, 0.2], [0.02, 0.2]]
    d["margin_m"] = 0.05
    d["pairs"][0] |= {"margin_m": 0.05, "intervals": [[0.0, 2.0, 1.0, 0.08, 0.02]]}
    _beside(d).clear()
    _passage(d)["intervals"] = [[0.0, 2.0, 1.0, 0.02]]


def _beside_is_none(d: Document) -> None:
    _passage(d)["beside"] = None


def _no_passage(d: Document) -> None:
    d["passages"] = []


def _one_interval_less(d: Document) -> None:
    del _passage(d)["intervals"][3]


def _first_for_all(d: Document) -> None:
    _passage(d)["intervals"] = [[0.0, 2.0, 1.0, 10.0]]


def _small_displacement(d: Document) -> None:
    _passage(d)["intervals"][2][3] *= 0.9


def _later_instant(d: Document) -> None:
    row = _passage(d)["intervals"][-1]
    row[2] = row[1]


def _narrow(d: Document) -> None:
    _passage(d)["slack_m"] = 1e-4


def _shallow(d: Document) -> None:
    _passage(d)["target"][2] += 3e-3


def _aside(d: Document) -> None:
    for end in ("entry", "target"):
        _passage(d)[end][0] += 3e-3


def _deep_entry(d: Document) -> None:
    _passage(d)["entry"][2] -= 3e-3


def _no_length(d: Document) -> None:
    _passage(d)["target"] = _passage(d)["entry"]


def _negative(d: Document) -> None:
    _passage(d)["radius_m"] = -1.0


def _no_number(d: Document) -> None:
    _passage(d)["intervals"][0][3] = float("nan")


def _of_two_parts(d: Document) -> None:
    _passage(d)["standing"] = 1


def _other_waypoint(d: Document) -> None:
    d["waypoints"][2][1] = 0.2


def _deeper(d: Document) -> None:
    d["waypoints"][2][0] -= 3e-3


def _patient_moved(d: Document) -> None:
    d["bodies"][2]["T_frame_mesh"][0][3] = -0.01


def _patient_around(d: Document) -> None:
    d["bodies"][2]["T_frame_mesh"][2][3] = 0.19


CHANGES = [
    _no_passage, _one_interval_less, _first_for_all, _small_displacement,
    _later_instant, _narrow, _shallow, _aside, _deep_entry, _no_length, _negative,
    _no_number, _of_two_parts, _other_waypoint, _deeper, _patient_moved,
    _patient_around, _beside_in_the_patient, _all_beside,
    _beside_for_within, _beside_as_corridor, _times_swapped, _gap_between_lists,
    _overlapping_lists, _farther_beside, _moves_less_beside, _greater_margin,
    _nothing_at_all, _beside_is_none, _margin_aside_of_the_line,
]  # fmt: skip


@pytest.mark.parametrize("change", CHANGES, ids=lambda c: c.__name__.strip("_"))
def test_any_change_is_rejected(
    change: Callable[[Document], None], document: Document, meshes: list[Any]
) -> None:
    changed = copy.deepcopy(document)
    change(changed)
    content = {name: value for name, value in changed.items() if name != "sha256"}
    changed["sha256"] = digest(content)
    found = verify(changed, meshes)
    assert not found.accepted
    assert all("does not have the hash" not in text for text in found.problems)


def _tilts_in_the_patient(d: Document) -> None:
    """From the target it swings aside, and that is said to be in the corridor."""
    d["waypoints"].append([-LENGTH, 0.3])
    _passage(d)["intervals"].append([2.0, 3.0, 2.5, 0.1])


def _tilts_beside_the_patient(d: Document) -> None:
    """The same, and it is said to be far from the patient."""
    d["waypoints"].append([-LENGTH, 0.3])
    _beside(d).append([2.0, 3.0, 2.5, 0.5, 0.1])


def _wider(d: Document) -> None:
    """So wide that the swing would be in it; path and passage agree about that."""
    _tilts_in_the_patient(d)
    for record in (_passage(d), d["about"]["corridor"]):
        record["radius_m"] = 5e-3


def _lists_exchanged(d: Document) -> None:
    """Each interval is stated in the other list, with numbers of its columns."""
    within, beside = _passage(d)["intervals"], list(_beside(d))
    _passage(d)["intervals"] = [[*row[:3], row[4]] for row in beside]
    _beside(d)[:] = [_as_beside(row, row[3] + 1e-6) for row in within]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (_tilts_in_the_patient, "2 to 3: needle may be"),
        (_tilts_beside_the_patient, "2 to 3: the surfaces are nearer than"),
        (_wider, "2 to 3: needle may be"),
        (_lists_exchanged, "needle may meet it before the entry"),
        (_beside_in_the_patient, "1.9375 to 2: the surfaces are nearer than"),
        (_all_beside, "1 to 1.0625: the surfaces are nearer than"),
    ],
    ids=lambda given: getattr(given, "__name__", "").strip("_"),
)
def test_which_of_both_is_named_is_no_evidence(
    change: Callable[[Document], None],
    why: str,
    problem: PathProblem,
    meshes: list[Any],
) -> None:
    """A path's needle alone: what is wrong is the passage, and that is said."""
    alone = PathProblem(
        problem.chain, problem.parts[:1], problem.obstacles, passages=problem.passages
    )
    about = {"corridor": corridor_record(CORRIDOR)}
    found = search(alone, WAYPOINTS)
    written = certificate(alone, WAYPOINTS, found, about)
    assert written is not None
    assert verify(written, meshes).accepted
    changed = copy.deepcopy(written)
    change(changed)
    content = {name: value for name, value in changed.items() if name != "sha256"}
    problems = verify({**content, "sha256": digest(content)}, meshes).problems
    assert len(problems) == 1
    assert why in problems[0]


def test_a_corridor_as_wide_as_a_needle_may_be_is_not_this_needles(
    problem: PathProblem, meshes: list[Any]
) -> None:
    """From before the entry it goes in aside of its line: by one interval's length."""
    alone = PathProblem(
        problem.chain, problem.parts[:1], problem.obstacles, passages=problem.passages
    )
    written = statement(
        alone, [[0.0021, 0.0], [-0.0015, 0.0]], {"corridor": corridor_record(CORRIDOR)}
    )
    for name, radius in (("its own", RADIUS), ("a wider", 5e-3)):
        changed = copy.deepcopy(written)
        for record in (_passage(changed), changed["about"]["corridor"]):
            record["radius_m"] = radius
        _passage(changed)["intervals"] = [[0.0, 1.0, 0.0, 3.6e-3]]
        content = {**changed, "sha256": digest(changed)}
        (problem_text,) = verify(content, meshes).problems
        why = "aside of its corridor" if radius == RADIUS else "needle only 0.707 mm"
        assert why in problem_text, name


def test_a_needle_held_by_the_patient_is_not_beside_it(
    document: Document, meshes: list[Any]
) -> None:
    """Surfaces far apart, distances true: one of a hollow body's shells holds it."""
    shell = _block([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0])
    changed = copy.deepcopy(document)
    whole = [[0.0, 2.0, 1.0, 0.7, 0.2]]
    record = _passage(changed)
    record["intervals"], record["beside"]["intervals"] = [], whole
    changed["pairs"][0]["intervals"] = whole
    patient = (shell.vertices, shell.triangles)
    changed["bodies"][2]["mesh_sha256"] = mesh_hash(*patient)
    content = {name: value for name, value in changed.items() if name != "sha256"}
    found = verify({**content, "sha256": digest(content)}, [*meshes, patient])
    assert found.problems == (
        "holder and body: holder is inside body",
        "needle and body: needle is inside body",
    )


def test_what_holds_without_a_list_beside_holds(
    problem: PathProblem, meshes: list[Any]
) -> None:
    """As certificates without it state: all of the motion by its corridor."""
    within = WAYPOINTS[1:]
    about = {"plan": {"name": "liver", **corridor_record(CORRIDOR)}}
    written = certificate(problem, within, search(problem, within), about)
    assert written is not None
    assert written["passages"][0].pop("beside")["intervals"] == []
    content = {name: value for name, value in written.items() if name != "sha256"}
    found = verify({**content, "sha256": digest(content)}, meshes)
    assert found.accepted, found.problems
    assert "beyond its ends" in found.passages[0]
    assert "asked for" not in found.passages[0]


def _named(problem: PathProblem, plan: dict[str, Any] | None) -> Document:
    """A certificate that also says what it is called."""
    about: dict[str, Any] = {} if plan is None else {"plan": plan}
    outcome = search(problem, WAYPOINTS)
    written = certificate(problem, WAYPOINTS, outcome, about)
    assert written is not None
    return written


def test_contact_is_allowed_in_the_named_plans_corridor_only(
    problem: PathProblem, meshes: list[Any]
) -> None:
    """A wider, deeper, shifted or missing plan does not stand for this corridor."""
    plan = {"name": "liver", **corridor_record(CORRIDOR)}
    assert verify(_named(problem, plan), meshes).accepted
    others: list[dict[str, Any]] = [
        {**plan, "radius_m": 2.0 * RADIUS},
        {**plan, "slack_m": 0.0},
        {**plan, "target": [0.0, 0.0, -LENGTH - 1e-9]},
        {**plan, "entry": [1e-9, 0.0, 0.0]},
    ]
    for other in others:
        problems = verify(_named(problem, other), meshes).problems
        assert problems == ("the corridor is not that of the plan 'liver'",)
    nameless = verify(_named(problem, None), meshes)
    assert nameless.problems == (
        "needle and body: it allows contact, but names no needle plan or corridor",
    )


@pytest.mark.parametrize("about", [[], "liver", {"plan": {}}, {"plan": "liver"}])
def test_names_that_are_none_are_rejected(
    about: Any, document: Document, meshes: list[Any]
) -> None:
    content = {k: v for k, v in document.items() if k != "sha256"} | {"about": about}
    assert not verify({**content, "sha256": digest(content)}, meshes).accepted


def _wide(d: Document) -> None:
    d["radius_m"] = 1.5 * RADIUS


def _loose(d: Document) -> None:
    d["slack_m"] = 3e-3


def _thick(d: Document) -> None:
    d["radius_m"] = 6e-3


@pytest.mark.parametrize("change", [_wide, _loose, _thick])
def test_a_corridor_is_no_wider_than_the_needle(
    change: Callable[[Document], None], document: Document, meshes: list[Any]
) -> None:
    """Even if the plan says so, too: an arm is no needle, and a bore no corridor."""
    changed = copy.deepcopy(document)
    for record in (_passage(changed), changed["about"]["plan"]):
        change(record)
    content = {name: value for name, value in changed.items() if name != "sha256"}
    found = verify({**content, "sha256": digest(content)}, meshes)
    assert not found.accepted
    assert all("corridor is" in text for text in found.problems)


@pytest.mark.parametrize("role", ["scanner", "other", "couch", "robot"])
def test_contact_is_allowed_with_a_patient_alone(
    role: str, document: Document, meshes: list[Any]
) -> None:
    changed = copy.deepcopy(document)
    changed["bodies"][2]["role"] = role
    content = {name: value for name, value in changed.items() if name != "sha256"}
    assert not verify({**content, "sha256": digest(content)}, meshes).accepted


def test_both_sides_agree_about_random_needles(rng: np.random.Generator) -> None:
    """What the writer allows the verifier does, but for a hair at the borders."""
    fold = _block([0.002, -0.05, 0.004], [0.1, 0.05, 0.02])
    patient = Body("body", _joined("body", BODY, fold))
    count = {True: 0, False: 0}
    for _ in range(150):
        direction = np.array([*rng.uniform(-0.6, 0.6, 2), -1.0])
        target = LENGTH * direction / np.linalg.norm(direction)
        corridor = Corridor(np.zeros(3), target, RADIUS)
        x = np.array([*rng.uniform(-1.0, 1.0, 2), 0.0])
        R = axis_rotation(x / np.linalg.norm(x), np.linalg.norm(x) * 0.02)
        upright = np.column_stack(
            [
                *np.linalg.qr(np.column_stack([target, np.eye(3)[:, :2]]))[0].T[1:],
                -corridor.direction,
            ]
        )
        corners = NEEDLE.corners @ (R @ upright).T + rng.uniform(0.1, 1.02) * target
        grow = rng.uniform(0.0, 5e-4)
        flat = corners.reshape(-1, 3)
        depth, aside = (c.reshape(1, -1, 3) for c in corridor.coordinates(flat))
        allowed = Approach(patient, corridor).allows(Slabs.of(depth, aside, grow))
        passage = StatedPassage(0, 1, np.zeros(3), target, RADIUS, SLACK, np.empty(0))
        stated = StatedCorridor(passage, patient.mesh.corners)
        assert allowed == (stated.why_not(corners, grow) == "")
        count[allowed] += 1
    assert min(count.values()) > 20
