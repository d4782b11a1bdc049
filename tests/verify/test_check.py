"""Certificates hold as written, and no longer once anything in them is changed."""

import ast
import copy
import json
import os
import sys
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.core.se3 import axis_rotation, transform
from borecheck.errors import BorecheckError
from borecheck.geometry.mesh.primitives import box, sphere
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.certificate import (
    certificate,
    digest,
    holds_certified_meshes,
    write_certificate,
)
from borecheck.motion.problem import Body, PathProblem, path_motion
from borecheck.motion.search import search
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS
from borecheck.verify import chain as certificate_chain
from borecheck.verify import check as certificate_check
from borecheck.verify import distance as certificate_distance
from borecheck.verify.check import verify
from borecheck.verify.distance import GroupedMesh
from borecheck.verify.read_statement import read_statement
from borecheck.verify.reading import mesh_hash, read_meshes
from borecheck.verify.solid import connected_corners, is_closed, winding
from tests.places import PROJECT

Array = NDArray[np.float64]
Document = dict[str, Any]

WAYPOINTS = np.array([[-0.8, 0.0], [0.2, 0.05], [0.9, 0.0]])


def _problem() -> PathProblem:
    """A hinge with a mimic slider on it, swinging two bars past a ball."""
    chain = JointChain(
        parent=np.array([-1, 0, 1]),
        origin=np.array([transform([0, 0, 0.1]), np.eye(4), transform([0.27, 0, 0])]),
        kind=np.array([TURNS, SLIDES, SLIDES]),
        axis=np.array([[0, 0, 1.0], [1.0, 0, 0], [0, 0, 1.0]]),
        source=np.array([0, 1, 1]),
        factor=np.array([1.0, 1.0, -0.5]),
        offset=np.zeros(3),
    )
    bar = box("bar", [0.2, 0.02, 0.02])
    parts = (
        Body("bar", bar.moved(transform([0.1, 0, 0])), 0),
        Body("tip", box("tip", [0.1, 0.01, 0.01]), 2),
    )
    ball = Body("ball", sphere("ball", 0.1), T_frame_mesh=transform([0.515, 0, 0.1]))
    return PathProblem(chain, parts, (ball,), ((1, 0),), margin=0.02)


@pytest.fixture(scope="module")
def problem() -> PathProblem:
    return _problem()


@pytest.fixture(scope="module")
def document(problem: PathProblem) -> Document:
    outcome = search(problem, WAYPOINTS)
    assert outcome.verdict == "clear", outcome.reason
    written = certificate(problem, WAYPOINTS, outcome)
    assert written is not None
    assert len(_most(written)) > 4
    return written


@pytest.fixture(scope="module")
def meshes(problem: PathProblem) -> list[tuple[Array, NDArray[np.int64]]]:
    bodies = (*problem.parts, *problem.obstacles)
    return [(body.mesh.vertices, body.mesh.triangles) for body in bodies]


def test_it_holds_as_written(document: Document, meshes: list[Any]) -> None:
    found = verify(document, meshes)
    assert found.problems == ()
    assert found.accepted
    assert found.pairs == 3
    assert found.intervals == sum(len(p["intervals"]) for p in document["pairs"])


def test_it_holds_read_from_a_file(
    tmp_path: Path, document: Document, problem: PathProblem
) -> None:
    file = tmp_path / "path.json"
    write_certificate(file, document, problem)
    assert verify(file).accepted
    file.with_suffix(".npz").unlink()
    assert not verify(file).accepted
    assert not verify(tmp_path / "none.json").accepted


def _most(document: Document) -> list[list[float]]:
    """The intervals of the pair that needs most of them."""
    return max((pair["intervals"] for pair in document["pairs"]), key=len)


def _remove_one(document: Document) -> None:
    del _most(document)[1]


def _widen(document: Document) -> None:
    intervals = _most(document)
    intervals[1][1] = intervals[2][1]
    del intervals[2]


def _overlap(document: Document) -> None:
    _most(document)[1][0] -= 1e-3


def _shift_in_time(document: Document) -> None:
    row = _most(document)[1]
    row[2] = row[0]


def _claim_more_clearance(document: Document) -> None:
    _most(document)[1][3] += 0.5


def _claim_less_displacement(document: Document) -> None:
    _most(document)[1][4] *= 0.9


def _rehash(document: Document) -> None:
    document["bodies"][0]["mesh_sha256"] = "0" * 64


def _drop_a_pair(document: Document) -> None:
    del document["pairs"][0]


def _cut_the_path(document: Document) -> None:
    document["waypoints"].append([2.0, 0.0])


def _move_a_waypoint(document: Document) -> None:
    document["waypoints"][1][0] = 1.5


def _lengthen_the_arm(document: Document) -> None:
    document["chain"][2]["origin"][0][3] += 0.1


def _turn_the_mimic(document: Document) -> None:
    document["chain"][2]["factor"] = -8.0


def _shrink_the_margin(document: Document) -> None:
    document["pairs"][0]["margin_m"] = 0.0


def _raise_the_margin(document: Document) -> None:
    document["margin_m"] = 0.2


def _not_a_number(document: Document) -> None:
    _most(document)[0][3] = float("nan")


def _no_pairs(document: Document) -> None:
    document["pairs"] = []


def _no_field(document: Document) -> None:
    del document["chain"]


def _move_the_ball(document: Document) -> None:
    document["bodies"][2]["T_frame_mesh"][0][3] -= 0.05


CHANGES = [
    _remove_one, _widen, _overlap, _shift_in_time, _claim_more_clearance,
    _claim_less_displacement, _rehash, _drop_a_pair, _cut_the_path,
    _move_a_waypoint, _lengthen_the_arm, _turn_the_mimic, _shrink_the_margin,
    _raise_the_margin, _not_a_number, _no_pairs, _no_field, _move_the_ball,
]  # fmt: skip


@pytest.mark.parametrize("change", CHANGES, ids=lambda c: c.__name__.strip("_"))
def test_any_change_is_rejected(
    change: Callable[[Document], None], document: Document, meshes: list[Any]
) -> None:
    """Even by someone who writes a fresh hash over the changed content."""
    changed = copy.deepcopy(document)
    change(changed)
    assert not verify(changed, meshes).accepted
    content = {name: value for name, value in changed.items() if name != "sha256"}
    changed["sha256"] = digest(content)
    found = verify(changed, meshes)
    assert not found.accepted
    assert found.problems
    assert all("does not have the hash" not in text for text in found.problems)


def test_other_meshes_are_rejected(document: Document, meshes: list[Any]) -> None:
    vertices, triangles = meshes[0]
    moved = vertices.copy()
    moved[0, 0] += 1e-9
    assert not verify(document, [(moved, triangles), *meshes[1:]]).accepted
    assert not verify(document, []).accepted
    assert not verify({"format": "something"}, meshes).accepted
    earlier = {**document, "format_version": 1}
    assert "version 2" in verify(earlier, meshes).problems[0]


def test_a_false_claim_is_answered_at_once(
    document: Document, meshes: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clearances of a kilometre let no box drop out; few triangles are measured."""
    measured = []
    real = certificate_distance.may_be_nearer

    def counted(first: Array, second: Array, distance: float) -> NDArray[np.bool_]:
        measured.append(len(first))
        return real(first, second, distance)

    monkeypatch.setattr(certificate_distance, "may_be_nearer", counted)
    changed = copy.deepcopy(document)
    for record in changed["pairs"]:
        for row in record["intervals"]:
            row[3:] = [1000.0, 900.0]
    content = {name: value for name, value in changed.items() if name != "sha256"}
    found = verify({**content, "sha256": digest(content)}, meshes)
    assert len(found.problems) == 3
    assert sum(measured) == 0
    assert verify(document, meshes).accepted
    assert sum(measured) > 0


CERTIFICATES = PROJECT / "tests" / "data" / "cases"


@pytest.mark.parametrize(
    ("case", "saying"),
    [
        ("cert_excluded_all", "arm and gantry: not examined"),
        ("cert_nan_placement", "factor is no number from -1000 to 1000"),
        ("cert_negative_margin", "margin_m is no number from 0"),
        ("cert_part_count_0", "part_count is no whole number from 1"),
        ("cert_passage_no_about", "the corridor is wider than a needle's"),
        ("cert_spoof_rejected", "the surfaces are nearer than 5.000e+00 m"),
    ],
)
def test_forged_ones_of_version_1_are_refused_in_version_2(
    case: str, saying: str
) -> None:
    """They touch, and were accepted; here they are told in the words of today."""
    file = CERTIFICATES / case / "c.json"
    old = json.loads(file.read_text())
    meshes = read_meshes(file.with_suffix(".npz")).values()
    hashed = {sha256(v.tobytes() + t.tobytes()).hexdigest(): (v, t) for v, t in meshes}
    new = {k: v for k, v in old.items() if k not in ("excluded", "sha256")}
    new |= {"format_version": 2, "allowed": [], "versions": {}}
    for k, body in enumerate(new["bodies"]):
        body["role"] = "robot" if k < max(new["part_count"], 1) else "patient"
        body["mesh_sha256"] = mesh_hash(*hashed[body["mesh_sha256"]])
    for record in new["pairs"]:
        record["columns"] = ["from", "to", "at", "clearance_m", "displacement_m"]
    for record in new.setdefault("passages", []):
        record["columns"] = ["from", "to", "at", "displacement_m"]
        corridor = {n: record[n] for n in ("entry", "target", "radius_m", "slack_m")}
        new["about"] = {"plan": {"name": "liver", **corridor}}
    found = verify({**new, "sha256": digest(new)}, hashed)
    assert not found.accepted
    assert any(saying in text for text in found.problems), found.problems


def test_a_solid_inside_another_is_rejected(meshes: list[Any]) -> None:
    """The surfaces are far from each other, and no motion."""
    inner = Body("inner", box("inner", [0.01] * 3), 0)
    outer = Body("outer", box("outer", [1.0] * 3))
    chain = _problem().chain
    problem = PathProblem(chain, (inner,), (outer,))
    q = np.zeros((2, 2))
    outside = Body("outer", outer.mesh, T_frame_mesh=transform([2.0, 0, 0]))
    clear = PathProblem(chain, (inner,), (outside,))
    written = certificate(clear, q, search(clear, q))
    assert written is not None
    surfaces = [(b.mesh.vertices, b.mesh.triangles) for b in (inner, outer)]
    assert verify(written, surfaces).accepted
    written["bodies"][1]["T_frame_mesh"] = np.eye(4).tolist()
    written["sha256"] = digest({k: v for k, v in written.items() if k != "sha256"})
    found = verify(written, surfaces)
    assert any("inside" in text for text in found.problems)
    assert certificate(problem, q, search(problem, q)) is None


def test_open_surfaces_get_no_certificate() -> None:
    cup = box("cup", [0.1] * 3)
    open_cup = TriangleMesh("cup", cup.vertices, cup.triangles[2:])
    part = Body("part", box("part", [0.01] * 3), 0)
    far = Body("cup", open_cup, T_frame_mesh=transform([5, 0, 0]))
    problem = PathProblem(_problem().chain, (part,), (far,))
    q = np.zeros((2, 2))
    outcome = search(problem, q)
    assert outcome.verdict == "clear"
    assert certificate(problem, q, outcome) is None


def test_no_code_is_shared_with_the_search() -> None:
    """Only numpy, the standard library and its own modules."""
    assert certificate_check.__file__ is not None
    files = sorted(Path(certificate_check.__file__).parent.glob("*.py"))
    assert len(files) > 6
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [str(node.module)]
            for name in names:
                is_own = name.startswith("borecheck.verify.")
                assert is_own or name.split(".")[0] in {
                    "numpy",
                    *sys.stdlib_module_names,
                }


def test_the_certificate_is_plain_json(document: Document, meshes: list[Any]) -> None:
    again = json.loads(json.dumps(document))
    assert again == document
    assert verify(again, meshes).accepted


def test_its_kinematics_are_those_of_the_chain(
    document: Document, meshes: list[Any], problem: PathProblem
) -> None:
    """Placements and joint values derived twice."""
    chain = read_statement(document, read_meshes(meshes)).chain
    motion = path_motion(problem, WAYPOINTS)
    for time in (0.0, 0.37, 1.0, 1.62, 2.0):
        values = chain.at(time)
        np.testing.assert_allclose(values, motion.joints_at(time), atol=1e-15)
        placed = motion.place(problem.chain, time)
        np.testing.assert_allclose(chain.placements(time), placed, atol=1e-14)


@pytest.mark.parametrize("angle", [-2.0, -0.3, 0.0, 0.4, 3.0])
def test_turns_follow_the_right_hand_rule(angle: float) -> None:
    rng = np.random.default_rng(8)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    joint = certificate_chain.Joint(-1, np.eye(4), "turns", axis, 0, 1.0, 0.0)
    R = certificate_chain.motion(joint, angle)[:3, :3]
    np.testing.assert_allclose(R, axis_rotation(axis, angle), atol=1e-15)


def test_winding_and_parts() -> None:
    a, b = sphere("a", 0.1), sphere("b", 0.1).moved(transform([1.0, 0, 0]))
    both_vertices = np.concatenate([a.vertices, b.vertices])
    both = np.concatenate([a.triangles, b.triangles + len(a.vertices)])
    assert is_closed(both_vertices, both)
    assert not is_closed(both_vertices, both[1:])
    corners = connected_corners(both_vertices, both)
    assert len(corners) == 2
    assert abs(corners[0, 0] - corners[1, 0]) > 0.5
    triangles = GroupedMesh(both_vertices, both).corners
    for place, expected in ((0.0, 1), (1.0, 1), (0.5, 0)):
        point = np.array([place, 0.01, 0.02])
        assert round(winding(point, triangles), 9) == expected


@pytest.mark.parametrize("cause", [KeyboardInterrupt, OSError])
@pytest.mark.parametrize("moment", [1, 2, 3, 4])
def test_an_interrupted_write_leaves_no_half_beside_another(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    document: Document,
    problem: PathProblem,
    moment: int,
    cause: type[BaseException],
) -> None:
    """Stopped at any of its file operations: the old pair is there, or nothing."""
    file = tmp_path / "path.json"
    write_certificate(file, document, problem)
    before = _contents(tmp_path)
    assert set(before) == {"path.json", "path.npz"}
    calls = 0

    def stopped(real: Callable[..., Any]) -> Callable[..., Any]:
        def operation(*args: Any, **kwargs: Any) -> Any:
            nonlocal calls
            calls += 1
            if calls == moment:
                raise cause("stopped")
            return real(*args, **kwargs)

        return operation

    with monkeypatch.context() as patched:
        patched.setattr(os, "open", stopped(os.open))
        patched.setattr(Path, "replace", stopped(Path.replace))
        with pytest.raises((KeyboardInterrupt, BorecheckError)):
            write_certificate(file, {**document, "margin_m": 0.0}, problem)
    assert calls == moment
    assert _contents(tmp_path) == (before if moment <= 2 else {})


def test_a_new_pair_replaces_the_old_one(
    tmp_path: Path, document: Document, problem: PathProblem
) -> None:
    file = tmp_path / "path.json"
    file.write_text("old")
    file.with_suffix(".npz").write_bytes(b"old")
    assert not holds_certified_meshes(file.with_suffix(".npz"))
    write_certificate(file, document, problem)
    assert verify(file).accepted
    assert holds_certified_meshes(file.with_suffix(".npz"))
    assert set(_contents(tmp_path)) == {"path.json", "path.npz"}


def _contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}
