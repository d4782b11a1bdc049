"""Set-ups in words: a row for each needle, then what to do with it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from borecheck.report.blocks import Block, Table

MARKS = {"reachable": "REACHABLE", "unreachable": "UNREACHABLE"}
_HEADER = ("plan", "", "f", "gap", "mu", "scanner", "patient", "cone", "looked at")


def setup_text(document: Mapping[str, Any]) -> Sequence[Block]:
    """The result of `setup`: a table, reasons, and the configurations."""
    found = document["setups"]
    blocks: list[Block] = [Table([_HEADER, *(_row(one) for one in found)]), ""]
    blocks += [line for one in found for line in _lines(one)]
    blocks += [
        f"  waypoints: {file} (borecheck check ... --path {file})"
        for file in document["motions"].values()
    ]
    blocks += [f"warning: {text}" for text in document["warnings"]]
    return blocks


def _row(one: Mapping[str, Any]) -> tuple[str, ...]:
    said = one["constraints"]
    mark = MARKS.get(one["status"], "UNDECIDED")
    if one["status"] != "reachable":
        bound = _number(one["lower_bound"])
        return (
            one["name"],
            mark,
            f">= {bound}" if bound else "",
            *[""] * 5,
            _many(one),
        )
    room = said["clearance"]
    cone = said["cone"]["zenith_rad"]
    return (
        one["name"],
        mark,
        _number(one["cost"]),
        _number(one["gap"]) or "not known",
        _number(said["manipulability"]),
        f"{1e3 * room['scanner_m']:.1f} mm",
        f"{1e3 * room['patient_m']:.1f} mm",
        f"{57.29577951308232 * cone:.0f} deg shown" if cone else "not asked",
        _many(one),
    )


def _many(one: Mapping[str, Any]) -> str:
    return f"{one['boxes']} in {one['seconds']:.2f} s"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _lines(one: Mapping[str, Any]) -> Iterator[str]:
    if one["status"] != "reachable":
        yield f"{one['name']}: {one['status']}: {one['reason']}"
        return
    q = ",".join(f"{name}={value:.9g}" for name, value in one["q"].items())
    yield f"{one['name']}: --q {q}"
