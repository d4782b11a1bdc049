"""A fit of wrong data says what is odd; a fit of honest data says nothing."""

import json
from dataclasses import replace

import numpy as np
import pytest

from borecheck.calibration.arm_source import read_subject
from borecheck.calibration.fit import fit
from borecheck.calibration.measurements import read_measurements, write_measurements
from borecheck.calibration.plausible import oddities
from borecheck.calibration.simulate import simulate
from borecheck.cli import main
from tests.places import DATA

CASES = DATA / "cases"


@pytest.fixture(scope="module")
def subject():
    return read_subject("mri_arm", {}, [], None, None, None)


@pytest.fixture(scope="module")
def measured(subject):
    def make(noise="laser", seed=1):
        rng = np.random.default_rng(seed)
        return simulate(subject.arm, subject.setup, 21, noise, rng)[0]

    return make


def found(subject, data, refined=True, robust=False):
    result = fit(subject.arm, data, refined=refined, robust=robust)
    return oddities(result, data)


@pytest.mark.parametrize("noise", ["none", "laser", "cameras", "voxels"])
@pytest.mark.parametrize("refined", [False, True])
def test_honest_data_are_not_odd(subject, measured, noise, refined):
    for seed in (1, 2):
        assert found(subject, measured(noise, seed), refined) == []


@pytest.mark.parametrize("factor", [10.0, 1.0 / 0.3048, 0.1, 0.0254, 1e-3])
def test_another_unit_is_told_as_one_thing(subject, measured, factor):
    data = measured()
    (line,) = found(subject, replace(data, points=factor * data.points))
    assert "in another unit" in line


def test_a_joint_in_anothers_column_is_told(subject, measured):
    data = measured()
    swapped = np.array(data.q)[:, [0, 1, 2, 5, 4, 3]]
    names = dict(q4="q6", q6="q4")
    moving = tuple(names.get(name, name) for name in data.moving)
    lines = found(subject, replace(data, q=swapped, moving=moving))
    assert any("each other's columns" in line for line in lines)


@pytest.mark.parametrize("refined", [False, True])
def test_a_target_that_slipped_is_told(subject, measured, refined):
    data = measured()
    points = data.points.copy()
    points[data.of("q3")[0] :] += [0.0, 0.0, 0.004]
    lines = found(subject, replace(data, points=points), refined)
    assert any("slip" in line or "off the drawing" in line for line in lines)


def test_mistakes_are_told_unless_they_are_left_out(subject, measured):
    data = measured()
    points = data.points.copy()
    points[[7, 40]] += [0.03, -0.02, 0.01]
    wrong = replace(data, points=points)
    (line,) = found(subject, wrong)  # a wrong sample draws others with it
    assert {"8", "41"} <= set(line.partition(" are ")[0].replace(",", "").split())
    assert found(subject, wrong, robust=True) == []


def test_exact_repeats_are_counted_once(subject, measured, tmp_path):
    data = measured()
    file, doubled = tmp_path / "once.csv", tmp_path / "twice.csv"
    write_measurements(file, subject.arm, data)
    header, *rows = file.read_text().splitlines()
    doubled.write_text("\n".join([header, *rows, *rows[3:9]]) + "\n")
    read = read_measurements(doubled, subject.arm)
    assert read.repeated == 6
    assert np.array_equal(read.points, read_measurements(file, subject.arm).points)


@pytest.mark.parametrize(
    ("data", "saying"),
    [
        ("cal_wrong_scale/dm.csv", "9.986 times as drawn"),
        ("cal_wrong_scale/feet.csv", "another unit"),
        ("cal_swapped_joints/swap46.csv", "each other's columns"),
    ],
)
def test_no_urdf_is_written_of_an_odd_fit(data, saying, tmp_path, capsys):
    out = tmp_path / "out.urdf"
    words = ["calibrate", "fit", "mri_arm", str(CASES / data), "--refine"]
    assert main([*words, "--urdf", str(out)]) == 1
    printed = capsys.readouterr()
    assert saying in printed.out
    assert "not written, because the fit is odd" in printed.err
    assert not out.exists()


def test_of_each_prismatic_joint_it_is_said_that_it_is_not_identified(capsys, tmp_path):
    data = str(tmp_path / "d.csv")
    words = ["calibrate", "simulate", "zerobot", "--samples", "20", "--out", data]
    assert main(words) == 0
    capsys.readouterr()
    out = tmp_path / "fit.json"
    for more in (
        ["plan", "zerobot", "--samples", "10", "--out", str(tmp_path / "p.csv")],
        ["observe", "zerobot", data],
        ["fit", "zerobot", data, "--out", str(out)],
    ):
        main(["calibrate", *more])
        err = capsys.readouterr().err
        for joint in ("q1", "q2", "q3"):
            line = f"borecheck: prismatic joint {joint} is not identified: held at"
            assert err.count(line) == 1
    held = json.loads(out.read_text())["not_identified"]
    assert held.keys() == {"q1", "q2", "q3"}


def test_prismatic_joints_are_named(capsys, tmp_path):
    arm = CASES / "calib_prismatic" / "gantry.urdf"
    words = ["calibrate", "simulate", str(arm), "--samples", "21"]
    assert main([*words, "--out", str(tmp_path / "d.csv")]) == 2
    assert "prismatic joints are not identified" in capsys.readouterr().err
