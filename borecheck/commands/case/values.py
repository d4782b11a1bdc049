"""What a case file may say, and how the same is typed on the command line.

Every function takes a value as TOML gives it and returns the texts of an option; what
it cannot take is a `CaseValueError` that says what is wrong and how it is written.
"""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from borecheck.core.units import ANGLE_UNITS, LENGTH_UNITS, parse_length, parse_pose
from borecheck.errors import BorecheckError

Kind = Callable[[Any, Path], list[str]]

# How much of a value is shown in a problem, [characters].
_SHOWN = 40
_QUANTITY = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*([a-z]+)\s*", re.A)
_TYPES = {
    bool: "true or false",
    str: "text",
    int: "a whole number",
    float: "a number",
    dict: "a table",
    list: "a list",
}


class CaseValueError(BorecheckError):
    """A value that a case file may not hold.

    Args:
        problem: What is wrong with it.
        below: Where, below the key that was read: `.unit`, `[2]`.
    """

    def __init__(self, problem: str, below: str = "") -> None:
        super().__init__(problem)
        self.below = below


def text(value: Any, folder: Path) -> list[str]:
    """Text that stands in one line."""
    del folder
    return [_text(value)]


def one_of(names: Sequence[str]) -> Kind:
    """One of these words."""

    def kind(value: Any, folder: Path) -> list[str]:
        del folder
        if _text(value) not in names:
            raise CaseValueError(f"{_shown(value)} is none of {', '.join(names)}")
        return [value]

    return kind


def installed(value: Any, folder: Path) -> list[str]:
    """The name of an installed robot or scanner."""
    del folder
    if not re.fullmatch(r"[A-Za-z_][\w-]*", _text(value)):
        raise CaseValueError(f"{_shown(value)} is no name; a file stands under `file`")
    return [value]


def flag(value: Any, folder: Path) -> list[str]:
    """Whether an option without a value is given."""
    del folder
    return [""] if _typed(value, bool) else []


def whole(value: Any, folder: Path) -> list[str]:
    """A whole number."""
    del folder
    return [str(_typed(value, int))]


def number(value: Any, folder: Path) -> list[str]:
    """A finite number."""
    del folder
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise CaseValueError(f"is {_kind(value)}, not a number")
    if not math.isfinite(value):
        raise CaseValueError("is no finite number")
    return [repr(value)]


def length(value: Any, folder: Path) -> list[str]:
    """A length with its unit."""
    del folder
    typed = _quantity(value, LENGTH_UNITS)
    _as_typed(parse_length, typed)
    return [typed]


def pose(value: Any, folder: Path) -> list[str]:
    """Three lengths, and three angles about x, y and z, each with its unit."""
    del folder
    parts = _typed(value, list)
    if len(parts) not in (3, 6):
        raise CaseValueError(f"has {len(parts)} numbers; it takes x, y, z (, r, p, y)")
    units = [LENGTH_UNITS] * 3 + [ANGLE_UNITS] * 3
    typed = ",".join(_each(parts, lambda k, part: _quantity(part, units[k])))
    _as_typed(parse_pose, typed)
    return [typed]


def point(value: Any, folder: Path) -> list[str]:
    """Three lengths, each with its unit."""
    del folder
    return [_point(_typed(value, list))]


def arguments(value: Any, folder: Path) -> list[str]:
    """Arguments by name, each text."""
    del folder
    table = _typed(value, dict)
    return _each(table, lambda name, given: f"{_name(name, '=')}={_text(given)}")


def file(value: Any, folder: Path) -> list[str]:
    """A file, seen from the folder that the case file lies in."""
    found = folder / _text(value)
    if not found.exists():
        raise CaseValueError(f"there is no file {found}")
    if not found.is_file():
        raise CaseValueError(f"{found} is no file")
    return [str(found)]


def folders(value: Any, folder: Path) -> list[str]:
    """Folders, seen from the one that the case file lies in."""

    def one(_: Any, given: Any) -> str:
        found = folder / _text(given)
        if not found.is_dir():
            raise CaseValueError(f"there is no folder {found}")
        return str(found)

    return _each(_typed(value, list), one)


def bodies(value: Any, folder: Path) -> list[str]:
    """One body, or a list of them: each a file with its unit, frame and pose."""
    if isinstance(value, list):
        return _each(value, lambda _, given: _body(given, folder))
    return [_body(value, folder)]


def pairs(value: Any, folder: Path) -> list[str]:
    """Pairs of links."""
    del folder

    def one(_: Any, pair: Any) -> str:
        if len(_typed(pair, list)) != 2:
            raise CaseValueError(f"holds {len(pair)} links; a pair has two")
        return ":".join(_each(pair, lambda _, link: _name(link, ":")))

    return _each(_typed(value, list), one)


def configuration(value: Any, folder: Path) -> list[str]:
    """`home`, or the position of joints by name, each with its unit."""
    del folder
    if value == "home":
        return [value]
    if not isinstance(value, dict) or not value:
        raise CaseValueError('is neither "home" nor joints: { j1 = "10deg" }')
    units = {**LENGTH_UNITS, **ANGLE_UNITS}

    def one(joint: Any, given: Any) -> str:
        return f"{_name(joint, '=,')}={_quantity(given, units)}"

    return [",".join(_each(value, one))]


def corridor(value: Any, folder: Path) -> list[str]:
    """`last-leg`; or an entry and a target; or a plan of a file of plans."""
    if value == "last-leg":
        return [value]
    if isinstance(value, dict) and value.keys() == {"entry", "target"}:
        return [":".join(_each(value, lambda _, point: _point(point)))]
    if isinstance(value, dict) and value.keys() == {"file", "plan"}:
        return [f"{file(value['file'], folder)[0]}:{_text(value['plan'])}"]
    raise CaseValueError(
        'is neither "last-leg" nor a table: { entry = [x, y, z], target = [x, y, z] } '
        'or { file = "plans.csv", plan = "name" }'
    )


def meant(name: str, known: Iterable[str]) -> str:
    """What to add about a key that is none of these."""
    names = list(known)
    close = get_close_matches(name, names, n=1)
    return (f"; did you mean {close[0]}?" if close else "") + (
        f" (known: {', '.join(names)})"
    )


def _body(value: Any, folder: Path) -> str:
    from borecheck.robots.file_text import FileText, split_file_text

    table = _typed(value, dict)
    if "body" in table:
        return _body_by_size(table, folder)
    unknown = next((key for key in table if key not in BODY), None)
    if unknown is not None:
        raise CaseValueError(f"unknown key{meant(unknown, BODY)}", f".{unknown}")
    if "file" not in table:
        raise CaseValueError("is missing", ".file")
    found = dict(zip(table, _each(table, lambda k, v: BODY[k](v, folder)), strict=True))
    words = {key: texts[0] for key, texts in found.items()}
    meant_so = FileText(Path(words.pop("file")), **words)
    typed = meant_so.completed(None, None)
    if split_file_text(typed) != meant_so:
        raise CaseValueError(f"{meant_so.path} cannot be told from its pose: rename it")
    return typed


def _body_by_size(table: Mapping[str, Any], folder: Path) -> str:
    """A patient's body by sex, height and body mass index, and where it lies."""
    from borecheck.bodies.spec import PREFIX, body_spec

    unknown = next((key for key in table if key not in ("body", "pose")), None)
    if unknown is not None:
        raise CaseValueError("does not go with body", f".{unknown}")
    words = _text(table["body"])
    _as_typed(body_spec, words)
    at = f"@{pose(table['pose'], folder)[0]}" if "pose" in table else ""
    return f"{PREFIX}{words.removeprefix(PREFIX)}{at}"


def _frame(value: Any, folder: Path) -> list[str]:
    from borecheck.geometry.mesh_files.frames import FRAMES, is_frame

    word = text(value, folder)[0].lower()
    if not is_frame(word):
        raise CaseValueError(f"{_shown(value)} is none of {', '.join(FRAMES)}, lps-hfs")
    return [word]


BODY: Mapping[str, Kind] = {
    "file": file,
    "unit": one_of(tuple(LENGTH_UNITS)),
    "frame": _frame,
    "pose": pose,
}


def _point(value: Any) -> str:
    if len(_typed(value, list)) != 3:
        raise CaseValueError(f"has {len(value)} numbers, not 3")
    return ",".join(_each(value, lambda _, part: _quantity(part, LENGTH_UNITS)))


def _quantity(value: Any, units: Mapping[str, float]) -> str:
    """A number with a unit as it is typed; 0 needs none."""
    if not isinstance(value, bool) and value in (0, "0"):
        return "0"
    example = "20mm" if "mm" in units else "15deg"
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise CaseValueError(
            f'{_shown(value)} has no unit; write for example "{example}"'
        )
    found = _QUANTITY.fullmatch(_text(value))
    if found is None or found[3] not in units:
        raise CaseValueError(
            f"{_shown(value)} is no number with a unit ({', '.join(units)}); write for "
            f'example "{example}"'
        )
    return str(value).replace(" ", "")


def _each(values: Any, one: Callable[[Any, Any], Any]) -> list[Any]:
    """What `one` makes of every value; a problem names which of them it is."""
    named = isinstance(values, dict)
    made = []
    for key, value in values.items() if named else enumerate(values):
        try:
            made.append(one(key, value))
        except CaseValueError as problem:
            where = f".{key}" if named else f"[{key + 1}]"
            raise CaseValueError(str(problem), where + problem.below) from None
    return made


def _as_typed(parse: Callable[[str], object], typed: str) -> None:
    try:
        parse(typed)
    except BorecheckError as error:
        raise CaseValueError(str(error)) from error


def _name(value: Any, without: str) -> str:
    """A name that none of these signs stands in."""
    found = _text(value)
    sign = next((sign for sign in without if sign in found), None)
    if sign is not None:
        raise CaseValueError(
            f"{_shown(found)}: a name with {sign!r} cannot be given here"
        )
    return found


def _text(value: Any) -> str:
    found: str = _typed(value, str)
    if not found.strip() or not found.isprintable():
        raise CaseValueError("is empty, or not text in one line")
    return found


def _typed(value: Any, kind: type) -> Any:
    if type(value) is not kind:
        raise CaseValueError(f"is {_kind(value)}, not {_TYPES[kind]}")
    return value


def _kind(value: Any) -> str:
    return _TYPES.get(type(value), "a date or time")


def _shown(value: Any) -> str:
    shown = repr(value)
    return shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}..."
