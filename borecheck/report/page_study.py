"""What pages of `fk`, `validate` and of any study show, drawn from their documents.

A study may say itself how it wants to be shown:

- `sections: [{title, text, table: {columns, rows}, figure}]`, where a figure is data:
  `{kind: "curves", lines: {name: [[x, y], ...]}, x, y}`,
  `{kind: "histogram", values: [...], x}` or
  `{kind: "heat_map", columns: [...], rows: [[name, value, ...], ...], unit}`;
- `summary`: one sentence for the top; `verdict` and `reason` as in a check.

Everything else that is a table by its form is shown as one.
"""

from collections.abc import Mapping, Sequence
from math import log10
from typing import Any

from markupsafe import Markup

from borecheck.report.figures import bars, curves, histogram

# What `inputs.html.j2` and the headline show already.
_SHOWN_ELSEWHERE = {
    *("schema_version", "command", "argv", "date", "versions", "version", "robot"),
    *("scene", "not_modelled", "display", "seed", "verdict", "reason", "summary"),
    *("sections", "samples"),
}

SEVERITIES = ("error", "warning", "info")


def kinematics_views(document: Mapping[str, Any]) -> dict[str, Any]:
    """Differences by frame, as rows and as bars, and their distribution."""
    found = document["worst_by_frame"]
    sources = list(found)
    frames = list(dict.fromkeys(name for pair in found.values() for name in pair))
    least = 1e-17
    worst = [
        (
            frame,
            max(found[v][frame]["position_m"] for v in found if frame in found[v]),
        )
        for frame in frames
    ]
    sizes = [
        max(d["position_m"], least) for pair in found.values() for d in pair.values()
    ]
    title = "Worst difference of position per frame, logarithmic"
    return {
        "sources": sources,
        "frames": frames,
        "bars": bars(worst, "m", title, least),
        "spread": histogram(
            [log10(size) for size in sizes],
            "log10 of the difference [m]",
            "How the differences of position are distributed over frames and sources",
        )
        if sizes
        else None,
    }


def validate_views(document: Mapping[str, Any]) -> dict[str, Any]:
    """Findings of every file, worst first, and how many of each severity."""
    files = []
    for entry in document["files"]:
        findings = sorted(
            entry["findings"],
            key=lambda f: (_rank(f["severity"]), f["line"] or 0),
        )
        counts = {s: sum(f["severity"] == s for f in findings) for s in SEVERITIES}
        codes = sorted({f["code"] for f in findings})
        files.append(
            {
                **{"file": entry["file"], "findings": findings},
                **{"counts": counts, "codes": codes},
            }
        )
    return {
        "files": files,
        "codes": _codes([f for file in files for f in file["findings"]]),
        "totals": {s: sum(f["counts"][s] for f in files) for s in SEVERITIES},
    }


def _codes(findings: Sequence[Mapping[str, Any]]) -> list[tuple[str, str, int]]:
    """Code, name and number of each kind of finding, the most frequent first."""
    counts: dict[tuple[str, str], int] = {}
    for finding in findings:
        key = (str(finding["code"]), str(finding.get("name", "")))
        counts[key] = counts.get(key, 0) + 1
    ordered = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    return [(code, name, count) for (code, name), count in ordered]


def _rank(severity: str) -> int:
    return SEVERITIES.index(severity) if severity in SEVERITIES else len(SEVERITIES)


def study_views(document: Mapping[str, Any]) -> dict[str, Any]:
    """Sections of a study: its own, then what is a table or a number by its form."""
    sections = [_section(entry) for entry in document.get("sections", ())]
    facts = []
    for name, value in document.items():
        if name in _SHOWN_ELSEWHERE:
            continue
        table = _as_table(value)
        if table is not None:
            title = name.replace("_", " ")
            sections.append(
                {"title": title, "text": "", "table": table, "figure": None}
            )
        elif not isinstance(value, Mapping | list | tuple):
            facts.append((name.replace("_", " "), value))
    return {"sections": sections, "facts": facts}


def _section(entry: Mapping[str, Any]) -> dict[str, Any]:
    table = entry.get("table")
    figure = entry.get("figure")
    return {
        "title": str(entry.get("title", "")),
        "text": str(entry.get("text", "")),
        "table": None if table is None else _checked_table(table),
        "figure": None if figure is None else _figure(figure),
    }


def _checked_table(table: Mapping[str, Any]) -> dict[str, Any]:
    columns = [str(name) for name in table["columns"]]
    rows = [list(row) for row in table["rows"]]
    if any(len(row) != len(columns) for row in rows):
        raise ValueError("a table's row is not as long as its header")
    return {"columns": columns, "rows": rows, "levels": None}


def _figure(figure: Mapping[str, Any]) -> dict[str, Any] | Markup:
    kind = figure["kind"]
    title = str(figure.get("title", "plot"))
    if kind == "curves":
        lines = {
            str(name): [(float(x), float(y)) for x, y in points]
            for name, points in figure["lines"].items()
        }
        return curves(lines, str(figure["x"]), str(figure["y"]), title)
    if kind == "histogram":
        values = [float(v) for v in figure["values"]]
        return histogram(values, str(figure["x"]), title)
    if kind == "heat_map":
        return heat_map(figure)
    raise ValueError(f"a figure of kind {kind!r} is none that a page can draw")


def heat_map(figure: Mapping[str, Any]) -> dict[str, Any]:
    """A table whose cells are shaded in five levels by their value."""
    table = _checked_table(
        {"columns": ["", *figure["columns"]], "rows": figure["rows"]}
    )
    values = [v for row in table["rows"] for v in row[1:] if v is not None]
    low, high = min(values, default=0.0), max(values, default=1.0)
    span = (high - low) or 1.0
    table["levels"] = [
        [
            None,
            *(
                None if v is None else min(int(5 * (v - low) / span), 4)
                for v in row[1:]
            ),
        ]
        for row in table["rows"]
    ]
    return table


def _as_table(value: Any) -> dict[str, Any] | None:
    """A table from a list of records, or from named records."""
    if isinstance(value, Mapping) and value and all(map(_is_record, value.values())):
        records = [{"name": name, **record} for name, record in value.items()]
        return _from_records(records)
    if isinstance(value, Mapping) and value:
        rows = [[name, v] for name, v in value.items() if _is_cell(v)]
        return (
            {"columns": ["", "value"], "rows": rows, "levels": None} if rows else None
        )
    if isinstance(value, list) and value and all(map(_is_record, value)):
        return _from_records(value)
    return None


def _from_records(records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    records = [_flat(record) for record in records]
    columns = list(dict.fromkeys(name for record in records for name in record))
    columns = [c for c in columns if any(_is_cell(r.get(c)) for r in records)]
    rows = [
        [r.get(c) if _is_cell(r.get(c)) else None for c in columns] for r in records
    ]
    titles = [str(c).replace("_", " ") for c in columns]
    return {"columns": titles, "rows": rows, "levels": None}


def _flat(record: Mapping[str, Any]) -> dict[str, Any]:
    """The record with the small records in it as columns of their own."""
    flat: dict[str, Any] = {}
    for name, value in record.items():
        if isinstance(value, Mapping) and _is_cell(value):
            before = "" if name == "verdicts" else f"{name} "
            flat |= {f"{before}{inner}": v for inner, v in value.items()}
        else:
            flat[name] = value
    return flat


def _is_record(value: Any) -> bool:
    return isinstance(value, Mapping)


def _is_cell(value: Any) -> bool:
    """Whether it fits into a table's cell: a scalar, or a flat and short collection."""
    if isinstance(value, Mapping):
        return len(value) <= 8 and not any(
            isinstance(v, Mapping | list | tuple) for v in value.values()
        )
    if isinstance(value, list | tuple):
        return len(value) <= 8 and not any(
            isinstance(v, Mapping | list | tuple) for v in value
        )
    return True
