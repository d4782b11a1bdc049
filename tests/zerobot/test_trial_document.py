"""The study as a document, as text and as a page, from one approach that is solved."""

import json
from dataclasses import replace

import numpy as np
import pytest

from borecheck.report.blocks import plain
from borecheck.report.page import page
from zerobot.trials import error_tables
from zerobot.trials import run as trial_run
from zerobot.trials.bench import Setup
from zerobot.trials.document import document
from zerobot.trials.errors import Sources
from zerobot.trials.monte_carlo import Experiment
from zerobot.trials.published import PublishedApproach
from zerobot.trials.run import KINDS, ExaminedApproach, Study, StudyOptions, examine
from zerobot.trials.text import trials_text

REPETITIONS = 20
REACH = {"enlarge-axes": 0.028, "enlarge-axes:world": 0.027, "offset": 0.02}


@pytest.fixture(autouse=True)
def few_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(error_tables, "FIRST_ORDER_DRAWS", 2_000)


@pytest.fixture(scope="module")
def study() -> Study:
    """P3 Z (0,15), a published miss, and an approach that is out of reach."""
    sources = Sources()
    frame4 = replace(sources, level_parts="frame4")
    missed = PublishedApproach("P3", "Z", 0, 15)
    with pytest.MonkeyPatch.context() as patch:  # its own test is in test_trials.py
        patch.setattr(trial_run, "reach", lambda bench, setup, kind: REACH[kind])
        solved = examine(Experiment(sources), Experiment(frame4), missed, aim=False)
    setup = Setup(
        PublishedApproach("P1", "Y", 0, 0), 0.0, 1.0, {}, np.inf, "the joint limit"
    )
    lost = ExaminedApproach(
        setup,
        {
            d: replace(o, trial=setup.approach.trial(d), setup=setup, verdicts={})
            for d, o in solved.outcomes.items()
        },
        {},
        (),
        None,
    )
    rng = np.random.default_rng(0)
    clear = np.array([[[25.0, 15.0]]]) + rng.normal(0.0, 1.0, (REPETITIONS, 1, 1))
    options = StudyOptions(aim=False, samples=REPETITIONS)
    return Study(options, sources, (lost, solved), clear)


def test_document_is_json_and_keeps_the_contract(study: Study) -> None:
    found = document(study)
    assert json.loads(json.dumps(found, allow_nan=False)) == json.loads(
        json.dumps(found)
    )
    keys = {"point", "axis", "q4_deg", "q5_deg", "distance_mm", "expected"}
    keys |= {"published_ok", "verdicts"}
    assert all(keys <= set(trial) for trial in found["trials"])
    assert len(found["trials"]) == 4
    told = [t for t in found["trials"] if t["reached"]]
    assert [t["verdicts_by_margin"]["offset"]["exact"] for t in told] == [
        "clear",
        "contact",
    ]
    assert [t["published_ok"] for t in told] == [True, False]
    assert set(told[0]["reach_mm"]) == set(KINDS)
    assert told[1]["flips_after_mm"]["offset"] == pytest.approx(5.0)


def test_unreached_trials_say_so_and_are_not_counted(study: Study) -> None:
    found = document(study)
    lost = [t for t in found["trials"] if not t["reached"]]
    assert [t["reason"] for t in lost] == ["the joint limit"] * 2
    assert all(t["verdicts"] == {} for t in lost)
    assert found["unreachable"] == ["P1 Y (0,0): the joint limit"]
    assert all(row["of"] == 2 for row in found["nominal"])
    assert found["exact_and_two_sided_agree"] is True


def test_repetitions_are_counted_with_a_true_margin(study: Study) -> None:
    found = document(study)["monte_carlo"]
    wrong = (study.clear_mm[..., 0] <= 20).sum() + (study.clear_mm[..., 1] > 20).sum()
    assert found["success_rate"] == 1.0 - wrong / (2 * REPETITIONS)
    assert found["misses_at_15_mm"] == (study.clear_mm[..., 1] > 20).sum()
    assert len(found["right_of_each"]) == REPETITIONS
    none = document(replace(study, clear_mm=np.zeros((0, 1, 2))))
    assert none["monte_carlo"] is None
    assert "57 of 64" in none["summary"]


def test_text_and_page_show_it(study: Study) -> None:
    found = document(study)
    text = plain(trials_text(found))
    assert "exact and two-sided agree in all cells" in text
    assert "out of reach: P1 Y (0,0): the joint limit" in text
    assert "missed" in text
    header = {"schema_version": "1", "command": "trials", "argv": [], "date": None}
    html = page({**header, "versions": {}, **found})
    shown, _, _ = html.partition("borecheck-result")
    assert ">Goal point P3</h2>" in shown
    assert "`" not in shown.partition("<body")[2]
    for word in ("Goal point P3", "Miss probability at 15 mm", "out of reach"):
        assert word in html


def test_trials_fit_their_schema(study: Study) -> None:
    import jsonschema

    from tests.places import PROJECT

    file = PROJECT / "zerobot" / "trials" / "trials.schema.json"
    written = {"schema_version": "1", **json.loads(json.dumps(document(study)))}
    jsonschema.validate(written, json.loads(file.read_text()))
