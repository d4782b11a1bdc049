"""Curves as SVG files that stand alone, beside a study's JSON."""

from collections.abc import Mapping, Sequence
from html import escape
from math import ceil, floor, log10

Points = Sequence[Sequence[float]]

WIDTH, HEIGHT = 720, 420
LEFT, RIGHT, TOP, BOTTOM = 64, 170, 20, 48
# Told apart by those who do not see all colours (after Okabe and Ito).
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#e69f00")
DASHES = ("none", "7 4", "2 3", "9 3 2 3", "1 2", "12 4")


def curves(lines: Mapping[str, Points], x: str, y: str) -> str:
    """A whole SVG document of lines through points.

    Args:
        lines: Points (x, y) by the line's name.
        x: Name of the axis across, with its unit.
        y: Of the axis up.
    """
    xs = [float(p[0]) for points in lines.values() for p in points]
    ys = [float(p[1]) for points in lines.values() for p in points]
    across, up = _Scale(xs, LEFT, WIDTH - RIGHT), _Scale(ys, HEIGHT - BOTTOM, TOP)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'font-family="sans-serif" font-size="13"><rect width="100%" height="100%" '
        f'fill="white"/><title>{escape(y)} over {escape(x)}</title>'
    ]
    parts += _axes(across, up, x, y)
    for k, (name, points) in enumerate(lines.items()):
        colour = COLOURS[k % len(COLOURS)]
        places = " ".join(f"{across.at(p[0]):.1f},{up.at(p[1]):.1f}" for p in points)
        parts.append(
            f'<polyline fill="none" stroke="{colour}" stroke-width="1.6" '
            f'stroke-dasharray="{DASHES[k % len(DASHES)]}" points="{places}"/>'
        )
        height = TOP + 14 + 20 * k
        parts.append(
            f'<text x="{WIDTH - RIGHT + 12}" y="{height}" fill="{colour}">'
            f"{escape(name)}</text>"
        )
    return "\n".join([*parts, "</svg>", ""])


class _Scale:
    """Values to places along one axis, with a little room at both ends."""

    def __init__(self, values: Sequence[float], start: float, end: float) -> None:
        low, high = min(values, default=0.0), max(values, default=1.0)
        room = 0.04 * (high - low) or 0.5
        self.low, self.high = low - room, high + room
        self.start, self.end = start, end

    def at(self, value: float) -> float:
        part = (float(value) - self.low) / (self.high - self.low)
        return self.start + part * (self.end - self.start)

    def marks(self) -> list[float]:
        """Round numbers, 1, 2 or 5 times a power of ten apart: four to nine."""
        rough = (self.high - self.low) / 6.0
        power = 10.0 ** floor(log10(rough))
        step = next(k * power for k in (1, 2, 5, 10) if k * power >= 0.999 * rough)
        first, last = ceil(self.low / step), floor(self.high / step)
        return [k * step for k in range(first, last + 1)]


def _axes(across: _Scale, up: _Scale, x: str, y: str) -> list[str]:
    """Grid, numbers and names."""
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    parts = []
    for value in across.marks():
        at = across.at(value)
        parts.append(f'<path stroke="#ddd" d="M{at:.1f} {TOP}V{bottom}"/>')
        parts.append(
            f'<text x="{at:.1f}" y="{bottom + 17}" text-anchor="middle">{value:.4g}'
            "</text>"
        )
    for value in up.marks():
        at = up.at(value)
        parts.append(f'<path stroke="#ddd" d="M{LEFT} {at:.1f}H{right}"/>')
        parts.append(
            f'<text x="{LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{value:.4g}'
            "</text>"
        )
    middle = 0.5 * (LEFT + right)
    parts.append(
        f'<text x="{middle}" y="{HEIGHT - 8}" text-anchor="middle">{escape(x)}</text>'
    )
    parts.append(
        f'<text transform="translate(14 {0.5 * HEIGHT}) rotate(-90)" '
        f'text-anchor="middle">{escape(y)}</text>'
    )
    return parts
