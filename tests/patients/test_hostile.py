"""A seeded part of the study of damaged scans: nothing but a result or one line."""

import pytest

from studies.hostile_volumes import KINDS, read


@pytest.mark.parametrize("kind", KINDS[:3])
def test_damaged_files_end_in_a_result_or_one_line(kind):
    ends, problems = read(kind, 0, 12, 7)
    assert problems == []
    assert sum(ends.values()) == 12
    assert len(ends) == 2  # some are read all the same, some are refused
