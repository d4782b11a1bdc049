"""A fit's result as one self-contained HTML page: parameters, axes, residuals."""

from collections.abc import Mapping, Sequence
from html import escape
from math import degrees
from typing import Any

WIDTH, HEIGHT, MARGIN = 680, 170, 46

COLOURS = {"x": "#b3423a", "y": "#3a7d44", "z": "#33609c"}

STYLE = """
body{font:15px/1.45 system-ui,sans-serif;margin:2em auto;max-width:60em;color:#222}
table{border-collapse:collapse;margin:1em 0}
td,th{padding:.2em .8em;text-align:right;border-bottom:1px solid #ddd}
td:first-child,th:first-child{text-align:left}
svg{display:block;margin:.4em 0 1.2em;background:#fafafa}
.note{color:#555}
"""


def page(document: Mapping[str, Any]) -> str:
    """The page; opens without a network."""
    title = f"Calibration of {escape(str(document['robot']))}"
    kind = "all parameters at once" if document["refined"] else "axis by axis"
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
        f"<title>{title}</title><style>{STYLE}</style></head><body>",
        f"<h1>{title}</h1>",
        f"<p>{len(document['samples'])} samples from {escape(str(document['data']))}, "
        f"fitted {kind}; rms of the coordinates {_mm(document['rms_m'])} mm, "
        f"{document['iterations']} iterations{_condition(document)}.</p>",
        _parameters(document["parameters"]),
        _axes(document["axes"]),
        *_plots(document["samples"]),
        f"<p class='note'>borecheck {escape(str(document['version']))}: "
        f"{escape(' '.join(map(str, document['argv'])))}</p></body></html>",
    ]
    return "\n".join(parts) + "\n"


def _condition(document: Mapping[str, Any]) -> str:
    value = document["condition"]
    return "" if value is None else f", condition number {value:.1f}"


def _parameters(rows: Mapping[str, Mapping[str, Any]]) -> str:
    cells = []
    for name, row in rows.items():
        length = row["unit"] == "m"
        scale, unit = (1e3, "mm") if length else (degrees(1.0), "deg")
        value, nominal, sigma = (scale * row[k] for k in ("value", "nominal", "sigma"))
        cells.append(
            f"<tr><td>{escape(name)}</td><td>{value:.5f}</td><td>{nominal:.5f}</td>"
            f"<td>{value - nominal:+.5f}</td><td>{sigma:.5f}</td><td>{unit}</td></tr>"
        )
    head = "<tr><th>parameter</th><th>found</th><th>nominal</th><th>difference</th>"
    return (
        f"<h2>Parameters</h2><table>{head}<th>sigma</th><th></th></tr>"
        + "".join(cells)
        + "</table>"
    )


def _axes(axes: Sequence[Mapping[str, Any]]) -> str:
    if not axes:
        return ""
    rows = "".join(
        f"<tr><td>{escape(a['joint'])}</td><td>{a['samples']}</td>"
        f"<td>{degrees(a['arc_rad']):.1f}</td><td>{_mm(a['radius_m'])}</td>"
        f"<td>{_mm(a['rms_m'])}</td><td>{a['iterations']}</td></tr>"
        for a in axes
    )
    head = "<tr><th>joint</th><th>samples</th><th>arc [deg]</th><th>radius [mm]</th>"
    tail = "<th>rms [mm]</th><th>iterations</th></tr>"
    return f"<h2>Axes</h2><table>{head}{tail}{rows}</table>"


def _plots(samples: Sequence[Mapping[str, Any]]) -> list[str]:
    """One plot for each joint that turned alone, and one for other poses."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for sample in samples:
        groups.setdefault(sample["moving"], []).append(sample)
    plots = ["<h2>Residuals: measured minus fitted</h2>"]
    for name, members in groups.items():
        label = escape(name) if name else "poses of their own"
        plots += [f"<h3>{label}</h3>", _plot(members)]
    return plots


def _plot(members: Sequence[Mapping[str, Any]]) -> str:
    values = [[1e3 * v for v in m["residual_m"]] for m in members]
    top = max((abs(v) for row in values for v in row), default=0.0) or 1.0
    step = (WIDTH - 2 * MARGIN) / max(len(values), 1)
    middle, scale = HEIGHT / 2, (HEIGHT / 2 - 18) / top
    dots = [
        f"<circle cx='{MARGIN + (i + 0.5) * step:.1f}' cy='{middle - scale * v:.1f}' "
        f"r='2.2' fill='{COLOURS[axis]}'/>"
        for i, row in enumerate(values)
        for axis, v in zip("xyz", row, strict=True)
    ]
    lines = [
        f"<line x1='{MARGIN}' x2='{WIDTH - MARGIN}' y1='{y}' y2='{y}' stroke='#ccc'/>"
        f"<text x='4' y='{y + 4}' font-size='11'>{text}</text>"
        for y, text in (
            (18, f"{top:.3g} mm"),
            (middle, "0"),
            (HEIGHT - 18, f"-{top:.3g} mm"),
        )
    ]
    legend = "".join(
        f"<text x='{WIDTH - 40}' y='{30 + 15 * k}' font-size='12' "
        f"fill='{COLOURS[axis]}'>{axis}</text>"
        for k, axis in enumerate("xyz")
    )
    return (
        f"<svg viewBox='0 0 {WIDTH} {HEIGHT}' width='{WIDTH}' height='{HEIGHT}'>"
        + "".join(lines)
        + "".join(dots)
        + legend
        + "</svg>"
    )


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.4f}"
