"""Bending by beam theory against an integration, repetitions, and their state file."""

import math
from pathlib import Path

import numpy as np
import pytest

from borecheck.errors import InputError
from zerobot.trials.bench import Bench, Setup, set_up
from zerobot.trials.errors import (
    ALUMINIUM,
    AT_THE_END,
    CARBON,
    GRAVITY,
    Beam,
    Sources,
    bent,
    sag,
    tip_sag,
)
from zerobot.trials.monte_carlo import (
    Experiment,
    chunks,
    draw,
    interval,
    real_stops,
    undisturbed,
)
from zerobot.trials.published import PublishedApproach
from zerobot.trials.run import StudyOptions, _append_state, _key, _read_state

SILENT = Sources(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    return Experiment(Sources())


@pytest.fixture(scope="module")
def setup(experiment: Experiment) -> Setup:
    bench = Bench(experiment.real, experiment.scene)
    found = set_up(bench, PublishedApproach("P2", "Z", 30, 15), aim=False)
    assert found.unreachable is None
    return found


def integrated(beam: Beam, ahead: float) -> tuple[float, float]:
    """Drop and slope at the end from the bending moment, by the trapezoid rule."""
    x = np.linspace(0.0, beam.length, 20_001)
    force = beam.load * GRAVITY
    left = beam.length - x
    moment = force * (left + ahead) + beam.weight * left**2 / 2.0
    step = x[1] - x[0]
    slope = np.concatenate(
        [[0.0], np.cumsum((moment[1:] + moment[:-1]) / 2.0 * step / beam.bending)]
    )
    drop = float(((slope[1:] + slope[:-1]) / 2.0 * step).sum())
    return drop, float(slope[-1])


@pytest.mark.parametrize("beam", [CARBON, ALUMINIUM])
@pytest.mark.parametrize("q5", [0.0, 0.26, -0.26])
def test_bending_is_the_integral_of_the_moment(beam: Beam, q5: float) -> None:
    ahead = beam.load_forward * math.cos(q5) + beam.load_up * math.sin(q5)
    drop, slope = integrated(beam, ahead)
    found = sag(beam, 0.0, q5)
    assert found.displacement == pytest.approx([0.0, 0.0, -drop], rel=1e-6)
    assert found.rotation == pytest.approx([0.0, slope, 0.0], rel=1e-6, abs=1e-15)
    assert 0.3e-3 < drop < 5e-3  # a light arm of 900 mm bends by about a millimetre


def test_twist_is_towards_the_hanging_load() -> None:
    """The load hangs below the arm's axis: turned by q4, gravity turns it back."""
    assert sag(CARBON, 0.0, 0.0).rotation[0] == 0.0
    for q4 in (0.5, -0.5):
        twist = sag(CARBON, q4, 0.0).rotation[0]
        assert twist * q4 < 0.0
        mirrored = sag(CARBON, q4, 0.0, -1.0)
        # about -x the same q4 is the other way round
        assert mirrored.rotation[0] == pytest.approx(-twist)


def test_bent_robot_droops_and_stays_rigid(experiment: Experiment) -> None:
    q = np.array([0.0, 0.0, 0.0, 0.4, 0.2, 0.0])
    stiff = experiment.real.placements(q)
    droop = bent(stiff, CARBON, 0.4, 0.2, 1.0)
    for link, T in droop.items():
        R = T[:3, :3]
        assert np.abs(R @ R.T - np.eye(3)).max() < 1e-12
        moved = T[:3, 3] - stiff[link][:3, 3]
        if link in AT_THE_END:
            assert -5e-3 < moved[2] < -0.3e-3
        elif link in ("base", "lift", "slide", "cross"):
            assert np.array_equal(T, stiff[link])
    assert tip_sag(CARBON, q, "+90")[2] < -0.3e-3
    rigid = Beam(young=1e30, shear=1e30)
    assert np.abs(tip_sag(rigid, q, "+90")).max() < 1e-15


def test_without_errors_the_model_sees_the_true_distance(setup: Setup) -> None:
    stiff = Beam(young=1e30, shear=1e30)
    exact = Experiment(
        Sources(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, beam=stiff), level="coarse"
    )
    stops = real_stops(exact, [setup])
    said = draw(exact, stops, np.random.default_rng(0))
    assert said == pytest.approx(np.array([[0.025, 0.015]]), abs=1e-6)


def test_bent_robot_stands_at_the_measured_distance(
    experiment: Experiment, setup: Setup
) -> None:
    stops = real_stops(experiment, [setup])
    for stop, distance in zip(stops[0], (0.025, 0.015), strict=True):
        assert experiment.true_distance(stop.q) == pytest.approx(distance, abs=1e-6)
        assert 0.1 < stop.slope <= 1.0
    assert np.abs(undisturbed(experiment, stops) - [0.025, 0.015]).max() < 1e-3


def test_pick_shifts_the_model_along_the_normal(
    experiment: Experiment, setup: Setup
) -> None:
    stop = setup.stops[15]
    away = np.array(stop.closest.points[0]) - stop.closest.points[1]
    away /= np.linalg.norm(away)
    said = [experiment.model_distance(stop.q, by * away) for by in (-1e-3, 0.0, 1e-3)]
    assert np.diff(said) == pytest.approx([1e-3, 1e-3], rel=0.02)


def test_chunks_do_not_depend_on_how_many_are_run() -> None:
    few = {i: rng.random() for i, _, rng in chunks(3, 40)}
    draws = [count for _, count, _ in chunks(3, 45)]
    many = {i: rng.random() for i, _, rng in chunks(3, 45)}
    assert draws == [20, 20, 5]
    assert few[0] == many[0] != few[1]


def test_interval_is_exact_at_the_ends() -> None:
    assert interval(0, 20)[0] == 0.0
    assert interval(20, 20) == (pytest.approx(0.025 ** (1 / 20)), 1.0)
    low, high = interval(57, 64)
    assert low < 57 / 64 < high
    assert (round(low, 2), round(high, 2)) == (0.79, 0.95)


def test_state_file_keeps_chunks_and_refuses_another_study(tmp_path: Path) -> None:
    file = tmp_path / "state.jsonl"
    key = _key(StudyOptions(), Sources(), [])
    other = _key(StudyOptions(seed=1), Sources(), [])
    assert key != other
    values = np.array([[[25.1, 15.2]]])
    _append_state(file, key, 3, values)
    with file.open("a") as stream:
        stream.write('{"key": "' + key)  # cut short by an interruption
    again = _read_state(file, key)
    assert list(again) == [3]
    assert np.array_equal(again[3], values)
    with pytest.raises(InputError, match="another study"):
        _read_state(file, other)
    assert _read_state(tmp_path / "none", key) == {}
