"""Files of needle plans, CSV and JSON, read strictly and written exactly.

CSV: a header with `name,entry_x,entry_y,entry_z,target_x,target_y,target_z` in any
order, in the scanner's frame, in metres or in the unit that all of them end in
(`entry_x_mm` ...), and optionally `roll` ([rad], or `15deg`) and `mount` (+90 or -90).
JSON: the same fields, a list of such plans or an object with
`plans`; `unit` (m, mm ...), `frame` (scanner, RAS, LPS), `patient_position` (HFS ...)
and `origin` (the patient frame's origin in the scanner's frame, in `unit`) may stand
beside `plans` or in each plan. Points may also be lists: `"entry": [x, y, z]`.
Markups of 3D Slicer (`.mrk.json`, `.fcsv`) are read with the patient's place.
"""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from borecheck.core.csv_columns import separator_problem
from borecheck.core.small_files import read_at_most
from borecheck.core.whole_files import write_whole
from borecheck.errors import InputError, PlanError, UsageError
from borecheck.exchange.markups import is_markups
from borecheck.plans.markup_plans import plans_of_markups
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.patient_place import PatientPlace
from borecheck.plans.plan_fields import (
    COLUMNS,
    COORDINATES,
    OPTIONAL,
    SETTINGS,
    PlanValueError,
    plan_of,
    unknown_line,
)
from borecheck.plans.plan_units import bare_names

MAX_BYTES = 20_000_000  # a hundred thousand plans


def given_plans(
    plans: str | Path | NeedlePlan | Iterable[NeedlePlan],
) -> list[NeedlePlan]:
    """Plans as a caller gives them: their file, one, or several.

    Raises:
        PlanError: The file cannot be used.
        UsageError: Something else.
    """
    if isinstance(plans, str | Path):
        return list(read_plans(plans))
    found = [plans] if isinstance(plans, NeedlePlan) else list(plans)
    for plan in found:
        if not isinstance(plan, NeedlePlan):
            kind = type(plan).__name__
            raise UsageError(f"plans holds a {kind}: give a file, or NeedlePlans")
    return found


def read_plans(
    path: str | Path, place: PatientPlace | None = None
) -> tuple[NeedlePlan, ...]:
    """All needle plans of a CSV, JSON or markups file, in the scanner's frame, [m].

    Args:
        path: The file.
        place: Where the patient's coordinates lie; markups of 3D Slicer need it.

    Raises:
        PlanError: The file or one of its plans cannot be used; one line that says
            where and why.
    """
    text = _text(Path(path))
    if is_markups(text):
        plans = _from_markups(text, path, place)
    elif text.lstrip()[:1] in ("{", "["):
        plans = _from_json(text, str(path))
    else:
        plans = _from_csv(text, str(path))
    _refuse_repeated([plan.name for plan in plans], str(path))
    return plans


def _from_markups(
    text: str, path: str | Path, place: PatientPlace | None
) -> tuple[NeedlePlan, ...]:
    try:
        return plans_of_markups(text, path, place)
    except PlanError:
        raise
    except InputError as error:
        raise PlanError(path, error.problem, error.element) from error


def plans_csv(plans: Iterable[NeedlePlan]) -> str:
    """The plans as CSV text that `read_plans` reads back without loss."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow((*COLUMNS, *OPTIONAL))
    for plan in plans:
        numbers = [repr(float(v)) for v in (*plan.entry, *plan.target)]
        roll = "" if plan.roll is None else repr(plan.roll)
        writer.writerow([plan.name, *numbers, roll, plan.mount or ""])
    return out.getvalue()


def plans_json(plans: Iterable[NeedlePlan]) -> str:
    """The plans as JSON text that `read_plans` reads back without loss."""
    document = {
        "unit": "m",
        "frame": "scanner",
        "plans": [_fields(plan) for plan in plans],
    }
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def save_plans(path: str | Path, plans: Iterable[NeedlePlan]) -> None:
    """Write plans as JSON or CSV, by the file's suffix; all of the file or nothing.

    Raises:
        PlanError: Neither suffix, or the file cannot be written.
    """
    path = Path(path)
    writers = {".json": plans_json, ".csv": plans_csv}
    if path.suffix.lower() not in writers:
        raise PlanError(path, "plans are saved as .csv or .json")
    text = writers[path.suffix.lower()](plans)
    try:
        write_whole(path, text)
    except InputError as error:
        raise PlanError(path, error.problem) from error


def _fields(plan: NeedlePlan) -> dict[str, Any]:
    values = [float(v) for v in (*plan.entry, *plan.target)]
    fields: dict[str, Any] = {"name": plan.name}
    fields |= dict(zip(COORDINATES, values, strict=True))
    if plan.roll is not None:
        fields["roll"] = plan.roll
    if plan.mount is not None:
        fields["mount"] = plan.mount
    return fields


def _text(path: Path) -> str:
    try:
        content = read_at_most(path, MAX_BYTES)
    except InputError as error:
        raise PlanError(path, error.problem) from error
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise PlanError(path, "is no text in UTF-8") from error
    if not text.strip():
        raise PlanError(path, "is empty")
    if "\0" in text:
        raise PlanError(path, "holds NUL bytes: is it a plan file?")
    return text


def _from_csv(text: str, file: str) -> tuple[NeedlePlan, ...]:
    # Lines are counted by the reader, because a quoted name may hold a line break.
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    header: list[str] | None = None
    settings: dict[str, Any] = {}
    plans = []
    try:
        for row in reader:
            where = f"line {reader.line_num}"
            cells = [cell.strip() for cell in row]
            if not any(cells):
                continue
            if header is None:
                header, settings = _header(cells, file, where)
                continue
            if len(cells) != len(header):
                raise PlanError(
                    file, f"{len(cells)} cells under {len(header)} columns", where
                )
            fields = dict(zip(header, cells, strict=True))
            plans.append(plan_of(fields, file, where, settings))
    except csv.Error as error:
        raise PlanError(file, f"no CSV: {error}", f"line {reader.line_num}") from error
    if not plans:
        raise PlanError(file, "holds a header and no plan")
    return tuple(plans)


def _header(
    cells: list[str], file: str, where: str
) -> tuple[list[str], dict[str, Any]]:
    """The columns without their unit, and the unit that they say, as a setting."""
    known = (*COLUMNS, *OPTIONAL)
    problem = separator_problem(cells)
    if problem is not None:
        raise PlanError(file, problem, where)
    bare, unit = _without_units(cells, file, where)
    cells = [bare[cell] for cell in cells]
    for cell in cells:
        if cell not in known:
            raise PlanError(file, unknown_line("column", cell, known), where)
        if cells.count(cell) > 1:
            raise PlanError(file, f"column {cell!r} stands twice", where)
    missing = [name for name in COLUMNS if name not in cells]
    if missing:
        raise PlanError(file, f"missing columns: {', '.join(missing)}", where)
    return cells, {} if unit is None else {"unit": unit}


def _without_units(
    names: Iterable[str], file: str, where: str
) -> tuple[dict[str, str], str | None]:
    try:
        return bare_names(names)
    except PlanValueError as error:
        raise PlanError(file, str(error), where) from error


def _from_json(text: str, file: str) -> tuple[NeedlePlan, ...]:
    try:
        document = json.loads(
            text, parse_constant=_refuse_constant, object_pairs_hook=_no_repeats
        )
    except (ValueError, RecursionError) as error:
        raise PlanError(file, f"no JSON plan: {error}") from error
    settings: dict[str, Any] = {}
    if isinstance(document, dict) and "plans" in document:
        plans = document["plans"]
        settings = {k: v for k, v in document.items() if k != "plans"}
        for name in settings:
            if name not in SETTINGS:
                known = ("plans", *SETTINGS)
                raise PlanError(file, unknown_line("field", name, known))
    else:
        plans = document if isinstance(document, list) else [document]
    if not isinstance(plans, list) or not plans:
        raise PlanError(file, "holds no plan: plans must be a list that is not empty")
    return tuple(
        _json_plan(p, settings, file, f"plan {i + 1}") for i, p in enumerate(plans)
    )


def _json_plan(
    given: Any, settings: Mapping[str, Any], file: str, where: str
) -> NeedlePlan:
    if not isinstance(given, dict):
        raise PlanError(file, "is no object with the fields of a plan", where)
    bare, unit = _without_units(given, file, where)
    if len(set(bare.values())) < len(bare):
        raise PlanError(file, "a coordinate is given twice", where)
    fields = _flat({bare[k]: v for k, v in given.items()}, file, where)
    chosen = {**settings, **{k: v for k, v in fields.items() if k in SETTINGS}}
    if unit is not None:
        if chosen.get("unit", unit) != unit:
            problem = f"unit is {chosen['unit']!r}, but the coordinates say {unit!r}"
            raise PlanError(file, problem, where)
        chosen["unit"] = unit
    fields = {k: v for k, v in fields.items() if k not in SETTINGS}
    for name in fields:
        if name not in (*COLUMNS, *OPTIONAL):
            known = (*COLUMNS, *OPTIONAL, *SETTINGS)
            raise PlanError(file, unknown_line("field", name, known), where)
    missing = [name for name in COLUMNS if name not in fields]
    if missing:
        raise PlanError(file, f"missing fields: {', '.join(missing)}", where)
    return plan_of(fields, file, where, chosen)


def _flat(given: Mapping[str, Any], file: str, where: str) -> dict[str, Any]:
    """Points given as lists become the fields that CSV has."""
    fields: dict[str, Any] = {}
    for name, value in given.items():
        if name in ("entry", "target"):
            if not isinstance(value, list) or len(value) != 3:
                raise PlanError(file, f"{name} is no list of three numbers", where)
            parts = {f"{name}_{a}": v for a, v in zip("xyz", value, strict=True)}
        else:
            parts = {name: value}
        for part in parts:
            if part in fields:
                raise PlanError(file, f"{part} is given twice", where)
        fields |= parts
    return fields


def _refuse_repeated(names: Sequence[str], file: str) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise PlanError(file, f"two plans are called {name!r}")
        seen.add(name)


def _refuse_constant(text: str) -> float:
    raise ValueError(f"{text} is no finite number")


def _no_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    names = [name for name, _ in pairs]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"field {twice[:60]!r} stands twice")
    return dict(pairs)
