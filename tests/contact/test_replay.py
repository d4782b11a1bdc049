"""Disputed triangles replayed alone give the verdicts they were dumped with."""

import json
import time
from itertools import count

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.comparison import to_json
from borecheck.contact.replay import replay
from borecheck.errors import BorecheckError
from borecheck.robots.scene import load_scene
from tests.places import ROBOTS

TRIANGLES = [
    [[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]],
    [[0.0, 0, -0.01], [0.001, 0, 0.1], [-0.001, 0, 0.1]],
]


def stored(tmp_path, **content):
    file = tmp_path / "result.json"
    file.write_text(json.dumps({"schema_version": "1", **content}))
    return file


@pytest.fixture(scope="module")
def comparison(tmp_path_factory):
    wall = tmp_path_factory.mktemp("wall") / "wall.obj"
    wall.write_text("v 0.03 -9 -9\nv 0.03 9 -9\nv 0.03 0 9\nf 1 2 3\n")
    robot = bc.load_robot(ROBOTS / "two_link.urdf")
    return bc.compare(robot, load_scene(f"{wall}:m"), [[0.0], [0.02]])


def test_every_disputed_pair_is_judged_again_alike(comparison, tmp_path):
    document = json.loads(json.dumps(to_json(comparison)))
    assert len(document["disagreements"]) > 10
    again = replay(stored(tmp_path, **document))
    assert len(again["disagreements"]) == len(document["disagreements"])
    for before, after in zip(
        document["disagreements"], again["disagreements"], strict=True
    ):
        for key in ("link", "obstacle", "link_triangle", "verdicts", "exact", "cause"):
            assert after[key] == before[key]
        assert np.array_equal(after["corners"], before["corners"])


def test_a_replay_can_be_replayed(comparison, tmp_path):
    first = replay(stored(tmp_path, **json.loads(json.dumps(to_json(comparison)))))
    second = replay(stored(tmp_path, **json.loads(json.dumps(first))))
    assert first["disagreements"] == second["disagreements"]


def test_counts_are_those_of_the_pairs(comparison, tmp_path):
    again = replay(stored(tmp_path, **json.loads(json.dumps(to_json(comparison)))))
    pairs = len(again["disagreements"])
    for name, summary in again["checkers"].items():
        seen = sum(d["verdicts"][name] for d in again["disagreements"])
        assert summary["triangle_pairs"] == len(summary["contact_poses"]) == seen
        assert summary["pairs_examined"] == pairs


def test_the_time_is_that_of_all_pairs(comparison, tmp_path, monkeypatch):
    ticks = count()
    monkeypatch.setattr(time, "perf_counter", lambda: next(ticks))
    again = replay(stored(tmp_path, **json.loads(json.dumps(to_json(comparison)))))
    pairs = len(again["disagreements"])
    assert {s["seconds"] for s in again["checkers"].values()} == {pairs}


def test_nothing_disputed_is_fine(tmp_path):
    assert replay(stored(tmp_path, disagreements=[]))["disagreements"] == []


@pytest.mark.parametrize(
    "content",
    [
        {},
        {"disagreements": 5},
        {"disagreements": [1]},
        {"disagreements": [{}]},
        {"disagreements": [{"corners": [[0, 0, 0]]}]},
        {"disagreements": [{"corners": [[[0, 0], [1, 0], [0, 1]]] * 2}]},
        {"disagreements": [{"corners": "two triangles"}]},
        {"disagreements": [{"corners": [[[10**400] * 3] * 3] * 2}]},
        {"disagreements": [{"corners": [[[1e308, 0, 0], [0, 1, 0], [0, 0, 1]]] * 2}]},
        {"disagreements": [{"corners": TRIANGLES, "link_triangle": "first"}]},
        {"disagreements": [{"corners": TRIANGLES, "obstacle_triangle": 1.5}]},
        {"disagreements": [], "robot": None},
        {"disagreements": [], "scene": {"warnings": [1]}},
        {"disagreements": [], "not_modelled": 7},
    ],
)
def test_damaged_results_are_one_line(tmp_path, content):
    with pytest.raises(BorecheckError) as error:
        replay(stored(tmp_path, **content))
    assert "\n" not in str(error.value)


def test_what_the_file_says_otherwise_is_named(comparison, tmp_path):
    document = json.loads(json.dumps(to_json(comparison)))
    first = document["disagreements"][0]
    first["verdicts"]["exact"] = not first["verdicts"]["exact"]
    again = replay(stored(tmp_path, **document))
    (changed,) = again["changed"]
    assert changed["checker"] == "exact"
    assert changed["stored"] is not changed["now"]
    assert changed["link_triangle"] == first["link_triangle"]


def test_pairs_about_which_all_agree_now_are_no_disagreements(comparison, tmp_path):
    document = json.loads(json.dumps(to_json(comparison)))
    apart = document["disagreements"][0]
    apart["corners"][1] = (np.array(apart["corners"][1]) + 50.0).tolist()
    again = replay(stored(tmp_path, **document))
    assert len(again["disagreements"]) == len(document["disagreements"]) - 1
    assert [pair["pose"] for pair in again["agreed"]] == [0]
    assert set(again["agreed"][0]["verdicts"].values()) == {False}
