"""`borecheck route`: the way is written, checked as written, and bound to its ends."""

import json

import jsonschema
import numpy as np
import pytest

import borecheck as bc
from borecheck.cli import main
from borecheck.planning.route import NONE_FOUND, Route
from borecheck.plans.path_file import read_path, write_path
from tests.places import PROJECT

PLANS = PROJECT / "urdf" / "zerobot" / "examples" / "plans.csv"
STAND = ("zerobot", "ct_gantry")


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


def schema(name):
    return json.loads((PROJECT / f"borecheck/schemas/{name}.schema.json").read_text())


def test_a_way_to_a_plan_is_written_certified_and_verified(capsys, tmp_path):
    path, certificate = tmp_path / "way.csv", tmp_path / "way.json"
    words = ["route", *STAND, "--to", f"{PLANS}:oblique", "--margin", "5mm"]
    files = ["--out", path, "--certificate", certificate]
    status, out, _ = run(capsys, *words, *files)
    assert status == 0, out
    assert "CLEAR: every instant is proven clear" in out
    assert f"path: {path}" in out
    bound = ["--robot", STAND[0], "--scene", STAND[1], "--margin", "5mm"]
    status, out, _ = run(capsys, "verify", certificate, *bound, "--path", path)
    assert status == 0, out
    # it ends where the plan's own motion begins
    robot = bc.load_robot("zerobot")
    from borecheck.plans.plan_file import read_plans
    from borecheck.plans.plan_motion import plan_motion

    plan = next(p for p in read_plans(PLANS) if p.name == "oblique")
    way = read_path(path, robot.model.joint_names)
    np.testing.assert_array_equal(way[0], robot.home)
    np.testing.assert_array_equal(way[-1], plan_motion(robot, plan).waypoints[0])


def test_the_result_is_a_checks_with_how_it_was_found(capsys, tmp_path):
    words = ["route", *STAND, "--to", "q1=0.05,q5=0.1", "--from", "home"]
    path, result = tmp_path / "way.csv", tmp_path / "r.json"
    more = ["--format", "json", "--out", path, "--result", result]
    status, out, _ = run(capsys, *words, *more)
    document = json.loads(out)
    assert status == 0
    jsonschema.Draft202012Validator(schema("check")).validate(document)
    assert document["route"]["status"] == "found"
    assert document["route"]["path"] == str(path)
    page = tmp_path / "page.html"
    bc.report(document, page)
    assert "<title>borecheck route: clear," in page.read_text()
    assert "<li>Robot zerobot (mount=+90), base at (0, 0, 0) mm<" in page.read_text()
    robot = bc.load_robot("zerobot")
    way = read_path(path, robot.model.joint_names)
    assert document["route"]["waypoints"] == way.tolist()
    assert json.loads(result.read_text())["route"] == document["route"]
    first = path.read_bytes()
    run(capsys, *words, "--out", path)
    assert path.read_bytes() == first


def test_without_a_file_the_way_is_in_the_result_alone(capsys):
    words = ["route", *STAND, "--to", "q1=0.05", "--format", "json"]
    status, out, _ = run(capsys, *words)
    assert status == 0
    document = json.loads(out)
    assert document["route"]["path"] is None
    assert len(document["route"]["waypoints"]) >= 2


def test_an_end_in_contact_is_named_and_nothing_written(capsys, tmp_path):
    path = tmp_path / "way.csv"
    words = ["route", *STAND, "--to", "q1=0.25,q3=0.25", "--out", path]
    status, out, _ = run(capsys, *words)
    assert status == 1
    assert out.startswith("CONTACT: no way: the goal touches: arm with gantry")
    assert not path.exists()
    status, out, _ = run(capsys, *words, "--format", "json")
    jsonschema.Draft202012Validator(schema("route")).validate(json.loads(out))


@pytest.mark.parametrize(
    ("more", "saying"),
    [
        (["--to", "nowhere"], "unknown configuration 'nowhere' (known: home)"),
        (["--to", f"{PLANS}"], "it holds 6 plans; say which"),
        (["--to", f"{PLANS}:oblik"], "unknown plan 'oblik'; did you mean 'oblique'?"),
        (["--to", "home", "--certificate", "c.json"], "--certificate needs --out"),
        (["--to", "home", "--edges", "0"], "at least one edge must be asked for"),
        (["--to", "q1=9"], "q1"),
        (
            ["--to", "home", "--out", "way.json"],
            "a way is written as CSV",
        ),
    ],
)
def test_what_is_no_route_is_one_line(capsys, more, saying):
    status, out, err = run(capsys, "route", *STAND, *more)
    assert status == 2
    assert out == ""
    assert saying in err
    assert len([line for line in err.splitlines() if "error" in line]) == 1


def test_a_path_file_is_read_back_bit_for_bit(tmp_path):
    way = np.random.default_rng(0).normal(size=(5, 3)) * [1e-9, 1.0, 1e6]
    write_path(tmp_path / "p.csv", ("a", "b", "c"), way)
    np.testing.assert_array_equal(read_path(tmp_path / "p.csv", ("a", "b", "c")), way)


@pytest.mark.parametrize("named", ["{}:straight", "{}"])
def test_a_file_that_is_read_is_not_written_over(capsys, tmp_path, named):
    """Plans are named FILE:PLAN: the file in it counts."""
    plans = tmp_path / "plans.csv"
    plans.write_text(PLANS.read_text())
    words = ["route", *STAND, "--to", named.format(plans), "--out", plans]
    status, out, err = run(capsys, *words)
    assert (status, out) == (2, "")
    assert "the file is read too; it would be lost" in err
    assert plans.read_text() == PLANS.read_text()


def test_a_mesh_with_unit_and_place_is_not_written_over(capsys, tmp_path):
    report = tmp_path / "torso.html"  # not by its ending: it is an input
    report.write_text("solid x\nendsolid x\n")
    obstacle = f"{report}:mm:lps@0,0,1"
    words = ["check", *STAND, "--q", "home", "--obstacle", obstacle]
    status, _, err = run(capsys, *words, "--report", report)
    assert status == 2
    assert "the file is read too; it would be lost" in err
    assert report.read_text().startswith("solid")


def test_a_way_ends_where_the_certified_plan_begins(capsys, tmp_path, monkeypatch):
    """An arm that can begin in several ways begins in one: check's and route's."""
    monkeypatch.chdir(tmp_path)
    assert main(["examples", "."]) == 0
    plans = (tmp_path / "plans.csv").read_text().splitlines()
    (tmp_path / "one.csv").write_text("\n".join(plans[:2]) + "\n")
    check = ["check", "case.toml", "--plan", "one.csv", "--certificate", "c.json"]
    assert run(capsys, *check)[0] == 0
    begins = json.loads((tmp_path / "c.json").read_text())["waypoints"][0]
    seen = []

    def asked(robot, scene, start, goal, *rest, **more):
        seen.append(goal)
        return Route(NONE_FOUND, "unknown", "not searched", None, 0.0, 0, 0)

    monkeypatch.setattr("borecheck.planning.route.route", asked)
    assert run(capsys, "route", "case.toml", "--to", "one.csv")[0] == 2
    np.testing.assert_allclose(seen[0], begins, atol=1e-12)


def test_python_takes_what_a_configuration_is_elsewhere():
    robot, scene = bc.load_robot("zerobot"), bc.load_scene("ct_gantry")
    found = bc.route(robot, scene, "home", {"q1": 0.05}, "5mm")
    assert found.found
    assert found.waypoints[-1][robot.model.joint_names.index("q1")] == 0.05
    with pytest.raises(bc.BorecheckError, match="swapped"):
        bc.route(scene, robot, "home", "home")
