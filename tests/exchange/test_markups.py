"""Markups of Slicer: points in LPS, whatever a file says they are in."""

import json
import string

import numpy as np
import pytest

from borecheck.errors import InputError
from borecheck.exchange.markups import markup_json, read_markups
from tests.places import DATA

SLICER = DATA / "slicer"
EXPECTED = json.loads((SLICER / "manifest.json").read_text())["entries"]
POINTS = [name for name in EXPECTED if name.endswith((".mrk.json", ".fcsv"))]


@pytest.mark.parametrize("name", POINTS)
def test_points_are_where_the_manifest_has_them(name):
    entry = EXPECTED[name]
    there = entry.get("points_lps_mm") or [
        entry["entry_lps_mm"],
        entry["target_lps_mm"],
    ]
    (markup,) = read_markups(SLICER / name)
    np.testing.assert_allclose(1e3 * markup.points_lps, there, atol=1e-9)
    assert len(markup.labels) == len(there)


def test_what_is_written_says_its_frame_and_is_read_back(tmp_path):
    points = np.random.default_rng(2).uniform(-1.0, 1.0, (5, 3))
    labels = list(string.ascii_letters[:5])
    file = tmp_path / "ours.mrk.json"
    file.write_text(markup_json("ours", "Fiducial", points, labels))
    (plain,) = json.loads(file.read_text())["markups"]  # by none of our code
    assert (plain["coordinateSystem"], plain["coordinateUnits"]) == ("LPS", "mm")
    written = [point["position"] for point in plain["controlPoints"]]
    np.testing.assert_allclose(written, 1e3 * points, rtol=1e-15)
    (back,) = read_markups(file)
    np.testing.assert_allclose(back.points_lps, points, rtol=1e-15)
    assert back.labels == tuple(labels)


def line(**changes):
    markup = {
        "type": "Line",
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "controlPoints": [{"label": "a", "position": [1, 2, 3]}],
    }
    markup = {k: v for k, v in (markup | changes).items() if v is not None}
    return json.dumps({"@schema": "markups-schema", "markups": [markup]})


def point(**changes):
    return line(controlPoints=[{"label": "a", "position": [1, 2, 3]} | changes])


FCSV = (
    "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
    "# columns = id,x,y,z,label\n1,1,2,3,a\n"
)
REFUSED = {
    "no frame": (line(coordinateSystem=None), "no coordinateSystem"),
    "another frame": (line(coordinateSystem="IJK"), "neither LPS nor RAS"),
    "no frame's kind": (line(coordinateSystem=1), "neither LPS nor RAS"),
    "another unit": (line(coordinateUnits="furlong"), "none of m"),
    "a plane": (line(type="Plane"), "of type 'Plane'"),
    "no points": (line(controlPoints=[]), "no point"),
    "an undefined point": (point(positionStatus="undefined"), "not defined"),
    "two numbers": (point(position=[1, 2]), "three finite numbers"),
    "a large number": (point(position=[1, 2, 10**400]), "three finite numbers"),
    "not a number": (point().replace("[1, 2, 3]", "[1, 2, NaN]"), "no finite number"),
    "nothing": ('{"@schema": "markups-schema"}', "no `markups`"),
    "half": (point()[:-9], "no JSON"),
    "fcsv, no frame": (
        FCSV.replace("CoordinateSystem", "System"),
        "no CoordinateSystem",
    ),
    "fcsv, IJK": (FCSV.replace("LPS", "2"), "neither LPS nor RAS"),
    "fcsv, no columns": (FCSV.replace("x,y", "u,v"), "x, y and z"),
    "fcsv, words": (FCSV.replace("1,1,2", "1,one,2"), "no finite number"),
    "fcsv, short": (FCSV.replace(",3,a", ""), "3 cells under 5"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_not_said_is_not_guessed(case, tmp_path):
    text, said = REFUSED[case]
    (tmp_path / "m").write_text(text)
    with pytest.raises(InputError, match=said) as told:
        read_markups(tmp_path / "m")
    assert "\n" not in str(told.value)


def test_units_are_heard(tmp_path):
    for unit, scale in (("cm", 1e-2), (["mm", "UCUM", "millimeter"], 1e-3), ("m", 1.0)):
        (tmp_path / "m").write_text(line(coordinateUnits=unit))
        (markup,) = read_markups(tmp_path / "m")
        np.testing.assert_allclose(markup.points_lps[0], scale * np.array([1, 2, 3]))
        assert not markup.notes
    (tmp_path / "m").write_text(line(coordinateUnits=None))
    assert "mm" in read_markups(tmp_path / "m")[0].notes[0]
