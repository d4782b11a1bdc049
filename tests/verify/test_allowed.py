"""Pairs that may touch: stated, named, and accepted by the verifier's files only."""

import json

import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.motion.certificate import digest
from borecheck.motion.certify import write_path_certificate
from tests.sliders import pair, sliders, spread, srdf

WAY = [spread(b=0.07), spread(b=0.07, d=4.0)]  # a and b meet all the way


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("allowed")
    (folder / "sliders.urdf").write_text(sliders())
    text = srdf(pair("a", "b", "Always"), pair("c", "d", "Never"))
    (folder / "arm.srdf").write_text(text)
    write_stl(folder / "wall.stl", box("wall", (1.0, 1.0, 1.0)))
    robot = load(folder, srdf=folder / "arm.srdf")
    write_path_certificate(robot, scene(folder), WAY, 0.0, folder / "way.json")
    return folder


def load(folder, **allowed):
    return bc.load_robot(folder / "sliders.urdf", **allowed)


def scene(folder):
    return bc.load_scene(f"{folder / 'wall.stl'}:m@9,0,0")


def verified(folder, robot, certificate=None):
    return bc.verify(
        folder / "way.json" if certificate is None else certificate,
        robot,
        scene(folder),
        waypoints=WAY,
        meshes=folder / "way.npz",
    )


def test_it_states_and_names_the_pair(made):
    (stated,) = json.loads((made / "way.json").read_text())["allowed"]
    assert stated == {"first": 0, "second": 1, "reason": "Always (arm.srdf, line 2)"}
    found = verified(made, load(made, srdf=made / "arm.srdf"))
    assert found.accepted
    assert found.not_covered == (("a", "b"),)
    assert found.allowed == ("a and b: Always (arm.srdf, line 2)",)


def test_the_reason_told_is_the_verifiers_own(made):
    """Whatever reason the certificate gives."""
    forged = json.loads((made / "way.json").read_text())
    forged["allowed"][0]["reason"] = "proven"
    forged["sha256"] = digest({k: v for k, v in forged.items() if k != "sha256"})
    found = verified(made, load(made, allow=["b:a"]), forged)
    assert found.accepted
    assert found.allowed == ("a and b: by request (--allow)",)


def test_by_itself_it_is_its_writers_word(made):
    found = bc.verify(made / "way.json")
    assert not found.accepted
    assert found.problems == (
        "a and b: not examined; that they may touch is its writer's word "
        "(Always (arm.srdf, line 2)): give --robot and what allows it, --srdf or "
        "--allow",
    )


OTHERS = {
    "none": ({}, "a and b: it states them under allowed (Always (arm.srdf, line 2))"),
    "another": ({"allow": ["c:d"]}, "a and b: it states them under allowed"),
    "one more": ({"allow": ["a:b", "c:d"]}, "c and d: it lacks them under allowed"),
    "on trust": (
        {"srdf": "arm.srdf", "trust_never": True},
        "c and d: it lacks them under allowed",
    ),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_pairs_than_the_verifiers_are_refused(made, name):
    allowed, words = OTHERS[name]
    if "srdf" in allowed:
        allowed = {**allowed, "srdf": made / allowed["srdf"]}
    found = verified(made, load(made, **allowed))
    assert not found.accepted
    assert any(problem.startswith(words) for problem in found.problems)


def _less(document):
    document["allowed"] = []


def _more(document):
    document["allowed"].append({"first": 2, "second": 3, "reason": "they may"})


def _twice(document):
    document["allowed"] *= 2


def _silent(document):
    """The pair c, d is neither examined nor stated."""
    document["pairs"] = [
        p for p in document["pairs"] if {p["moving"], p["standing"]} != {2, 3}
    ]


def _instead(document):
    """It is stated as allowed, not examined."""
    _silent(document)
    _more(document)


def _an_obstacle(document):
    document["allowed"].append({"first": 0, "second": 4, "reason": "they may"})


@pytest.mark.parametrize(
    "change", [_less, _more, _twice, _silent, _instead, _an_obstacle]
)
def test_a_statement_that_is_not_complete_is_refused(made, change):
    document = json.loads((made / "way.json").read_text())
    change(document)
    document["sha256"] = digest({k: v for k, v in document.items() if k != "sha256"})
    assert not verified(made, load(made, srdf=made / "arm.srdf"), document).accepted
    assert not bc.verify(document, meshes=made / "way.npz").accepted
