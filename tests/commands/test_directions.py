"""`borecheck directions`: statuses, files, and what is refused in one line."""

import json
import xml.etree.ElementTree as ET

import pytest

from borecheck.cli import main
from borecheck.core.patient_frame import scanner_from_patient
from borecheck.plans.plan_file import read_plans

MAP = ["directions", "zerobot", "ct_gantry", "--target", "0,0,-50mm"]
COARSE = [*MAP, "--resolution", "4deg"]


def test_files_of_a_map(tmp_path, capsys):
    plans, picture, result = (tmp_path / n for n in ("p.csv", "map.svg", "r.json"))
    files = ["--out", str(plans), "--picture", str(picture), "--result", str(result)]
    assert main([*COARSE, "--rank", "2", "--asked", "0,0,-1mm", *files]) == 0
    said = capsys.readouterr().out
    assert "CLEAR: the asked direction is clear" in said
    assert [plan.name for plan in read_plans(plans)] == ["rank_1", "rank_2"]
    document = json.loads(result.read_text())
    assert document["asked"]["nearest_clear"]["angle_deg"] == pytest.approx(
        0.0, abs=1e-6
    )
    assert sum(document["map"]["shares"].values()) == pytest.approx(1.0)
    root = ET.parse(picture).getroot()
    texts = [node.text for node in root.iter() if node.tag.endswith("text")]
    assert {"head (+x)", "feet (-x)", "right side (+y)", "1", "2"} <= set(texts)
    assert (
        main([*COARSE, "--position", "FFS", "--rank", "0", "--picture", str(picture)])
        == 0
    )
    assert "head (-x)" in picture.read_text()
    lies = scanner_from_patient("LPS", "FFS").T  # a transform leads to the patient
    numbers = " ".join(f"{x:g}" for x in [*lies.ravel(), 0.0, 0.0, 0.0])
    (tmp_path / "t.tfm").write_text(
        "#Insight Transform File V1.0\n#Transform 0\n"
        f"Transform: AffineTransform_double_3_3\nParameters: {numbers}\n"
        "FixedParameters: 0 0 0\n"
    )
    again = tmp_path / "again.svg"
    turned = ["--transform", str(tmp_path / "t.tfm"), "--picture", str(again)]
    assert main([*COARSE, "--rank", "0", *turned]) == 0
    assert "head (-x)" in again.read_text()


def test_status_tells_clear_none_and_undecided():
    assert main([*COARSE, "--rank", "0"]) == 0
    assert main([*COARSE, "--rank", "0", "--asked", "300mm,0,-50mm"]) == 1
    assert main([*COARSE, "--rank", "0", "--max-depth", "10mm"]) == 1
    outside = ["directions", "zerobot", "ct_gantry", "--target", "0,0,300mm"]
    assert main(outside) == 2


def test_where_nothing_is_clear_the_result_is_written_and_no_plans(tmp_path, capsys):
    plans, result = tmp_path / "p.csv", tmp_path / "r.json"
    files = ["--out", str(plans), "--result", str(result)]
    assert main([*COARSE, "--max-depth", "10mm", *files]) == 1
    assert "is not written: no plan is clear" in capsys.readouterr().err
    assert json.loads(result.read_text())["verdict"] == "none"
    assert not plans.exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--target", "0,0"], "three lengths"),
        (["--resolution", "5mm"], "angle"),
        (["--out", "plans.txt"], ".csv or .json"),
        (["--picture", "map.png"], ".svg"),
        (["--rank", "-1"], "--rank"),
        (["--asked", "0,0,-50mm"], "the target itself"),
        (["--position", "XYZ"], "XYZ"),
        (["--max-obliquity", "-3deg"], "above 0"),
    ],
)
def test_what_makes_no_sense_is_one_line(words, said, capsys):
    assert main([*MAP, *words]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
