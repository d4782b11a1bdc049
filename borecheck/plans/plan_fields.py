"""The named fields of one needle plan, as a file gives them, to a `NeedlePlan`.

Nothing is guessed: a field that is no number, a name that is one, or a unit mistake is
one clear line. What a file may leave to a convention is noted in the plan.
"""

import math
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.patient_frame import FRAMES, scanner_from_patient
from borecheck.core.units import LENGTH_UNITS, PLAIN_NUMBER, parse_angle
from borecheck.errors import BorecheckError, PlanError, UnknownNameError
from borecheck.plans.needle_plan import NeedlePlan

Array = NDArray[np.float64]

COORDINATES = tuple(f"{p}_{a}" for p in ("entry", "target") for a in "xyz")
COLUMNS = ("name", *COORDINATES)
OPTIONAL = ("roll", "mount")
SETTINGS = ("unit", "frame", "patient_position", "origin")

MAX_NAME = 200


class PlanValueError(BorecheckError):
    """A value in a plan that makes no sense; the reader adds file and place."""


def plan_of(
    fields: Mapping[str, Any],
    file: str,
    where: str,
    settings: Mapping[str, Any] | None = None,
) -> NeedlePlan:
    """The plan that these fields state.

    Args:
        fields: `name`, the six coordinates, and perhaps `roll` and `mount`.
        file: Named in errors.
        where: Line or number of the plan, named in errors.
        settings: `unit`, `frame`, `patient_position`, `origin`, as far as given.

    Raises:
        PlanError: A field makes no sense; one line that says which.
    """
    name = _name(fields, file, where)
    given = [_number(fields, key, file, where, name) for key in COORDINATES]
    points = np.reshape(given, (2, 3))
    try:
        scale, R, origin, notes = _placing(settings or {})
        entry, target = origin + scale * points @ R.T
        return NeedlePlan(name, entry, target, _roll(fields), _mount(fields), notes)
    except BorecheckError as error:
        raise PlanError(file, str(error), where) from error


def _placing(
    settings: Mapping[str, Any],
) -> tuple[float, Array, Array, tuple[str, ...]]:
    """Scale, rotation and origin that bring given points into the scanner's frame."""
    unit, frame = settings.get("unit", "m"), settings.get("frame", "scanner")
    if not isinstance(unit, str) or unit not in LENGTH_UNITS:
        raise UnknownNameError("unit", str(unit), LENGTH_UNITS)
    if not isinstance(frame, str):
        raise UnknownNameError("frame", str(frame), FRAMES)
    position = str(settings.get("patient_position", "HFS"))
    R = scanner_from_patient(frame, position)
    scale = LENGTH_UNITS[unit]
    origin, notes = np.zeros(3), []
    if "origin" in settings:
        origin = scale * _origin(settings["origin"])
    if frame == "scanner" and "patient_position" in settings:
        raise PlanValueError(
            "patient_position needs a frame: RAS or LPS (without one the points are in "
            "the scanner's frame, where it means nothing)"
        )
    if frame != "scanner":
        if "patient_position" not in settings:
            notes.append(f"{frame} is read as of a patient head first, supine (HFS)")
        if "origin" not in settings:
            notes.append(f"the origin of {frame} is taken to be the isocentre")
    return scale, R, origin, tuple(notes)


def _origin(given: Any) -> Array:
    if not isinstance(given, list) or len(given) != 3:
        raise PlanValueError("origin is no list of three numbers")
    return np.array([_as_number(value, "origin") for value in given])


def _name(fields: Mapping[str, Any], file: str, where: str) -> str:
    name = fields["name"]
    if isinstance(name, int) and not isinstance(name, bool):
        name = str(name)
    if not isinstance(name, str) or not name.strip():
        raise PlanError(file, "a plan needs a name", where)
    name = name.strip()
    if len(name) > MAX_NAME or not name.isprintable():
        raise PlanError(
            file, f"a name is at most {MAX_NAME} printable characters", where
        )
    if _looks_like_coordinate(name):
        raise PlanError(
            file, f"name is {name!r}, a coordinate: are the columns swapped?", where
        )
    return name


def _looks_like_coordinate(name: str) -> bool:
    """Whether it is a number that is no plain count (`7` may well be a name)."""
    return PLAIN_NUMBER.fullmatch(name) is not None and not name.isdecimal()


def _number(
    fields: Mapping[str, Any], key: str, file: str, where: str, name: str
) -> float:
    try:
        return _as_number(fields[key], key)
    except PlanValueError as error:
        raise PlanError(file, f"plan {name!r}: {error}", where) from error


def _as_number(value: Any, key: str) -> float:
    if isinstance(value, str):
        return _number_in(value.strip(), key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise PlanValueError(f"{key} is no number")
    try:
        number = float(value)
    except OverflowError as error:
        raise PlanValueError(f"{key} is too large") from error
    return _finite(number, key)


def _number_in(text: str, key: str) -> float:
    if PLAIN_NUMBER.fullmatch(text):
        return _finite(float(text), key)
    if text.lower().lstrip("+-") in ("nan", "inf", "infinity"):
        raise PlanValueError(f"{key} is {text!r}, not finite")
    raise PlanValueError(f"{key} is {text[:60]!r}, no number: are the columns swapped?")


def _finite(number: float, key: str) -> float:
    if not math.isfinite(number):
        raise PlanValueError(f"{key} is not finite")
    return number


def _roll(fields: Mapping[str, Any]) -> float | None:
    roll = fields.get("roll")
    if roll is None or roll == "":
        return None
    if isinstance(roll, str):
        return parse_angle(roll)
    return _as_number(roll, "roll")


def _mount(fields: Mapping[str, Any]) -> str | None:
    mount = fields.get("mount")
    if mount is None or mount == "":
        return None
    number = _as_number(mount, "mount")
    if abs(number) != 90.0:
        raise PlanValueError(f"mount {mount!r} is neither +90 nor -90")
    return f"{number:+.0f}"


def unknown_line(kind: str, name: str, known: Sequence[str]) -> str:
    """One line about a name that is none of the known ones."""
    close = get_close_matches(name, known, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    return f"unknown {kind} {name[:60]!r}{hint} (known: {', '.join(known)})"
