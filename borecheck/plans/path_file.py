"""A joint path from a CSV file: joint names in the header, a waypoint a line.

Radians and metres; another unit stands in the column's name: `elbow_deg`, `slide_mm`.
A column `time` (or `time_s`, `time_ms`) says when each is passed. Trajectories of ROS
are read by `trajectory_file`.
"""

import csv
import math
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.core.csv_columns import (
    ColumnError,
    refuse_mixed,
    separator_problem,
    unit_columns,
)
from borecheck.core.units import PLAIN_NUMBER
from borecheck.core.whole_files import write_whole
from borecheck.errors import PlanError, UnknownNameError
from borecheck.plans.joint_path import JointPath, first_not_after, time_note
from borecheck.plans.trajectory_file import SUFFIXES, read_trajectory

MAX_BYTES = 50_000_000


# Columns of times and their factor to seconds; a joint of that name comes first.
TIMES = {"time": 1.0, "time_s": 1.0, "time_ms": 1e-3}


def read_path(
    path: Path, joint_names: Sequence[str], sliding: Collection[str] = ()
) -> NDArray[np.float64]:
    """The waypoints of `read_joint_path`, (k, n), [m] and [rad]."""
    return read_joint_path(path, joint_names, sliding).waypoints


def read_joint_path(
    path: Path, joint_names: Sequence[str], sliding: Collection[str] = ()
) -> JointPath:
    """Waypoints (k, n) in the order of the joints, [m] and [rad], and their times.

    Args:
        path: A trajectory of ROS (.yaml, .yml, .json), or CSV: every joint is a column,
            in any order; NAME_deg, NAME_mm ... state another unit than SI, for all
            joints of a kind or for none.
        joint_names: The robot's free joints.
        sliding: Which of them slide; the others turn.

    Raises:
        PlanError: The file cannot be read, a column is missing, unknown or doubled, or
            a cell is no finite number; one line with file and line number.
    """
    if path.suffix.lower() in SUFFIXES:
        return read_trajectory(path, joint_names)
    rows = _rows(path)
    if not rows:
        raise PlanError(path, "is empty")
    header = [cell.strip() for cell in rows[0][1]]
    timed = _time_column(path, header, joint_names)
    named = [cell for k, cell in enumerate(header) if k != timed]
    columns = _columns(path, named, joint_names, sliding)
    if len(rows) < 2:
        raise PlanError(path, "has a header but no waypoint")
    waypoints = np.zeros((len(rows) - 1, len(joint_names)))
    times = []
    for k, (line, row) in enumerate(rows[1:]):
        if len(row) != len(header):
            problem = f"has {len(row)} cells, the header has {len(header)}"
            raise PlanError(path, problem, f"line {line}")
        if timed is not None:
            column = header[timed]
            times.append(TIMES[column] * _number(path, line, column, row.pop(timed)))
        for joint, name in enumerate(joint_names):
            index, factor = columns[name]
            value = _number(path, line, named[index], row[index])
            waypoints[k, joint] = factor * value
    if timed is None:
        return JointPath(waypoints)
    late = first_not_after(times)
    if late is not None:
        problem = f"its time {times[late]:g} s is not after {times[late - 1]:g} s"
        raise PlanError(path, problem, f"line {rows[late + 1][0]}")
    return JointPath(waypoints, np.array(times), (time_note(np.array(times)),))


def _time_column(
    path: Path, header: Sequence[str], joint_names: Sequence[str]
) -> int | None:
    """Where the times are, if there is such a column."""
    taken = {*joint_names}
    places = [k for k, c in enumerate(header) if c in TIMES and c not in taken]
    if len(places) > 1:
        raise PlanError(path, f"has {len(places)} columns of times: keep one")
    return places[0] if places else None


def write_path(
    path: Path, joint_names: Sequence[str], waypoints: NDArray[np.float64]
) -> None:
    """Writes waypoints (k, n) as a file that `read_path` reads back bit for bit."""
    lines = [",".join(joint_names)]
    lines += [",".join(repr(float(value)) for value in row) for row in waypoints]
    write_whole(path, "\n".join(lines) + "\n")


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of every line that is not blank."""
    reader = csv.reader(_text(path).splitlines())
    try:
        return [
            (reader.line_num, row)
            for row in reader
            if any(cell.strip() for cell in row)
        ]
    except csv.Error as error:
        raise PlanError(
            path, f"is no CSV: {error}", f"line {reader.line_num}"
        ) from None


def _text(path: Path) -> str:
    try:
        if path.is_dir():
            raise PlanError(path, "is a directory, not a path file")
        if path.stat().st_size > MAX_BYTES:
            raise PlanError(path, "is larger than 50 MB")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise PlanError(path, "there is no such file") from error
    except PermissionError as error:
        raise PlanError(path, "no permission to read it") from error
    except (OSError, ValueError) as error:
        raise PlanError(path, f"cannot be read as text: {error}") from error


def _columns(
    path: Path,
    header: list[str],
    joint_names: Sequence[str],
    sliding: Collection[str],
) -> dict[str, tuple[int, float]]:
    """Place and factor to SI of every joint."""
    problem = separator_problem(header) or _no_header(header, joint_names)
    if problem is not None:
        raise PlanError(path, problem)
    turning = [name for name in joint_names if name not in sliding]
    slides = [name for name in joint_names if name in sliding]
    try:
        columns = unit_columns(header, turning, slides, "joint")
        refuse_mixed(header, turning)
        refuse_mixed(header, slides)
    except (ColumnError, UnknownNameError) as error:
        raise PlanError(path, str(error)) from error
    missing = [name for name in joint_names if name not in columns]
    if missing:
        raise PlanError(path, f"has no column for {', '.join(missing)}")
    return columns


def _no_header(header: list[str], joint_names: Sequence[str]) -> str | None:
    """One line if the first row is no header of joints, but numbers or a plan's."""
    expected = f"expected a header with the joints: {','.join(joint_names)}"
    if all(PLAIN_NUMBER.fullmatch(cell) for cell in header):
        return f"has no header; {expected}, then a waypoint a line"
    if {"entry_x", "target_x"} <= {cell.partition("_mm")[0] for cell in header}:
        return f"holds needle plans (entry, target): give it as --plan; {expected}"
    return None


def _number(path: Path, line: int, name: str, cell: str) -> float:
    text = cell.strip()
    value = float(text) if PLAIN_NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise PlanError(
            path, f"{cell.strip()!r} is no finite number", f"line {line}, {name}"
        )
    return value
