"""Clearance along a motion, as inline SVG.

What is proven is a band, names stand at the curves, nothing is written over a curve.
The range is that in which something is decided, from 0 to about 50 mm; curves that run
above it leave the picture at its top, and their names say so.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from borecheck.report.figures import (
    BOTTOM,
    HEIGHT,
    LEFT,
    LINKS_SHOWN,
    TOP,
    WIDTH,
    Axes,
    Points,
    line,
    nice_ceiling,
    svg,
)
from borecheck.report.motion_words import at_least

# Room for names at the right, [px], and from name to name.
NAMES, NAME_STEP = 128, 15
# What is drawn at least, [mm].
RANGE_MM = 50.0


def clearance_plot(
    path: Mapping[str, Any], margin_m: float, motion: int, title: str
) -> Markup:
    """Clearance along a path in millimetres, per link too, with what is certified.

    Args:
        path: The `path` block of a result.
        margin_m: Required clearance, [m].
        motion: Number of the motion, for the cursor.
        title: What it shows, for readers who do not see it.
    """
    fractions = [100.0 * f for f in path["fractions"]]
    poses = path["poses"]
    whole = [
        (x, 1e3 * pose["clearance_m"])
        for x, pose in zip(fractions, poses, strict=True)
        if pose["clearance_m"] is not None
    ]
    links = _link_curves(fractions, poses)
    least = min((y for _, y in whole), default=0.0)
    top = nice_ceiling(max(RANGE_MM, 1.25e3 * margin_m, 1.5 * least))
    axes = Axes((0.0, 100.0), (0.0, top), HEIGHT, NAMES)
    inside = [
        _proven(path.get("least"), axes),
        *(
            line(axes, curve, f"curve link c{k}")
            for k, curve in enumerate(links.values())
        ),
        line(axes, whole, "curve whole"),
    ]
    parts = [
        axes.grid(_along(path), "clearance [mm]", 20.0, _clock(path)),
        _stretches(path["intervals"], axes),
        _clipped(inside, motion),
        _margin(axes, margin_m, whole),
        _proven_name(path.get("least"), axes),
        _names({"whole robot": whole, **links}, axes, top),
        _contact_marks(fractions, poses, axes),
        f'<line class="cursor" data-motion="{motion}" x1="{LEFT}" x2="{LEFT}" '
        f'y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>'
        f'<text class="value" data-motion="{motion}" y="{TOP + 12}"></text>',
    ]
    linked = f'data-plot="{motion}" data-left="{LEFT}" data-right="{WIDTH - NAMES}"'
    return svg("".join(parts), HEIGHT, title, linked) + _key_of_stretches()


def overlaid(
    paths: Mapping[str, Mapping[str, Any]], margin_m: float, title: str
) -> Markup:
    """The whole robot's clearance along several motions, one over the other."""
    curves = {
        name: [
            (100.0 * x, 1e3 * pose["clearance_m"])
            for x, pose in zip(path["fractions"], path["poses"], strict=True)
            if pose["clearance_m"] is not None
        ]
        for name, path in paths.items()
    }
    least = min((y for curve in curves.values() for _, y in curve), default=0.0)
    top = nice_ceiling(max(RANGE_MM, 1.25e3 * margin_m, 1.5 * least))
    axes = Axes((0.0, 100.0), (0.0, top), HEIGHT, NAMES)
    drawn = [
        line(axes, curve, f"curve link c{k % LINKS_SHOWN}")
        for k, curve in enumerate(curves.values())
    ]
    every = [point for curve in curves.values() for point in curve]
    parts = [
        axes.grid("along the path [%]", "clearance [mm]", 20.0),
        _clipped(drawn, "all"),
        _margin(axes, margin_m, every),
        _names(curves, axes, top, first=0),
    ]
    return svg("".join(parts), HEIGHT, title)


def _clipped(parts: Sequence[str], name: int | str) -> str:
    box = (
        f'<clipPath id="range-{name}"><rect x="{LEFT}" y="{TOP}" '
        f'width="{WIDTH - LEFT - NAMES}" height="{HEIGHT - TOP - BOTTOM}"/></clipPath>'
    )
    return f'{box}<g clip-path="url(#range-{name})">{"".join(parts)}</g>'


def _proven(least: Mapping[str, Any] | None, axes: Axes) -> str:
    """A band from 0 to the certified bound, and on to the length that is reached."""
    if least is None or not least["clearance_m"]:
        return ""
    low, high = 1e3 * least["clearance_m"], 1e3 * least["clearance_upper_m"]
    x, wide = axes.x(0.0), axes.x(100.0) - axes.x(0.0)
    return "".join(
        f'<rect class="{kind}" x="{x:.1f}" y="{axes.y(upper):.1f}" width="{wide:.1f}" '
        f'height="{max(axes.y(lower) - axes.y(upper), 0.0):.1f}"/>'
        for kind, lower, upper in (("proven", 0.0, low), ("between", low, high))
    )


def _proven_name(least: Mapping[str, Any] | None, axes: Axes) -> str:
    if least is None or not least["clearance_m"]:
        return ""
    return (
        f'<text class="least-name" x="{axes.x(0.0) + 6:.1f}" '
        f'y="{axes.y(0.0) - 6:.1f}">never nearer, proven: '
        f"{at_least(least['clearance_m'])}</text>"
    )


def _margin(axes: Axes, margin_m: float, whole: Points) -> str:
    """The margin's line, named at the end where the curve is farther from it."""
    if margin_m <= 0.0:
        return ""
    y = axes.y(1e3 * margin_m)
    gaps = [
        min(
            (abs(v - 1e3 * margin_m) for x, v in whole if low <= x <= high), default=1e9
        )
        for low, high in ((0.0, 30.0), (70.0, 100.0))
    ]
    at_end = gaps[1] >= gaps[0]
    x, anchor = (axes.x(100.0) - 6, "end") if at_end else (axes.x(0.0) + 6, "start")
    return (
        f'<line class="margin" x1="{axes.x(0):.1f}" x2="{axes.x(100):.1f}" '
        f'y1="{y:.1f}" y2="{y:.1f}"/><text class="margin-name" x="{x:.1f}" '
        f'y="{y + 14:.1f}" text-anchor="{anchor}">margin {1e3 * margin_m:g} mm</text>'
    )


def _names(
    curves: Mapping[str, Points], axes: Axes, top: float, first: int = -1
) -> str:
    """Names at the curves' ends, apart from each other; the first is the whole robot's.

    Args:
        curves: Points by name.
        axes: Where they are.
        top: Upper end of what is drawn; what ends above it has an arrow.
        first: Number of the first one's colour; -1 for the whole robot's.
    """
    ends = [
        (min(points[-1][1], top), points[-1][1] > top, name, first + k)
        for k, (name, points) in enumerate(curves.items())
        if points
    ]
    parts = []
    above = TOP - NAME_STEP + 10.0
    for value, beyond, name, k in sorted(ends, key=lambda end: -end[0]):
        end = axes.y(value)
        y = max(end, above + NAME_STEP)
        above = y
        kind = "whole" if k < 0 else f"link c{k % LINKS_SHOWN}"
        parts.append(
            f'<line class="curve {kind}" x1="{WIDTH - NAMES + 2}" '
            f'x2="{WIDTH - NAMES + 14}" y1="{end:.1f}" y2="{y:.1f}"/>'
            f'<text class="tick" x="{WIDTH - NAMES + 18}" y="{y + 4:.1f}">'
            f"{escape(_brief(name))}{' ↑' if beyond else ''}</text>"
        )
    return "".join(parts)


def _brief(name: str) -> str:
    return name if len(name) <= 15 else f"{name[:13]}…"


def _along(path: Mapping[str, Any]) -> str:
    """The name of the lower axis: where it is, and when, if the path has times."""
    return f"along the path [%]{', at time [s]' if 'times_s' in path else ''}"


def _clock(path: Mapping[str, Any]) -> Callable[[float], str]:
    """What stands below the plot at so many per cent of the path."""
    if "times_s" not in path:
        return "{:g}".format
    fractions, times = path["fractions"], path["times_s"]

    def written(percent: float) -> str:
        return f"{percent:g} | {np.interp(percent / 100.0, fractions, times):.4g}"

    return written


def _link_curves(
    fractions: Sequence[float], poses: Sequence[Mapping[str, Any]]
) -> dict[str, Points]:
    """The curves of the links that come nearest, by name."""
    curves: dict[str, list[tuple[float, float]]] = {}
    for x, pose in zip(fractions, poses, strict=True):
        for link, clearance in (pose.get("link_clearance") or {}).items():
            curves.setdefault(link, []).append((x, 1e3 * clearance))
    nearest = sorted(curves, key=lambda link: min(y for _, y in curves[link]))
    return {link: curves[link] for link in nearest[:LINKS_SHOWN]}


def _stretches(intervals: Sequence[Mapping[str, Any]], axes: Axes) -> str:
    """A band under the axis: what is known of each stretch between the samples."""
    y = HEIGHT - BOTTOM + 6
    names = {"clear": "proven clear", "contact": "contact", "unknown": "not proven"}
    parts = []
    for found in intervals:
        x0, x1 = axes.x(100.0 * found["from"]), axes.x(100.0 * found["to"])
        verdict = found["verdict"] if found["verdict"] in names else "unknown"
        label = f"{100 * found['from']:.1f} to {100 * found['to']:.1f} %"
        parts.append(
            f'<rect class="band {verdict}" x="{x0:.1f}" y="{y}" '
            f'width="{max(x1 - x0, 1.0):.1f}" height="9">'
            f"<title>{label}: {names[verdict]}</title></rect>"
        )
    return "".join(parts)


def _contact_marks(
    fractions: Sequence[float], poses: Sequence[Mapping[str, Any]], axes: Axes
) -> str:
    y = axes.y(0.0)
    parts = []
    for x, pose in zip(fractions, poses, strict=True):
        if pose["verdict"] == "contact":
            at = axes.x(x)
            parts.append(
                f'<path class="hit" d="M{at - 4:.1f} {y - 4:.1f}l8 8m0 -8l-8 8"/>'
            )
    return "".join(parts)


def _key_of_stretches() -> Markup:
    items = [
        f'<li><svg width="26" height="10" aria-hidden="true"><rect class="band '
        f'{verdict}" width="26" height="9"/></svg> {name} between samples</li>'
        for verdict, name in (("clear", "proven clear"), ("unknown", "not proven"))
    ]
    return Markup('<ul class="legend">' + "".join(items) + "</ul>")
