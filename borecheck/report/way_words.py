"""Points and ways in point_mm, as text and page write them."""

from collections.abc import Mapping, Sequence
from math import ceil, hypot
from typing import Any

# No way out is looked for beyond this: `contact.way_out`, [mm].
LONGEST_MM = 50


def way_out_words(row: Mapping[str, Any]) -> str:
    """How far and where to a link must move to part from what it touches."""
    shift = row.get("way_out_m")
    if shift is None:
        return f"none found within {LONGEST_MM} mm" if "way_out_m" in row else ""
    far = ceil(1e4 * hypot(*shift) - 1e-6) / 10.0
    return f"{far:.1f} by {point_mm(shift)}"


def point_mm(point: Sequence[float]) -> str:
    """A point of the scanner's frame in point_mm; no tenth of one is -0."""
    return "(" + ", ".join(f"{round(1e3 * x, 1) + 0.0:.1f}" for x in point) + ")"
