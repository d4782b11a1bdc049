"""`borecheck crane`: texts, files, pictures, and what is refused in one line."""

import argparse
import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from borecheck.errors import BorecheckError
from borecheck.report.page import page
from crane.command import add_arguments, run
from crane.encoders import simulated_series
from crane.pictures import curves
from crane.series_file import HEADER
from crane.transmission import CABLE


def asked(*words):
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    args = parser.parse_args(words)
    args.argv, args.case = ["crane", *words], None  # as the command line does
    return run(args)


def written(tmp_path, series):
    path = tmp_path / "series.csv"
    rows = np.hstack([series.motors, series.joints])
    lines = [",".join(map(repr, map(float, row))) for row in rows]
    path.write_text("\n".join([",".join(HEADER), *lines]) + "\n")
    return path


@pytest.mark.parametrize(
    ("study", "count", "says"),
    [
        ("inverse", "100", "0 lost"),
        ("coupling", "500", "m5 and m6 are driven in step"),
        ("statics", "100", "5 N at frame 8"),
        ("registration", "100", "eq. (15) read as affine"),
    ],
)
def test_studies_print_and_write(study, count, says, tmp_path, capsys):
    out, report = tmp_path / "out.json", tmp_path / "page.html"
    status = asked(
        *(study, "--count", count, "--out", str(out), "--report", str(report))
    )
    assert status == 0
    assert says in capsys.readouterr().out
    document = json.loads(out.read_text())
    assert document["command"] == "crane"
    assert document["study"] == study
    assert any(says in line for line in document["told"])
    assert report.read_text() == page(document)
    assert "What the study says" in report.read_text()


def test_the_loop_has_pictures(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("crane.studies.control.limits", list)  # half a minute each
    monkeypatch.setattr("crane.studies.control.motors", lambda targets, q0: [])
    assert asked("control", "--count", "200", "--pictures", str(tmp_path)) == 0
    assert "feed-forward" in capsys.readouterr().out
    for name in ("position", "angle", "path"):
        root = ET.fromstring((tmp_path / f"{name}.svg").read_text())
        lines = root.findall("{http://www.w3.org/2000/svg}polyline")
        assert len(lines) >= 3
        assert all(len(line.get("points").split()) == 20 for line in lines[-3:])


def test_the_covariance_is_a_file_for_check(tmp_path, capsys):
    path = tmp_path / "errors.json"
    asked("registration", "--count", "100", "--uncertainty", str(path))
    capsys.readouterr()
    (block,) = json.loads(path.read_text()).values()
    assert block["names"] == ["x", "y", "z", "rx", "ry", "rz"]
    assert np.linalg.eigvalsh(block["covariance"]).min() > 0.0


def test_a_measured_series_is_identified(tmp_path, capsys):
    series = simulated_series(1000, np.random.default_rng(0), bits=False, offset=0.01)
    path = written(tmp_path, series)
    assert asked("coupling", "--series", str(path), "--format", "json") == 0
    (found,) = json.loads(capsys.readouterr().out)["found"]
    np.testing.assert_allclose(found["cable"], CABLE, atol=1e-12)
    np.testing.assert_allclose(found["offset"], 0.01, atol=1e-12)


def test_a_series_in_step_is_refused_with_its_file(tmp_path):
    path = written(
        tmp_path, simulated_series(500, np.random.default_rng(0), in_step=True)
    )
    with pytest.raises(
        BorecheckError, match=r"series.csv: m5 and m6 are driven in step"
    ):
        asked("coupling", "--series", str(path))


def test_a_series_of_a_spreadsheet_is_the_same(tmp_path, capsys):
    """With a byte-order mark, its line ends, and blank lines at its end."""
    series = simulated_series(100, np.random.default_rng(0))
    path = written(tmp_path, series)
    asked("coupling", "--series", str(path))
    plain = capsys.readouterr().out
    text = path.read_text().replace("\n", "\r\n")
    path.write_bytes(b"\xef\xbb\xbf" + f"{text}\r\n  \n".encode())
    asked("coupling", "--series", str(path))
    assert capsys.readouterr().out == plain


def test_a_series_tells_its_errors_and_what_speaks_against_the_paper(tmp_path, capsys):
    C = np.array(CABLE)
    C[0, 1] = 0.02
    path = written(tmp_path, simulated_series(500, np.random.default_rng(1), cable=C))
    assert asked("coupling", "--series", str(path), "--out", str(tmp_path / "o")) == 0
    lines = capsys.readouterr().out.splitlines()
    (warning,) = [line for line in lines if "warning" in line]
    assert "not lower triangular" in warning
    assert "m6 moves q5 by 0.02" in warning
    (found,) = json.loads((tmp_path / "o").read_text())["found"]
    first = lines.index("standard errors of the entries, residual of the row") + 1
    told = [line.split()[1:5] for line in lines[first : first + 4]]
    np.testing.assert_allclose(
        np.array(told, float), found["standard_error"], rtol=0.06
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: the header must be m5,m6"),
        ("a,b\n1,2\n", "line 1: the header"),
        (",".join(HEADER) + "\n1,2,3,4,5,6,7,x\n", "line 2: q8 = 'x' is no finite"),
        (",".join(HEADER) + "\n1,2,nan,4,5,6,7,8\n", "line 2: m7 = 'nan' is no finite"),
        (",".join(HEADER) + "\n1,2,3,4,5,6,7,8\n1,2,3,4,5,6,7,\n", "line 3: q8 = ''"),
        (",".join(HEADER) + "\n1,2,3,1e999,5,6,7,8\n", "line 2: m8 = '1e999'"),
        (",".join(HEADER) + "\n1,2,3,4,5,6,1e160,8\n", "line 2: q7 = 1e160: readings"),
        (",".join(HEADER) + "\n\n1,2,3,4,5,6,7,8\n", "line 2: 1 numbers, not 8"),
        (",".join(HEADER) + "\n1,2,3\n", "line 2: 3 numbers, not 8"),
        (",".join(HEADER) + "\n", "0 samples"),
    ],
)
def test_a_bad_series_is_one_line(text, message, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(BorecheckError, match=message):
        asked("coupling", "--series", str(path))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("statics", "--count", "3"), "100 is the least"),
        (("inverse", "--count", "9999999"), "1000000 is the most"),
        (("control", "--count", "150"), "200 is the least"),
        (("statics", "--seed", "-1"), "--seed is 0 or more"),
        (
            ("statics", "--series", "x.csv"),
            "--series is for `borecheck crane",
        ),
        (("coupling", "--pictures", "."), "--pictures is for"),
        (("coupling", "--series", "x.csv", "--count", "500"), "--count is for simul"),
        (("coupling", "--series", "x.csv", "--seed", "1"), "--seed is for simulated"),
        (("control", "--pictures", ".", "--out", "angle.svg"), "name the same file"),
        (("control", "--pictures", "no/such"), "no such directory"),
        (("coupling", "--series", "no/such.csv"), "cannot be read: No such file"),
        (("coupling", "--series", "."), "cannot be read: Is a directory"),
    ],
)
def test_what_makes_no_sense_is_refused(words, message):
    with pytest.raises(BorecheckError, match=message):
        asked(*words)


def test_a_picture_holds_its_points_and_escapes_its_names():
    root = ET.fromstring(curves({"a<b": [(0, 0), (1, 2)], "flat": [(0, 1)]}, "x", "y"))
    assert "a<b" in "".join(root.itertext())
    assert len(root.findall("{http://www.w3.org/2000/svg}polyline")) == 2
