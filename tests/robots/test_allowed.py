"""Links that may touch: as asked, no pair more, and each with who says so."""

from itertools import combinations

import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.robots.allowed import MOST_OPTIONS, NONE, Allowances, hints, proposed
from borecheck.robots.robot import Robot
from tests.sliders import pair, sliders, spread, srdf

NAMES = "abcd"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("sliders")
    (made / "sliders.urdf").write_text(sliders())
    return made


@pytest.fixture(scope="module")
def far():
    from borecheck.geometry.mesh.primitives import box
    from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
    from borecheck.robots.scene import Obstacle, Scene

    block = box("wall", (0.1, 0.1, 0.1))
    mesh = TriangleMesh("wall", block.vertices + [0.0, 5.0, 0.0], block.triangles)
    wall = Obstacle("wall", "other", mesh, "")
    return Scene("s", None, {}, "test", (wall,), {}, (), ())


def load(folder, text=None, **more) -> Robot:
    if text is not None:
        (folder / "given.srdf").write_text(text)
        more["srdf"] = folder / "given.srdf"
    return bc.load_robot(folder / "sliders.urdf", **more)


def examined(robot):
    return {
        frozenset((robot.parts[i].link, robot.parts[j].link))
        for i, j in robot.self_pairs
    }


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("allowed", list(combinations(NAMES, 2)))
def test_an_allowed_pair_allows_no_other(folder, far, allowed, swapped):
    """In no order; and by verdicts, not by the list of pairs."""
    robot = load(folder, allow=[":".join(allowed[::-1] if swapped else allowed)])
    for both in combinations(NAMES, 2):
        q = spread(**{both[0]: 7.0, both[1]: 7.05})
        verdict = bc.check(robot, far, q)
        assert verdict.verdict == ("clear" if both == allowed else "contact")
        assert verdict.itself.pairs == (() if both == allowed else (both,))
        assert bc.first_contacts(robot, far, [q])[0] == (both != allowed)
        assert bc.check_path(robot, far, [q, q], clearance=False).clear == (
            both == allowed
        )


def test_an_obstacle_is_never_allowed(folder, far):
    robot = load(folder, allow=list(combinations(NAMES, 2)))
    assert examined(robot) == set()
    verdict = bc.check(robot, far, [7.0, 7.0, 7.0, 7.0])
    assert verdict.clear
    assert "pairs of links may touch" in verdict.itself.reason
    near = far.obstacles[0].mesh.vertices[:, 1].mean()
    moved = [[1.0, 0, 0, 0], [0, 1.0, 0, near], [0, 0, 1.0, 0], [0, 0, 0, 1.0]]
    robot = bc.load_robot(
        folder / "sliders.urdf", base=moved, allow=list(combinations(NAMES, 2))
    )
    verdict = bc.check(robot, far, [0.0, 7.0, 7.0, 7.0])
    assert verdict.contact
    assert verdict.obstacles.pairs == (("a", "wall"),)
    assert verdict.itself.clear


def test_what_is_taken_from_a_file_and_what_is_left(folder):
    text = srdf(
        pair("a", "b", "Always"), pair("b", "c", "Never"), pair("c", "d", "User")
    )
    robot = load(folder, text)
    assert examined(robot) == {frozenset(p) for p in combinations(NAMES, 2)} - {
        frozenset("ab")
    }
    (only,) = robot.allowed_contacts
    assert (only.reason, only.source) == ("Always", "given.srdf, line 2")
    (note,) = robot.warnings
    assert note.endswith(
        "2 pairs left out and examined all the same (1 Never, 1 User): --trust-never "
        "takes them"
    )
    trusting = load(folder, text, trust_never=True)
    assert len(examined(trusting)) == 3
    assert trusting.warnings[0].endswith("2 pairs taken on trust (1 Never, 1 User)")
    assert "contact of links that may touch: a with b, b with c, c with d" in (
        trusting.not_modelled
    )


def test_by_the_user_and_by_a_file_the_user_comes_first(folder):
    robot = load(folder, srdf(pair("a", "b", "Always")), allow=["b:a"])
    (only,) = robot.allowed_contacts
    assert (only.reason, only.source) == ("by request", "--allow")


def test_what_an_enabled_pair_does_not_allow_is_examined(folder):
    robot = load(
        folder,
        srdf(
            '<disable_default_collisions link="a"/>',
            '<enable_collisions link1="a" link2="c"/>',
        ),
    )
    assert examined(robot) == {frozenset(p) for p in ("ac", "bc", "bd", "cd")}


def test_called_adjacent_and_not_is_taken_and_said(folder):
    robot = load(
        folder, srdf(pair("a", "b", "Adjacent"), pair("c", "rail", "Adjacent"))
    )
    assert [p.links for p in robot.unexamined] == [frozenset("ab")]
    (odd,) = robot.warnings
    assert odd.startswith("given.srdf, line 2: a and b are called adjacent, but")


def test_nothing_given_is_the_same_robot(folder):
    robot = load(folder)
    assert robot.allowing(NONE) is robot
    assert robot.unexamined == ()
    assert not any("may touch" in text for text in robot.not_modelled)
    assert load(folder, srdf()).warnings == (
        f"{folder / 'given.srdf'}: lets no pair of links touch",
    )


def test_a_file_for_another_robot_is_told(folder):
    other = srdf(pair("a", "b", "Always")).replace("sliders", "crane")
    (told,) = load(folder, other).warnings
    assert told.endswith("is for a robot called 'crane', not 'sliders'")
    unnamed = srdf(pair("a", "b", "Always")).replace(' name="sliders"', "")
    assert load(folder, unnamed).warnings == ()


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ("a", "give two links of the robot, LINK:LINK"),
        ("a:", "give two links"),
        (":", "give two links"),
        ("a:x", "names 'x', which is no link of the robot"),
        ("x:a", "names 'x'"),
        ("a:b:c", "names 'b:c'"),
        ("a:Rail", "did you mean 'rail'"),
        ("a:a", "a with itself is no pair"),
        (("a",), "give two links"),
        (("a", "b", "c"), "give two links"),
        (("a", "x"), "--allow a:x names 'x'"),
        (None, "--allow None: give two links"),
        (7, "--allow 7: give two links"),
    ],
)
def test_a_pair_that_is_none(request_, words):
    with pytest.raises(UsageError, match=words):
        Allowances(pairs=(request_,)).of(("rail", *NAMES))


def test_names_with_colons():
    links = ("left::a", "left", ":a", "b")
    asked = Allowances(pairs=("left::a:b",)).of(links)
    assert asked.pairs[0].links == {"left::a", "b"}
    with pytest.raises(
        UsageError, match="can be read as left and :a:b or left::a and b"
    ):
        Allowances(pairs=("left::a:b",)).of((*links, ":a:b"))


def test_natural_mistakes_are_told(folder):
    with pytest.raises(UsageError, match=r"allow is a string: give a list, \['a:b'\]"):
        load(folder, allow="a:b")
    with pytest.raises(UsageError, match="--trust-never goes with --srdf"):
        load(folder, trust_never=True)


def test_hints_are_options_to_type(folder):
    file = folder / "sliders.urdf"
    assert hints(file, NONE, ()) == []
    first, *_ = hints(file, NONE, [("a", "b"), ("a link", "c")])
    assert first.endswith(
        "a with b, a link with c; if they may touch: --allow a:b --allow 'a link:c'"
    )
    many = [(f"p{k}", "q") for k in range(MOST_OPTIONS + 3)]
    first, *_ = hints(file, NONE, many)
    assert f"p{MOST_OPTIONS - 1}:q ..." in first
    assert f"p{MOST_OPTIONS}:q" not in first
    assert "and 3 more" in first


def test_files_beside_the_robots_are_proposed_and_never_read(tmp_path):
    """Also those in a folder `srdf` beside its own, its namesake first."""
    home = tmp_path / "urdf"
    home.mkdir()
    (tmp_path / "srdf").mkdir()
    robot = home / "arm.urdf"
    robot.write_text(sliders())
    assert proposed(robot) == ()
    (home / "other.srdf").write_text("<no XML")
    (tmp_path / "srdf" / "arm.srdf").write_text("<no XML")
    assert [path.name for path in proposed(robot)] == ["arm.srdf", "other.srdf"]
    _, second = hints(robot, NONE, [("a", "b")])
    assert f"--srdf {tmp_path / 'srdf' / 'arm.srdf'} or" in second
    assert len(hints(robot, Allowances(srdf=robot), [("a", "b")])) == 1
    assert bc.load_robot(robot).allowed_contacts == ()
