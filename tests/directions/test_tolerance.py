"""How far a plan may be off: nothing proven is contradicted by samples."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.cli import main
from borecheck.directions.chart import Chart
from borecheck.directions.tolerance import largest_tolerance, tolerance
from borecheck.errors import UsageError
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_file import save_plans
from tests.directions.test_map import RNG, depths_by_rays, poses_of

TARGET = np.array([0.05, 0.06, -0.08])
ENTRY = {"roomy": (0.0464, 0.0799, -0.0102), "near": (0.085, 0.025, 0.002)}


def plan(name):
    return NeedlePlan(name, ENTRY[name], TARGET)


def beside(direction, angle, rng):
    """A direction at an angle from another."""
    across = np.cross(direction, rng.normal(size=3))
    across /= np.linalg.norm(across)
    return np.cos(angle) * direction + np.sin(angle) * across


@pytest.mark.parametrize("name", sorted(ENTRY))
def test_what_is_proven_holds_at_the_rim_of_cone_and_ball(robot, scene, name):
    found = largest_tolerance(robot, scene, plan(name))
    assert found is not None
    assert found.target_error > 0.0
    rng = np.random.default_rng(RNG)
    asked = bc.queries(robot, scene, skip=[("needle", "torso")])
    for _ in range(12):
        off = rng.normal(size=3)
        target = TARGET + found.target_error * off / np.linalg.norm(off)
        n = beside(plan(name).direction, found.angle, rng)
        depth = depths_by_rays(scene, target, n[None])[0]
        other = NeedlePlan("off", target - depth * n, target)
        assert not asked.touches(poses_of(robot, other)).any()


def test_wider_tolerances_are_never_easier(robot, scene):
    answers = [
        tolerance(robot, scene, plan("near"), angle=np.radians(a), target_error=e).clear
        for a, e in ((0.2, 0.0), (0.5, 0.001), (1.0, 0.004), (3.0, 0.01), (20.0, 0.02))
    ]
    assert answers == sorted(answers, reverse=True)
    assert answers[0]
    assert not answers[-1]


def test_a_plan_in_contact_or_out_of_reach_has_none(robot, scene):
    touching = NeedlePlan("c", (0.1, 0.02, 0.0045), TARGET)
    assert tolerance(robot, scene, touching, angle="0.05deg").state == "contact"
    beyond = NeedlePlan("o", (0.0, 0.06, 0.0), TARGET)
    assert tolerance(robot, scene, beyond).state == "out"
    assert largest_tolerance(robot, scene, touching) is None
    outside = NeedlePlan("x", (0.0, 0.0, 0.4), (0.0, 0.0, 0.3))
    assert tolerance(robot, scene, outside).state == "undecided"
    for asked in ({"angle": 0.0}, {"target_error": -1e-3}, {"angle": "2rad"}):
        with pytest.raises(UsageError):
            tolerance(robot, scene, touching, **asked)


def test_a_cone_is_within_its_cell(robot):
    chart, rng = Chart.of(robot, TARGET), np.random.default_rng(RNG)
    for _ in range(50):
        centre = rng.uniform(chart.limits[0], chart.limits[1])
        angle = rng.uniform(0.0, 0.5)
        half = chart.about.halves(centre, angle)
        n = chart.directions(centre[None])[0]
        around = np.array([beside(n, angle, rng) for _ in range(20)])
        assert (np.abs(chart.angles(around) - centre) <= half + 1e-9).all()


def test_check_tells_and_demands_tolerances_and_proposes_repairs(tmp_path, capsys):
    file = tmp_path / "plans.csv"
    check = ["check", "zerobot", "ct_gantry", "--samples", "3", "--plan", str(file)]
    save_plans(file, [plan("roomy")])
    assert main(check) == 0
    assert "stays clear for every target within" in capsys.readouterr().out
    assert main([*check, "--tolerance", "1mm,0.5deg"]) == 0
    assert "within 1 mm and every direction within 0.5 deg, proven" in (
        capsys.readouterr().out
    )
    assert main([*check, "--tolerance", "50mm,1deg"]) == 2
    assert "NOT SHOWN" in capsys.readouterr().out
    save_plans(file, [NeedlePlan("c", (0.1, 0.02, 0.0045), TARGET)])
    assert main([*check, "--repair"]) == 1
    told = capsys.readouterr().out
    assert "nearest clear plan: entry" in told
    assert "no clear direction nearer than" in told


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["zerobot", "ct_gantry", "--q", "home", "--repair"], "--plan"),
        (["zerobot", "ct_gantry", "--plan", "p.csv", "--tolerance", "2mm"], "2mm,1deg"),
        (["zerobot", "ct_gantry", "--plan", "p.csv", "--tolerance", "1deg,2mm"], "deg"),
    ],
)
def test_stray_options_are_one_line(words, said, capsys):
    assert main(["check", *words]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
