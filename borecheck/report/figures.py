"""Plots as inline SVG: axes, curves, bars, histograms.

Every text in them is escaped; colours come from the page's style sheet, so that they
follow light and dark. No scripts needed; the page's script adds the cursor.
"""

from collections.abc import Callable, Mapping, Sequence
from math import ceil, floor, log10

from markupsafe import Markup, escape

WIDTH, HEIGHT = 760, 270
LEFT, RIGHT, TOP, BOTTOM = 58, 14, 14, 58
# Curves in one plot: more than these cannot be told apart.
LINKS_SHOWN = 6

Points = Sequence[tuple[float, float]]


class Axes:
    """From numbers to places in a plot of the standard width."""

    def __init__(
        self,
        xs: tuple[float, float],
        ys: tuple[float, float],
        height: int,
        right: int = RIGHT,
    ) -> None:
        self._xs, self._ys = xs, ys
        self._height, self._right = height, right

    def x(self, value: float) -> float:
        """Pixels from the left."""
        low, high = self._xs
        return LEFT + (value - low) / (high - low) * (WIDTH - LEFT - self._right)

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
                f'<line class="grid" x1="{LEFT}" x2="{WIDTH - self._right}" '
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
            f'<text class="name" x="{0.5 * (LEFT + WIDTH - self._right):.0f}" '
            f'y="{self._height - 8}" text-anchor="middle">{escape(x_name)}</text>'
            f'<text class="name" text-anchor="middle" '
            f'transform="translate(14 {middle:.0f}) rotate(-90)">'
            f"{escape(y_name)}</text>"
        )
        return "".join(parts)


def line(axes: Axes, points: Points, classes: str) -> str:
    """A curve, or a dot where there is one point only."""
    if len(points) == 1:
        x, y = points[0]
        at = f'cx="{axes.x(x):.1f}" cy="{axes.y(y):.1f}"'
        return f'<circle class="{classes}" r="3" {at}/>'
    places = " ".join(f"{axes.x(x):.1f},{axes.y(y):.1f}" for x, y in points)
    return f'<polyline class="{classes}" points="{places}"/>'


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
        parts.append(line(axes, points, classes))
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
