"""A scan, and the obstacle made of it, in words."""

from collections.abc import Iterator, Mapping
from typing import Any

from borecheck.report.blocks import Block, Table

_COLUMNS = (
    *("series", "slices", "voxels [mm]", "extent [mm]", "position", "kernel", "UID"),
)


def listed(document: Mapping[str, Any]) -> Iterator[Block]:
    """The series of a folder, a row each."""
    rows = [_COLUMNS]
    for one in document["series"]:
        down, across = one["spacing_down_across_mm"]
        rows.append(
            (
                str(one["number"]),
                str(one["slices"]),
                f"{across:.3g} x {down:.3g}, {one['columns']} x {one['rows']}",
                f"{one['extent_mm']:.4g}",
                one["position"] or "not stated",
                one["kernel"] or "",
                one["uid"] or "empty",
            )
        )
    yield Table(rows)


def patient_text(document: Mapping[str, Any]) -> Iterator[Block]:
    """What was read, what was made of it, and what is not known."""
    volume = document["volume"]
    down, across = volume["spacing_down_across_mm"]
    low, high = volume["steps_mm"]
    even = volume["step_lps_mm"] is not None
    steps = f"{low:.4g}" if even else f"{low:.4g} to {high:.4g}"
    yield (
        f"{document['file']}: {volume['slices']} slices of {volume['columns']} x "
        f"{volume['rows']}, {across:.4g} x {down:.4g} mm, steps of {steps} mm; "
        f"position {volume['position'] or 'not stated'}"
    )
    if document["proof"] is not None:
        yield from _obstacle(document)
    for line in document["notes"]:
        yield f"note: {line}"
    for line in document["dropped"]:
        yield f"left out: {line}"


def _obstacle(document: Mapping[str, Any]) -> Iterator[str]:
    proof, made = document["proof"], document["obstacle"]
    excess = proof["excess_m"]
    large = "" if excess is None else f", at most {1e3 * excess:.1f} mm too large"
    yield (
        f"obstacle of {made['triangles']} triangles ({made['frame']} frame): proven at "
        f"least {1e3 * proof['gap_m']:.2f} mm outside the skin{large}"
    )
    for one in document["components"]:
        verb = "kept" if one["kept"] else "removed"
        pieces = "" if one["pieces"] == 1 else f", {one['pieces']} pieces"
        yield f"  {verb}: {one['what']}, {1e6 * one['volume_m3']:.4g} cm3{pieces}"
    if made["file"] is not None:
        yield f"written: {made['file']} (metres)"
    if not document["place"]["known"]:
        yield "its place is not known: checks with it are never clear"
