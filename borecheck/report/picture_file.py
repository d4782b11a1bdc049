"""One view of a result, or its curve, as a picture file for people who write.

The same pictures as on the page, at a stated size, without a browser.
"""

from collections.abc import Mapping
from typing import Any

from borecheck.core.palette import LIGHT, PLAN, TOUCHING
from borecheck.errors import UsageError

# Names as they are typed, and as the pictures are called.
VIEWS = {
    "cut": "cut open",
    "bore": "along the bore",
    "side": "from the side",
    "narrow": "the narrowest place",
    "curve": "clearance along the motion",
}
SUFFIXES = (".svg", ".png")

INK, SOFT, LINE = "#1b1f24", "#5a6370", "#d5dae0"
_CURVES = ("#0072b2", "#b3560d", "#007a5a", "#a3457a", "#5b6b00", "#6b5bb5")
_DASHES = ("", "7 3", "2 3", "9 3 2 3", "4 2", "12 4")


def styles() -> dict[str, dict[str, str]]:
    """How every class of a mark or a curve is drawn; the later of two classes wins."""
    white = "#ffffff"
    found: dict[str, dict[str, str]] = {
        "halo": {"stroke": white, "stroke-width": "9"},
        "leader": {"stroke": INK, "stroke-width": "2.5"},
        "plan": {"stroke": PLAN, "stroke-width": "4", "fill": white},
        "pair": {"stroke-width": "4"},
        "lit": {"stroke-width": "1", "stroke": INK},
        "alpha": {"fill": TOUCHING[0]},
        "beta": {"fill": TOUCHING[1]},
        "chip": {"stroke": white, "stroke-width": "2"},
        "fill": {"fill": white},
        "stroke": {"fill": "none", "stroke-width": "2.6"},
        "name": {"fill": SOFT, "font-size": "13"},
        "tick": {"fill": SOFT, "font-size": "12"},
        "grid": {"stroke": LINE},
        "curve": {"fill": "none", "stroke-width": "1.6"},
        "whole": {"stroke": INK, "stroke-width": "3"},
        "proven": {"fill": LIGHT["clear"].ground},
        "between": {"fill": "#a9cdc3"},
        "least-name": {"fill": LIGHT["clear"].ink, "font-size": "12"},
        "margin": {"stroke": LIGHT["contact"].ink, "stroke-dasharray": "8 5"},
        "margin-name": {"fill": LIGHT["contact"].ink, "font-size": "12"},
        "hit": {"stroke": LIGHT["contact"].ink, "stroke-width": "2.5", "fill": "none"},
        "cursor": {"stroke": "none"},
    }
    for verdict, shade in LIGHT.items():
        found[verdict] = {"stroke": shade.ink, "fill": shade.ink}
    for k, (colour, dash) in enumerate(zip(_CURVES, _DASHES, strict=True)):
        found[f"c{k}"] = {"stroke": colour, "stroke-dasharray": dash}
    return found


def picture_svg(document: Mapping[str, Any], view: str, width: int, height: int) -> str:
    """The worst motion's picture, as an SVG that stands alone.

    Args:
        document: The result of a check, a route or of one pose.
        view: One of `VIEWS`.
        width: Of the picture, [px].
        height: Of the picture, [px].

    Raises:
        UsageError: The result has no such picture.
    """
    from borecheck.report import page_check

    if document.get("command") != "check" or document.get("display") is None:
        raise UsageError("only a check's result, or a route's, has such a picture")
    worst = page_check.worst_motion(document)
    if worst is None:
        raise UsageError("no motion was found that could be drawn")
    if view == "curve":
        drawn = page_check.plot_of(worst)
    else:
        drawn = page_check.picture_of(document, worst, VIEWS[view], width, height)
    if drawn is None:
        raise UsageError(f"this result has no picture of {VIEWS[view]}")
    start, end = drawn.index("<svg"), drawn.index("</svg>") + len("</svg>")
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        'font-family="DejaVu Sans, Verdana, sans-serif" font-weight="600" '
    )
    body = str(drawn[start:end]).replace("<svg ", head, 1)
    opened = body.index(">") + 1
    return body[:opened] + _sheet() + body[opened:] + "\n"


def _sheet() -> str:
    rules = [
        f".{name}{{{';'.join(f'{k}:{v}' for k, v in values.items() if v)}}}"
        for name, values in styles().items()
    ]
    more = (
        ".still text{font-size:22px}.still .name{fill:#003c96;stroke:#fff;"
        "stroke-width:4;paint-order:stroke}.chip text{fill:#fff;stroke:none}"
        ".chip .fill{fill:#fff}.chip .fill,.still text.label{stroke:none}"
        ".chip rect{stroke:#fff}.still line.plan{stroke-dasharray:9 6}"
        ".plot text{stroke:none}"
    )
    return f"<style>{''.join(rules)}{more}</style>"


def picture_png(
    document: Mapping[str, Any], view: str, width: int, height: int
) -> bytes:
    """The same picture as a PNG; needs Pillow.

    Raises:
        UsageError: The result has no such picture, or Pillow is not installed.
    """
    try:
        from borecheck.report.raster import rasterised
    except ImportError as error:
        raise UsageError(
            "a PNG needs Pillow: pip install 'borecheck[picture]', or write .svg"
        ) from error
    svg = picture_svg(document, view, width, height)
    return rasterised(svg, styles(), width, height)
