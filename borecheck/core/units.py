"""Quantities with units as users type them: `20mm`, `15deg`, `0.02m`."""

import math
import re

import numpy as np

from borecheck.core.se3 import Array, transform
from borecheck.errors import UsageError

LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
ANGLE_UNITS = {"rad": 1.0, "deg": math.pi / 180.0}

# Whatever is placed in a scanner room stands nearer than this, [m].
FARTHEST_POSE = 10.0
# Nobody turns a thing by more than once round; rounded up, as 6.2832 is typed, [rad].
LARGEST_TURN = 2.0 * math.pi + 1e-3

# Python's float() also takes 1_000 and digits of other scripts; our files do not.
PLAIN_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)

_QUANTITY = re.compile(
    r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*)\s*", re.ASCII
)


def parse_length(text: str) -> float:
    """A length in [m]; a bare number is metres.

    Raises:
        UsageError: No number, not finite, or a unit that is no length.
    """
    return _parse(text, "length", LENGTH_UNITS, "m")


def parse_angle(text: str) -> float:
    """An angle in [rad]; a bare number is radians."""
    return _parse(text, "angle", ANGLE_UNITS, "rad")


def parse_share(text: str) -> float:
    """A share typed in per cent, `5%`, as a number.

    Raises:
        UsageError: No finite number before the sign.
    """
    number, sign, rest = text.strip().partition("%")
    match = _QUANTITY.fullmatch(number)
    if not sign or rest or match is None or match.group(2):
        raise UsageError(f"{text!r} is no share; write for example 5%")
    return 0.01 * float(number)


def parse_joint_value(text: str, *, revolute: bool) -> float:
    """A joint position in SI, for a revolute or a prismatic joint."""
    return parse_angle(text) if revolute else parse_length(text)


def parse_pair(text: str, option: str) -> tuple[str, str]:
    """Name and value of an option typed as NAME=VALUE.

    Raises:
        UsageError: No `=`, or no name.
    """
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise UsageError(f"{option} {text!r} is not NAME=VALUE")
    return name, value


def parse_pose(text: str) -> Array:
    """A placement `x,y,z[,roll,pitch,yaw]` as a (4, 4) transform.

    Raises:
        UsageError: Not 3 or 6 quantities; metres or radians that can only be
            millimetres or degrees.
    """
    parts = text.split(",")
    if len(parts) not in (3, 6):
        raise UsageError(f"pose {text!r} has {len(parts)} numbers, not 3 or 6")
    xyz = [parse_length(part) for part in parts[:3]]
    rpy = [parse_angle(part) for part in parts[3:]] or [0.0, 0.0, 0.0]
    if max(map(abs, rpy)) > LARGEST_TURN:
        raise UsageError(
            f"pose {text!r} turns by more than 360 degrees: are these degrees? "
            "Bare numbers are radians; write for example 0,0,0,0,0,90deg"
        )
    return check_near(transform(np.array(xyz), np.array(rpy)), f"pose {text!r}")


def check_near(T: Array, name: str) -> Array:
    """The same placement, if it is within the scanner's room.

    Raises:
        UsageError: It is beyond FARTHEST_POSE.
    """
    if np.abs(T[:3, 3]).max() > FARTHEST_POSE:
        raise UsageError(
            f"{name} lies beyond {FARTHEST_POSE:g} m: are these millimetres? "
            "Bare numbers are metres; write for example 800mm,0,0"
        )
    return T


def _parse(text: str, kind: str, units: dict[str, float], bare: str) -> float:
    match = _QUANTITY.fullmatch(text)
    if match is None:
        example = "0.02 or 20mm" if kind == "length" else "0.2 or 15deg"
        raise UsageError(f"{text!r} is no {kind}; write for example {example}")
    number, unit = match.groups()
    if unit and unit not in units:
        raise UsageError(
            f"{text!r} is no {kind}: unit {unit!r} is none of {', '.join(units)}"
        )
    value = float(number) * units[unit or bare]
    if not math.isfinite(value):
        raise UsageError(f"{text!r} is too large for a {kind}")
    return value


_SIZES = {"kB": 10**3, "MB": 10**6, "GB": 10**9}


def parse_size(text: str) -> int:
    """A size on disk, such as `500MB` or `2 GB`, [bytes].

    Raises:
        UsageError: No number with one of these units.
    """
    stripped = text.strip()
    for unit, factor in _SIZES.items():
        number = stripped.removesuffix(unit).strip()
        if stripped.endswith(unit) and number.isdecimal() and number.isascii():
            return int(number) * factor
    raise UsageError(f"{text!r} is no size; write {', '.join(_SIZES)} behind a number")
