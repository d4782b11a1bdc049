"""The study of the 64 trials as text: the papers' tables beside ours."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from borecheck.report.blocks import Block, Table

if TYPE_CHECKING:
    from zerobot.trials.run import StudyOptions

Document = Mapping[str, Any]

MARKS = {True: "v", False: "x", None: "-"}
SHOWN_MARGINS = ("offset", "enlarge-axes", "enlarge-axes:world")


def begins(options: "StudyOptions") -> str:
    """What is about to be done, and whether it may be interrupted without loss."""
    jobs = options.jobs or "all"
    kept = (
        "finished repetitions are not kept: --state FILE keeps them"
        if options.state is None
        else f"finished repetitions are kept in {options.state}"
    )
    return (
        f"trials: every approach as set up, then {options.samples} repetitions, on "
        f"{jobs} cores (each loads robot and gantry first); {kept}"
    )


def ends_early(options: "StudyOptions") -> str:
    """What an interruption leaves."""
    if options.state is None:
        return "trials: nothing is kept of what was done; --state FILE keeps it"
    return f"trials: the same command goes on from {options.state}"


def trials_text(document: Document) -> list[Block]:
    """Tables 2 to 4, the repetitions, the fits, and what margin would have worked."""
    lines: list[Block] = [
        "The 64 trials of [Matsuno2020], Tables 2 to 4: v right, x wrong, - none",
        "",
    ]
    for point in ("P1", "P2", "P3"):
        lines += _tables(document["trials"], point)
    lines += _nominal(document)
    if document["monte_carlo"] is not None:
        lines += _monte_carlo(document["monte_carlo"])
    lines += _ranking(document["ranking"])
    lines += _fits(document)
    lines += _margins(document["margins"])
    return lines


def _tables(trials: Sequence[Document], point: str) -> list[Block]:
    """One of the papers' tables: theirs, then ours under every reading."""
    mine = [t for t in trials if t["point"] == point]
    axes = list(dict.fromkeys(t["axis"] for t in mine))
    head = ["q4,q5 [deg]"]
    for axis in axes:
        for d in (25, 15):
            head += [f"{axis} {d} paper", "offset", "body", "world"]
    rows = [tuple(head)]
    for posture in dict.fromkeys((t["q4_deg"], t["q5_deg"]) for t in mine):
        row = [f"{posture[0]:3d},{posture[1]:3d}"]
        for axis in axes:
            for d in (25, 15):
                row += _cells(mine, axis, d, posture)
        rows.append(tuple(row))
    right = sum(t["published_ok"] for t in mine)
    return [f"{point}: the papers {right}/{len(mine)}", Table(rows), ""]


def _cells(
    trials: Sequence[Document], axis: str, distance: int, posture: tuple[int, int]
) -> list[str]:
    for t in trials:
        key = (t["axis"], t["distance_mm"], (t["q4_deg"], t["q5_deg"]))
        if key == (axis, distance, posture):
            ours = [
                MARKS[t["verdicts_by_margin"][kind]["exact"] == t["expected"]]
                if t["reached"]
                else "?"
                for kind in SHOWN_MARGINS
            ]
            return [MARKS[t["published_ok"]], *ours]
    return ["-"] * 4


def _nominal(document: Document) -> list[Block]:
    rows = [("checker", "margin", "25 mm", "15 mm", "right")]
    rows += [
        (
            row["checker"],
            row["margin_kind"],
            str(row["right_at_25_mm"]),
            str(row["right_at_15_mm"]),
            f"{row['right']}/{row['of']}",
        )
        for row in document["nominal"]
    ]
    agree = "agree" if document["exact_and_two_sided_agree"] else "DIFFER"
    lines: list[Block] = [
        "Without any error (? above: out of the model's reach)",
        Table(rows),
    ]
    lines.append(f"exact and two-sided {agree} in all cells")
    lines += [f"out of reach: {text}" for text in document["unreachable"]]
    unexpected = {t["reason"] for t in document["trials"] if t["reached"]} - {None}
    if unexpected:
        lines.append(
            f"{sum(bool(t['reason']) for t in document['trials'])} cells are not as "
            "expected; the reason of each is in the JSON, for example:"
        )
        lines += [f"  {text}" for text in sorted(unexpected)[:3]]
    return [*lines, ""]


def _monte_carlo(found: Document) -> list[str]:
    low, high = found["success_interval_95"]
    e = found["error_mm"]
    return [
        f"{found['repetitions']} repetitions with errors fixed from their sources "
        "(true 20 mm margin)",
        f"  right: {100 * found['success_rate']:.2f} % (95 %: {100 * low:.2f} to "
        f"{100 * high:.2f} %); the papers: {100 * found['published_rate']:.1f} %",
        f"  misses at 15 mm {found['misses_at_15_mm']}, "
        f"false alarms at 25 mm {found['false_alarms_at_25_mm']}",
        f"  repetitions as bad as the papers' table: "
        f"{100 * found['share_of_repetitions_at_or_below_published']:.1f} %",
        f"  error: mean {e['mean']:+.2f} mm, standard deviation "
        f"{e['standard_deviation']:.2f} mm, from {e['smallest']:+.2f} to "
        f"{e['largest']:+.2f} mm; a miss needs more than +5 mm",
        "",
    ]


def _ranking(rows: Sequence[Document]) -> list[Block]:
    lines: list[Block] = [
        "15 mm cells by our miss probability, then by the largest error (first order)"
    ]
    listed = [("place", "trial", "probability", "largest error", "papers")]
    for place, row in enumerate(rows, start=1):
        if row["published_miss"] or place <= 3:
            listed.append(
                (
                    str(place),
                    f"{row['point']} {row['axis']} ({row['q4_deg']},{row['q5_deg']})",
                    f"{row['miss_probability']:.2g}",
                    f"{row['largest_error_mm']:+.2f} mm",
                    "missed" if row["published_miss"] else "right",
                )
            )
    places = [i for i, row in enumerate(rows, start=1) if row["published_miss"]]
    mean = sum(places) / max(1, len(places))
    chance = (len(rows) + 1) / 2.0
    lines.append(Table(listed))
    lines.append(
        f"mean place of the published misses: {mean:.1f}; by chance it would be "
        f"{chance:.1f}: the error model does not predict which cells fail"
        if mean > 0.7 * chance
        else f"mean place of the published misses: {mean:.1f} (by chance {chance:.1f})"
    )
    return [*lines, ""]


def _fits(document: Document) -> list[Block]:
    rows = [("free", "log likelihood", "AIC", "expected misses", "cells as published")]
    for row in document["fitted_to_the_published_table"]:
        rows.append(
            (
                row["family"],
                f"{row['log_likelihood']:.1f}",
                f"{row['aic']:.1f}",
                f"{row['expected_misses']:.1f}",
                f"{row['right_cells']}/32",
            )
        )
    lines: list[Block] = [
        "Fitted to the published table (predicts nothing)",
        Table(rows),
        "",
    ]
    lines.append("Smallest disturbance that gives exactly the published table")
    for row in document["smallest_disturbances"]:
        size = row["size_mm"]
        lines.append(
            f"  {row['family']}: " + ("none" if size is None else f"{size:.2f} mm")
        )
        if size is not None and len(row["parameters"]) <= 18:
            big = {k: v for k, v in row["parameters"].items() if abs(v) > 0.005}
            lines += [f"    {name} {value:+.2f}" for name, value in big.items()]
    return [*lines, ""]


def _margins(found: Document) -> list[Block]:
    ours = found["with_our_error_model"]
    rate = found["gaussian_fit_of_the_published_rate"]
    lines: list[Block] = [
        "Margin for 99.9 % at 15 mm without false alarms (0.1 %) at 25 mm",
        f"  by our error model: {ours['at_least_mm']:.2f} to "
        f"{ours['at_most_mm']:.2f} mm",
        f"  by a normal error with the published rates (mean {rate['mean_mm']:.1f} mm, "
        f"standard deviation {rate['standard_deviation_mm']:.1f} mm): at least "
        f"{rate['at_least_mm']:.1f}, at most {rate['at_most_mm']:.1f} mm"
        + ("" if rate["at_least_mm"] < rate["at_most_mm"] else ": no margin does both"),
        "Reach of the robot enlarged by 20 mm towards the gantry",
    ]
    lines += [
        f"  {kind}: {row['smallest']:.1f} to {row['largest']:.1f} mm, "
        f"{row['false_alarms_at_25_mm']} false alarms at 25 mm"
        for kind, row in found["enlarged_reach_mm"].items()
    ]
    return lines
