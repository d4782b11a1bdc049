import json

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.comparison import to_json
from borecheck.errors import JointLimitError, UsageError
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
