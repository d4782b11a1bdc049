"""A map of directions in words."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from borecheck.report.blocks import Block, Table

MARKS = {"clear": "CLEAR", "none": "NOT CLEAR", "unknown": "UNKNOWN"}


def direction_text(document: Mapping[str, Any]) -> Sequence[Block]:
    """Shares, reasons, ranked directions, and the one that was asked."""
    found = document["map"]
    lines: list[Block] = [*_about(found)]
    lines.append(f"{MARKS[document['verdict']]}: {document['reason']}")
    shares = ", ".join(f"{k} {100 * v:.1f} %" for k, v in found["shares"].items())
    lines.append(f"directions: {shares}; {len(found['cells'])} cells")
    lines += [
        f"  {100 * row['share']:.1f} % {row['state']}: {row['reason']}"
        for row in found["reasons"]
        if row["share"] >= 5e-4
    ]
    lines += _blocking_lines(found["blockers"])
    if document["ranked"]:
        lines.append(_table(document["ranked"]))
    lines += _asked_lines(document["asked"])
    lines += [f"warning: {text}" for text in document["warnings"]]
    return lines


def _about(found: Mapping[str, Any]) -> Iterator[str]:
    target = ", ".join(f"{1e3 * x + 0.0:g}" for x in found["target"])
    ranges = ", ".join(
        f"{name} {low:g} to {high:g} deg"
        for name, low, high in zip(
            found["chart"]["joints"],
            found["chart"]["lower_deg"],
            found["chart"]["upper_deg"],
            strict=True,
        )
    )
    yield f"target ({target}) mm; directions of {ranges}"
    parts = [
        f"cells down to {found['resolution_deg']:g} deg",
        f"approach {1e3 * found['standoff_m']:g} mm",
        f"margin {1e3 * found['margin_m']:g} mm",
        f"targets within {1e3 * found['target_error_m']:g} mm",
    ]
    if found["max_depth_m"] is not None:
        parts.append(f"at most {1e3 * found['max_depth_m']:g} mm deep")
    if found["max_obliquity_deg"] is not None:
        parts.append(f"at most {found['max_obliquity_deg']:g} deg oblique")
    yield "asked: " + ", ".join(parts)


def _blocking_lines(blockers: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """What would open what is blocked, where that is the needle."""
    for blocker in blockers:
        if blocker["needle_short_m"]:
            yield (
                f"{blocker['part']} meets {blocker['obstacle']}: the needle is up to "
                f"{1e3 * blocker['needle_short_m']:.0f} mm too short, "
                f"{1e3 * blocker['deepest_m']:.0f} mm deep there"
            )


def _table(ranked: Sequence[Mapping[str, Any]]) -> Table:
    rows: list[tuple[str, ...]] = [
        ("rank", "entry [mm]", "depth", "oblique", "clearance seen")
    ]
    for row in ranked:
        entry = ", ".join(f"{1e3 * x:.1f}" for x in row["entry"])
        rows.append(
            (
                str(row["rank"]),
                f"({entry})",
                f"{1e3 * row['depth_m']:.1f} mm",
                f"{row['obliquity_deg']:.0f} deg",
                f"{1e3 * row['clearance_seen_m']:.1f} mm",
            )
        )
    return Table(tuple(rows))


def _asked_lines(asked: Mapping[str, Any] | None) -> Iterator[str]:
    if asked is None:
        return
    why = f": {asked['reason']}" if asked["reason"] else ""
    yield f"asked direction: {asked['state']}{why}"
    near = asked["nearest_clear"]
    if asked["state"] == "clear" or near is None:
        return
    bound = f"none nearer than {near['none_nearer_than_deg']:.1f} deg, proven"
    if near["entry"] is None:
        yield "no clear direction"
        return
    entry = ", ".join(f"{1e3 * x:.1f}" for x in near["entry"])
    yield (
        f"nearest clear direction: {near['angle_deg']:.1f} deg away, "
        f"entry ({entry}) mm; {bound}"
    )
