"""One self-contained HTML page from a result: a pure function of the document.

Names in a URDF or a plan are untrusted: the template escapes everything, the JSON block
cannot end its own script element, and the page's policy lets no other script run than
the one whose hash it names.
"""

import json
import shlex
import zlib
from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from borecheck.core.palette import style_sheet
from borecheck.core.result_file import RESULT_ID
from borecheck.errors import BorecheckError
from borecheck.report.case_words import case_notes
from borecheck.report.motion_words import at_least, at_most

TEMPLATES = Path(__file__).parent / "templates"
ASSETS = Path(__file__).parent / "assets"

# Rows of a table shown; the page's data block holds all.
MOST_ROWS = 400

# What reading a document that is not as its command writes it can end in.
DAMAGE = (
    ArithmeticError,
    AttributeError,
    LookupError,
    RecursionError,
    TypeError,
    ValueError,
    zlib.error,
)

STUDIES = ("check", "compare", "fk", "validate", "verify")


def page(document: Mapping[str, Any]) -> str:
    """The page, the same bytes for the same document.

    Raises:
        BorecheckError: The document lacks something that its command's result holds.
    """
    from jinja2 import UndefinedError

    try:
        text = _rendered(document)
        text.encode()  # half a character, as JSON can hold, is no text
        return text
    except (UndefinedError, *DAMAGE) as error:
        raise BorecheckError(
            f"no page can be made of this result: it is damaged or incomplete ({error})"
        ) from error


def _rendered(document: Mapping[str, Any]) -> str:
    views = _views(document)
    style = _style()
    script = _script("page_view.js" if views["has_view"] else "page.js")
    template = _environment().get_template("page.html.j2")
    return str(
        template.render(
            document=document,
            kind=_kind(document),
            # a way is checked as any path, and is not what was asked for
            command_shown="route" if "route" in document else document["command"],
            **views,
            style=style,
            script=script,
            policy=_policy(style, script),
            result_id=RESULT_ID,
            result_json=embedded_json(document),
        )
    )


def _kind(document: Mapping[str, Any]) -> str:
    command = str(document.get("command", ""))
    return command if command in STUDIES else "study"


def _views(document: Mapping[str, Any]) -> dict[str, Any]:
    """What the command's template needs besides the document itself."""
    from borecheck.report import page_check, page_compare, page_study

    kind = _kind(document)
    has_view = bool(document.get("display", {}).get("motions"))
    views: dict[str, Any] = {"pictures": [], "has_view": has_view}
    if kind == "check":
        views |= page_check.views(document)
    elif kind == "compare":
        views |= page_compare.views(document)
    elif kind == "fk":
        views |= page_study.kinematics_views(document)
    elif kind == "verify":
        pass  # the document itself says all
    elif kind == "validate":
        views |= page_study.validate_views(document)
    else:
        views |= page_study.study_views(document)
    return views


def _policy(style: str, script: str) -> str:
    """Nothing may be fetched; only this style and this script are in force."""
    return (
        "default-src 'none'; base-uri 'none'; form-action 'none'; img-src data:; "
        f"style-src '{_hash(style)}'; script-src '{_hash(script)}'"
    )


def _hash(text: str) -> str:
    return "sha256-" + b64encode(sha256(text.encode()).digest()).decode("ascii")


@cache
def _style() -> str:
    return style_sheet() + (TEMPLATES / "page.css").read_text(encoding="utf-8")


@cache
def _script(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")


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
    environment.filters["mm"] = millimetres
    environment.filters["at_least"] = at_least
    environment.filters["at_most"] = at_most
    environment.filters["thousands"] = lambda number: f"{number:,}"
    environment.filters["percent"] = lambda share: f"{100.0 * share:.1f} %"
    environment.filters["case_notes"] = case_notes
    environment.filters["sentence"] = lambda text: f"{text[:1].upper()}{text[1:]}"
    environment.filters["cell"] = cell
    environment.filters["command_line"] = lambda words: shlex.join(map(str, words))
    environment.globals["MOST_ROWS"] = MOST_ROWS
    return environment


def millimetres(length: float | None) -> str:
    """A length for people, or a dash."""
    return "–" if length is None else f"{1e3 * length:.2f} mm"


def cell(value: Any) -> str:
    """A table's cell: numbers short, truth in words, nothing as a dash."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, list | tuple):
        return ", ".join(cell(item) for item in value)
    if isinstance(value, Mapping):
        return ", ".join(f"{name}: {cell(item)}" for name, item in value.items())
    return str(value)
