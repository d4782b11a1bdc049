"""What is written over a still picture, in the forms and colours of the page's panes.

The plan with entry and target, the closest pair or the contact, and a label with the
verdict's shape, millimetres and names: web/src/marks.js.
"""

from collections.abc import Mapping, Sequence
from math import floor
from typing import Any

import numpy as np
from markupsafe import escape
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHAPES = {
    "clear": ("M12 1a11 11 0 1 0 .01 0z", "M6.5 12.5l4 4 7-8.5"),
    "contact": ("M7.5 1h9L23 7.5v9L16.5 23h-9L1 16.5v-9z", "M7.5 7.5l9 9m0-9l-9 9"),
    "unknown": ("M12 1L23.5 21.5H.5z", "M12 8.5v6m0 2.8v1.2"),
}
# Size of a label's letters and their usual width, [px].
LETTERS, WIDE = 22, 13.0


def plan_marks(ends: Array) -> str:
    """Entry and target, and the line between them; (2, 2) pixels."""
    (x0, y0), (x1, y1) = ends
    side = 1 if x0 > x1 else -1
    return (
        segment(ends, "plan") + f'<circle class="plan" r="8" cx="{x0:.1f}" '
        f'cy="{y0:.1f}"/><path class="plan" d="M{x1 - 11:.1f} {y1:.1f}h22'
        f'M{x1:.1f} {y1 - 11:.1f}v22"/>'
        + _name("entry", x0 + 14 * side, y0 - 8, side)
        + _name("target", x1 - 14 * side, y1 + 24, -side)
    )


def _name(words: str, x: float, y: float, side: int) -> str:
    anchor = "start" if side > 0 else "end"
    return (
        f'<text class="name plan" x="{x:.1f}" y="{y:.1f}" '
        f'text-anchor="{anchor}">{words}</text>'
    )


def segment(ends: Array, kind: str) -> str:
    """A line that parts from what is behind it; (2, 2) pixels."""
    (x0, y0), (x1, y1) = ends
    at = f'x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}"'
    return f'<line class="halo" {at}/><line class="{kind}" {at}/>'


def label(at: Sequence[float], words: str, verdict: str, width: int) -> str:
    """The verdict's shape, colour and words, with a line to what they are about."""
    wide = 50.0 + WIDE * len(words)
    x = min(max(at[0] + 40.0, 6.0), width - wide - 6.0)
    y = at[1] - 90.0 if at[1] > 140.0 else at[1] + 55.0
    foot = y + 36.0 if y < at[1] else y
    disc, stroke = SHAPES[verdict]
    return (
        f'<line class="leader {verdict}" x1="{at[0]:.1f}" y1="{at[1]:.1f}" '
        f'x2="{max(x, min(at[0], x + wide)):.1f}" y2="{foot:.1f}"/>'
        f'<g class="chip {verdict}" transform="translate({x:.1f} {y:.1f})">'
        f'<rect rx="7" width="{wide:.1f}" height="36"/>'
        f'<g transform="translate(8 6)"><path class="fill" d="{disc}"/>'
        f'<path class="stroke" d="{stroke}"/></g>'
        f'<text x="40" y="26">{escape(words)}</text></g>'
    )


def told(closest: Mapping[str, Any] | None, touching: Sequence[str] | None) -> str:
    """What a label says: contact and of what, or how far apart what is."""
    if touching is not None:
        return f"contact: {' – '.join(touching)}" if touching else "contact"
    if closest is None:
        return ""
    return f"{millimetres(closest['distance'])}: {closest['link']} – " + str(
        closest["obstacle"]
    )


def millimetres(distance: float) -> str:
    """A lower bound for people: never more than it is."""
    return f"{floor(1e4 * distance + 1e-6) / 10.0:.1f} mm"
