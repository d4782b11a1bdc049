"""The quick road of `check` says what the pair-by-pair road says, field by field."""

from dataclasses import replace

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.check import check_with
from borecheck.contact.decision import Findings
from borecheck.contact.settings import settings
from borecheck.contact.together import Together, is_usual
from borecheck.geometry.mesh.primitives import box, sphere
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.scene import Obstacle, Scene


def verdicts(robot, scene, q, chosen):
    """By both roads, without the time they took."""
    quick = check_with(robot, scene, q, chosen)
    long = check_with(robot, scene, q, replace(chosen, pair_by_pair=True))
    return replace(quick, seconds=0.0), replace(long, seconds=0.0)


def assert_same(quick, long):
    """Equal; of pairs that are equally near another one may be named."""
    if quick != long and quick.closest is not None:
        assert quick.closest.distance == long.closest.distance
        assert quick.closest.upper == long.closest.upper
        np.testing.assert_allclose(
            np.linalg.norm(np.subtract(*quick.closest.points)),
            np.linalg.norm(np.subtract(*long.closest.points)),
            rtol=1e-12,
        )
        quick = replace(quick, closest=long.closest)
    assert quick == long


ROBOTS = [
    ("zerobot", {"mount": "+90"}, "ct_gantry"),
    ("zerobot", {"mount": "-90"}, "ct_gantry"),
    ("mri_arm", {}, "mri_open_magnet"),
]
CHOSEN = [
    settings(),
    settings(margin=0.02),
    settings("paper"),
    settings("two-sided", margin=0.005),
]


@pytest.mark.parametrize("case", ROBOTS, ids=lambda case: "".join(case[0]))
def test_random_poses(case):
    name, arguments, scanner = case
    robot, scene = bc.load_robot(name, **arguments), bc.load_scene(scanner)
    qs = robot.model.random_configurations(np.random.default_rng(11), 25)
    seen = set()
    for q in [robot.home, *qs]:
        for chosen in CHOSEN:
            quick, long = verdicts(robot, scene, q, chosen)
            assert_same(quick, long)
            seen.add(quick.verdict)
    assert {"clear", "contact"} <= seen


def scene_of(*meshes):
    obstacles = tuple(Obstacle(m.name, "other", m, "t") for m in meshes)
    return Scene("s", None, {}, "t", obstacles, {}, (), ())


def rooms():
    """Obstacles that hold, might hold, or are held by parts of the robot."""
    room = box("room", (9.0, 9.0, 9.0))
    both = np.vstack([room.triangles, room.triangles[:, ::-1]])
    return [
        room,
        TriangleMesh("open", room.vertices, room.triangles[:-1]),
        TriangleMesh("twice", room.vertices, both),
        sphere("ball", 0.05),
        box("speck", (1e-3, 1e-3, 1e-3)),
    ]


@pytest.mark.parametrize("k", range(5))
def test_solids_open_meshes_and_round_ones(k):
    robot = bc.load_robot("zerobot", mount="+90")
    mesh = rooms()[k]
    rng = np.random.default_rng(k)
    qs = robot.model.random_configurations(rng, 6)
    for q in [robot.home, *qs]:
        link = robot.placements(q)[robot.parts[k].link]
        middle = link @ np.append(robot.parts[k].mesh.bounds.mean(axis=0), 1.0)
        at = middle[:3] if k > 2 else np.zeros(3)
        placed = TriangleMesh(mesh.name, mesh.vertices + at, mesh.triangles)
        for chosen in (settings(), settings("paper"), settings(margin=0.01)):
            assert_same(*verdicts(robot, scene_of(placed), q, chosen))


def test_pairs_examined_and_contacts_are_counted_alike():
    robot, scene = bc.load_robot("zerobot"), bc.load_scene("ct_gantry")
    contacts = 0
    for q in robot.model.random_configurations(np.random.default_rng(3), 20):
        quick, long = verdicts(robot, scene, q, settings())
        assert quick.pairs_examined == long.pairs_examined
        assert quick.pairs_pruned == long.pairs_pruned
        assert quick.contacts == long.contacts
        assert quick.self_contacts == long.self_contacts
        contacts += len(quick.contacts)
    assert contacts > 100


def test_the_quick_road_is_for_the_usual_settings_only():
    assert is_usual(settings(), None)
    assert is_usual(settings("paper", margin=0.0), None)
    assert not is_usual(settings("coal"), None)
    assert not is_usual(settings(pruning="none"), None)
    assert not is_usual(settings(pruning="coal"), None)
    assert not is_usual(settings(link_clearance=True), None)
    assert not is_usual(settings("paper", margin=0.02), None)  # grows its axes
    assert not is_usual(settings(), object())


def test_the_long_road_is_long_to_its_end(monkeypatch):
    """Also where `exact` is asked again after another checker said clear."""
    robot, scene = bc.load_robot("zerobot", mount="+90"), bc.load_scene("ct_gantry")
    chosen = replace(settings("paper"), pair_by_pair=True)
    expected = check_with(robot, scene, robot.home, chosen)

    def of(*_):
        raise AssertionError("the quick road was taken")

    monkeypatch.setattr(Together, "of", of)
    found = check_with(robot, scene, robot.home, chosen)
    assert replace(found, seconds=0.0) == replace(expected, seconds=0.0)
    assert found.verdict == "clear"
    with pytest.raises(AssertionError, match="quick"):
        check_with(robot, scene, robot.home, settings("paper"))


def test_what_is_found_is_added_to_what_was_found():
    robot, scene = bc.load_robot("zerobot"), bc.load_scene("ct_gantry")
    q = robot.model.random_configurations(np.random.default_rng(3), 1)[0]
    pose = Together.of(robot, scene, robot.placements(q))
    around, within = Findings(), Findings()
    pose.examine("exact", around, within)
    once = [(f.total, f.examined, len(f.contacts)) for f in (around, within)]
    pose.examine("exact", around, within)
    twice = [(f.total, f.examined, len(f.contacts)) for f in (around, within)]
    assert min(once)[0] > 0
    assert twice == [tuple(2 * n for n in row) for row in once]
