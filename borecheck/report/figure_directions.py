"""A map of needle directions as a picture of its own: SVG, read at one look.

Directions are drawn by where the needle comes from, seen from above the patient: the
middle is straight from above, distance from it the tilt. Every state has a hatching of
its own beside its colour.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import escape
from numpy.typing import NDArray

from borecheck.core.patient_frame import scanner_from_patient

if TYPE_CHECKING:
    from borecheck.directions.direction_map import DirectionMap, NearestClear
    from borecheck.directions.ranking import Ranked

Array = NDArray[np.float64]

WIDTH, HEIGHT, SIDE = 860, 640, 560
MIDDLE = (310.0, 320.0)
RINGS_DEG = (15, 30, 45)
# Edges of cells are drawn as so many pieces for every so many radians.
PIECE = np.radians(2.0)

COLOURS = {
    "clear": "#3a8f6f",
    "contact": "#c8553d",
    "out": "#c9ced6",
    "undecided": "#e9b44c",
}
WORDS = {
    "clear": "clear, proven",
    "contact": "in contact, proven",
    "out": "out of reach or asked limits, proven",
    "undecided": "not decided",
}

_STYLE = """
text { font: 13px sans-serif; fill: #22262b; }
.small { font-size: 12px; } .side { font-weight: bold; }
.ring { fill: none; stroke: #22262b; stroke-opacity: .35; stroke-dasharray: 2 4; }
.mark { fill: #fff; stroke: #22262b; stroke-width: 1.5; }
.arrow { stroke: #22262b; stroke-width: 2; marker-end: url(#head); }
"""

_PATTERNS = """
<pattern id="contact" width="7" height="7" patternUnits="userSpaceOnUse">
<rect width="7" height="7" fill="#c8553d"/>
<path d="M-1 1l2-2M0 7l7-7M6 8l2-2" stroke="#fff" stroke-width="1"/></pattern>
<pattern id="undecided" width="6" height="6" patternUnits="userSpaceOnUse">
<rect width="6" height="6" fill="#e9b44c"/><circle cx="3" cy="3" r="1" fill="#22262b"/>
</pattern>
<pattern id="out" width="6" height="6" patternUnits="userSpaceOnUse">
<rect width="6" height="6" fill="#c9ced6"/>
<path d="M0 3h6" stroke="#9aa3ad" stroke-width="1"/></pattern>
<marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7"
 markerHeight="7" orient="auto"><path d="M0 0L8 4L0 8z" fill="#22262b"/></marker>
"""


def direction_picture(
    found: "DirectionMap",
    ranked: Sequence["Ranked"] = (),
    asked: Array | None = None,
    nearest: "NearestClear | None" = None,
    R_scanner_ras: Array | None = None,
) -> str:
    """The map as a complete SVG file.

    Args:
        found: The map.
        ranked: Directions that are numbered in it.
        asked: A direction that is marked with a cross, (3,).
        nearest: The clear one nearest to it, where an arrow ends.
        R_scanner_ras: How the patient lies, which names the sides, (3, 3); head first
            and supine by default.
    """
    scale = _scale(found)
    parts = [
        _cells(found, name, scale) for name in ("out", "undecided", "contact", "clear")
    ]
    parts.append(_rings(scale))
    lies = scanner_from_patient("RAS") if R_scanner_ras is None else R_scanner_ras
    parts.append(_sides(lies))
    for number, best in enumerate(ranked, start=1):
        parts.append(_numbered(_place(best.plan.direction[None], scale)[0], number))
    if asked is not None:
        parts.append(_asked(asked, nearest, scale))
    parts.append(_legend(found))
    title = escape(f"Needle directions to {_point(found.target)} mm")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'role="img" aria-label="{title}"><title>{title}</title>'
        f"<style>{_STYLE}</style><defs>{_PATTERNS}</defs>"
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>{"".join(parts)}</svg>\n'
    )


def _point(point: Array) -> str:
    return "(" + ", ".join(f"{1e3 * x + 0.0:g}" for x in point) + ")"


def _scale(found: "DirectionMap") -> float:
    """Pixels for a radian of tilt, so that the chart fits."""
    low, high = found.setup.chart.limits
    edge = np.array([(a, b) for a in (low[0], high[0]) for b in (low[1], high[1])])
    tilt = np.arccos(np.clip(-found.setup.chart.directions(edge)[:, 2], -1.0, 1.0))
    return float(0.47 * SIDE / max(float(tilt.max()), 0.1))


def _place(directions: Array, scale: float) -> Array:
    """Pixels (k, 2) of directions (k, 3): head up, the patient's right on the left."""
    from_where = -directions
    across = np.hypot(from_where[:, 0], from_where[:, 1])
    tilt = np.arctan2(across, from_where[:, 2])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(across > 0.0, tilt / across, 0.0) * scale
    x = MIDDLE[0] - share * from_where[:, 1]
    return np.stack([x, MIDDLE[1] - share * from_where[:, 0]], axis=1)


def _cells(found: "DirectionMap", name: str, scale: float) -> str:
    """All cells of one state as one path."""
    from borecheck.directions.leaves import STATES

    rows = np.flatnonzero(found.leaves.state == STATES.index(name))
    if not len(rows):
        return ""
    low, high = found.leaves.low[rows], found.leaves.high[rows]
    pieces = max(1, int(np.ceil((high - low).max() / PIECE)))
    around = _around(pieces)
    angles = low[:, None] + around * (high - low)[:, None]
    flat = found.setup.chart.directions(angles.reshape(-1, 2))
    corners = _place(flat, scale).reshape(len(rows), -1, 2)
    path = "".join(
        "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in outline) + "z"
        for outline in corners
    )
    fill = COLOURS[name] if name == "clear" else f"url(#{name})"
    edge = COLOURS[name]
    return f'<path d="{path}" fill="{fill}" stroke="{edge}" stroke-width=".5"/>'


def _around(pieces: int) -> Array:
    """Places round a unit square, (4 pieces, 2)."""
    t = np.arange(pieces) / pieces
    zero, one = np.zeros(pieces), np.ones(pieces)
    sides = ((t, zero), (one, t), (1.0 - t, one), (zero, 1.0 - t))
    return np.concatenate([np.stack(side, axis=1) for side in sides])


def _rings(scale: float) -> str:
    x, y = MIDDLE
    parts = []
    for ring in RINGS_DEG:
        r = np.radians(ring) * scale
        if r > 0.56 * SIDE:
            break
        parts.append(
            f'<circle class="ring" cx="{x}" cy="{y}" r="{r:.1f}"/>'
            f'<text class="small" x="{x + 4}" y="{y - r - 3:.1f}">{ring} deg</text>'
        )
    return "".join(parts)


def _sides(R: Array) -> str:
    """Names of the patient's sides at the ends of the axes, by R_scanner_ras."""
    names: dict[str, str] = {}
    for axis, word in ((0, "x"), (1, "y")):
        for sign in (1.0, -1.0):
            along = R.T @ (sign * np.eye(3)[axis])
            k = int(np.abs(along).argmax())
            positive = ("right side", "front", "head")
            negative = ("left side", "back", "feet")
            name = (positive if along[k] > 0 else negative)[k]
            names[("+" if sign > 0 else "-") + word] = (
                f"{name} ({'+' if sign > 0 else '-'}{word})"
            )
    x, y, far = *MIDDLE, 0.5 * SIDE
    places: Mapping[str, tuple[float, float, str]] = {
        "+x": (x, y - far - 12, "middle"),
        "-x": (x, y + far + 22, "middle"),
        "+y": (x - far - 24, y - 8, "start"),
        "-y": (x + far + 24, y - 8, "end"),
    }
    return "".join(
        f'<text class="side" x="{a:.0f}" y="{b:.0f}" text-anchor="{anchor}">'
        f"{escape(names[key])}</text>"
        for key, (a, b, anchor) in places.items()
    )


def _numbered(place: Array, number: int) -> str:
    x, y = place
    return (
        f'<circle class="mark" cx="{x:.1f}" cy="{y:.1f}" r="10"/>'
        f'<text x="{x:.1f}" y="{y + 4.5:.1f}" text-anchor="middle">{number}</text>'
    )


def _asked(asked: Array, nearest: "NearestClear | None", scale: float) -> str:
    x, y = _place(asked[None], scale)[0]
    cross = (
        f'<path d="M{x - 7:.1f} {y - 7:.1f}l14 14m0 -14l-14 14" stroke="#22262b" '
        'stroke-width="3" fill="none"/>'
    )
    if nearest is None or nearest.plan is None or nearest.angle == 0.0:
        return cross
    a, b = _place(nearest.plan.direction[None], scale)[0]
    return (
        f'{cross}<line class="arrow" x1="{x:.1f}" y1="{y:.1f}" x2="{a:.1f}" '
        f'y2="{b:.1f}"/>'
    )


def _legend(found: "DirectionMap") -> str:
    """States with their shares, the main reasons, and what was asked."""
    lines, y = [], 60
    for name, word in WORDS.items():
        fill = COLOURS[name] if name == "clear" else f"url(#{name})"
        share = 100.0 * found.shares[name]
        lines.append(
            f'<rect x="625" y="{y - 11}" width="16" height="14" fill="{fill}" '
            f'stroke="#22262b" stroke-width=".5"/>'
            f'<text x="648" y="{y}">{share:.1f} %</text>'
            f'<text class="small" x="625" y="{y + 18}">{word}</text>'
        )
        y += 46
    y += 10
    for (state, reason), share in list(found.reasons.items())[:5]:
        if share < 0.005:
            break
        lines.append(
            f'<text class="small" x="625" y="{y}">{100.0 * share:.1f} % {state}:</text>'
            f'<text class="small" x="625" y="{y + 15}">{escape(_short(reason))}</text>'
        )
        y += 36
    return "".join(lines)


def _short(text: str) -> str:
    return text if len(text) <= 36 else f"{text[:33]}..."
