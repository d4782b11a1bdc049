"""A scan, and the obstacle made of it, in words."""

from collections.abc import Iterator, Mapping
from typing import Any

from borecheck.report.blocks import Block, Table


def listed(document: Mapping[str, Any]) -> Iterator[Block]:
    """The series of a folder, a row each."""
    rows = [
        ("series", "slices", "voxels [mm]", "extent [mm]", "position", "kernel", "UID")
    ]
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
    steps = (
        f"{low:.4g}"
        if volume["step_lps_mm"] is not None
        else f"{low:.4g} to {high:.4g}"
    )
    yield (
        f"{document['file']}: {volume['slices']} slices of {volume['columns']} x "
        f"{volume['rows']}, {across:.4g} x {down:.4g} mm, steps of {steps} mm; "
        f"position {volume['position'] or 'not stated'}"
    )
    for line in document["notes"]:
        yield f"note: {line}"
    for line in document["dropped"]:
        yield f"left out: {line}"
