"""`borecheck calibrate`: the contract of the command line, and its refusals."""

import json

import numpy as np
import pytest

from borecheck.cli import main

NOISE_FREE = 1e-12  # the figure


def run(*words):
    return main(["calibrate", *map(str, words)])


@pytest.fixture
def data(tmp_path):
    paths = tmp_path / "data.csv", tmp_path / "truth.json"
    status = run(
        "simulate", "mri_arm", "--samples", 21, "--seed", 5,
        "--out", paths[0], "--truth", paths[1],
    )  # fmt: skip
    assert status == 0
    return paths


@pytest.mark.parametrize("refine", [(), ("--refine",)])
def test_noise_free_data_give_the_truth(data, capsys, refine):
    capsys.readouterr()
    assert run("fit", "mri_arm", data[0], *refine, "--format", "json") == 0
    result = json.loads(capsys.readouterr().out)
    truth = json.loads(data[1].read_text())["parameters"]
    assert len(truth) == 24
    assert set(result["parameters"]) == set(truth)
    for name, value in truth.items():
        row = result["parameters"][name]
        assert row["value"] == pytest.approx(value, abs=NOISE_FREE)
        assert row["sigma"] < 1e-9
    assert result["rms_m"] < NOISE_FREE
    assert result["schema_version"] == "1"
    assert max(
        abs(r["value"] - r["nominal"]) for r in result["parameters"].values()
    ) > (1e-3)


def test_the_papers_start_takes_at_most_8_iterations(data, capsys):
    capsys.readouterr()
    assert run("fit", "mri_arm", data[0], "--start", "nominal", "--format", "json") == 0
    result = json.loads(capsys.readouterr().out)
    assert 1 <= result["iterations"] <= 8


@pytest.mark.parametrize("noise", ["laser", "cameras", "cameras4", "voxels"])
def test_devices_can_be_simulated_and_fitted(tmp_path, capsys, noise):
    csv = tmp_path / "data.csv"
    simulated = run(
        "simulate", "mri_arm", "--samples", 42, "--noise", noise, "--out", csv
    )
    assert simulated == 0
    assert run("fit", "mri_arm", csv, "--refine", "--out", tmp_path / "r.json") == 0
    text = capsys.readouterr().out
    assert "axis q6: 42 samples" in text
    assert run("report", tmp_path / "r.json", tmp_path / "r.html") == 0
    html = (tmp_path / "r.html").read_text()
    assert html.count("<svg") == 6
    assert "http" not in html.replace("http://www.w3.org", "")


def test_corrected_robot_is_accepted(data, tmp_path, capsys):
    urdf = tmp_path / "corrected.urdf"
    assert run("fit", "mri_arm", data[0], "--urdf", urdf) == 0
    assert main(["validate", str(urdf)]) == 0
    assert main(["fk", str(urdf), "--random", "5"]) == 0
    capsys.readouterr()
    assert run("fit", urdf, data[0], "--world", "W", "--tip", "6") == 0


def test_same_seed_same_bytes(data, tmp_path):
    again = tmp_path / "again.csv"
    run("simulate", "mri_arm", "--samples", 21, "--seed", 5, "--out", again)
    assert again.read_bytes() == data[0].read_bytes()


def test_what_samples_show_is_said(data, tmp_path, capsys):
    capsys.readouterr()
    assert run("observe", "mri_arm", data[0]) == 0
    assert "all seen, condition number" in capsys.readouterr().out
    still = tmp_path / "still.csv"
    rows = [f"{0.1 * k},0.1,{0.05 * k},0.3,{0.2 * (k % 3)},0.4" for k in range(20)]
    still.write_text("\n".join(["q1,q2,q3,q4,q5,q6", *rows]))
    assert run("observe", "mri_arm", still, "--format", "json") == 0
    seen = json.loads(capsys.readouterr().out)
    assert seen["condition"] is None
    assert seen["unseen"]


def test_encoders_of_a_strangers_arm_can_be_coarse(tmp_path, capsys):
    csv = tmp_path / "data.csv"
    words = ("--noise", "laser", "--pulse", "0.1deg", "--out", csv)
    assert run("simulate", "mri_arm", *words) == 0
    capsys.readouterr()
    assert run("fit", "mri_arm", csv, "--refine", "--format", "json") == 0
    noise = json.loads(capsys.readouterr().out)["noise"]
    # -1, 0, +1 pulse: a standard deviation of 0.82 pulses
    for value in noise["joints_rad"].values():
        assert value == pytest.approx(np.radians(0.0816), rel=0.3)


def test_planned_samples_are_joint_values(tmp_path, capsys):
    out = tmp_path / "plan.csv"
    words = ("--samples", 12, "--candidates", 60, "--out", out)
    assert run("plan", "mri_arm", *words) == 0
    assert "target uncertain by" in capsys.readouterr().err
    table = np.loadtxt(out, delimiter=",", skiprows=1)
    assert table.shape == (12, 6)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("fit", "mri_arm", "none.csv"), "there is no such file"),
        (("fit", "mri_amr", "none.csv"), "unknown robot 'mri_amr'"),
        (("fit", "zerobot", "none.csv"), "there is no such file"),
        (("simulate", "mri_arm", "--out", "no/such/x.csv"), "cannot be written"),
        (("simulate", "mri_arm", "--samples", "2", "--out", "x"), "at least 3"),
        (
            ("simulate", "mri_arm", "--noise", "sonar", "--out", "x"),
            "unknown noise 'sonar'",
        ),
        (("report", "none.json", "x.html"), "there is no such file"),
        (("plan", "mri_arm", "--samples", "5"), "--samples must lie between 10"),
        (("fit", "mri_arm", "x", "--target", "1,2"), "--target '1,2' is not X,Y,Z"),
    ],
)
def test_what_cannot_be_done_is_one_line(tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    assert run(*words) == 2
    errors = capsys.readouterr().err
    assert message in errors
    assert errors.count("\n") == 1


def test_half_a_data_set_says_which_joint_is_missing(data, tmp_path, capsys):
    header, *rows = data[0].read_text().splitlines()
    half = tmp_path / "half.csv"
    half.write_text("\n".join([header, *(r for r in rows if not r.endswith("q4"))]))
    assert run("fit", "mri_arm", half) == 2
    assert "q4 never turned alone" in capsys.readouterr().err
