"""One self-contained HTML page from a result: a pure function of the document.

Names in a URDF or a plan are untrusted: the template escapes everything, and the JSON
block cannot end its own script element.
"""

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from borecheck.result_file import RESULT_ID

TEMPLATES = Path(__file__).parent / "templates"


def page(document: Mapping[str, Any]) -> str:
    """The page, the same bytes for the same document."""
    template = _environment().get_template("page.html.j2")
    return str(
        template.render(
            document=document,
            result_id=RESULT_ID,
            result_json=embedded_json(document),
        )
    )


def embedded_json(document: Mapping[str, Any]) -> str:
    """JSON that may stand inside a script element: no `<`, `>` or `&` in it."""
    text = json.dumps(document, allow_nan=False, separators=(",", ":"))
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


@cache
def _environment() -> Any:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["mm"] = _millimetres
    environment.filters["thousands"] = lambda number: f"{number:,}"
    return environment


def _millimetres(length: float | None) -> str:
    return "–" if length is None else f"{1e3 * length:.2f} mm"
