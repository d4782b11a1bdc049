"""Settings from `borecheck.toml` ([validate]) or `pyproject.toml` ([tool.borecheck]).

Keys are the long options (`package-path = ["."]`, `fail-on = "warning"`), and tables
for what is too long for a command line: `remote-centre`, `tool-axis`, `loop` and
`per-file-ignore`.
"""

import os
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any

from borecheck.errors import InputError, UnknownNameError, UsageError
from borecheck.robots.urdf.reach import Roots, reach_of
from borecheck.validation.codes import codes_of
from borecheck.validation.options import (
    PROFILES,
    Loop,
    Options,
    RemoteCentre,
    ToolAxis,
    check_count,
)

FILES = ("borecheck.toml", "pyproject.toml")
FAIL_ON = ("error", "warning", "info", "never")

_TABLES: dict[str, type] = {
    "remote-centre": RemoteCentre,
    "tool-axis": ToolAxis,
    "loop": Loop,
}
_LISTS = ("select", "ignore", "package-path", "frame", "link")
_WORDS = ("profile", "fail-on", "srdf", "reference", "baseline")
_SWITCHES = ("meshes", "run", "load-meshes", "containment", "self-intersection")
_NUMBERS = ("samples", "seed", "self-contact")
_FIELDS = {
    **{"profile": "profile", "select": "select", "ignore": "ignore", "srdf": "srdf"},
    **{"meshes": "meshes", "run": "run", "containment": "containment"},
    **{"self-intersection": "self_intersection", "self-contact": "self_contact"},
    **{"samples": "samples", "seed": "seed", "frame": "frames", "link": "links"},
    **{"reference": "reference", "load-meshes": "load_meshes"},
}
_DECLARED = {
    "remote-centre": "remote_centres",
    "tool-axis": "tool_axes",
    "loop": "loops",
}
KEYS = (*_TABLES, *_LISTS, *_WORDS, *_SWITCHES, *_NUMBERS, "per-file-ignore", "arg")


@dataclass(frozen=True)
class ValidationSettings:
    """What a configuration file says; empty without one.

    Attributes:
        values: Plain settings by key.
        declared: Declared remote centres, tool axes and loops by key.
        per_file_ignore: Codes to leave out by file pattern.
        file: Where it stands.
        is_named: Whether the user named the file; one that was only found beside a
            robot may be a stranger's, too.
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    declared: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    per_file_ignore: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    file: Path | None = None
    is_named: bool = False


def find_settings(
    start: Path, look: Callable[[Path], ValidationSettings] | None = None
) -> ValidationSettings:
    """The settings of the nearest configuration file at or above a folder.

    Args:
        start: The folder.
        look: `settings_in`, or a form of it that remembers.
    """
    for folder in (start, *start.parents):
        settings = (look or settings_in)(folder)
        if settings.file is not None:
            return settings
    return ValidationSettings()


def settings_in(folder: Path) -> ValidationSettings:
    """The settings of a file that stands in this very folder; empty without one."""
    for name in FILES:
        path = folder / name
        if os.path.isfile(path):  # noqa: PTH113  False where it may not be asked
            settings = read_settings(path)
            if settings.file is not None:
                return settings
    return ValidationSettings()


def read_settings(path: Path) -> ValidationSettings:
    """The settings in one file; `file` is None if it holds none for validate.

    Raises:
        InputError: Not TOML, an unknown key, a wrong type.
    """
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(path, error.strerror or str(error)) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(path, f"not TOML: {error}") from error
    table = document.get("tool", {}).get("borecheck", {})
    table = (document if path.name != "pyproject.toml" else table).get("validate")
    if table is None:
        return ValidationSettings()
    if not isinstance(table, dict):
        raise InputError(path, "validate is no table")
    return _settings(table, path)


def options_with(settings: ValidationSettings, given: Mapping[str, Any]) -> Options:
    """The options of one file: what is given wins, lists of roots add up.

    Args:
        settings: What the configuration file says.
        given: Fields of `Options`; None means not given.

    Raises:
        InputError: The settings name a file beyond their own folder tree.
    """
    values = settings.values
    if not (settings.is_named or given.get("allow_outside")):
        _refuse_outside(settings)
    chosen: dict[str, Any] = {
        field_name: values[key] for key, field_name in _FIELDS.items() if key in values
    }
    chosen |= {_DECLARED[key]: found for key, found in settings.declared.items()}
    chosen |= {name: value for name, value in given.items() if value is not None}
    roots = [*(given.get("package_paths") or ()), *values.get("package-path", ())]
    chosen["package_paths"] = tuple(Path(root) for root in roots)
    chosen["arguments"] = {**values.get("arg", {}), **(given.get("arguments") or {})}
    for name in ("select", "ignore", "frames", "links"):
        chosen[name] = tuple(chosen.get(name, ()))
    for name in ("srdf", "reference"):
        if chosen.get(name) is not None:
            chosen[name] = Path(chosen[name])
    return Options(**chosen)


def _refuse_outside(settings: ValidationSettings) -> None:
    """Settings that come with a robot name no other files than the robot may."""
    for key in ("package-path", "srdf", "reference", "baseline"):
        value = settings.values.get(key, ())
        for entry in [value] if isinstance(value, str) else value:
            file = settings.file or Path()
            reach = reach_of(file.parent, Roots())
            if not reach.holds(Path(entry)):
                problem = f"{key}: {entry} leaves {reach.own}: name it by --{key}, "
                raise InputError(file, problem + "or give --allow-outside")


def _settings(table: dict[str, Any], path: Path) -> ValidationSettings:
    values: dict[str, Any] = {}
    declared: dict[str, tuple[Any, ...]] = {}
    ignored: dict[str, tuple[str, ...]] = {}
    for key, value in table.items():
        if key not in KEYS:
            raise InputError(path, str(UnknownNameError("setting", key, KEYS)))
        if key in _TABLES:
            entries: list[Any] = value if isinstance(value, list) else [value]
            declared[key] = tuple(_record(_TABLES[key], e, key, path) for e in entries)
        elif key == "per-file-ignore":
            if not isinstance(value, dict):
                raise InputError(path, f"{key} is a table: file pattern = [codes]")
            ignored = {k: _codes(f"{key} {k!r}", v, path) for k, v in value.items()}
        else:
            values[key] = _checked(key, value, path)
    return ValidationSettings(values, declared, ignored, path)


def _record(kind: type, entry: object, key: str, path: Path) -> Any:
    names = [f.name for f in fields(kind)]
    if not isinstance(entry, dict):
        raise InputError(path, f"{key} is a list of tables with {', '.join(names)}")
    unknown = set(entry) - set(names)
    if unknown:
        raise InputError(path, str(UnknownNameError(key, min(unknown), names)))
    values = {k: tuple(v) if isinstance(v, list) else v for k, v in entry.items()}
    try:
        return kind(**values)
    except UsageError as error:
        raise InputError(path, f"{key}: {error}") from error
    except TypeError as error:
        missing = [
            f.name for f in fields(kind) if f.default is MISSING and f.name not in entry
        ]
        raise InputError(path, f"{key} lacks {', '.join(missing)}") from error


def _codes(key: str, value: object, path: Path) -> tuple[str, ...]:
    """The codes of a list of words, each of which must be known."""
    if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
        raise InputError(path, f"{key} = {value!r} is no list of codes")
    try:
        return codes_of(value)
    except UnknownNameError as error:
        raise InputError(
            path,
            f"{key}: {error.name!r} is no check; see borecheck validate --list-checks",
        ) from error


def _checked(key: str, value: Any, path: Path) -> Any:
    kinds: dict[str, type] = dict.fromkeys(_LISTS, list)
    kinds |= dict.fromkeys(_WORDS, str) | dict.fromkeys(_SWITCHES, bool)
    kinds |= dict.fromkeys(_NUMBERS, int) | {"arg": dict}
    is_wrong = type(value) is not kinds[key]
    if is_wrong:
        raise InputError(path, f"{key} = {value!r} is no {kinds[key].__name__}")
    if key == "arg":
        return {name: _argument(name, given, path) for name, given in value.items()}
    if key in _NUMBERS:
        try:
            check_count(key, value)
        except UsageError as error:
            raise InputError(path, str(error)) from error
    if key in ("select", "ignore"):
        return _codes(key, value, path)
    if key in _LISTS and not all(isinstance(entry, str) for entry in value):
        raise InputError(path, f"{key} = {value!r} is no list of words")
    words = {"fail-on": FAIL_ON, "profile": PROFILES}.get(key)
    if words is not None and value not in words:
        raise InputError(path, f"{key} = {value!r} is none of {', '.join(words)}")
    if key == "package-path":
        return [str(path.parent / entry) for entry in value]
    if key in ("srdf", "reference", "baseline"):
        return str(path.parent / value)
    return value


def _argument(name: str, value: object, path: Path) -> str:
    """A xacro argument as the text it would be on the command line."""
    if not isinstance(value, str | int | float):
        raise InputError(path, f"arg {name} = {value!r} is no word or number")
    return str(value).lower() if isinstance(value, bool) else str(value)
