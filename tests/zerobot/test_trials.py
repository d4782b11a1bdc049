"""The 64 trials: the published tables as data, and their set-up in the model."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from borecheck.robots.robot import load_robot
from borecheck.robots.scene import load_scene
from zerobot.kinematics import forward
from zerobot.trials.bench import QUESTIONS, Bench, outcome, posture, reach, set_up
from zerobot.trials.published import (
    DISTANCES_MM,
    POSTURES_DEG,
    PublishedApproach,
    Trial,
    approaches,
    trials,
)
from zerobot.trials.stops import STOP_TOLERANCE, solve_stop

MICROMETRE = 1e-6  # what issue 5 asks of the stops


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench(
        load_robot("zerobot"), load_scene("ct_gantry", couch="no", patient="no")
    )


def test_there_are_64_trials_and_57_are_right() -> None:
    told = trials()
    assert len(told) == len(set(told)) == 64
    assert sum(t.published_ok for t in told) == 57
    right = Counter(t.point for t in told if t.published_ok)
    assert right == {"P1": 22, "P2": 15, "P3": 20}


def test_misses_are_where_the_papers_have_them() -> None:
    """All at 15 mm; 7 of 17 with q5 not 0, none of 15 with q5 = 0 (ledger A4)."""
    missed = [t for t in trials() if not t.published_ok]
    assert {t.distance_mm for t in missed} == {15}
    at_15 = [t for t in trials() if t.distance_mm == 15]
    level = [t for t in at_15 if t.q5_deg == 0]
    tilted = [t for t in at_15 if t.q5_deg != 0]
    assert (len(level), len(tilted)) == (15, 17)
    assert (sum(not t.published_ok for t in level), len(missed)) == (0, 7)
    by_axis = Counter(t.axis for t in missed)
    assert by_axis == {"Y": 2, "Z": 5}


def test_expected_verdict_follows_from_the_margin() -> None:
    assert Trial("P1", "Y", 0, 0, 25).expected == "clear"
    assert Trial("P1", "Y", 0, 0, 15).expected == "contact"
    assert Trial("P1", "Y", 0, 0, 15).approach == PublishedApproach("P1", "Y", 0, 0)


@pytest.mark.parametrize("mount", ["+90", "-90"])
def test_posture_keeps_the_tip_at_the_isocentre(mount: str) -> None:
    for q4, q5 in POSTURES_DEG:
        q = posture(q4, q5, mount)
        tip = forward(q, mount=mount)["E"][:3, 3]
        assert np.abs(tip).max() < 1e-12
        assert np.degrees(q[3:5]) == pytest.approx([q4, q5])


@pytest.mark.parametrize("slope", [1.0, 0.6, 0.05])
def test_stop_is_the_first_place_at_that_distance(slope: float) -> None:
    found = solve_stop(lambda t: 0.05 - slope * t, 0.0, 2.0, 0.025)
    assert found == pytest.approx(0.025 / slope, abs=STOP_TOLERANCE / slope)


def test_stop_is_not_past_a_narrow_place() -> None:
    """A bump that comes within 20 mm at t = 0.1 and is behind the robot at 0.2."""

    def distance(t: float) -> float:
        return 0.02 + abs(t - 0.1)

    found = solve_stop(distance, 0.0, 1.0, 0.025)
    assert found == pytest.approx(0.095, abs=STOP_TOLERANCE)
    assert solve_stop(distance, 0.0, 1.0, 0.015) is None
    assert solve_stop(distance, 0.1, 1.0, 0.025) is None  # begins too near


def test_curved_approach_is_solved() -> None:
    def distance(t: float) -> float:
        return 0.39 - math.hypot(0.2, t)

    found = solve_stop(distance, 0.0, 0.4, 0.025)
    assert found is not None
    assert distance(found) == pytest.approx(0.025, abs=STOP_TOLERANCE)


@pytest.mark.parametrize(
    "approach",
    [
        PublishedApproach("P1", "Y", 0, 0),
        PublishedApproach("P2", "Z", 30, 15),
        PublishedApproach("P3", "Z", -30, -15),
    ],
    ids=str,
)
def test_stops_are_at_the_measured_distance(
    bench: Bench, approach: PublishedApproach
) -> None:
    found = set_up(bench, approach, aim=False)
    assert found.unreachable is None
    moved = []
    for distance_mm in DISTANCES_MM:
        stop = found.stops[distance_mm]
        assert bench.closest(stop.q).distance == pytest.approx(
            1e-3 * distance_mm, abs=MICROMETRE
        )
        assert np.degrees(stop.q[3:5]) == pytest.approx(
            [approach.q4_deg, approach.q5_deg]
        )
        bench.robot.model.check_limits(stop.q)
        moved.append(stop.q[:3])
    along = {"X": 1, "Y": 2, "Z": 0}[approach.axis]
    step = moved[1] - moved[0]
    assert abs(step[along]) > 0.009  # 10 mm nearer needs 10 mm of travel or more
    assert np.delete(step, along) == pytest.approx([0.0, 0.0], abs=1e-15)


def test_aim_brings_the_goal_point_nearer(bench: Bench) -> None:
    approach = PublishedApproach("P1", "Z", 0, 0)
    literal = set_up(bench, approach, aim=False)
    aimed = set_up(bench, approach)
    assert literal.shift == 0.0
    assert aimed.aim_error < 0.02 < literal.aim_error
    assert aimed.stops[15].closest.distance == pytest.approx(0.015, abs=MICROMETRE)


def test_out_of_reach_says_why(bench: Bench) -> None:
    """A gantry 5 m away is never 25 mm away."""
    away = np.eye(4)
    away[0, 3] = 5.0
    far = tuple(replace(o, mesh=o.mesh.moved(away)) for o in bench.scene.obstacles)
    empty = Bench(bench.robot, replace(bench.scene, obstacles=far))
    found = set_up(empty, PublishedApproach("P1", "Y", 0, 15), aim=False)
    assert found.stops == {}
    assert found.unreachable == "the joint limit comes before 25 mm"
    assert outcome(empty, found, 25).verdicts == {}


def test_true_offset_is_right_and_body_axes_alarm_at_25_mm(bench: Bench) -> None:
    """Tilted towards a slanting wall the 20 mm volume reaches 25 to 35 mm."""
    found = set_up(bench, PublishedApproach("P1", "Y", 0, 15), aim=False)
    said = {d: outcome(bench, found, d).verdicts for d in DISTANCES_MM}
    assert set(said[25]) == set(QUESTIONS)
    assert said[25][("exact", "offset")] == "clear"
    assert said[15][("exact", "offset")] == "contact"
    assert said[25][("exact", "enlarge-axes")] == "contact"
    reached = reach(bench, found, "enlarge-axes")
    assert 0.025 < reached < math.sqrt(3) * 0.02 + MICROMETRE
    for verdicts in said.values():
        for checker, kind in QUESTIONS:
            if checker == "two-sided":
                assert verdicts[(checker, kind)] == verdicts[("exact", kind)]


def test_32_approaches_in_the_order_of_the_tables() -> None:
    told = approaches()
    assert len(told) == 32
    assert told[0] == PublishedApproach("P1", "Y", 0, 0)
    assert [a for a in told if a.axis == "X"] == [
        PublishedApproach("P2", "X", 0, 15),
        PublishedApproach("P2", "X", 30, 15),
    ]
