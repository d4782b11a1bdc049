"""Plans from markups: entry and target, and where the patient's coordinates lie."""

import json

import numpy as np
import pytest

from borecheck.core.patient_frame import POSITIONS
from borecheck.errors import PlanError, UsageError
from borecheck.plans.patient_place import at_isocentre, by_transform
from borecheck.plans.plan_file import read_plans
from tests.places import DATA

SLICER = DATA / "slicer"
ENTRY = 1e-3 * np.array([40.25, -61.5, -748.0])
TARGET = 1e-3 * np.array([22.0, -180.75, -741.5])
LINES = ("line_lps_1.0.3", "line_ras_1.0.3", "line_lps_1.0.0_minimal")


@pytest.mark.parametrize("name", LINES)
def test_a_line_is_the_same_plan_in_either_frame(name):
    place = at_isocentre(TARGET, "HFS")
    (plan,) = read_plans(SLICER / f"{name}.mrk.json", place)
    np.testing.assert_allclose(plan.target, 0.0, atol=1e-12)
    # head first, supine: superior is along the bore, anterior is up, right is +y
    left, posterior, superior = ENTRY - TARGET
    np.testing.assert_allclose(plan.entry, [superior, -left, -posterior], atol=1e-12)
    assert plan.name == name


def test_the_order_decides_only_where_labels_do_not_and_then_it_is_said(tmp_path):
    place = at_isocentre(TARGET, "HFS")
    (told,) = read_plans(SLICER / "line_lps_1.0.0_minimal.mrk.json", place)
    assert any("entry L-1, target L-2" in note for note in told.notes)
    labelled = SLICER / "line_lps_1.0.3.mrk.json"
    (plan,) = read_plans(labelled, place)
    assert plan.notes == ()
    document = json.loads(labelled.read_text())
    document["markups"][0]["controlPoints"].reverse()
    (tmp_path / "back.mrk.json").write_text(json.dumps(document))
    (back,) = read_plans(tmp_path / "back.mrk.json", place)
    np.testing.assert_array_equal([back.entry, back.target], [plan.entry, plan.target])


def fiducials(folder, *labels, points=None):
    rows = [f"{k},{k},{-60 * (k % 2)},{k},{label}" for k, label in enumerate(labels)]
    text = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
    (folder / "f.fcsv").write_text(
        text + "# columns = id,x,y,z,label\n" + "\n".join(rows)
    )
    return read_plans(folder / "f.fcsv", at_isocentre([0, 0, 0], "HFS"))


def test_labels_name_several_plans(tmp_path):
    plans = fiducials(tmp_path, "a entry", "b_target", "Entry: b", "target a")
    assert [plan.name for plan in plans] == ["a", "b"]
    up = [1e3 * np.array([plan.entry[0], plan.target[0]]) for plan in plans]
    np.testing.assert_allclose(up, [[0, 3], [2, 1]], atol=1e-12)
    assert [p.name for p in fiducials(tmp_path, "F-1", "F-2", "F-3", "F-4")] == [
        "f-1",
        "f-2",
    ]


def test_there_may_be_so_many_plans_and_no_more(tmp_path, monkeypatch):
    monkeypatch.setattr("borecheck.plans.markup_plans.MOST_PLANS", 2)
    pairs = [f"F-{k}" for k in range(6)]
    assert len(fiducials(tmp_path, *pairs[:4])) == 2
    with pytest.raises(PlanError, match="more than 2 plans"):
        fiducials(tmp_path, *pairs)


REFUSED = {
    ("F-1", "F-2", "F-3"): "3 points",
    ("entry", "F-2"): "neither entry nor target",
    ("entry", "entry"): "two entry points",
    ("a entry", "b target"): "has no target",
    ("entry or target", "target"): "neither entry nor target",
}


@pytest.mark.parametrize("labels", REFUSED)
def test_points_that_are_no_plan_are_refused(labels, tmp_path):
    with pytest.raises(PlanError, match=REFUSED[labels]):
        fiducials(tmp_path, *labels)


@pytest.mark.parametrize("position", POSITIONS)
def test_a_place_is_its_own_way_back(position):
    place = at_isocentre([0.1, -0.2, 0.7], position)
    points = np.random.default_rng(5).uniform(-1, 1, (10, 3))
    np.testing.assert_allclose(
        place.to_lps(place.to_scanner(points)), points, atol=1e-15
    )
    np.testing.assert_allclose(
        place.to_scanner(np.array([[0.1, -0.2, 0.7]])), 0, atol=1e-15
    )


def test_a_transform_is_of_itks_sense():
    """A file maps the fixed space, the scanner's, to the moving one, the patient's."""
    name = "rigid_versor.tfm"
    entry = json.loads((SLICER / "manifest.json").read_text())["entries"][name]
    given = 1e-3 * np.array(entry["points_in_lps_mm"])
    place = by_transform(SLICER / name)
    there = 1e-3 * np.array(entry["inverse_maps_to_lps_mm"])
    np.testing.assert_allclose(place.to_scanner(given), there, atol=1e-9)
    other = by_transform(f"{SLICER / name}:inverse")
    there = 1e-3 * np.array(entry["file_maps_to_lps_mm"])
    np.testing.assert_allclose(other.to_scanner(given), there, atol=1e-9)


def test_an_isocentre_is_three_finite_numbers():
    for bad in ([0, 0], [0, 0, np.nan]):
        with pytest.raises(UsageError):
            at_isocentre(bad, "HFS")
