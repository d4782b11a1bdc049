"""Each field of a plan and each way a file fails, at its borders."""

import json
from pathlib import Path

import numpy as np
import pytest

from borecheck.errors import GeometryError, PlanError
from borecheck.plans import path_file, plan_file
from borecheck.plans.needle_plan import NeedlePlan, plan_problem, waypoints
from borecheck.plans.path_file import read_path
from borecheck.plans.plan_fields import plan_of
from borecheck.plans.plan_file import read_plans

POINTS = {
    "entry_x": 0.0,
    "entry_y": 0.0,
    "entry_z": 0.1,
    "target_x": 0.0,
    "target_y": 0.0,
    "target_z": 0.0,
}


def plan(settings=None, **fields):
    return plan_of({"name": "p", **POINTS, **fields}, "f", "line 1", settings)


@pytest.mark.parametrize(
    ("name", "taken"),
    [
        ("liver", "liver"),
        ("  liver ", "liver"),
        ("7", "7"),
        (7, "7"),
        ("a" * 200, "a" * 200),
        ("a" * 201, None),
        ("a\nb", None),
        ("a\x1bb", None),
        ("", None),
        ("  ", None),
        ("0.5", None),
        ("-3", None),
        ("1e3", None),
        (True, None),
        (None, None),
        (0.5, None),
        (["a"], None),
    ],
)
def test_names(name, taken):
    if taken is None:
        with pytest.raises(PlanError, match="name"):
            plan(name=name)
    else:
        assert plan(name=name).name == taken


@pytest.mark.parametrize(
    "value",
    [
        True,
        None,
        [0.1],
        {},
        "0,1",
        "1_0",
        "",
        "nan",
        "inf",
        "-Infinity",
        "ten",
        "\u0661",
    ]
    + [float("nan"), float("inf"), 10**400, "1e999"],
)
def test_what_is_no_coordinate(value):
    with pytest.raises(PlanError, match="plan 'p': entry_z"):
        plan(entry_z=value)


@pytest.mark.parametrize(("value", "metres"), [("0.1", 0.1), (" +.5 ", 0.5), (1, 1.0)])
def test_coordinates_as_numbers_and_text(value, metres):
    assert plan(entry_z=value).entry.tolist() == [0.0, 0.0, metres]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"unit": "furlong"}, "unit"),
        ({"unit": 1}, "unit"),
        ({"unit": ["m"]}, "unit"),
        ({"unit": True}, "unit"),
        ({"frame": 1}, "frame"),
        ({"frame": None}, "frame"),
        ({"frame": "LPI"}, "frame"),
        ({"frame": "RAS", "patient_position": "XYZ"}, "position"),
        ({"origin": [0, 0]}, "origin"),
        ({"origin": "0,0,0"}, "origin"),
        ({"origin": [0, 0, None]}, "origin"),
        ({"origin": [0, 0, True]}, "origin"),
        ({"patient_position": "HFS"}, "needs a frame"),
    ],
)
def test_settings_that_make_no_sense(settings, words):
    with pytest.raises(PlanError, match=words):
        plan(settings)


def test_unit_and_origin_scale_and_shift_every_point():
    settings = {"unit": "mm", "origin": [10, 20, 30]}
    found = plan(settings, entry_z=100, target_x=-40)
    np.testing.assert_allclose(found.entry, [0.01, 0.02, 0.13])
    np.testing.assert_allclose(found.target, [-0.03, 0.02, 0.03])
    assert found.notes == ()


@pytest.mark.parametrize(
    ("settings", "count"),
    [
        ({"frame": "RAS"}, 2),
        ({"frame": "RAS", "origin": [0, 0, 0]}, 1),
        ({"frame": "LPS", "patient_position": "HFP"}, 1),
        ({"frame": "LPS", "patient_position": "HFP", "origin": [0, 0, 0]}, 0),
        ({}, 0),
    ],
)
def test_what_is_left_to_a_convention_is_noted(settings, count):
    assert len(plan(settings).notes) == count


@pytest.mark.parametrize(
    ("mount", "taken"),
    [
        ("+90", "+90"),
        ("90", "+90"),
        (-90, "-90"),
        ("-90.0", "-90"),
        ("", None),
        (None, None),
    ],
)
def test_mounts(mount, taken):
    assert plan(mount=mount).mount == taken
    for wrong in ("0", 45, "89.999", True, "left"):
        with pytest.raises(PlanError, match="mount"):
            plan(mount=wrong)


def test_rolls():
    assert plan().roll is None
    assert plan(roll="").roll is None
    assert plan(roll=0).roll == 0.0
    assert plan(roll=-0.5).roll == -0.5
    assert plan(roll="90deg").roll == pytest.approx(np.pi / 2)
    for wrong in (True, [], float("nan"), "up"):
        with pytest.raises(PlanError):
            plan(roll=wrong)


@pytest.mark.parametrize(
    ("entry", "target", "fine"),
    [
        ([0, 0, 5.0], [0, 0, 4.5], True),
        ([0, 0, 5.0 + 1e-9], [0, 0, 4.5], False),
        ([0, -5.0, 0], [0, -5.0 - 1e-9, 0.5], False),
        ([0, 0, 1e-3], [0, 0, 0], True),
        ([0, 0, 1e-3 - 1e-12], [0, 0, 0], False),
        ([0, 0, 1.0], [0, 0, 0], True),
        ([0, 0, 1.0 + 1e-9], [0, 0, 0], False),
        ([0, 0, 0, 0.1], [0, 0, 0], False),
        ([0, 0, 0.1], [[0, 0, 0]], False),
        ([0, 0, 0.1], [0, 0, float("inf")], False),
    ],
)
def test_paths_from_a_millimetre_to_a_metre_within_five(entry, target, fine):
    assert (plan_problem(entry, target) is None) == fine


def test_a_plan_of_another_mount_or_roll_is_none():
    for given in ({"mount": "90"}, {"mount": ""}, {"roll": float("nan")}):
        with pytest.raises(GeometryError):
            NeedlePlan("p", [0, 0, 0.1], [0, 0, 0], **given)
    whole = NeedlePlan("p", [0, 0.03, 0.04], [0, 0, 0], 0.5, "-90")
    assert (whole.length, whole.mount, whole.roll) == (0.05, "-90", 0.5)
    np.testing.assert_allclose(whole.direction, [0.0, -0.6, -0.8])


def test_waypoints_lie_on_the_line_each_at_its_distance():
    given = NeedlePlan("p", [0.1, 0.2, 0.1], [0.1, 0.2 - 0.06, 0.1 - 0.08])
    path = waypoints(given, standoff=0.03, step=0.02, insertion=0.01)
    assert [w.along for w in path] == pytest.approx(
        [-0.03, -0.015, 0.0, 0.02, 0.04, 0.06, 0.08, 0.1]
    )
    for w in path:
        expected = np.array([0.1, 0.2 - 0.6 * w.along, 0.1 - 0.8 * w.along])
        np.testing.assert_allclose(w.tip, expected, atol=1e-15)
        assert w.insertion == pytest.approx(0.01 + max(w.along, 0.0))
        assert w.phase == ("approach" if w.along <= 0.0 else "insertion")
        with pytest.raises(ValueError, match="read-only"):
            w.tip[0] = 1.0
    for bad in ((float("inf"), 0.1), (-1e-9, 0.1), (0.1, -0.1), (0.1, float("inf"))):
        with pytest.raises(GeometryError):
            waypoints(given, *bad)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (PermissionError(13, "denied"), "no permission to read it"),
        (OSError(5, "broken disk"), "cannot be read as text"),
        (FileNotFoundError(2, "gone"), "there is no such file"),
    ],
)
def test_paths_that_cannot_be_read(tmp_path, monkeypatch, error, words):
    file = tmp_path / "path.csv"
    file.write_text("q1\n1\n")

    def refuse(*_given, **_named):
        raise error

    monkeypatch.setattr(Path, "read_text", refuse)
    with pytest.raises(PlanError, match=words):
        read_path(file, ("q1",))


def test_files_that_are_too_large_or_no_text(tmp_path, monkeypatch):
    monkeypatch.setattr(path_file, "MAX_BYTES", 9)
    monkeypatch.setattr(plan_file, "MAX_BYTES", 9)
    file = tmp_path / "path.csv"
    file.write_text("q1\n1.0000")
    assert read_path(file, ("q1",)).tolist() == [[1.0]]
    file.write_text("q1\n1.00000")
    with pytest.raises(PlanError, match="larger than 50 MB"):
        read_path(file, ("q1",))
    with pytest.raises(PlanError, match="is larger than 9 bytes"):
        read_plans(file)
    for content, words in (
        (b"\xff\xfe\xff", "no text in UTF-8"),
        (b" \n ", "is empty"),
        (b"a\0b", "NUL"),
    ):
        file.write_bytes(content)
        with pytest.raises(PlanError, match=words):
            read_plans(file)
    with pytest.raises(PlanError, match="cannot be read"):
        read_plans(tmp_path / "none.csv")


NINE = {"name": "p", "entry": [0, 0, 0.1], "target": [0, 0, 0]}


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({**NINE, "entry": "0,0,0"}, "entry is no list of three"),
        ({**NINE, "entry": "abc"}, "entry is no list of three"),
        ({**NINE, "target": [0, 0]}, "target is no list of three"),
        ({**NINE, "entry_x": 1}, "entry_x is given twice"),
        ({"name": "p", "entry": [0, 0, 0.1]}, "missing fields: target_x"),
        ({**NINE, "depth": 1}, "unknown field 'depth'"),
        ({"plans": [NINE], "units": "m"}, "unknown field 'units'"),
        ({"plans": []}, "holds no plan"),
        ({"plans": NINE}, "holds no plan"),
        ([], "holds no plan"),
        ([NINE, NINE], "two plans are called 'p'"),
        ([NINE, 1], "plan 2"),
    ],
)
def test_json_that_is_no_plan(tmp_path, document, words):
    file = tmp_path / "p.json"
    file.write_text(json.dumps(document))
    with pytest.raises(PlanError, match=words):
        read_plans(file)


@pytest.mark.parametrize("document", [NINE, [NINE], {"plans": [NINE], "unit": "m"}])
def test_json_in_each_of_its_forms(tmp_path, document):
    file = tmp_path / "p.json"
    file.write_text(json.dumps(document))
    (found,) = read_plans(file)
    assert found.entry.tolist() == [0.0, 0.0, 0.1]


HEADER = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEADER + "\np,0,0,0.1,0,0\n", "6 cells under 7 columns"),
        (HEADER + "\np,0,0,0.1,0,0,0,0\n", "8 cells under 7 columns"),
        (HEADER + "\n", "a header and no plan"),
        (HEADER.replace("target_z", "depth") + "\np,0,0,0.1,0,0,0\n", "unknown column"),
        (HEADER.replace("target_z", "name") + "\np,0,0,0.1,0,0,q\n", "name"),
        (HEADER.replace(",target_z", "") + "\np,0,0,0.1,0,0\n", "missing column"),
        (HEADER.replace(",", ";") + "\np;0;0;0.1;0;0;0\n", "commas"),
        (HEADER + '\np,0,0,0.1,0,0,"0\n', "no CSV"),
    ],
)
def test_csv_that_is_no_plan(tmp_path, text, words):
    file = tmp_path / "p.csv"
    file.write_text(text)
    with pytest.raises(PlanError, match=words):
        read_plans(file)


def test_plans_are_read_up_to_twenty_megabytes(tmp_path):
    file = tmp_path / "p.csv"
    file.write_bytes(b"")
    for size, words in ((20_000_000, "NUL"), (20_000_001, "larger than 20000000")):
        with file.open("r+b") as opened:
            opened.truncate(size)
        with pytest.raises(PlanError, match=words):
            read_plans(file)


@pytest.mark.parametrize("other", ["entry_z_mm", "entry_z_m"])
def test_a_coordinate_with_a_unit_and_without_is_refused(tmp_path, other):
    file = tmp_path / "p.json"
    file.write_text(json.dumps({"name": "p", **POINTS, other: 100}))
    with pytest.raises(PlanError, match="not in the same unit"):
        read_plans(file)
