"""Plots as inline SVG: curves along a path, bars, maps of values.

Every text in them is escaped; colours come from the page's style sheet, so that they
follow light and dark. No scripts needed; the page's script adds the cursor.
"""

from collections.abc import Callable, Mapping, Sequence
from math import ceil, floor, log10
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from borecheck.report.motion_words import at_least

WIDTH, HEIGHT = 760, 270
LEFT, RIGHT, TOP, BOTTOM = 58, 14, 14, 58
# Curves of single links, nearest first: more than these cannot be told apart.
LINKS_SHOWN = 6

Points = Sequence[tuple[float, float]]


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
    tallest = [y for curve in (whole, *links.values()) for _, y in curve]
    top = nice_ceiling(max([*tallest, 1.25e3 * margin_m, 1.0]))
    axes = Axes((0.0, 100.0), (0.0, top), HEIGHT)
    parts = [axes.grid(_along(path), "clearance [mm]", 20.0, _clock(path))]
    parts += [_stretches(path["intervals"], axes)]
    if margin_m > 0.0:
        name = f"margin {1e3 * margin_m:g} mm"
        parts.append(_level(axes, 1e3 * margin_m, "margin", name))
    if path.get("least") is not None:
        proven = path["least"]["clearance_m"]
        name = f"never nearer, proven: {at_least(proven)}"
        parts.append(_level(axes, 1e3 * proven, "least", name))
    for k, curve in enumerate(links.values()):
        parts.append(_line(axes, curve, f"curve link c{k}"))
    parts.append(_line(axes, whole, "curve whole"))
    parts += [_contact_marks(fractions, poses, axes)]
    parts.append(
        f'<line class="cursor" data-motion="{motion}" x1="{axes.x(0):.1f}" '
        f'x2="{axes.x(0):.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>'
    )
    return svg("".join(parts), HEIGHT, title, f'data-plot="{motion}"') + _legend(
        links, margin_m
    )


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


class Axes:
    """From numbers to places in a plot of the standard width."""

    def __init__(
        self, xs: tuple[float, float], ys: tuple[float, float], height: int
    ) -> None:
        self._xs, self._ys = xs, ys
        self._height = height

    def x(self, value: float) -> float:
        """Pixels from the left."""
        low, high = self._xs
        return LEFT + (value - low) / (high - low) * (WIDTH - LEFT - RIGHT)

    def y(self, value: float) -> float:
        """Pixels from the top."""
        low, high = self._ys
        span = self._height - TOP - BOTTOM
        return TOP + (high - value) / (high - low) * span

    def grid(
        self,
        x_name: str,
        y_name: str,
        x_step: float,
        below: Callable[[float], str] = "{:g}".format,
    ) -> str:
        """Lines, numbers and names of the axes; `below` writes a number of x."""
        low, high = self._ys
        parts = []
        step = nice_step((high - low) / 4.0)
        for k in range(ceil(low / step), floor(high / step) + 1):
            y = self.y(k * step)
            parts.append(
                f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" '
                f'y1="{y:.1f}" y2="{y:.1f}"/>'
                f'<text class="tick" x="{LEFT - 8}" y="{y + 4:.1f}" '
                f'text-anchor="end">{k * step:g}</text>'
            )
        low, high = self._xs
        bottom = self._height - BOTTOM
        for k in range(ceil(low / x_step), floor(high / x_step) + 1):
            parts.append(
                f'<text class="tick" x="{self.x(k * x_step):.1f}" y="{bottom + 32}" '
                f'text-anchor="middle">{below(k * x_step)}</text>'
            )
        middle = 0.5 * (TOP + bottom)
        parts.append(
            f'<text class="name" x="{0.5 * (LEFT + WIDTH):.0f}" '
            f'y="{self._height - 8}" text-anchor="middle">{escape(x_name)}</text>'
            f'<text class="name" text-anchor="middle" '
            f'transform="translate(14 {middle:.0f}) rotate(-90)">'
            f"{escape(y_name)}</text>"
        )
        return "".join(parts)


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


def _line(axes: Axes, points: Points, classes: str) -> str:
    if len(points) == 1:
        x, y = points[0]
        at = f'cx="{axes.x(x):.1f}" cy="{axes.y(y):.1f}"'
        return f'<circle class="{classes}" r="3" {at}/>'
    places = " ".join(f"{axes.x(x):.1f},{axes.y(y):.1f}" for x, y in points)
    return f'<polyline class="{classes}" points="{places}"/>'


def _level(axes: Axes, height_mm: float, kind: str, name: str) -> str:
    """A line across the plot, named above its right end; the least one, its left."""
    y, at_left = axes.y(height_mm), kind == "least"
    x, anchor = (LEFT + 4, "start") if at_left else (WIDTH - RIGHT - 4, "end")
    return (
        f'<line class="{kind}" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" '
        f'y2="{y:.1f}"/><text class="{kind}-name" x="{x}" '
        f'y="{y - 5:.1f}" text-anchor="{anchor}">{name}</text>'
    )


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


def _legend(links: Mapping[str, Points], margin_m: float) -> Markup:
    entries = [("whole", "robot as a whole, straight between the poses sampled")]
    entries += [(f"link c{k}", name) for k, name in enumerate(links)]
    items = [_key(f"curve {classes}", name) for classes, name in entries]
    for verdict, name in (("clear", "proven clear"), ("unknown", "not proven")):
        items.append(
            f'<li><svg width="26" height="10" aria-hidden="true"><rect class="band '
            f'{verdict}" width="26" height="9"/></svg> {name} between samples</li>'
        )
    return Markup('<ul class="legend">' + "".join(items) + "</ul>")


def _key(classes: str, name: str) -> str:
    """A line as it is drawn, and what it stands for."""
    line = f'<line class="{classes}" x1="0" x2="26" y1="5" y2="5"/>'
    sample = f'<svg width="26" height="10" aria-hidden="true">{line}</svg>'
    return f"<li>{sample} {escape(name)}</li>"


def bars(
    rows: Sequence[tuple[str, float]], unit: str, title: str, floor_value: float
) -> Markup:
    """Horizontal bars on a logarithmic scale: differences of many magnitudes.

    Args:
        rows: Name and value; values at or below `floor_value` get no bar.
        unit: Unit of the values.
        title: What it shows.
        floor_value: Left end of the scale, > 0.
    """
    height, name_width, value_width = 18 * len(rows) + 8, 190, 90
    most = max([floor_value * 10.0, *(value for _, value in rows)])
    decades = log10(most / floor_value)
    span = WIDTH - name_width - value_width
    parts = []
    for k, (name, value) in enumerate(rows):
        y = 18 * k + 4
        share = log10(value / floor_value) / decades if value > floor_value else 0.0
        parts.append(
            f'<text class="tick" x="{name_width - 8}" y="{y + 12}" '
            f'text-anchor="end">{escape(name)}</text>'
            f'<rect class="bar" x="{name_width}" y="{y + 2}" height="11" '
            f'width="{max(share * span, 0.5):.1f}"/>'
            f'<text class="tick" x="{name_width + share * span + 6:.1f}" '
            f'y="{y + 12}">{value:.1e} {escape(unit)}</text>'
        )
    return svg("".join(parts), height, title)


def histogram(values: Sequence[float], x_name: str, title: str) -> Markup:
    """How often values occur, in twelve bins."""
    low, high = min(values), max(values)
    width = (high - low) / 12.0 or 1.0
    counts = [0] * 12
    for value in values:
        counts[min(int((value - low) / width), 11)] += 1
    height = 220
    axes = Axes((low, low + 12 * width), (0.0, nice_ceiling(max(counts))), height)
    parts = [axes.grid(x_name, "how often", nice_step(12 * width / 5.0))]
    for k, count in enumerate(counts):
        x0, x1 = axes.x(low + k * width), axes.x(low + (k + 1) * width)
        y = axes.y(count)
        parts.append(
            f'<rect class="bar" x="{x0 + 1:.1f}" y="{y:.1f}" '
            f'width="{x1 - x0 - 2:.1f}" height="{axes.y(0) - y:.1f}"/>'
        )
    return svg("".join(parts), height, title)


def curves(lines: Mapping[str, Points], x_name: str, y_name: str, title: str) -> Markup:
    """Lines of numbers over numbers, with a legend."""
    xs = [x for points in lines.values() for x, _ in points]
    ys = [y for points in lines.values() for _, y in points]
    low, high = min([0.0, *ys]), nice_ceiling(max([*ys, 1e-12]))
    axes = Axes(
        (min(xs), max(xs) if max(xs) > min(xs) else min(xs) + 1.0), (low, high), HEIGHT
    )
    parts = [axes.grid(x_name, y_name, nice_step((max(xs) - min(xs) or 1.0) / 6.0))]
    items = []
    for k, (name, points) in enumerate(lines.items()):
        classes = f"curve link c{k % LINKS_SHOWN}"
        parts.append(_line(axes, points, classes))
        items.append(_key(classes, name))
    legend = Markup('<ul class="legend">' + "".join(items) + "</ul>")
    return svg("".join(parts), HEIGHT, title) + legend


def nice_step(value: float) -> float:
    """The next of 1, 2, 5, 10, ... at or above a positive value."""
    power = 10.0 ** floor(log10(max(value, 1e-12)))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= value * 0.999)


def nice_ceiling(value: float) -> float:
    """A round number a little above a positive value."""
    step = nice_step(value / 8.0)
    return ceil(value * 1.02 / step) * step


def svg(content: str, height: float, title: str, attributes: str = "") -> Markup:
    """An SVG element of the standard width with its accessible name."""
    return Markup(
        f'<svg class="plot" viewBox="0 0 {WIDTH} {height:g}" role="img" '
        f'aria-label="{escape(title)}" {attributes}>{content}</svg>'
    )
