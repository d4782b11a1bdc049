"""`borecheck setup`: statuses, files for check, one line for what is wrong."""

import json

import jsonschema
import pytest

from borecheck.cli import main
from tests.places import PROJECT

PLANS = PROJECT / "urdf" / "zerobot" / "examples" / "plans.csv"
STAND = ("zerobot", "ct_gantry", "--scene-arg", "bore=0.70")


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


def test_the_result_and_the_motions(capsys, tmp_path):
    result, some = tmp_path / "r.json", tmp_path / "some.csv"
    rows = PLANS.read_text().splitlines()
    some.write_text("\n".join([rows[0], rows[1], rows[-1]]) + "\n")
    words = ["setup", *STAND, "--plan", some, "--motions", tmp_path / "ways"]
    status, out, _ = run(capsys, *words, "--cone", "5", "--out", result)
    assert status == 1  # one of them is out of reach
    assert "UNREACHABLE" in out
    document = json.loads(result.read_text())
    schema = (PROJECT / "borecheck/schemas/setup.schema.json").read_text()
    jsonschema.Draft202012Validator(json.loads(schema)).validate(document)
    assert document["requirements"]["cone"]["source"] == "set"
    assert document["summary"]["reachable"] == len(document["motions"]) == 1
    name, file = next(iter(document["motions"].items()))
    corridor = f"{PLANS}:{name}"
    status, out, _ = run(
        capsys, "check", *STAND, "--path", file, "--corridor", corridor
    )
    assert status == 0, out


@pytest.mark.parametrize(
    ("more", "saying"),
    [
        ([], "give the needles: --plan FILE"),
        (["--plan", PLANS, "--cone", "wide"], "wide"),
        (["--plan", PLANS, "--weight", "patient=x"], "'x' is no number"),
        (["--plan", PLANS, "--exclude", "needle"], "give LINK:OBSTACLE"),
        (["--plan", PLANS, "--solver", "magic"], "unknown solver 'magic'"),
    ],
)
def test_what_is_no_request_is_one_line(capsys, more, saying):
    status, out, err = run(capsys, "setup", *STAND, *more)
    assert (status, out) == (2, "")
    assert saying in err
    assert len([line for line in err.splitlines() if "error" in line]) == 1
