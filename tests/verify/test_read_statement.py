"""What a certificate may state: every field at its borders, in a document by hand."""

import copy
from typing import Any

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.motion.certificate import digest
from borecheck.verify.distance import GroupedMesh
from borecheck.verify.fields import Rejected
from borecheck.verify.read_statement import check_frame, read_statement
from borecheck.verify.reading import mesh_hash, read_meshes
from borecheck.verify.statement import Statement, Surface

Document = dict[str, Any]

CUBE = box("cube", [0.1] * 3)
HASH = mesh_hash(CUBE.vertices, CUBE.triangles)
MESHES = read_meshes([(CUBE.vertices, CUBE.triangles)])
CORRIDOR = {
    "entry": [0.0, 0.0, 0.1],
    "target": [0.0, 0.0, 0.05],
    "radius_m": 0.001,
    "slack_m": 0.002,
}


def _joint(kind: str, parent: int, source: int) -> Document:
    return {
        "parent": parent,
        "origin": np.eye(4).tolist(),
        "kind": kind,
        "axis": [0.0, 0.0, 1.0],
        "source": source,
        "factor": 1.0,
        "offset": 0.0,
    }


def _body(name: str, role: str, frame: int) -> Document:
    placed = {"name": name, "role": role, "frame": frame}
    return {**placed, "T_frame_mesh": np.eye(4).tolist(), "mesh_sha256": HASH}


PAIR = {
    "moving": 0,
    "standing": 2,
    "margin_m": 0.01,
    "columns": ["from", "to", "at", "clearance_m", "displacement_m"],
    "intervals": [[0.0, 1.0, 0.5, 0.3, 0.2]],
}
PASSAGE = {
    "moving": 1,
    "standing": 3,
    **CORRIDOR,
    "columns": ["from", "to", "at", "displacement_m"],
    "intervals": [[0.0, 1.0, 0.5, 0.2]],
}
DOCUMENT: Document = {
    "format": "borecheck path certificate",
    "format_version": 2,
    "versions": {"borecheck": "1"},
    "waypoints": [[0.0, 0.1], [0.5, 0.2], [0.7, 0.1]],
    "margin_m": 0.01,
    "chain": [_joint("turns", -1, 0), _joint("slides", 0, 1), _joint("fixed", 1, -1)],
    "bodies": [
        *(_body("arm", "robot", 0), _body("hand", "robot", 2)),
        *(_body("bore", "scanner", -1), _body("man", "patient", -1)),
    ],
    "part_count": 2,
    "pairs": [PAIR],
    "passages": [PASSAGE],
    "allowed": [{"first": 0, "second": 1, "reason": "Adjacent"}],
    "about": {
        "robot": {"name": "arm", "arguments": {"a": "b"}, "urdf_sha256": "0"},
        "scene": {"name": "bore", "arguments": {}},
        "plan": {"name": "liver", **CORRIDOR},
    },
}


def changed(*path: Any, to: Any) -> Document:
    """The document with one value in the place of another; None takes it out."""
    made = copy.deepcopy(DOCUMENT)
    place: Any = made
    for step in path[:-1]:
        place = place[step]
    if to is None:
        del place[path[-1]]
    else:
        place[path[-1]] = to
    return made


def read(document: Document) -> Statement:
    return read_statement(document, MESHES)


def hashed(document: Document) -> Document:
    return {**document, "sha256": digest(document)}


def test_it_is_read_as_it_stands() -> None:
    check_frame(hashed(DOCUMENT))
    found = read(DOCUMENT)
    assert found.waypoints.tolist() == DOCUMENT["waypoints"]
    assert (found.end, found.margin, found.parts) == (2.0, 0.01, 2)
    names = [(b.name, b.role, b.frame) for b in found.bodies]
    assert names == [
        *(("arm", "robot", 0), ("hand", "robot", 2)),
        *(("bore", "scanner", -1), ("man", "patient", -1)),
    ]
    (pair,), (passage,) = found.pairs, found.passages
    assert (pair.moving, pair.standing, pair.margin) == (0, 2, 0.01)
    assert pair.intervals.tolist() == PAIR["intervals"]
    assert (passage.moving, passage.standing) == (1, 3)
    assert passage.entry.tolist() == CORRIDOR["entry"]
    assert passage.target.tolist() == CORRIDOR["target"]
    assert (passage.radius, passage.slack) == (0.001, 0.002)
    assert passage.intervals.tolist() == PASSAGE["intervals"]
    assert found.allowed == {(0, 1): "Adjacent"}
    joint = found.chain.joints[1]
    assert (joint.parent, joint.kind, joint.source) == (0, "slides", 1)
    assert (joint.factor, joint.offset) == (1.0, 0.0)


def test_one_waypoint_is_a_motion_that_stands_still() -> None:
    found = read(changed("waypoints", to=[[0.5, 0.2]]))
    assert found.waypoints.tolist() == [[0.5, 0.2], [0.5, 0.2]]
    assert found.end == 1.0


@pytest.mark.parametrize(
    ("document", "words"),
    [
        (changed("format", to="something"), "not in the format"),
        (changed("format", to=None), "not in the format"),
        (changed("format_version", to=1), "not in version 2"),
        (changed("format_version", to=3), "not in version 2"),
        (changed("format_version", to=2.0), "not in version 2"),
        (changed("more", to=1), "unknown: more"),
        (changed("margin_m", to=None), "lacks margin_m"),
        (changed("versions", to=["1"]), "versions is no record"),
        (changed("versions", to={"a": 1}), "version of a is no text"),
        (changed("versions", to={"a" * 10_001: "1"}), "a name is no text"),
    ],
)
def test_the_frame(document: Document, words: str) -> None:
    with pytest.raises(Rejected, match=words):
        check_frame(hashed(document))


def test_the_frame_needs_no_names_and_its_own_hash() -> None:
    check_frame(hashed(changed("about", to=None)))
    with pytest.raises(Rejected, match="the hash"):
        check_frame({**changed("margin_m", to=0.02), "sha256": digest(DOCUMENT)})


SKEW = np.eye(4)
SKEW[0, 0] += 0.4e-12  # its square is off by twice that
TURNED = transform([0.0, 0.0, 0.0], [0.3, -0.2, 0.9]).tolist()


@pytest.mark.parametrize(
    "document",
    [
        changed("chain", 0, "axis", to=[0.0, 0.0, 1.0 + 0.9e-12]),
        changed("chain", 0, "axis", to=[0.0, 0.0, 1.0 - 0.9e-12]),
        changed("chain", 2, "axis", to=[0.0, 0.0, 0.0]),
        changed("chain", 2, "axis", to=[0.0, -1e3, 1e3]),
        changed("chain", 2, "source", to=1),
        changed("chain", 2, "factor", to=1e3),
        changed("chain", 2, "factor", to=-1e3),
        changed("chain", 2, "offset", to=1e3),
        changed("chain", 2, "offset", to=-1000),
        changed("chain", 1, "parent", to=-1),
        changed("chain", 2, "parent", to=0),
        changed("chain", 1, "origin", to=TURNED),
        changed("chain", 1, "origin", to=SKEW.tolist()),
        changed("waypoints", 0, 0, to=1e3),
        changed("waypoints", 0, 0, to=-1e3),
        changed("waypoints", 1, 1, to=-999.0),
        changed("margin_m", to=0.0),
        changed("margin_m", to=1e3),
        *(changed("bodies", 3, "role", to=r) for r in ("scanner", "couch", "other")),
        changed("bodies", 0, "frame", to=2),
        changed("bodies", 1, "frame", to=0),
        changed("bodies", 2, "T_frame_mesh", 0, 3, to=999.9),
        changed("part_count", to=1) | {"passages": [], "allowed": []}
        | {"bodies": [DOCUMENT["bodies"][0], *DOCUMENT["bodies"][2:]]}
        | {"pairs": []},
        changed("pairs", 0, "moving", to=1),
        changed("pairs", 0, "standing", to=3),
        changed("pairs", 0, "standing", to=0),
        changed("pairs", 0, "margin_m", to=0.0),
        changed("pairs", 0, "margin_m", to=1e3),
        changed("pairs", 0, "intervals", 0, 1, to=1e6),
        changed("pairs", to=[]),
        changed("passages", 0, "moving", to=0),
        changed("passages", 0, "standing", to=2),
        changed("passages", 0, "radius_m", to=0.0),
        changed("passages", 0, "radius_m", to=1e3),
        changed("passages", 0, "slack_m", to=0.0),
        changed("passages", 0, "slack_m", to=1e3),
        changed("passages", 0, "entry", to=[1e3, -1e3, 0]),
        changed("passages", to=[]),
        changed("allowed", to=[]),
        changed("about", to={}),
        changed("about", "robot", to=None),
        changed("about", "scene", to=None),
        changed("about", "plan", to=None),
    ],
)  # fmt: skip
def test_what_is_taken(document: Document) -> None:
    read(document)


BEYOND = 1e3 + 1e-9
MIRRORED = np.diag([1.0, 1.0, -1.0, 1.0]).tolist()
FIXED = _joint("fixed", -1, -1)


@pytest.mark.parametrize(
    ("document", "words"),
    [
        (changed("waypoints", to=[]), "waypoints: 0 of them"),
        (changed("waypoints", to=[[0.0, 0.1], [0.0]]), "waypoints: not numbers"),
        (changed("waypoints", 0, 0, to=BEYOND), "waypoints: holds a number"),
        (changed("waypoints", to=[[0.0] * 2001]), "waypoints: 2001 of them"),
        (changed("waypoints", to=[[0.0, 0.0]] * 1_000_001), "waypoints: 1000001 of"),
        (changed("chain", to=[]), "chain: 0 of them"),
        (changed("chain", to=[FIXED] * 2001), "chain: 2001 of them"),
        (changed("chain", 0, "kind", to="bends"), "joint 0 of the chain is of an unkn"),
        (changed("chain", 1, "parent", to=1), "parent is no whole .* from -1 to 0"),
        (changed("chain", 0, "parent", to=-2), "parent is no whole .* from -1 to -1"),
        (changed("chain", 0, "source", to=-1), "source is no whole .* from 0 to 1"),
        (changed("chain", 1, "source", to=2), "source is no whole .* from 0 to 1"),
        (changed("chain", 2, "source", to=-2), "source is no whole .* from -1 to 1"),
        (changed("chain", 0, "axis", to=[0.0, 1.0]), "axis: not numbers in .* 3"),
        (changed("chain", 2, "axis", to=[0.0, 0.0, BEYOND]), "axis: holds a number"),
        (changed("chain", 0, "axis", to=[0, 0, 1 + 1.5e-12]), "no unit vector"),
        (changed("chain", 1, "axis", to=[0, 0, 1 - 1.5e-12]), "no unit vector"),
        (changed("chain", 2, "factor", to=BEYOND), "factor is no number from -1000"),
        (changed("chain", 2, "factor", to=-BEYOND), "factor is no number from -1000"),
        (changed("chain", 2, "offset", to=BEYOND), "offset is no number from -1000"),
        (changed("chain", 2, "offset", to=-BEYOND), "offset is no number from -1000"),
        (changed("chain", 1, "origin", to=MIRRORED), "not a rigid placement"),
        (changed("chain", 1, "origin", 0, 0, to=1 + 0.8e-12), "not a rigid"),
        (changed("chain", 1, "origin", 0, 1, to=1e-6), "not a rigid placement"),
        (changed("chain", 1, "origin", 3, 3, to=2.0), "not a rigid placement"),
        (changed("chain", 1, "origin", 3, 0, to=1.0), "not a rigid placement"),
        (changed("chain", 1, "origin", 0, 3, to=BEYOND), "placement: holds a number"),
        (changed("bodies", to=DOCUMENT["bodies"][:1]), "bodies: 1 of them"),
        (changed("bodies", to=DOCUMENT["bodies"] * 501), "bodies: 2004 of them"),
        (changed("part_count", to=0), "part_count is no whole number from 1 to 3"),
        (changed("part_count", to=4), "part_count is no whole number from 1 to 3"),
        (changed("bodies", 0, "role", to="other"), "arm: its role"),
        (changed("bodies", 2, "role", to="robot"), "bore: its role"),
        (changed("bodies", 0, "frame", to=-1), "frame is no whole .* from 0 to 2"),
        (changed("bodies", 0, "frame", to=3), "frame is no whole .* from 0 to 2"),
        (changed("bodies", 2, "frame", to=0), "frame is no whole .* from -1 to -1"),
        (changed("bodies", 2, "mesh_sha256", to="x" * 64), "the hash xxxxxxxxxxxx[.]"),
        (changed("bodies", 2, "T_frame_mesh", to=MIRRORED), "bore: not a rigid"),
        (changed("margin_m", to=-1e-12), "margin_m is no number from 0 to 1000"),
        (changed("margin_m", to=BEYOND), "margin_m is no number from 0 to 1000"),
        (changed("pairs", 0, "moving", to=2), "moving is no whole .* from 0 to 1"),
        (changed("pairs", 0, "moving", to=-1), "moving is no whole .* from 0 to 1"),
        (changed("pairs", 0, "standing", to=4), "standing is no .* from 0 to 3"),
        (changed("pairs", 0, "standing", to=-1), "standing is no .* from 0 to 3"),
        (changed("pairs", 0, "margin_m", to=-1e-12), "pair 0: margin_m is no number"),
        (changed("pairs", 0, "margin_m", to=BEYOND), "pair 0: margin_m is no number"),
        (changed("pairs", 0, "columns", to=["from"]), "columns are not from, to, at"),
        (changed("pairs", 0, "intervals", to=[]), "intervals: 0 of them"),
        (changed("pairs", 0, "intervals", to=[[0.0] * 4]), "shape 1 x 5"),
        (changed("pairs", 0, "intervals", 0, 1, to=1e6 + 1), "not within 1e[+]06"),
        (changed("pairs", 0, "intervals", to=[[0.0] * 5] * 20_001), "20001 of them"),
        (changed("pairs", to=[None] * 1_000_001), "pairs: 1000001 of them"),
        (changed("passages", 0, "moving", to=2), "moving is no whole .* from 0 to 1"),
        (changed("passages", 0, "moving", to=-1), "moving is no .* from 0 to 1"),
        (changed("passages", 0, "standing", to=1), "standing is no .* from 2 to 3"),
        (changed("passages", 0, "standing", to=4), "standing is no .* from 2 to 3"),
        (changed("passages", 0, "entry", to=[0, 0, BEYOND]), "entry: holds a number"),
        (changed("passages", 0, "target", to=[0, 0, BEYOND]), "target: holds a num"),
        (changed("passages", 0, "entry", to=[0.0, 0.0]), "entry: not numbers"),
        (changed("passages", 0, "target", to=[0.0, 0.0]), "target: not numbers"),
        (changed("passages", 0, "radius_m", to=-1e-12), "radius_m is no number"),
        (changed("passages", 0, "radius_m", to=BEYOND), "radius_m is no number"),
        (changed("passages", 0, "slack_m", to=-1e-12), "slack_m is no number"),
        (changed("passages", 0, "slack_m", to=BEYOND), "slack_m is no number"),
        (changed("passages", 0, "columns", to=PAIR["columns"]), "columns are not"),
        (changed("passages", 0, "target", to=None), "passage 0 lacks target"),
        (changed("passages", to=[None] * 1_000_001), "passages: 1000001 of them"),
        (changed("allowed", 0, "second", to=2), "second is no whole .* from 1 to 1"),
        (changed("allowed", 0, "second", to=0), "second is no whole .* from 1 to 1"),
        (changed("allowed", 0, "first", to=1), "first is no whole .* from 0 to 0"),
        (changed("allowed", 0, "first", to=-1), "first is no whole .* from 0 to 0"),
        (changed("allowed", to=DOCUMENT["allowed"] * 2), "pair 1: stated twice"),
        (changed("allowed", 0, "reason", to=1), "reason is no text"),
        (changed("allowed", to=[None] * 1_000_001), "allowed: 1000001 of them"),
        (changed("about", to=[]), "about is no record"),
        (changed("about", "couch", to={}), "about holds what is unknown: couch"),
        (changed("about", "robot", "urdf_sha256", to=None), "robot lacks urdf_sha256"),
        (changed("about", "robot", "urdf_sha256", to=1), "urdf_sha256 is no text"),
        (changed("about", "scene", "name", to=1), "scene: name is no text"),
        (changed("about", "robot", "arguments", to=["a"]), "robot: its arguments are"),
        (changed("about", "scene", "arguments", to=["a"]), "scene: its arguments are"),
        (changed("about", "robot", "arguments", "a", to=1), "of the robot is no text"),
        (
            changed("about", "scene", "arguments", to={"a" * 10_001: "b"}),
            "of the scene is no text",
        ),
        (changed("about", "plan", "name", to=1), "name of the plan is no text"),
        (changed("about", "plan", "entry", to=None), "plan lacks entry"),
        (changed("about", "plan", "radius_m", to=-1.0), "plan: radius_m is no number"),
    ],
)
def test_what_is_refused(document: Document, words: str) -> None:
    with pytest.raises(Rejected, match=words):
        read(document)


def test_joints_turn_up_to_a_thousand_radians_by_whatever_factor() -> None:
    for turn in (1000.0, -1000.0, 1001.0, -1001.0):
        document = changed("chain", 0, "factor", to=2.0)
        document["waypoints"][1][0] = turn / 2.0
        if abs(turn) == 1000.0:
            read(document)
        else:
            with pytest.raises(Rejected, match="turns farther than 1000 rad"):
                read(document)


HALF = 0.05 * 3**0.5  # from the cube's middle to a corner


def test_nothing_reaches_farther_than_a_kilometre() -> None:
    """The arm by all of its lengths, what stands by its own place."""
    for off, fine in ((-1e-6, True), (1e-6, False)):
        slide = changed("waypoints", 1, 1, to=-(1000.0 - HALF + off))
        wall = changed("bodies", 2, "T_frame_mesh", 2, 3, to=1000.0 - HALF + off)
        hand = changed("bodies", 1, "T_frame_mesh", 2, 3, to=999.8 - HALF + off)
        for document in (slide, wall, hand):
            if fine:
                read(document)
            else:
                with pytest.raises(Rejected, match=r"reaches 1e\+03 m from"):
                    read(document)


def test_what_is_not_quite_rigid_must_not_be_far_off() -> None:
    """Three times both placements' lack of 0.8e-12, at a distance: up to 0.2 nm."""
    for far, fine in ((30.0, True), (50.0, False)):
        document = changed("bodies", 3, "T_frame_mesh", to=SKEW.tolist())
        document["bodies"][2]["T_frame_mesh"][1][3] = far
        if fine:
            read(document)
        else:
            with pytest.raises(Rejected, match="rounding may put points"):
                read(document)


def test_a_surface_has_its_box_and_its_size() -> None:
    """Of what its triangles use; the size counts from the frame it is placed in."""
    vertices = np.vstack([CUBE.vertices + [0.2, 0.0, 0.0], [[9.0, 9.0, 9.0]]])
    T = transform([0.0, 3.0, 4.0])
    surface = Surface("s", "other", -1, T, GroupedMesh(vertices, CUBE.triangles))
    corners = {tuple(np.round(corner, 12)) for corner in surface.box}
    sides = (-0.05, 0.05)
    assert corners == {(x, y, z) for x in (0.15, 0.25) for y in sides for z in sides}
    far = float(np.linalg.norm([0.25, 0.05, 0.05]))
    assert surface.size == pytest.approx(far + 5.0)
    assert surface.closed
    assert surface.one_corner_each.shape == (1, 3)
    assert surface.placed([]) is T
    on_a_link = Surface("s", "robot", 1, T, surface.mesh)
    link = transform([1.0, 0.0, 0.0], [0.0, 0.0, np.pi / 2])
    placed = on_a_link.placed([np.eye(4), link])
    np.testing.assert_allclose(placed[:3, 3], [-2.0, 0.0, 4.0], atol=1e-12)
    np.testing.assert_allclose(placed[:3, :3], link[:3, :3])
