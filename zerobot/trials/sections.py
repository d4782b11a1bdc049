"""The sections of the trials' report page: tables, heat maps, repetitions, fits."""

from collections.abc import Mapping, Sequence
from typing import Any

from zerobot.trials.published import AXES, POSTURES_DEG

Document = Mapping[str, Any]

MARKS = {True: "✓", False: "×", None: "–"}
KINDS = ("offset", "enlarge-axes", "enlarge-axes:world")
APPROACHES = tuple((point, axis) for point, axes in AXES.items() for axis in axes)


def sections(document: Document) -> list[dict[str, Any]]:
    """What the page shows, in order; `report.page_study` says the form."""
    found = [_table(document["trials"], point) for point in AXES]
    found.append(
        _records("Without any error", document["nominal"], "Right verdicts by checker.")
    )
    found += _heat_maps(document["ranking"])
    if document["monte_carlo"] is not None:
        found.append(_repetitions(document["monte_carlo"]))
    found += [
        _records(
            "Fitted to the published table",
            document["fitted_to_the_published_table"],
            "These numbers are fitted to the published table and predict nothing.",
        ),
        _records(
            "Smallest disturbance that gives exactly the published table",
            document["smallest_disturbances"],
            "A length in mm, or none where no disturbance of that kind does it.",
        ),
        _margins(document["margins"]),
    ]
    return found


def summary(document: Document) -> str:
    """One sentence for the top of the page."""
    by = {(r["checker"], r["margin_kind"]): r for r in document["nominal"]}
    offset, body = by[("exact", "offset")], by[("exact", "enlarge-axes")]
    words = (
        f"Without errors {offset['right']} of {offset['of']} trials are right with a "
        f"true 20 mm margin and {body['right']} with the volume enlarged along its axes"
    )
    repeated = document["monte_carlo"]
    if repeated is None:
        return words + "; the papers have 57 of 64."
    return (
        f"{words}; with errors of known source {100 * repeated['success_rate']:.1f} % "
        "are right, and the papers' 57 of 64 (89.1 %) are not explained by them."
    )


def _table(trials: Sequence[Document], point: str) -> dict[str, Any]:
    """One of the papers' tables: their mark, then ours for three margins."""
    columns = ["q4, q5 [deg]"]
    for axis in AXES[point]:
        for distance in (25, 15):
            columns.append(f"{axis} {distance} mm: paper")
            columns += [f"{axis} {distance} mm: {kind}" for kind in KINDS]
    cells = {
        (t["axis"], t["distance_mm"], t["q4_deg"], t["q5_deg"]): t
        for t in trials
        if t["point"] == point
    }
    rows = []
    for q4, q5 in POSTURES_DEG:
        row: list[Any] = [f"{q4}, {q5}"]
        for axis in AXES[point]:
            for distance in (25, 15):
                row += _marks(cells.get((axis, distance, q4, q5)))
        rows.append(row)
    right = sum(t["published_ok"] for t in cells.values())
    return {
        "title": f"Goal point {point}",
        "text": f"The papers have {right} of {len(cells)} right; ours by “exact”.",
        "table": {"columns": columns, "rows": rows},
    }


def _marks(trial: Document | None) -> list[str]:
    if trial is None:
        return [MARKS[None]] * (1 + len(KINDS))
    if not trial["reached"]:
        return [MARKS[trial["published_ok"]], *["out of reach"] * len(KINDS)]
    ours = (
        trial["verdicts_by_margin"][kind]["exact"] == trial["expected"]
        for kind in KINDS
    )
    return [MARKS[trial["published_ok"]], *(MARKS[right] for right in ours)]


def _heat_maps(ranking: Sequence[Document]) -> list[dict[str, Any]]:
    """The 15 mm cells by miss probability; a published miss has its cell named."""
    names = {
        "miss_probability": "Miss probability at 15 mm, errors as their sources say",
        "normal_miss_probability": "Miss probability at 15 mm, normal errors as wide",
        "largest_error_mm": "Largest error the picking allows at 15 mm",
    }
    units = {"largest_error_mm": "mm"}
    cells = {(r["point"], r["axis"], r["q4_deg"], r["q5_deg"]): r for r in ranking}
    missed = ", ".join(
        f"{r['point']} {r['axis']} ({r['q4_deg']}, {r['q5_deg']})"
        for r in ranking
        if r["published_miss"]
    )
    return [
        {
            "title": title,
            "text": f"Published misses: {missed}.",
            "figure": {
                "kind": "heat_map",
                "title": title,
                "unit": units.get(name, ""),
                "columns": [f"{point} {axis}" for point, axis in APPROACHES],
                "rows": [
                    [
                        f"{q4}, {q5}",
                        *(
                            cells[(*where, q4, q5)][name]
                            if (*where, q4, q5) in cells
                            else None
                            for where in APPROACHES
                        ),
                    ]
                    for q4, q5 in POSTURES_DEG
                ],
            },
        }
        for name, title in names.items()
    ]


def _repetitions(found: Document) -> dict[str, Any]:
    low, high = found["success_interval_95"]
    as_bad = found["share_of_repetitions_at_or_below_published"]
    return {
        "title": "The experiment repeated with errors of known source",
        "text": (
            f"{found['repetitions']} repetitions: {100 * found['success_rate']:.2f} % "
            f"right (95 %: {100 * low:.2f} to {100 * high:.2f} %), "
            f"{found['misses_at_15_mm']} misses, "
            f"{found['false_alarms_at_25_mm']} false alarms; "
            f"{100 * as_bad:.1f} % of the repetitions are as bad as the papers' 57 of "
            "64."
        ),
        "figure": {
            "kind": "histogram",
            "title": "Right verdicts of each repetition",
            "values": found["right_of_each"],
            "x": f"right verdicts of {found['trials_each']}",
        },
    }


def _margins(found: Document) -> dict[str, Any]:
    ours = found["with_our_error_model"]
    rate = found["gaussian_fit_of_the_published_rate"]
    rows: list[list[Any]] = [
        ["errors of known source", ours["at_least_mm"], ours["at_most_mm"]],
        [
            f"errors of the published rates (mean {rate['mean_mm']:.1f} mm, "
            f"{rate['standard_deviation_mm']:.1f} mm wide)",
            rate["at_least_mm"],
            rate["at_most_mm"],
        ],
    ]
    reach = found["enlarged_reach_mm"]
    words = "; ".join(
        f"{kind}: {r['smallest']:.1f} to {r['largest']:.1f} mm "
        f"({r['false_alarms_at_25_mm']} false alarms at 25 mm)"
        for kind, r in reach.items()
    )
    return {
        "title": "What margin would have worked",
        "text": (
            "A margin catches 99.9 % at 15 mm with 0.1 % false alarms at 25 mm where "
            "“at least” is below “at most”. Reach of the robot enlarged by 20 mm "
            f"towards the gantry: {words}."
        ),
        "table": {"columns": ["", "at least [mm]", "at most [mm]"], "rows": rows},
    }


def _records(title: str, records: Sequence[Document], text: str) -> dict[str, Any]:
    """A table of records; nested values are written out."""
    columns = list(records[0])
    rows = [[_plain(record[name]) for name in columns] for record in records]
    titles = [name.replace("_", " ") for name in columns]
    return {"title": title, "text": text, "table": {"columns": titles, "rows": rows}}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        big = {k: v for k, v in value.items() if abs(v) > 0.005}
        return ", ".join(f"{k} {v:+.2f}" for k, v in big.items()) or "0"
    return value
