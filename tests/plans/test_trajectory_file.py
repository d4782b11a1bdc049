"""JointTrajectory files of ROS and columns of times: by name, growing, not guessed."""

import json

import numpy as np
import pytest

from borecheck.cli import main
from borecheck.errors import PlanError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.plans.path_file import read_joint_path, read_path
from tests.places import ROBOTS

NAMES = ("a", "b")
ROWS = [[0.1, -0.2], [0.3, 0.4], [1e-5, 0.5]]
TIMES = [0.0, 0.25, 2.0]


def message(names=("b", "a"), times=TIMES, seconds=("sec", "nanosec"), **more):
    """A message whose joints stand in another order than the robot's."""
    order = [NAMES.index(name) for name in names if name in NAMES]
    points = []
    for row, time in zip(ROWS, times or [None] * 3, strict=True):
        point = {"positions": [row[k] for k in order], **more}
        if time is not None:
            whole, parts = divmod(round(time * 1e9), 10**9)
            point["time_from_start"] = dict(zip(seconds, (whole, parts), strict=True))
        points.append(point)
    return {"header": {"frame_id": ""}, "joint_names": list(names), "points": points}


def read(tmp_path, text, name="way.yaml"):
    (tmp_path / name).write_text(text)
    return read_joint_path(tmp_path / name, NAMES)


@pytest.mark.parametrize("seconds", [("sec", "nanosec"), ("secs", "nsecs")])
@pytest.mark.parametrize("end", [".json", ".yaml", ".yml"])
@pytest.mark.parametrize(
    "around",
    [
        lambda m: m,
        lambda m: {"joint_trajectory": m, "multi_dof_joint_trajectory": {"points": []}},
        lambda m: {"trajectory": m},
        lambda m: {"goal": {"trajectory": m}},
        lambda m: {"trajectory": [{"joint_trajectory": m}]},
    ],
)
def test_what_was_written_is_read_in_the_robots_order(tmp_path, around, end, seconds):
    import yaml

    whole = around(message(seconds=seconds))
    text = json.dumps(whole) if end == ".json" else f"{yaml.safe_dump(whole)}---\n"
    found = read(tmp_path, text, f"way{end}")
    np.testing.assert_array_equal(found.waypoints, ROWS)
    np.testing.assert_allclose(found.times, TIMES, rtol=0.0, atol=1e-12)


def test_times_may_be_missing_and_what_is_not_used_is_said(tmp_path):
    found = read(tmp_path, json.dumps(message(times=None)))
    assert (found.times, found.notes) == (None, ())
    untimed = message(times=[0.0, 0.0, 0.0], velocities=[1.0, 1.0], effort=[])
    found = read(tmp_path, json.dumps(untimed))
    assert found.times is None
    assert found.notes == ("its velocities are not used",)
    assert found.times_at([0.0, 1.0]) is None


def point(**changed):
    whole = message()
    whole["points"][1] = {**whole["points"][1], **changed}
    return json.dumps(whole)


WRONG = (
    (json.dumps({"joints": []}), "it holds no `joint_names`"),
    (json.dumps([message(), message()]), "it holds no `joint_names`"),
    (json.dumps(message(names=("b", "c"))), "joint_names: unknown joint 'c'"),
    (json.dumps(message(names=("b",))), "joint_names: does not name a"),
    (json.dumps(message(names=("b", "a", "b"))), "joint_names: names 'b' twice"),
    (json.dumps({**message(), "points": []}), "points: holds no waypoint"),
    (json.dumps({**message(), "points": 3}), "holds no list of `points`"),
    (point(positions=[1.0]), "points[2]: has 1 positions, not 2"),
    (point(positions=[1.0, True]), "points[2], a: 'true' is no finite number"),
    (point(positions=[1.0, "0x1"]), "points[2], a: '0x1' is no finite number"),
    (point(positions=[float("nan"), 1.0]), "points[2], b: 'NaN' is no finite number"),
    (point(positions=[1e999, 1.0]), "points[2], b: 'Infinity' is no finite number"),
    (point(positions=None), "points[2]: holds no list of `positions`"),
    (point(time_from_start={"sec": 2}), "points[3]: its time 2 s is not after 2 s"),
    (point(time_from_start=-1.0), "points[2]: its time -1 s is not after 0 s"),
    (point(time_from_start={"s": 1}), "is neither seconds nor {sec, nanosec}"),
    (point(time_from_start="soon"), "'soon' is no finite number"),
    ("a: [1, 2", "is no YAML"),
    ("", "it holds no `joint_names`"),
    ("--- {a: 1}\n--- {b: 1}\n", "holds 2 messages"),
    ("[" * 50_000, "way.yaml"),
    ("a: &x [1]\nb: !!python/object:os.system {}", "it holds no `joint_names`"),
    (json.dumps({"multi_dof_joint_trajectory": {"points": [1]},
                 "joint_trajectory": message()}), "joints of several freedoms"),
)  # fmt: skip


@pytest.mark.parametrize(("text", "said"), WRONG)
def test_what_is_wrong_is_one_line_that_says_where(tmp_path, text, said):
    with pytest.raises(PlanError) as error:
        read(tmp_path, text)
    assert said in str(error.value)
    assert "way.yaml" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_point_without_its_time_is_refused(tmp_path):
    whole = message()
    del whole["points"][2]["time_from_start"]
    with pytest.raises(PlanError, match=r"points\[3\]: has no time_from_start"):
        read(tmp_path, json.dumps(whole))


@pytest.mark.parametrize(
    ("column", "times"),
    [("time", TIMES), ("time_s", TIMES), ("time_ms", [0, 250, 2000])],
)
def test_a_column_of_times_is_no_joint(tmp_path, column, times):
    rows = [f"{b!r},{t},{a!r}" for (a, b), t in zip(ROWS, times, strict=True)]
    found = read(tmp_path, "\n".join([f"b,{column},a", *rows]), "way.csv")
    np.testing.assert_array_equal(found.waypoints, ROWS)
    np.testing.assert_allclose(found.times, TIMES, rtol=1e-15)
    assert "0 to 2 s" in found.notes[0]


def test_a_joint_called_time_is_a_joint(tmp_path):
    (tmp_path / "way.csv").write_text("time,b\n1,2\n0,3\n")
    found = read_path(tmp_path / "way.csv", ("time", "b"))
    np.testing.assert_array_equal(found, [[1, 2], [0, 3]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b,time\n0,0,1\n0,1,1\n", "line 3: its time 1 s is not after 1 s"),
        ("a,b,time\n0,0,0\n\n0,1,-1\n", "line 4: its time -1 s is not after 0 s"),
        ("a,b,time\n0,0,x\n", "line 2, time: 'x' is no finite number"),
        ("a,b,time,time_ms\n0,0,1,1\n", "has 2 columns of times"),
        ("a,b,tiem\n0,0,1\n", "unknown joint 'tiem'"),
    ],
)
def test_times_that_make_no_sense_are_refused(tmp_path, text, said):
    with pytest.raises(PlanError, match=said):
        read(tmp_path, text, "way.csv")


def test_time_runs_evenly_between_waypoints(tmp_path):
    found = read(tmp_path, json.dumps(message()))
    assert found.times_at([0.0, 0.25, 0.5, 0.75, 1.0]) == [0, 0.125, 0.25, 1.125, 2.0]


def test_a_check_keeps_the_times_and_says_what_it_does_not_use(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    write_stl(tmp_path / "block.stl", box("block", (0.2, 0.2, 0.2)))
    arm = str(ROBOTS / "two_link.urdf")
    points = [
        {"positions": [0.1 * k], "velocities": [1.0], "time_from_start": {"sec": k * k}}
        for k in range(3)
    ]
    (tmp_path / "way.json").write_text(
        json.dumps({"joint_names": ["j"], "points": points})
    )
    (tmp_path / "way.csv").write_text("j\n0\n0.1\n0.2\n")
    begin = ["check", arm, "block.stl:m@2,0,0", "--path"]
    words = [*begin, "way.json", "--report", "page.html", "--format", "json"]
    assert main(words) == 0
    out, err = capsys.readouterr()
    timed = json.loads(out)
    assert "way.json: its velocities are not used" in err
    assert any("splines" in line for line in timed["not_modelled"])
    at = dict(zip(timed["path"]["fractions"], timed["path"]["times_s"], strict=True))
    assert (at[0.0], at[0.5], at[1.0]) == (0.0, 1.0, 4.0)
    page = (tmp_path / "page.html").read_text()
    assert "at time [s]" in page
    assert "60 | 1.6<" in page  # a fifth of the second, of three seconds, after one
    assert main([*begin, "way.csv", "--format", "json"]) == 0
    plain = json.loads(capsys.readouterr().out)
    assert "times_s" not in plain["path"]
    assert plain["path"]["waypoints"] == timed["path"]["waypoints"]
    assert plain["clearance_m"] == timed["clearance_m"]
