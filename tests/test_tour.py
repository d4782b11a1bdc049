"""The notebook of the docs: its cells run in order and say what its text says."""

import json

import pytest

import borecheck as bc
from borecheck.cli import main
from tests.places import PROJECT

TOUR = json.loads((PROJECT / "docs" / "tour.ipynb").read_text(encoding="utf-8"))
CELLS = [cell for cell in TOUR["cells"] if cell["cell_type"] == "code"]


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    """What is known after all cells have run where the examples are."""
    folder = tmp_path_factory.mktemp("tour")
    assert main(["examples", str(folder)]) == 0
    known = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for cell in CELLS:
            exec("".join(cell["source"]), known)
        rejected = eval("".join(CELLS[5]["source"]).splitlines()[-1], known)
    return {**known, "rejected": rejected}


def test_no_output_is_kept():
    assert TOUR["nbformat"] == 4
    for cell in CELLS:
        assert cell["outputs"] == []
        assert cell["execution_count"] is None


def test_the_cells_give_what_the_text_says(names):
    assert names["verdict"].contact
    assert names["there"].clear
    motion = names["motion"]
    assert motion.clear
    assert 0.005 < motion.clearance_m <= motion.clearance_upper_m
    assert names["verified"].accepted
    assert names["verified"].bound_to
    assert not names["rejected"].accepted
    assert [answer.verdict for answer in names["answers"]] == ["clear", "clear"]
    assert names["found"].configurations


def test_questions_of_planners_are_those_of_single_poses(names):
    for q, touches in zip(names["qs"][:10], names["touching"], strict=False):
        verdict = bc.check(names["robot"], names["scene"], q, margin=0.005)
        assert verdict.contact == touches
    assert (names["lower"] <= names["upper"]).all()
    assert names["lower"].min() > 0.004  # a bound of what is beyond the margin
