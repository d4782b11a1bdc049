"""Public robots with their own SRDFs, a few of the study's."""

import pytest

from studies.one_judge import example_robot_data
from studies.srdf_robots import rows

NAMES = ("b1_description/srdf/b1", "romeo_description/srdf/romeo_moveit")


@pytest.mark.skipif(not example_robot_data(), reason="example-robot-data is not there")
@pytest.mark.parametrize("name", NAMES)
def test_nothing_touches_at_named_poses_where_coal_finds_nothing(name, tmp_path):
    (base,) = example_robot_data()
    found = list(rows(base / f"{name}.srdf", tmp_path))
    assert found
    for row in found:
        assert row.alone  # there is something to allow
        assert row.trusted == row.coal == set()
        assert row.given <= row.left
        assert row.wrong == ""
