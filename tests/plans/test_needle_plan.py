"""Plans: read by name, refused in one line, converted, sampled, written, read back."""

import json
import math
import os
import stat
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from borecheck.core.patient_frame import POSITIONS, scanner_from_patient
from borecheck.errors import GeometryError, PlanError, UnknownNameError
from borecheck.plans.needle_plan import NeedlePlan, waypoints
from borecheck.plans.plan_file import plans_csv, plans_json, read_plans, save_plans
from tests.places import DATA

CORPUS = DATA / "plans"
INVALID = sorted(
    f for f in (CORPUS / "invalid").iterdir() if f.suffix in (".csv", ".json")
)
HEADER = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z\n"


def one_line(error: pytest.ExceptionInfo[PlanError]) -> str:
    text = str(error.value)
    assert "\n" not in text
    return text


def test_csv_is_read_by_column_name() -> None:
    plans = read_plans(CORPUS / "two.csv")
    assert [plan.name for plan in plans] == ["lesion, left", "7"]
    assert plans[0].entry.tolist() == [0.01, 0.02, 0.15]
    assert plans[0].target.tolist() == [0.01, 0.04, 0.05]
    assert plans[1].roll == pytest.approx(math.radians(15))
    assert plans[1].mount == "-90"
    assert plans[0].roll is plans[0].mount is None


def test_column_order_does_not_matter(tmp_path: Path) -> None:
    file = tmp_path / "p.csv"
    header = "target_z,target_y,target_x,name,entry_x,entry_y,entry_z"
    file.write_text(f"{header}\n0.06,0.05,0.04,p,0.01,0.02,0.03\n")
    plan = read_plans(file)[0]
    assert plan.entry.tolist() == [0.01, 0.02, 0.03]
    assert plan.target.tolist() == [0.04, 0.05, 0.06]


IN_MM = ",".join(
    f"{c}_mm" if c.startswith(("entry", "target")) else c
    for c in HEADER.strip().split(",")
)


def test_coordinates_may_say_their_unit(tmp_path: Path) -> None:
    file = tmp_path / "p.csv"
    file.write_text(f"{IN_MM}\np,10,20,30,40,50,60\n")
    (plan,) = read_plans(file)
    assert plan.entry == pytest.approx([0.01, 0.02, 0.03])
    assert plan.target == pytest.approx([0.04, 0.05, 0.06])
    lists = {"name": "p", "entry_cm": [1, 2, 3], "target_cm": [4, 5, 6]}
    file = tmp_path / "p.json"
    file.write_text(json.dumps(lists))
    assert read_plans(file)[0].entry == pytest.approx([0.01, 0.02, 0.03])


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"entry_mm": [1, 2, 3], "target": [4, 5, 6]}, "not in the same unit"),
        ({"entry_mm": [1, 2, 3], "target_cm": [4, 5, 6]}, "not in the same unit"),
        ({"entry_furlong": [1, 2, 3], "target": [4, 5, 6]}, "no unit of length"),
        ({"entry_mm": [1, 2, 3], "target_mm": [4, 5, 6], "unit": "m"}, "say 'mm'"),
        ({"entry_mm": [1, 2, 3], "entry": [1, 2, 3], "target": [4, 5, 6]}, "unit"),
    ],
)
def test_units_that_contradict_each_other_are_refused(
    tmp_path: Path, fields: dict[str, object], words: str
) -> None:
    file = tmp_path / "p.json"
    file.write_text(json.dumps({"name": "p", **fields}))
    with pytest.raises(PlanError, match=words) as error:
        read_plans(file)
    one_line(error)


@pytest.mark.parametrize("file", ["one.json", "list.json", "plans_lps_mm.json"])
def test_json_forms_state_the_same_plan(file: str) -> None:
    plan = read_plans(CORPUS / file)[0]
    assert np.abs(plan.entry - [0.01, 0.02, 0.15]).max() < 1e-15
    assert np.abs(plan.target - [0.01, 0.04, 0.05]).max() < 1e-15


def test_conventions_that_were_relied_on_are_noted() -> None:
    assert read_plans(CORPUS / "one.json")[0].notes == ()
    notes = read_plans(CORPUS / "plans_lps_mm.json")[0].notes
    assert any("HFS" in note for note in notes)
    assert any("isocentre" in note for note in notes)


@pytest.mark.parametrize("file", INVALID, ids=lambda file: file.name)
def test_bad_files_give_one_clear_line(file: Path) -> None:
    """Each defect is a file; the words it must be told with stand beside it."""
    with pytest.raises(PlanError) as error:
        read_plans(file)
    text = one_line(error)
    assert text.startswith(str(file))
    for words in file.with_name(file.name + ".expected").read_text().splitlines():
        assert words in text


def test_corpus_of_bad_files_is_there() -> None:
    assert len(INVALID) >= 20


def test_missing_file_directory_and_permission(tmp_path: Path) -> None:
    closed = tmp_path / "closed.csv"
    closed.write_text(HEADER)
    closed.chmod(0)
    cases: list[tuple[Path, str]] = [
        (tmp_path / "none.csv", "No such file"),
        (tmp_path, "directory"),
    ]
    if os.geteuid() != 0:  # root reads everything
        cases.append((closed, "Permission"))
    for path, words in cases:
        with pytest.raises(PlanError, match=words) as error:
            read_plans(path)
        one_line(error)
    closed.chmod(stat.S_IRUSR | stat.S_IWUSR)


@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_saved_plans_are_read_back_without_loss(tmp_path: Path, suffix: str) -> None:
    rng = np.random.default_rng(0)
    plans = [
        NeedlePlan(f'plan {i}, "é"', e, e + t, roll, mount)
        for i, (e, t, roll, mount) in enumerate(
            zip(
                rng.uniform(-1, 1, (20, 3)),
                rng.uniform(0.01, 0.1, (20, 3)),
                [None, 0.1] * 10,
                [None, "+90", "-90", "+90"] * 5,
                strict=True,
            )
        )
    ]
    save_plans(tmp_path / f"p{suffix}", plans)
    again = read_plans(tmp_path / f"p{suffix}")
    assert len(again) == 20
    for old, new in zip(plans, again, strict=True):
        assert (old.name, old.roll, old.mount) == (new.name, new.roll, new.mount)
        assert np.array_equal(old.entry, new.entry)
        assert np.array_equal(old.target, new.target)
    assert list(tmp_path.iterdir()) == [tmp_path / f"p{suffix}"]


def test_plans_cannot_be_saved_just_anywhere(tmp_path: Path) -> None:
    plan = NeedlePlan("p", [0, 0, 0.1], [0, 0, 0])
    with pytest.raises(PlanError, match=r"\.csv or \.json"):
        save_plans(tmp_path / "p.txt", [plan])
    with pytest.raises(PlanError, match="cannot be written"):
        save_plans(tmp_path / "none" / "p.csv", [plan])


def test_plan_is_a_frozen_copy() -> None:
    entry = np.array([0.0, 0.0, 0.1])
    plan = NeedlePlan("p", entry, [0, 0, 0])
    entry[0] = 1.0
    assert plan.entry[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        plan.entry[0] = 1.0


@pytest.mark.parametrize(
    ("entry", "target", "words"),
    [
        ([0, 0, 0.1], [0, 0, 0.1], "no length"),
        ([0, 0, math.nan], [0, 0, 0], "not finite"),
        ([0, 0, 150], [0, 0, 50], "millimetres"),
        ([0, 0, 0.00015], [0, 0, 0.00005], "is the unit right"),
        ([0, 0, 4], [0, 0, 0], "is the unit right"),
        ([0, 0], [0, 0, 0], "shape"),
    ],
)
def test_what_is_no_needle_path_is_refused(
    entry: list[float], target: list[float], words: str
) -> None:
    with pytest.raises(GeometryError, match=words):
        NeedlePlan("p", entry, target)


def test_waypoints_reach_entry_and_target_exactly() -> None:
    plan = NeedlePlan("p", [0.1, 0.02, 0.13], [0.07, 0.01, 0.02])
    path = waypoints(plan, standoff=0.03, step=0.004)
    tips = np.array([w.tip for w in path])
    gaps = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    assert gaps.max() <= 0.004 + 1e-15
    assert gaps.min() > 0.002
    at_entry = [w for w in path if w.along == 0.0]
    assert len(at_entry) == 1
    assert np.array_equal(at_entry[0].tip, plan.entry)
    assert np.array_equal(path[-1].tip, plan.target)
    assert math.dist(path[0].tip, plan.entry) == pytest.approx(0.03)
    assert {w.phase for w in path} == {"approach", "insertion"}
    for w in path:
        assert w.insertion == (0.0 if w.phase == "approach" else w.along)
        assert np.array_equal(w.direction, plan.direction)


def test_waypoints_without_standoff_begin_at_the_entry() -> None:
    plan = NeedlePlan("p", [0, 0, 0.1], [0, 0, 0])
    path = waypoints(plan, standoff=0.0, step=1.0, insertion=0.02)
    assert [w.along for w in path] == [0.0, 0.1]
    assert [w.insertion for w in path] == pytest.approx([0.02, 0.12])
    for bad in ((-0.1, 0.1), (math.nan, 0.1), (0.1, 0.0), (0.1, math.inf * 0)):
        with pytest.raises(GeometryError):
            waypoints(plan, *bad)


def test_supine_head_first_is_what_one_sees_from_the_couch() -> None:
    """Anterior is up, the head goes into the bore, and the right hand is at +y."""
    R = scanner_from_patient("RAS")
    assert (R @ [0, 1, 0]).tolist() == [0, 0, 1]
    assert (R @ [0, 0, 1]).tolist() == [1, 0, 0]
    assert (R @ [1, 0, 0]).tolist() == [0, 1, 0]


@pytest.mark.parametrize("position", POSITIONS)
def test_patient_frames_are_rotations_of_each_other(position: str) -> None:
    RAS, LPS = (scanner_from_patient(f, position) for f in ("RAS", "LPS"))
    for R in (RAS, LPS):
        assert np.array_equal(R @ R.T, np.eye(3))
        assert np.linalg.det(R) == pytest.approx(1)
    assert np.array_equal(LPS, RAS @ np.diag([-1, -1, 1]))
    # lying on the right side, the right points down
    down = {"R": -1, "L": 1}
    if position.endswith(("DR", "DL")):
        assert (RAS @ [1, 0, 0])[2] == down[position[-1]]
    assert RAS[0, 2] == (1 if position.startswith("H") else -1)


def test_unknown_frame_and_position_are_named() -> None:
    with pytest.raises(UnknownNameError, match="LPS"):
        scanner_from_patient("LPI")
    with pytest.raises(UnknownNameError, match="HFS"):
        scanner_from_patient("RAS", "HF")


def survives(content: bytes, file: Path) -> None:
    """Whatever a file holds: plans, or one clear line."""
    file.write_bytes(content)
    try:
        plans = read_plans(file)
    except PlanError as error:
        assert "\n" not in str(error)  # noqa: PT017 - both outcomes are fine
    else:
        assert plans
        assert all(np.isfinite(plan.entry).all() for plan in plans)


@settings(max_examples=150, deadline=None)
@given(content=st.binary(max_size=300))
def test_any_bytes(content: bytes, tmp_path_factory: pytest.TempPathFactory) -> None:
    survives(content, tmp_path_factory.getbasetemp() / "fuzz.csv")


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=9),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                [
                    "name",
                    "entry",
                    "target",
                    "entry_x",
                    "plans",
                    "unit",
                    "frame",
                    "origin",
                ]
            ),
            inner,
            max_size=6,
        )
    ),
    max_leaves=20,
)


@settings(max_examples=200, deadline=None)
@given(document=JSON)
def test_any_json(document: object, tmp_path_factory: pytest.TempPathFactory) -> None:
    text = json.dumps(document)
    survives(text.encode(), tmp_path_factory.getbasetemp() / "fuzz.json")


@pytest.mark.parametrize("write", [plans_csv, plans_json])
def test_damaged_plans(
    write: Callable[[list[NeedlePlan]], str], tmp_path: Path
) -> None:
    """Bytes cut, swapped and overwritten in a good file."""
    rng = np.random.default_rng(1)
    good = write([NeedlePlan("p", [0, 0, 0.1], [0, 0.01, 0], 0.1, "+90")]).encode()
    for _ in range(300):
        damaged = bytearray(good)
        for _ in range(rng.integers(1, 4)):
            damaged[rng.integers(len(damaged))] = rng.integers(256)
        survives(bytes(damaged[: rng.integers(1, len(damaged) + 1)]), tmp_path / "f")


def test_deep_json_is_one_line(tmp_path: Path) -> None:
    survives(b"[" * 100_000, tmp_path / "deep.json")
    survives(b'{"plans": [1' + b"0" * 6000 + b"]}", tmp_path / "long.json")


def test_a_position_without_a_frame_is_refused(tmp_path: Path) -> None:
    plan = {"name": "a", "entry": [0, 0, 0.1], "target": [0, 0, 0]}
    file = tmp_path / "plan.json"
    for stated in ({}, {"frame": "scanner"}):
        document = {**stated, "patient_position": "FFP", "plans": [plan]}
        file.write_text(json.dumps(document))
        with pytest.raises(PlanError, match="patient_position needs a frame"):
            read_plans(file)


@pytest.mark.parametrize("name", ["line.mrk.json", "pts.fcsv"])
def test_markups_of_slicer_need_the_patients_place(name: str) -> None:
    with pytest.raises(PlanError, match=r"patient's coordinates.*--isocentre"):
        read_plans(DATA / "cases" / "slicer_plan" / name)
