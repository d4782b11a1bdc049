"""Joint values and measured points of a calibration, read from and written to CSV.

Header: the joints' names, x, y, z, and if one likes `moving`, the joint that turned
alone while the others stood still. Angles are radians, lengths metres; another unit is
in the column's name: shoulder_deg, x_mm.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.serial_arm import SerialArm
from borecheck.core.csv_columns import (
    ColumnError,
    refuse_mixed,
    separator_problem,
    unit_columns,
)
from borecheck.core.whole_files import write_whole
from borecheck.errors import InputError, UnknownNameError

Array = NDArray[np.float64]

# Joints nearer than this stand still: [rad], far below any encoder's pulse.
STILL = 1e-9

# No arm turns a joint further than this [rad]; degrees typed as radians do.
LARGEST_ANGLE = 4.0 * np.pi


@dataclass(frozen=True, eq=False)
class Measurements:
    """What was measured, in the arm's world frame.

    Attributes:
        q: Joint angles, (n, k), [rad].
        points: Measured places of the target, (n, 3), [m].
        moving: The joint that turned alone in each sample, "" where none did.
        file: Where they come from, for messages.
        repeated: Samples of the file that repeat others exactly: no device measures
            the same number twice, so that they are copies and are left out.
    """

    q: Array
    points: Array
    moving: tuple[str, ...]
    file: str = "measurements"
    repeated: int = 0

    def __len__(self) -> int:
        return len(self.q)

    def of(self, joint: str) -> NDArray[np.intp]:
        """Indices of the samples in which this joint turned alone."""
        return np.flatnonzero(np.array(self.moving) == joint)


def write_measurements(
    path: Path,
    arm: SerialArm,
    data: Measurements,
    held: Mapping[str, float] | None = None,
) -> None:
    """Writes a CSV that `read_measurements` gives back bit by bit."""
    held = dict(arm.held if held is None else held)
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow([*arm.joint_names, *held, "x", "y", "z", "moving"])
    for q, point, moving in zip(data.q, data.points, data.moving, strict=True):
        numbers = [*map(float, q), *held.values(), *map(float, point)]
        writer.writerow([*map(repr, numbers), moving])
    write_whole(path, text.getvalue())


def read_measurements(path: Path, arm: SerialArm) -> Measurements:
    """Measurements of an arm from a CSV file.

    Raises:
        InputError: One line: what is wrong, in which line and column.
    """
    header, rows = _read_csv(path)
    columns = _columns(path, header, arm, wanted=[*arm.joint_names, *"xyz"])
    values = {
        name: np.array([factor * _number(path, row, k, header, i) for k, row in rows])
        for name, (i, factor) in columns.items()
    }
    q = np.stack([values[name] for name in arm.joint_names], axis=1)
    points = np.stack([values[axis] for axis in "xyz"], axis=1)
    _check_held(path, arm, values)
    _check_angles(path, arm, q)
    given = header.index("moving") if "moving" in header else None
    if given is None:
        moving = find_moving(q, arm.joint_names)
    else:
        moving = tuple(_joint(path, arm, line, row[given]) for line, row in rows)
    _check_scale(path, arm, points)
    kept = _first_of_each(q, points, moving)
    return Measurements(
        q[kept],
        points[kept],
        tuple(moving[k] for k in kept),
        str(path),
        len(q) - len(kept),
    )


def _first_of_each(q: Array, points: Array, moving: Sequence[str]) -> NDArray[np.intp]:
    """Indices of the samples that repeat none before them, in order."""
    joint = np.unique(np.array(moving), return_inverse=True)[1]
    rows = np.column_stack([q, points, joint])
    return np.sort(np.unique(rows, axis=0, return_index=True)[1])


def read_joint_values(path: Path, arm: SerialArm) -> Array:
    """Joint values (n, k) [rad] of a CSV in which measured points may be missing.

    Raises:
        InputError: As for `read_measurements`.
    """
    header, rows = _read_csv(path)
    columns = _columns(path, header, arm, wanted=arm.joint_names)
    q = np.array(
        [
            [
                columns[n][1] * _number(path, row, k, header, columns[n][0])
                for k, row in rows
            ]
            for n in arm.joint_names
        ]
    ).T
    _check_angles(path, arm, q)
    return q


def find_moving(q: Array, names: Sequence[str]) -> tuple[str, ...]:
    """The joint that turned alone in each sample, told from the joint values.

    Samples in which all joints but one agree belong together; a sample that fits
    nowhere (a pose of its own) gets "".
    """
    moving = np.full(len(q), "", dtype=object)
    size = np.zeros(len(q), dtype=int)
    steps = np.round(q / STILL).astype(np.int64)
    for i, name in enumerate(names):
        others = np.delete(steps, i, axis=1)
        _, group = np.unique(others, axis=0, return_inverse=True)
        for g in range(group.max() + 1):
            members = np.flatnonzero(group == g)
            different = len(np.unique(steps[members, i]))
            if different > 2:
                better = members[size[members] < different]
                moving[better], size[better] = name, different
    return tuple(moving)


def _read_csv(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise InputError(path, "there is no such file") from error
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, f"cannot be read as text: {error}") from error
    lines = [
        (number, [cell.strip() for cell in row])
        for number, row in enumerate(csv.reader(text.splitlines()), start=1)
        if row and not row[0].lstrip().startswith("#")
    ]
    if not lines:
        raise InputError(path, "is empty")
    (_, header), *rows = lines
    if not rows:
        raise InputError(path, "has a header but no measurement")
    for number, row in rows:
        if len(row) != len(header):
            raise InputError(
                path,
                f"{len(row)} cells, but the header has {len(header)}",
                f"line {number}",
            )
    return header, rows


def _columns(
    path: Path, header: list[str], arm: SerialArm, wanted: Sequence[str]
) -> dict[str, tuple[int, float]]:
    """Index and factor to SI of each joint and coordinate; no column is ignored."""
    if all(_is_number(cell) for cell in header):
        names = ",".join(wanted)
        problem = f"its columns have no names; the first line must be {names}"
        raise InputError(path, problem, "line 1")
    separated = separator_problem(header)
    if separated is not None:
        raise InputError(path, separated, "line 1")
    named = [column for column in header if column != "moving"]
    try:
        columns = unit_columns(named, arm.joint_names, [*arm.held, *"xyz"])
        refuse_mixed(named, arm.joint_names)
    except (ColumnError, UnknownNameError) as error:
        raise InputError(path, str(error), "line 1") from error
    found = {
        name: (header.index(named[index]), factor)
        for name, (index, factor) in columns.items()
    }
    missing = [n for n in wanted if n not in found]
    if missing:
        raise InputError(path, f"column {', '.join(missing)} is missing", "line 1")
    return found


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _number(path: Path, row: list[str], line: int, header: list[str], i: int) -> float:
    if not _is_number(row[i]) or not np.isfinite(float(row[i])):
        raise InputError(
            path, f"{row[i]!r} is no finite number", f"line {line}, column {header[i]}"
        )
    return float(row[i])


def _joint(path: Path, arm: SerialArm, line: int, name: str) -> str:
    if name and name not in arm.joint_names:
        known = ", ".join(arm.joint_names)
        raise InputError(
            path,
            f"unknown joint {name!r} (known: {known})",
            f"line {line}, column moving",
        )
    return name


def _check_held(path: Path, arm: SerialArm, values: Mapping[str, Array]) -> None:
    for name, stand in arm.held.items():
        if name in values and np.abs(values[name] - stand).max() > STILL:
            raise InputError(
                path,
                f"prismatic joint {name} must stand at {stand} m in all samples: only "
                "revolute joints are calibrated",
            )


def _check_angles(path: Path, arm: SerialArm, q: Array) -> None:
    for i, name in enumerate(arm.joint_names):
        largest = float(np.abs(q[:, i]).max())
        if largest > LARGEST_ANGLE:
            raise InputError(
                path,
                f"joint {name} is at {largest:.4g} rad; if these are degrees, name the "
                f"column {name}_deg",
            )


def _check_scale(path: Path, arm: SerialArm, points: Array) -> None:
    """Millimetres typed as metres make the arm a thousand times as large."""
    reach = _reach(arm)
    spread = float(np.linalg.norm(np.ptp(points, axis=0)))
    if spread > 20.0 * reach:
        raise InputError(
            path,
            f"the points spread over {spread:.4g} m, but the arm is {reach:.3g} m "
            "long; if these are millimetres, name the columns x_mm, y_mm, z_mm",
        )


def _reach(arm: SerialArm) -> float:
    """Length of the arm from its first joint along all joints to the tip, [m]."""
    places = np.vstack([arm.T_world_joint[:, :3, 3], arm.T_world_tip[:3, 3]])
    return max(float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum()), 0.1)
