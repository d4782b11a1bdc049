"""The older files of point lists, `.fcsv`: comments that say the frame, then rows.

`# CoordinateSystem` holds a word since version 4.11 and a number before: 0 is RAS, 1 is
LPS. Coordinates are mm.
"""

import csv
import io

import numpy as np
from numpy.typing import NDArray

from borecheck.core.units import PLAIN_NUMBER
from borecheck.errors import InputError

Array = NDArray[np.float64]

FCSV_START = "# Markups fiducial file"
COLUMNS_LINE = "# columns"

# Signs of x and y that bring them into LPS.
_TO_LPS = {"LPS": 1.0, "1": 1.0, "RAS": -1.0, "0": -1.0}
_NEEDED = ("x", "y", "z")


def fcsv_points(text: str, file: str) -> tuple[Array, tuple[str, ...]]:
    """Points in the patient's LPS coordinates, (n, 3) [mm], and their labels.

    Raises:
        InputError: No frame is stated, or a row makes no sense.
    """
    lines = text.splitlines()
    said = _said(lines)
    system = said.get("CoordinateSystem")
    if system is None:
        raise InputError(
            file, "has no CoordinateSystem in its comments: LPS or RAS is not guessed"
        )
    if system not in _TO_LPS:
        raise InputError(
            file, f"CoordinateSystem {system[:40]!r} is neither LPS nor RAS"
        )
    columns = [name.strip() for name in said.get("columns", "").split(",")]
    if any(columns.count(name) != 1 for name in _NEEDED):
        raise InputError(file, "its `# columns` do not name x, y and z once each")
    sign = np.array([_TO_LPS[system], _TO_LPS[system], 1.0])
    points, labels = [], []
    for number, line in enumerate(lines, 1):
        if line.strip() and not line.startswith("#"):
            row = _row(line, columns, file, f"line {number}")
            points.append([_number(row, axis, file, number) for axis in _NEEDED])
            labels.append(row.get("label", "").strip())
    return sign * np.reshape(points, (-1, 3)), tuple(labels)


def _said(lines: list[str]) -> dict[str, str]:
    """What the comments at the beginning state, `# name = value`."""
    found: dict[str, str] = {}
    for line in lines:
        if not line.startswith("#"):
            break
        name, equals, value = line.lstrip("# ").partition("=")
        if equals:
            found.setdefault(name.strip(), value.strip())
    return found


def _row(line: str, columns: list[str], file: str, where: str) -> dict[str, str]:
    try:
        cells = next(csv.reader(io.StringIO(line), strict=True))
    except csv.Error as error:
        raise InputError(file, f"no CSV: {error}", where) from error
    if len(cells) < len(columns):
        raise InputError(
            file, f"{len(cells)} cells under {len(columns)} columns", where
        )
    return dict(zip(columns, cells, strict=False))


def _number(row: dict[str, str], axis: str, file: str, line: int) -> float:
    text = row[axis].strip()
    if PLAIN_NUMBER.fullmatch(text) is None or not abs(float(text)) < 1e9:
        raise InputError(
            file, f"{axis} is {text[:40]!r}, no finite number", f"line {line}"
        )
    return float(text)
