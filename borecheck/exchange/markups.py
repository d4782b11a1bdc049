"""Markups of 3D Slicer: points, lines and lists of points with their labels.

`.mrk.json` (published schema 1.0.x) and the older `.fcsv`. Both say in which patient
coordinates they are, LPS or RAS; a file that does not is refused, for the two differ in
the sign of x and y and nothing else in a file tells them apart.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.patient_frame import LPS_FROM_RAS
from borecheck.core.small_files import read_at_most
from borecheck.core.units import LENGTH_UNITS
from borecheck.errors import InputError
from borecheck.exchange.fcsv import COLUMNS_LINE, FCSV_START, fcsv_points

Array = NDArray[np.float64]

MAX_BYTES = 20_000_000  # a hundred thousand points
# Kinds whose points are points; of others (ROI, Plane) they mean something else.
KINDS = ("Line", "Fiducial")

SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/"
    "Resources/Schema/markups-schema-v1.0.3.json#"
)


@dataclass(frozen=True, eq=False)
class Markup:
    """One markup: a line, or a list of points.

    Attributes:
        name: Its name in the file; empty where it has none.
        kind: "Line" or "Fiducial".
        points_lps: Its points in the patient's LPS coordinates, (n, 3), [m].
        labels: What each is called, (n,).
        notes: What the file leaves to the format's own convention.
    """

    name: str
    kind: str
    points_lps: Array
    labels: tuple[str, ...]
    notes: tuple[str, ...] = ()


def is_markups(text: str) -> bool:
    """Whether it is a markups file, which says so where it begins."""
    start = text.lstrip("\ufeff \t\r\n")[:400]
    if start.startswith((FCSV_START, "# CoordinateSystem", COLUMNS_LINE)):
        return True
    return start.startswith("{") and (
        "markups-schema" in start or '"markups"' in start or '"controlPoints"' in start
    )


def read_markups(path: str | Path) -> tuple[Markup, ...]:
    """The markups of a file.

    Raises:
        InputError: It cannot be used; one line that says where and why.
    """
    content = read_at_most(Path(path), MAX_BYTES)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(path, "is no text in UTF-8") from error
    return markups_in(text, str(path))


def markups_in(text: str, file: str) -> tuple[Markup, ...]:
    """The markups of a file's text; see `read_markups`."""
    if text.lstrip()[:1] == "#":
        points, labels = fcsv_points(text, file)
        found = [Markup("", "Fiducial", 1e-3 * points, labels)]
    else:
        found = _from_json(text, file)
    if not any(len(markup.points_lps) for markup in found):
        raise InputError(file, "holds no point")
    return tuple(found)


def markup_json(
    name: str,
    kind: str,
    points_lps: Array,
    labels: list[str],
    *,
    descriptions: list[str] | None = None,
    colour: tuple[float, float, float] = (0.2, 0.6, 1.0),
) -> str:
    """One markup as the text of a `.mrk.json` that Slicer loads, in LPS and mm.

    Args:
        name: What the file's markup is called.
        kind: "Line" or "Fiducial".
        points_lps: (n, 3), [m].
        labels: A label for each point.
        descriptions: A sentence for each point.
        colour: Red, green and blue, 0 to 1.
    """
    said = descriptions or [""] * len(labels)
    rows = zip(1e3 * np.asarray(points_lps), labels, said, strict=True)
    points = [
        {
            "id": str(k),
            "label": label,
            "description": text,
            "position": [float(x) for x in point],
            "positionStatus": "defined",
        }
        for k, (point, label, text) in enumerate(rows, 1)
    ]
    markup = {
        "type": kind,
        "name": name,
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "controlPoints": points,
        "display": {"color": list(colour), "selectedColor": list(colour)},
    }
    document = {"@schema": SCHEMA, "markups": [markup]}
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _from_json(text: str, file: str) -> list[Markup]:
    try:
        document = json.loads(text, parse_constant=_not_finite)
    except (ValueError, RecursionError) as error:
        raise InputError(file, f"is no JSON of markups: {error}") from error
    markups = document.get("markups") if isinstance(document, dict) else None
    if not isinstance(markups, list) or not markups:
        raise InputError(file, "holds no `markups`: a list that is not empty")
    return [_markup(m, file, f"markup {k}") for k, m in enumerate(markups, 1)]


def _markup(given: Any, file: str, where: str) -> Markup:
    if not isinstance(given, dict):
        raise InputError(file, "is no object", where)
    kind = given.get("type")
    if kind not in KINDS:
        known = " and ".join(KINDS)
        raise InputError(
            file, f"is of type {_shown(kind)}; {known} have points to use", where
        )
    R = _frame(given, file, where)
    scale, notes = _unit(given, file, where)
    points = given.get("controlPoints")
    if not isinstance(points, list):
        raise InputError(file, "has no list `controlPoints`", where)
    found = [_point(p, file, f"{where}, point {k}") for k, p in enumerate(points, 1)]
    xyz = np.reshape([point for point, _ in found], (-1, 3))
    name = given.get("name", "")
    return Markup(
        name if isinstance(name, str) else "",
        str(kind),
        scale * xyz @ R.T,
        tuple(label for _, label in found),
        tuple(notes),
    )


def _frame(given: dict[str, Any], file: str, where: str) -> Array:
    """The rotation that brings the markup's coordinates into LPS."""
    stated = given.get("coordinateSystem")
    if stated == "LPS":
        return np.eye(3)
    if stated == "RAS":
        return LPS_FROM_RAS
    if stated is None:
        raise InputError(
            file, "has no coordinateSystem: LPS or RAS is not guessed", where
        )
    raise InputError(
        file, f"coordinateSystem {_shown(stated)} is neither LPS nor RAS", where
    )


def _unit(given: dict[str, Any], file: str, where: str) -> tuple[float, list[str]]:
    stated = given.get("coordinateUnits")
    if stated is None:
        return 1e-3, ["no coordinateUnits: mm, as the format has it"]
    # newer files write ["mm", "UCUM", "millimeter"]
    word = stated[0] if isinstance(stated, list) and stated else stated
    if not isinstance(word, str) or word not in LENGTH_UNITS:
        known = ", ".join(LENGTH_UNITS)
        raise InputError(
            file, f"coordinateUnits {_shown(stated)} is none of {known}", where
        )
    return LENGTH_UNITS[word], []


def _point(given: Any, file: str, where: str) -> tuple[Any, str]:
    if not isinstance(given, dict):
        raise InputError(file, "is no object", where)
    status = given.get("positionStatus", "defined")
    if status != "defined":
        raise InputError(file, f"its position is {_shown(status)}, not defined", where)
    xyz = given.get("position")
    good = isinstance(xyz, list) and len(xyz) == 3 and all(map(_is_number, xyz))
    if not good:
        raise InputError(file, "position is no list of three finite numbers", where)
    label = given.get("label", "")
    return xyz, label.strip() if isinstance(label, str) else ""


def _is_number(value: Any) -> bool:
    """A number that a point may have; larger ones are no millimetres of a patient."""
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    return plain and abs(value) < 1e9


def _shown(value: Any) -> str:
    return repr(value)[:60]


def _not_finite(text: str) -> float:
    raise ValueError(f"{text} is no finite number")
