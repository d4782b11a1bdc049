"""A certificate beside what it should state: every field that differs is one line."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.verify.binding import Expected, differences
from borecheck.verify.chain import Chain
from borecheck.verify.distance import GroupedMesh
from borecheck.verify.statement import Statement, Surface

Content = dict[str, Any]
Meshes = dict[str, tuple[NDArray[np.float64], NDArray[np.int64]]]

CUBE = box("cube", [0.1] * 3)
CORRIDOR = {
    "entry": [0.0, 0.0, 0.1],
    "target": [0.0, 0.02, 0.05],
    "radius_m": 0.0008,
    "slack_m": 0.002,
}


def _joint(kind: str, parent: int, source: int) -> Content:
    return {
        "kind": kind,
        "parent": parent,
        "source": source,
        "origin": transform([0.0, 0.0, 0.25]).tolist(),
        "axis": [0.0, 0.0, 1.0],
        "factor": 1.0,
        "offset": 0.0,
    }


def _body(name: str, role: str, frame: int) -> Content:
    placed = {"name": name, "role": role, "frame": frame}
    return {**placed, "T_frame_mesh": np.eye(4).tolist(), "mesh_sha256": "cube"}


def _pair(moving: int, standing: int) -> Content:
    return {"moving": moving, "standing": standing, "margin_m": 0.02}


def content() -> Content:
    """Three parts, of which two may touch, and two obstacles; a needle in one."""
    return {
        "about": {
            "robot": {"name": "there/arm.urdf", "arguments": {"mount": "+90"}},
            "scene": {"name": "a/bore.stl + b/man.stl", "arguments": {}},
            "plan": {"name": "liver", **CORRIDOR},
        },
        "margin_m": 0.02,
        "waypoints": [[0.0, 0.1], [0.5, 0.2], [1.0, 0.3]],
        "chain": [_joint("turns", -1, 0), _joint("slides", 0, 1)],
        "bodies": [
            *(_body("arm", "robot", 0), _body("hand", "robot", 1)),
            *(_body("needle", "robot", 1), _body("bore", "scanner", -1)),
            _body("man", "patient", -1),
        ],
        "part_count": 3,
        "pairs": [_pair(0, 3), _pair(1, 3), _pair(2, 3), _pair(0, 4), _pair(1, 4)],
        "passages": [{"moving": 2, "standing": 4, **copy.deepcopy(CORRIDOR)}],
        "allowed": [{"first": 0, "second": 2, "reason": "Adjacent"}],
    }


def told(
    stated: Content,
    asked: Content | None = None,
    meshes: Meshes | None = None,
    doubt: str | None = None,
) -> tuple[str, ...]:
    """Differences of what is stated; what should be is `content` by default."""
    waypoints = np.zeros((2, 0))
    own = {**(meshes or {}), "cube": (CUBE.vertices, CUBE.triangles)}
    surfaces = tuple(
        Surface(b["name"], b["role"], b["frame"], np.eye(4), GroupedMesh(*own[key]))
        for b in stated["bodies"]
        for key in [b["mesh_sha256"]]
    )
    statement = Statement(
        stated, waypoints, Chain([], waypoints), 0.0, surfaces,
        stated["part_count"], (), (), {},
    )  # fmt: skip
    files = {"cube": (CUBE.vertices, CUBE.triangles)}
    expected = Expected("it", asked or content(), files, doubt)
    return differences(statement, expected)


def changed(*path: Any, to: Any) -> Content:
    """The content with one value of it put in the place of another."""
    made = content()
    place: Any = made
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = to
    return made


def test_what_is_the_same_is_told_nothing_of() -> None:
    assert told(content()) == ()
    assert told(content(), doubt="the arm is open") == (
        "nothing is clear: the arm is open",
    )


@pytest.mark.parametrize(
    ("stated", "line"),
    [
        (changed("margin_m", to=0.03), "margin: 0.03, not 0.02"),
        (changed("margin_m", to=0.01), "margin: 0.01, not 0.02"),
        (changed("margin_m", to=[0.02]), "margin: other numbers than its file's"),
        (changed("waypoints", to=[[0.0, 0.1]]), "waypoints: 1, not 3"),
        (changed("waypoints", 1, to=[0.5, 0.3]), "waypoint 2: off by up to 0.1"),
        (changed("waypoints", 1, to=[0.25, 0.2]), "waypoint 2: off by up to 0.25"),
        (
            changed("waypoints", 2, to=[1.0]),
            "waypoint 3: other numbers than its file's",
        ),
        (changed("chain", to=content()["chain"][:1]), "chain: 1 joints, not 2"),
        (
            changed("chain", 1, "kind", to="turns"),
            "joint 1 of the chain: kind turns, not slides",
        ),
        (
            changed("chain", 1, "parent", to=-1),
            "joint 1 of the chain: parent -1, not 0",
        ),
        (
            changed("chain", 0, "source", to=1),
            "joint 0 of the chain: source 1, not 0",
        ),
        (
            changed("chain", 1, "origin", 2, 3, to=0.125),
            "joint 1 of the chain: origin: off by up to 0.125",
        ),
        (
            changed("chain", 1, "axis", to=[0.0, 1.0, 0.0]),
            "joint 1 of the chain: axis: off by up to 1",
        ),
        (
            changed("chain", 1, "factor", to=0.5),
            "joint 1 of the chain: factor: 0.5, not 1",
        ),
        (
            changed("chain", 0, "offset", to=-0.5),
            "joint 0 of the chain: offset: -0.5, not 0",
        ),
        (changed("bodies", 1, "name", to="fist"), "hand: name is fist, not hand"),
        (changed("bodies", 4, "role", to="couch"), "man: role is couch, not patient"),
        (changed("bodies", 2, "frame", to=0), "needle: frame is 0, not 1"),
        (
            changed("bodies", 3, "T_frame_mesh", 0, 3, to=-0.5),
            "bore: placement: off by up to 0.5",
        ),
        (changed("part_count", to=2), "2 parts and 3 obstacles, not 3 and 2"),
        (
            changed("bodies", to=content()["bodies"][:4]),
            "3 parts and 1 obstacles, not 3 and 2",
        ),
        (
            changed("pairs", to=content()["pairs"][:-1]),
            "hand and man: it lacks them under pairs",
        ),
        (
            changed("pairs", to=[*content()["pairs"], _pair(2, 4)]),
            "needle and man: it states them under pairs",
        ),
        (
            changed("pairs", 1, "margin_m", to=0.01),
            "hand and bore: margin: 0.01, not 0.02",
        ),
        (changed("passages", to=[]), "needle and man: it lacks them under passages"),
        (
            changed("passages", 0, "entry", 1, to=0.5),
            "needle and man: corridor: off by up to 0.5",
        ),
        (
            changed("passages", 0, "target", 0, to=-0.5),
            "needle and man: corridor: off by up to 0.5",
        ),
        (
            changed("passages", 0, "radius_m", to=0.0018),
            "needle and man: corridor: off by up to 0.001",
        ),
        (
            changed("passages", 0, "slack_m", to=0.001),
            "needle and man: corridor: off by up to 0.001",
        ),
        (changed("allowed", to=[]), "arm and needle: it lacks them under allowed"),
        (
            changed("about", "robot", "name", to="there/leg.urdf"),
            "the robot is called there/leg.urdf, not there/arm.urdf",
        ),
        (
            changed("about", "robot", "arguments", to={"mount": "-90"}),
            "the robot's arguments are others",
        ),
        (
            changed("about", "scene", "name", to="a/bore.stl"),
            "the scene is called a/bore.stl, not a/bore.stl + b/man.stl",
        ),
        (
            changed("about", "scene", "arguments", to={"a": "b"}),
            "the scene's arguments are others",
        ),
        (
            changed("about", "plan", "name", to="lung"),
            "the plan is called lung, not liver",
        ),
        (
            changed("about", "plan", "slack_m", to=0.001),
            "corridor of the plan: off by up to 0.001",
        ),
    ],
)
def test_whatever_differs_is_one_line(stated: Content, line: str) -> None:
    assert told(stated) == (line,)


def test_a_pair_more_that_may_touch_is_told_with_its_reason() -> None:
    more = {"first": 1, "second": 0, "reason": "they may"}
    stated = changed("allowed", to=[*content()["allowed"], more])
    assert told(stated) == (
        "arm and hand: it states them under allowed (they may): if they may touch, "
        "give --srdf or --allow, too",
    )


def test_pairs_are_told_in_their_order() -> None:
    stated = changed("pairs", to=[])
    names = ("arm and bore", "arm and man", "hand and bore", "hand and man")
    lines = [f"{both}: it lacks them under pairs" for both in names]
    assert told(stated) == (*lines, "needle and bore: it lacks them under pairs")
    stated = content()
    for pair in stated["pairs"]:
        pair["margin_m"] = 0.01
    lines = [f"{both}: margin: 0.01, not 0.02" for both in names]
    assert told(stated) == (*lines, "needle and bore: margin: 0.01, not 0.02")


def test_the_order_within_a_pair_is_free() -> None:
    stated = content()
    stated["pairs"] = [
        {**r, "moving": r["standing"], "standing": r["moving"]} for r in stated["pairs"]
    ]
    assert told(stated) == ()


def test_an_obstacle_more_is_told_with_what_it_is_examined_against() -> None:
    stated = content()
    stated["bodies"].append(_body("mast", "other", -1))
    stated["pairs"].append(_pair(0, 5))
    assert told(stated) == (
        "3 parts and 3 obstacles, not 3 and 2",
        "arm: it states them under pairs",
    )


def test_numbers_are_the_same_up_to_a_millionth_of_a_micrometre() -> None:
    """1e-12, and no more, to either side."""
    zero = changed("waypoints", 1, to=[0.0, 0.0])
    for off, same in ((1e-12, True), (-1e-12, True), (1.5e-12, False)):
        for number in (off, -off):
            stated = changed("waypoints", 1, to=[0.0, number])
            assert (told(stated, zero) == ()) == same


def test_folders_are_no_part_of_a_name() -> None:
    stated = changed("about", "robot", "name", to="elsewhere/x/arm.urdf")
    stated["about"]["scene"]["name"] = "bore.stl + c/man.stl"
    assert told(stated) == ()


def test_what_it_is_called_need_not_be_said_but_the_plan() -> None:
    stated = content()
    del stated["about"]["robot"], stated["about"]["scene"]
    assert told(stated) == ()
    del stated["about"]
    assert told(stated) == ("it names no plan",)
    path = content()
    path["about"]["plan"] = None
    assert told(content(), path) == ("it names a plan",)
    del path["about"]["plan"]
    assert told(stated, path) == ()


def test_a_paths_corridor_is_the_one_asked_for() -> None:
    """Without a plan's name; named or not, and where it is."""
    path = content()
    del path["about"]["plan"]
    with_corridor = copy.deepcopy(path)
    with_corridor["about"]["corridor"] = copy.deepcopy(CORRIDOR)
    assert told(with_corridor, with_corridor) == ()
    assert told(with_corridor, path) == ("it names a corridor",)
    assert told(path, with_corridor) == ("it names no corridor",)
    for name, place, off in (("entry", 2, 0.5), ("target", 0, -0.25)):
        other = copy.deepcopy(with_corridor)
        other["about"]["corridor"][name][place] += off
        assert told(other, with_corridor) == (
            f"corridor of the path: off by up to {abs(off):g}",
        )


def _shifted(by: float) -> Callable[[], Any]:
    return lambda: (CUBE.vertices + [0.0, 0.0, by], CUBE.triangles)


@pytest.mark.parametrize(
    ("other", "same"),
    [
        # as another machine's sine places a corner
        (_shifted(2.0**-41), True),
        (_shifted(-(2.0**-41)), True),
        (_shifted(2.0**-39), False),
        (_shifted(-0.01), False),
        (lambda: (CUBE.vertices, CUBE.triangles[::-1]), False),
        (lambda: (CUBE.vertices, CUBE.triangles[:, [1, 2, 0]]), False),
        (lambda: (np.vstack([CUBE.vertices, np.zeros(3)]), CUBE.triangles), False),
    ],
)
def test_meshes_of_another_hash_are_the_same_up_to_rounding(
    other: Callable[[], Any], same: bool
) -> None:
    stated = changed("bodies", 1, "mesh_sha256", to="other")
    lines = () if same else ("hand: another mesh than its file's",)
    assert told(stated, meshes={"other": other()}) == lines


def test_one_corner_that_is_off_is_enough() -> None:
    vertices = CUBE.vertices.copy()
    vertices[3, 1] -= 2e-12
    stated = changed("bodies", 0, "mesh_sha256", to="other")
    meshes = {"other": (vertices, CUBE.triangles)}
    assert told(stated, meshes=meshes) == ("arm: another mesh than its file's",)


@pytest.mark.parametrize(("count", "last"), [(20, None), (21, 1), (25, 5)])
def test_of_twenty_differences_each_is_told(count: int, last: int | None) -> None:
    asked, stated = content(), content()
    asked["waypoints"] = [[0.0, float(k)] for k in range(30)]
    stated["waypoints"] = [[1.0 if k < count else 0.0, float(k)] for k in range(30)]
    lines = [f"waypoint {k + 1}: off by up to 1" for k in range(min(count, 20))]
    if last is not None:
        lines.append(f"and {last} more differences")
    assert told(stated, asked) == tuple(lines)
