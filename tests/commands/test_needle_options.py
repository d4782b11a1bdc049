"""A stranger's arm: needle plans, and insertions given as paths, with certificates."""

import json

import numpy as np
import pytest

import borecheck as bc
from borecheck.cli import main
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.motion.certificate import digest
from borecheck.plans.needle_corridor import last_leg
from borecheck.plans.plan_file import read_plans
from borecheck.view.session import Session
from tests.places import ROBOTS

ARM = ROBOTS / "needle_arm.urdf"
NEEDLE = ["--needle", "needle_link", "--tip", "needle_tip"]
HEAD = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z"
CORRIDOR = "0.5,0,0.1:0.5,0,0.03"


def run(capsys, *words):
    status = main(list(map(str, words)))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A body, a wall far off, a plan into the body, its motion as a path; certified."""
    made = tmp_path_factory.mktemp("arm")
    write_stl(made / "body.stl", box("body", (0.3, 0.3, 0.2)))
    write_stl(made / "wall.stl", box("wall", (0.05, 1.0, 1.0)))
    (made / "plans.csv").write_text(f"{HEAD}\nsteep,0.5,0,0.1,0.5,0,0.03\n")
    words = ["--plan", made / "plans.csv", "--certificate", made / "plan.json"]
    words += ["--out", made / "result.json", "--samples", "3"]
    assert main([str(w) for w in ["check", *around(made), *words, *NEEDLE]]) == 0
    result = json.loads((made / "result.json").read_text())
    waypoints = result["plans"][0]["path"]["waypoints"]
    rows = [",".join(repr(value) for value in q.values()) for q in waypoints]
    (made / "path.csv").write_text("\n".join([",".join(waypoints[0]), *rows]) + "\n")
    words = ["--path", made / "path.csv", "--certificate", made / "path.json"]
    words += ["--corridor", CORRIDOR, "--samples", "3"]
    assert main([str(w) for w in ["check", *around(made), *words, *NEEDLE]]) == 0
    return made


def around(folder):
    return [ARM, f"{folder / 'wall.stl'}:m@-1,0,0", "--patient", body(folder)]


def body(folder):
    return f"{folder / 'body.stl'}:m@0.5,0,0"


def bound(folder, *more):
    wall = f"{folder / 'wall.stl'}:m@-1,0,0"
    return ["--robot", ARM, "--scene", wall, "--patient", body(folder), *more]


def test_a_plan_is_certified_and_its_certificate_accepted(folder, capsys):
    words = ["verify", folder / "plan.json"]
    assert run(capsys, *words)[0] == 0
    more = ["--plan", folder / "plans.csv", *NEEDLE]
    status, out, _ = run(capsys, *words, *bound(folder, *more))
    assert status == 0
    assert "needle_link in body from (500.0, 0.0, 100.0)" in out


def test_an_insertion_as_a_path_is_certified_and_accepted(folder, capsys):
    words = ["verify", folder / "path.json"]
    assert run(capsys, *words)[0] == 0
    path = ["--path", folder / "path.csv", "--needle", "needle_link"]
    for corridor in (CORRIDOR, f"{folder / 'plans.csv'}:steep", folder / "plans.csv"):
        more = [*path, "--corridor", corridor]
        status, out, _ = run(capsys, *words, *bound(folder, *more))
        assert status == 0
        assert "with a corridor" in out


def test_without_a_corridor_the_same_path_is_contact(folder, capsys):
    words = ["--path", folder / "path.csv", "--samples", "3", "--no-certificate"]
    status, out, _ = run(capsys, "check", *around(folder), *words, *NEEDLE)
    assert status == 1
    assert "needle_link meets body" in out


def test_the_last_leg_of_a_path_is_its_corridor(folder, capsys):
    words = ["--path", folder / "path.csv", "--samples", "3", "--corridor", "last-leg"]
    status, out, err = run(capsys, "check", *around(folder), *words, *NEEDLE)
    assert status == 0
    assert "CLEAR" in out
    assert "the needle (needle needle_link tip needle_tip:z) may be in the" in out
    least = next(line for line in out.splitlines() if "least clearance" in line)
    assert least.endswith("; the needle to its patient does not count")
    assert not err


@pytest.mark.parametrize(
    "corridor", ["0.5,0.01,0.1:0.5,0.01,0.03", "0.5,0,0.1:0.5,0,0.05"]
)
def test_a_corridor_beside_or_short_of_the_needle_allows_nothing(
    folder, capsys, corridor
):
    words = ["--path", folder / "path.csv", "--samples", "3", "--corridor", corridor]
    words.append("--no-certificate")
    status, _, _ = run(capsys, "check", *around(folder), *words, *NEEDLE)
    assert status == 1


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--path", "path.csv"], "lets a needle enter a patient: give --needle"),
        (["--plan", "plans.csv", *NEEDLE], "is of a path, not of a needle plan"),
        (
            ["--path", "path.csv", *NEEDLE, "--corridor", "0.5,0,0.1:0.5,0,0.04"],
            "corridor",
        ),
        (
            ["--path", "path.csv", "--needle", "flange", "--corridor", CORRIDOR],
            "thick where it would enter",
        ),
    ],
)
def test_other_options_do_not_accept_it(folder, capsys, monkeypatch, more, says):
    monkeypatch.chdir(folder)
    status, out, err = run(capsys, "verify", "path.json", *bound(folder, *more))
    assert status != 0
    assert says in out + err


def forged(folder, name, change, tmp_path):
    """A certificate changed by a hand that also writes its hash anew."""
    document = json.loads((folder / name).read_text())
    change(document)
    del document["sha256"]
    document["sha256"] = digest(document)
    file = tmp_path / "forged.json"
    file.write_text(json.dumps(document))
    file.with_suffix(".npz").write_bytes(
        (folder / name).with_suffix(".npz").read_bytes()
    )
    return file


def both(document, **values):
    """The same in the corridor that is named and in every passage."""
    for record in (document["about"]["corridor"], *document["passages"]):
        record.update(values)


CHANGES = {
    "wider": lambda d: both(d, radius_m=0.004),
    "slack": lambda d: both(d, slack_m=0.01),
    "deeper": lambda d: d["passages"][0].update(target=[0.5, 0.0, 0.0]),
    "unnamed": lambda d: d["about"].pop("corridor"),
    "short": lambda d: both(d, target=[0.5, 0.0, 0.06]),
    "no length": lambda d: both(d, target=[0.5, 0.0, 0.1]),
    "plan as well": lambda d: d["about"].update(
        plan={"name": "x", **d["about"]["corridor"]}
    ),
    "more fields": lambda d: d["about"]["corridor"].update(note="x"),
    "not finite": lambda d: both(d, radius_m=True),
    "arm": lambda d: d["passages"].append(
        {**d["passages"][0], "moving": d["passages"][0]["moving"] - 1}
    ),
    "wall": lambda d: d["passages"][0].update(standing=d["part_count"]),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_forged_corridors_of_paths_are_refused(folder, tmp_path, change):
    assert not bc.verify(forged(folder, "path.json", change, tmp_path)).accepted


def loaded(folder):
    robot = bc.load_robot(ARM, needle="needle_link", tip="needle_tip")
    scene = bc.load_scene(f"{folder / 'wall.stl'}:m@-1,0,0", patients=[body(folder)])
    return robot, scene


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d["waypoints"].reverse(),
        lambda d: d["waypoints"].pop(0),
        lambda d: d["waypoints"][4].__setitem__(0, d["waypoints"][4][0] + 1e-3),
        lambda d: [q.__setitem__(1, q[1] + 1e-4) for q in d["waypoints"]],
        lambda d: [
            q.__setitem__(5, 50.0) or q.__setitem__(3, 3.0) for q in d["waypoints"]
        ],
    ],
)
def test_a_motion_that_is_not_the_plans_is_not_accepted_for_it(
    folder, tmp_path, change
):
    """Held to the plan by the URDF, before any of its intervals is asked."""
    file = forged(folder, "plan.json", change, tmp_path)
    plans = read_plans(folder / "plans.csv")
    found = bc.verify(file, *loaded(folder), plans=plans)
    assert not found.accepted
    assert any(
        word in " ".join(found.problems) for word in ("plan", "limit", "outside")
    )


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--plan", "plans.csv"], "--needle needle_link --tip needle_tip:z would be"),
        (
            ["--plan", "plans.csv", "--needle", "nedle_link"],
            "did you mean 'needle_link'",
        ),
        (["--plan", "plans.csv", "--tip", "needle_tip"], "--tip goes with --needle"),
        (
            ["--plan", "plans.csv", "--needle", "needle_link"],
            "no frame at its needle's",
        ),
        (["--plan", "plans.csv", *NEEDLE, "--corridor", CORRIDOR], "goes with --path"),
        (["--q", "home", *NEEDLE, "--corridor", CORRIDOR], "goes with --path"),
        (["--path", "path.csv", *NEEDLE, "--corridor", "1,2,3"], "is not X,Y,Z:X,Y,Z"),
        (["--path", "path.csv", *NEEDLE, "--corridor", "1,2:3,4"], "is not X,Y,Z"),
        (["--path", "path.csv", *NEEDLE, "--corridor", "a,b,c:1,2,3"], "no length"),
        (["--path", "path.csv", *NEEDLE, "--corridor", "500,0,1:5,0,1"], "millimetres"),
        (["--path", "path.csv", *NEEDLE, "--corridor", "0,0,0:0,0,0"], "same point"),
        (["--path", "path.csv", *NEEDLE, "--corridor", "plans.csv:x"], "unknown plan"),
        (["--path", "path.csv", *NEEDLE, "--corridor", "no.csv"], "No such file"),
        (["--path", "path.csv", "--corridor", CORRIDOR], "has no needle"),
    ],
)
def test_mistakes_are_one_line(folder, capsys, monkeypatch, words, says):
    monkeypatch.chdir(folder)
    status, out, err = run(capsys, "check", *around(folder), *words)
    assert status == 2
    assert not out
    assert says in err
    assert "Traceback" not in err
    assert len(err.strip().splitlines()) == 1


def test_in_python_a_corridor_is_of_a_path_too(folder):
    robot, scene = loaded(folder)
    points = np.loadtxt(folder / "path.csv", delimiter=",", skiprows=1)
    corridor = last_leg(robot, points)
    assert bc.check_path(robot, scene, points).verdict == "contact"
    assert bc.check_path(robot, scene, points, corridor=corridor).clear


def test_the_live_view_follows_plans_of_a_stated_needle(folder):
    robot, scene = loaded(folder)
    plan = read_plans(folder / "plans.csv")[0]
    session = Session(robot, scene, plan)
    assert session.follows_plans
    end = robot.placements(session.at(session.motion(), 1.0))["needle_tip"]
    np.testing.assert_allclose(end[:3, 3], plan.target, atol=1e-9)


def test_numbers_of_the_certificate_are_those_of_the_plan(folder):
    """The tip's way by Pinocchio, from waypoints as they were written."""
    robot, _ = loaded(folder)
    document = json.loads((folder / "plan.json").read_text())
    tip = robot.placements(document["waypoints"][-1])["needle_tip"][:3, 3]
    np.testing.assert_allclose(tip, document["about"]["plan"]["target"], atol=1e-9)
