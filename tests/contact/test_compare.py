import json
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.comparison import Gathered, to_json
from borecheck.errors import JointLimitError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.geometry.surfaces import CHECKERS

KNOWN_CAUSES = {
    "one-sided test",
    "touching",
    "coplanar",
    "zero-area",
    "rounding",
    "Coal tolerance",
}


@pytest.fixture(scope="module")
def random_comparison(zerobot, ct_gantry):
    rng = np.random.default_rng(7)
    qs = zerobot.model.random_configurations(rng, 12)
    return bc.compare(zerobot, ct_gantry, qs)


def test_premise_some_poses_touch_and_some_do_not(random_comparison):
    in_contact = random_comparison.checkers["exact"].contact_poses
    assert 3 <= len(in_contact) <= 11


def test_every_disagreement_has_a_known_cause(random_comparison):
    assert random_comparison.disagreements
    for found in random_comparison.disagreements:
        assert found.cause is not None
        assert set(found.cause.split(", ")) <= KNOWN_CAUSES


def test_exact_two_sided_and_coal_see_the_same_pairs(random_comparison):
    counts = {n: c.triangle_pairs for n, c in random_comparison.checkers.items()}
    assert counts["exact"] == counts["two-sided"] == counts["coal"] > 100
    assert counts["paper:robot"] < counts["exact"]


def test_pruning_changes_nothing(zerobot, ct_gantry):
    rng = np.random.default_rng(8)
    qs = zerobot.model.random_configurations(rng, 2)
    found = {p: bc.compare(zerobot, ct_gantry, qs, pruning=p) for p in ("coal", "bvh")}
    counts = {
        p: {n: c.triangle_pairs for n, c in result.checkers.items()}
        for p, result in found.items()
    }
    assert counts["coal"] == counts["bvh"]
    assert found["coal"].disagreements == found["bvh"].disagreements


def test_the_document_is_plain_json(random_comparison):
    document = json.loads(json.dumps(to_json(random_comparison), allow_nan=False))
    assert len(document["poses"]) == 12
    assert set(document["checkers"]) == set(CHECKERS)
    first = document["disagreements"][0]
    assert np.array(first["corners"]).shape == (2, 3, 3)


def test_refusals(zerobot, ct_gantry):
    with pytest.raises(UsageError):
        bc.compare(zerobot, ct_gantry, np.zeros((0, 6)))
    with pytest.raises(JointLimitError):
        bc.compare(zerobot, ct_gantry, [[9.0, 0, 0, 0, 0, 0]])


@pytest.mark.parametrize("empty", [[], [[]], np.zeros((0, 6)), np.zeros((3, 0))])
def test_there_must_be_a_configuration(zerobot, ct_gantry, empty):
    with pytest.raises(UsageError, match=r"no configuration|have shape"):
        bc.compare(zerobot, ct_gantry, empty)


def test_what_no_joint_moves_is_compared_as_often_as_asked(tmp_path):
    """A configuration of no joints is one; no configuration of none is none."""
    file = tmp_path / "post.urdf"
    file.write_text(
        '<robot name="post"><link name="post"><collision><geometry>'
        '<box size="0.1 0.1 1"/></geometry></collision></link></robot>'
    )
    write_stl(tmp_path / "wall.stl", box("wall", (1.0, 0.1, 1.0)))
    post, wall = bc.load_robot(file), bc.load_scene(f"{tmp_path / 'wall.stl'}:m")
    found = bc.compare(post, wall, np.zeros((2, 0)), checkers=["exact"])
    assert found.checkers["exact"].contact_poses == (0, 1)
    with pytest.raises(UsageError, match="no configuration"):
        bc.compare(post, wall, np.zeros((0, 0)))


@pytest.mark.parametrize("pruning", ["none", "bvh"])
def test_every_pair_of_triangles_is_examined_or_pruned(zerobot, ct_gantry, pruning):
    found = bc.compare(
        zerobot, ct_gantry, zerobot.home, checkers=["exact"], pruning=pruning
    )
    parts = [len(part.mesh.triangles) for part in zerobot.parts]
    standing = sum(len(o.mesh.triangles) for o in ct_gantry.obstacles)
    total = sum(parts) * standing + sum(
        parts[i] * parts[j] for i, j in zerobot.self_pairs
    )
    summary = found.checkers["exact"]
    assert summary.pairs_examined + summary.pairs_pruned == total
    assert (summary.pairs_pruned == 0) == (pruning == "none")


def test_interrupted_between_two_poses_both_are_kept(zerobot, ct_gantry):
    qs = zerobot.model.random_configurations(np.random.default_rng(7), 4)

    def stops(done, _total):
        if done == 2:
            raise KeyboardInterrupt

    whole = bc.compare(zerobot, ct_gantry, qs[:2])
    found = bc.compare(zerobot, ct_gantry, qs, progress=stops, keep_finished=True)
    assert found.interrupted
    assert not whole.interrupted
    assert len(found.poses) == len(found.pose_obstacles) == 2
    assert found.pose_verdicts == whole.pose_verdicts
    assert found.disagreements == whole.disagreements
    assert [c.triangle_pairs for c in found.checkers.values()] == [
        c.triangle_pairs for c in whole.checkers.values()
    ]


def test_interrupted_while_a_pose_is_closed_it_is_dropped_everywhere():
    class Interrupts:
        def __iter__(self):
            raise KeyboardInterrupt

    gathered = Gathered(("exact",))
    for hidden in ([], Interrupts()):
        gathered.begin_pose()
        gathered.summaries["exact"] = replace(
            gathered.summaries["exact"], pairs_examined=7
        )
        with suppress(KeyboardInterrupt):
            gathered.close_pose({"exact": True}, {"exact": True}, hidden)
    gathered.drop_unfinished()
    assert gathered.summaries["exact"].contact_poses == (0,)
    assert gathered.pose_verdicts == gathered.pose_obstacles == [{"exact": True}]
    assert gathered.contained == [()]


@pytest.mark.parametrize("keep", [True, False])
def test_interrupted_keeps_whole_poses_only(zerobot, ct_gantry, monkeypatch, keep):
    from borecheck.contact import compare as comparison

    qs = zerobot.model.random_configurations(np.random.default_rng(7), 4)
    whole = bc.compare(zerobot, ct_gantry, qs[:2])
    real, calls = comparison.contacts, []

    def stops_in_the_third_pose(*args, **options):
        calls.append(1)
        if len(calls) > per_pose * 2 + per_pose // 2:
            raise KeyboardInterrupt
        return real(*args, **options)

    pairs = len(zerobot.parts) * len(ct_gantry.obstacles) + len(zerobot.self_pairs)
    per_pose = pairs * len(CHECKERS)
    monkeypatch.setattr(comparison, "_warm_up", lambda names: None)
    monkeypatch.setattr(comparison, "contacts", stops_in_the_third_pose)
    if not keep:
        with pytest.raises(KeyboardInterrupt):
            bc.compare(zerobot, ct_gantry, qs)
        return
    result = bc.compare(zerobot, ct_gantry, qs, keep_finished=True)
    assert result.interrupted
    assert len(result.poses) == len(result.contained) == 2
    assert result.pose_verdicts == whole.pose_verdicts
    assert result.disagreements == whole.disagreements
    for name, summary in result.checkers.items():
        assert summary.triangle_pairs == whole.checkers[name].triangle_pairs
        assert summary.contact_poses == whole.checkers[name].contact_poses
