"""Every check finds its defects and leaves what is sound alone: the corpus says which.

Adding a check adds files under tests/data/urdf and no test code.
"""

from pathlib import Path

import pytest

from borecheck.validation import validate_file
from borecheck.validation.catalogue import all_checks
from tests import corpus


def _id(path: Path) -> str:
    return f"{corpus.code_of(path)}-{corpus.stem(path)}"


@pytest.mark.parametrize("path", corpus.cases("bad"), ids=_id)
def test_a_defect_is_found_where_it_is(path):
    found = corpus.findings_of_case(path)
    said = [f"{f.code} {f.severity} {f.line} {f.element}" for f in found]
    assert said == corpus.expected_of(path)
    assert corpus.code_of(path) in {finding.code for finding in found}


@pytest.mark.parametrize("path", corpus.cases("sound"), ids=_id)
def test_what_is_nearly_a_defect_is_left_alone(path):
    found = corpus.findings_of_case(path)
    loud = [f for f in found if f.severity != "info" or f.code == corpus.code_of(path)]
    assert loud == []


def test_every_check_has_defective_and_sound_files():
    for kind in ("bad", "sound"):
        covered = {corpus.code_of(path) for path in corpus.cases(kind)}
        codes = {check.code for check in all_checks()}
        assert codes - covered == set()
        assert covered - codes == set()


@pytest.mark.parametrize("profile", ["kinematics", "collision", "dynamics"])
def test_the_arm_that_all_cases_start_from_is_sound(profile):
    arm = corpus.FOLDER / "arm" / "arm.urdf"
    found = validate_file(arm, profile=profile, self_contact=20, configured=False)
    assert found == []


def test_every_defective_file_names_what_is_expected():
    for path in corpus.cases("bad"):
        assert corpus.expected_of(path), path


@pytest.mark.parametrize("path", corpus.cases("bad"), ids=_id)
def test_every_finding_says_all_it_should(path):
    for finding in corpus.findings_of_case(path):
        assert finding.message
        assert finding.why
        assert finding.hint
        assert finding.line >= 1
        assert finding.file
