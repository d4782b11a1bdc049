"""One self-contained HTML page from a result: a pure function of the document.

Names in a URDF or a plan are untrusted: the template escapes everything, the JSON block
cannot end its own script element, and the page's policy lets no other script run than
the one whose hash it names.
"""

import json
import re
import shlex
import zlib
from base64 import b64encode
from collections.abc import Mapping, Sequence
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from borecheck.core.palette import style_sheet
from borecheck.core.result_file import RESULT_ID
from borecheck.errors import BorecheckError
from borecheck.report.case_words import case_notes
from borecheck.report.many_plans import for_a_page
from borecheck.report.motion_words import at_least, at_most

TEMPLATES = Path(__file__).parent / "templates"
ASSETS = Path(__file__).parent / "assets"

# From the root of a disk down to a file, alone or behind a word like `--plan=`.
_WHOLE_PATH = re.compile(r"(?<![\w./~-])~?/(?:[^/\0\s:,;@]+/)*[^/\0\s:,;@]+")

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
    document = for_a_page(document)
    views = _views(document)
    data = embedded_json(document)
    digest = sha256(data.encode()).hexdigest()
    style = _style() + print_foot(digest)
    script = _script("page_view.js" if views["has_view"] else "page.js")
    template = _environment().get_template("page.html.j2")
    return str(
        template.render(
            document=document,
            kind=_kind(document),
            named=named(document),
            subject=subject(document),
            digest=digest,
            **views,
            style=style,
            script=script,
            policy=_policy(style, script),
            result_id=RESULT_ID,
            result_json=data,
        )
    )


def _kind(document: Mapping[str, Any]) -> str:
    command = str(document.get("command", ""))
    return command if command in STUDIES else "study"


def named(document: Mapping[str, Any]) -> str:
    """What the page is of: a way that was found is checked, yet it is a route."""
    return "route" if "route" in document else str(document.get("command", ""))


def subject(document: Mapping[str, Any]) -> str:
    """Of which robot where, for the page's head and its title."""
    robot, scene = document.get("robot"), document.get("scene")
    words = [block.get("name") for block in (robot, scene) if isinstance(block, dict)]
    return " in ".join(short(word) for word in words if word)


def print_foot(digest: str) -> str:
    """A style sheet's rule: on paper every sheet says of which result it is."""
    return (
        f'@page {{ @bottom-left {{ content: "result {digest[:16]}"; '
        "font: 8pt system-ui, sans-serif; color: #444; } }\n"
    )


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
    environment.filters["command_line"] = command_line
    environment.filters["short"] = short
    environment.globals["MOST_ROWS"] = MOST_ROWS
    return environment


def short(text: Any) -> str:
    """A file's name in place of its whole path: a page is handed on."""
    return _WHOLE_PATH.sub(lambda found: found[0].rsplit("/", 1)[1], str(text))


def command_line(words: Sequence[Any]) -> str:
    """The command as it was typed, files by their names."""
    return shlex.join(short(word) for word in words)


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
