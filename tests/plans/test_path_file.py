"""Joint paths from CSV: read as meant, or refused in one line with its place."""

import numpy as np
import pytest

from borecheck.errors import PlanError
from borecheck.plans.path_file import read_path

JOINTS = ("q1", "q2")


def path_of(tmp_path, text, encoding="utf-8"):
    file = tmp_path / "path.csv"
    file.write_bytes(text.encode(encoding))
    return file


def test_columns_go_by_name(tmp_path):
    file = path_of(tmp_path, "q2,q1\n1,2\n3e-1,-.5\n")
    assert np.array_equal(read_path(file, JOINTS), [[2.0, 1.0], [-0.5, 0.3]])


def test_units_stand_in_the_names(tmp_path):
    file = path_of(tmp_path, "slide_mm,q1_deg,lift_cm\n20,-180,1\n")
    found = read_path(file, ("q1", "slide", "lift"), sliding=("slide", "lift"))
    np.testing.assert_allclose(found, [[-np.pi, 0.02, 0.01]], rtol=1e-15)
    told = path_of(tmp_path, "q1_rad,slide_m\n1,2\n")
    assert np.array_equal(read_path(told, ("q1", "slide"), ("slide",)), [[1.0, 2.0]])


def test_a_kind_may_be_told_and_the_other_bare(tmp_path):
    file = path_of(tmp_path, "q1,slide_mm\n1,20\n")
    found = read_path(file, ("q1", "slide"), sliding=("slide",))
    np.testing.assert_allclose(found, [[1.0, 0.02]], rtol=1e-15)


def test_a_joints_own_name_comes_first(tmp_path):
    """A joint that is called `elbow_deg` is that joint, in radians."""
    file = path_of(tmp_path, "elbow_deg,elbow\n1,2\n")
    assert np.array_equal(read_path(file, ("elbow", "elbow_deg")), [[2.0, 1.0]])
    twice = path_of(tmp_path, "elbow_deg,elbow_deg_deg\n1,2\n")
    with pytest.raises(PlanError, match="twice"):
        read_path(twice, ("elbow", "elbow_deg"))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_any_line_end_blank_lines_and_byte_order_mark(tmp_path, end):
    text = end.join(["\ufeffq1, q2", "", " 1 ,2", "", "", "3,4", ""])
    assert np.array_equal(read_path(path_of(tmp_path, text), JOINTS), [[1, 2], [3, 4]])


@pytest.mark.parametrize(
    ("text", "saying"),
    [
        ("", "is empty"),
        ("\n\n", "is empty"),
        ("q1,q2\n", "no waypoint"),
        ("1,2\n3,4\n", "has no header"),
        ("q1\n1\n", "no column for q2"),
        ("q1,q2,q3\n1,2,3\n", "unknown joint 'q3'"),
        ("q1,q1,q2\n1,2,3\n", "twice"),
        ("q1;q2\n1;2\n", "separated by commas, not semicolons"),
        ("q1\tq2\n1\t2\n", "separated by commas, not tabs"),
        ("q1_deg,q2_mm\n1,2\n", "'mm' is no unit of q2, which is an angle"),
        ("q1_degrees,q2_deg\n1,2\n", "(known: q1, q1_rad, q1_deg)"),
        ("q1_deg,q2\n1,2\n", "q1_deg says its unit and q2 does not"),
        ("q1,q1_deg,q2\n1,2,3\n", "'q1' is there twice (as q1 and q1_deg)"),
        ("q1_deg,q1_rad,q2_deg\n1,2,3\n", "'q1' is there twice"),
        ("q1_deg,q3_deg\n1,2\n", "unknown joint 'q3_deg'"),
        ("q1_deg,q2_deg\n1,nan\n", "line 2, q2_deg: 'nan'"),
        ("q1,q2\n1\n", "line 2: has 1 cells"),
        ("q1,q2\n\n\n1,2\n\n3,4,5\n", "line 6: has 3 cells"),
        ("q1,q2\n1,nan\n", "line 2, q2: 'nan'"),
        ("q1,q2\n1,2\n\n1,inf\n", "line 4, q2: 'inf'"),
        ("q1,q2\n1,1e999\n", "'1e999' is no finite number"),
        ("q1,q2\n1,20mm\n", "'20mm'"),
        ("q1,q2\n1,1_000\n", "'1_000'"),
        ("q1,q2\n1,\u0661\n", "is no finite number"),
        ("q1,q2\n1,0x10\n", "'0x10'"),
        ("q1,q2\n1,\n", "line 2, q2: ''"),
        ("q1,q2\n1,\0\n", "line 2"),
        ('q1,q2\n1,"' + "9" * 200_000 + '"\n', "line 2"),
    ],
)
def test_refusals_say_where(tmp_path, text, saying):
    file = path_of(tmp_path, text)
    with pytest.raises(PlanError, match=r"path\.csv") as error:
        read_path(file, JOINTS)
    assert saying in str(error.value)
    assert "\n" not in str(error.value)


def test_files_that_are_none(tmp_path):
    with pytest.raises(PlanError, match="no such file"):
        read_path(tmp_path / "none.csv", JOINTS)
    with pytest.raises(PlanError, match="directory"):
        read_path(tmp_path, JOINTS)
    with pytest.raises(PlanError, match="as text"):
        read_path(path_of(tmp_path, "q1,q2\n1,2\n", "utf-16"), JOINTS)
