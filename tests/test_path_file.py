"""Joint paths from CSV: read as meant, or refused in one line with its place."""

import numpy as np
import pytest

from borecheck.errors import PlanError
from borecheck.path_file import read_path

JOINTS = ("q1", "q2")


def path_of(tmp_path, text, encoding="utf-8"):
    file = tmp_path / "path.csv"
    file.write_bytes(text.encode(encoding))
    return file


def test_columns_go_by_name(tmp_path):
    file = path_of(tmp_path, "q2,q1\n1,2\n3e-1,-.5\n")
    assert np.array_equal(read_path(file, JOINTS), [[2.0, 1.0], [-0.5, 0.3]])


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
        ("1,2\n3,4\n", "unknown joint '1'"),
        ("q1\n1\n", "no column for q2"),
        ("q1,q2,q3\n1,2,3\n", "unknown joint 'q3'"),
        ("q1,q1,q2\n1,2,3\n", "twice"),
        ("q1;q2\n1;2\n", "unknown joint 'q1;q2'"),
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
