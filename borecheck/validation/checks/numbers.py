"""Number checks: every numeric attribute holds as many finite numbers as it should."""

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from borecheck.robots.urdf.source import NotNumbersError, parse_numbers, tag_of
from borecheck.validation.checks.document import standard
from borecheck.validation.reading.draft import Robot
from borecheck.validation.reading.schema import NUMERIC
from borecheck.validation.registry import Hit, check

_PLAIN = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_NOT_FINITE = re.compile(r"[-+]?(inf(inity)?|nan)", re.I)
_OTHER_LOCALE = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
_WITH_UNIT = re.compile(
    r"[-+]?(\d+\.?\d*|\.\d+)\s*(m|mm|cm|rad|deg|°|kg|g|in)[.,]?", re.I
)


class _Numeric(NamedTuple):
    element: Any
    attribute: str
    text: str
    size: int


def _numeric(robot: Robot) -> Iterator[_Numeric]:
    """All numeric attributes that are there, without left-over xacro."""
    for element in standard(robot):
        tag = tag_of(element)
        for attribute, text in element.attrib.items():
            count = NUMERIC.get((tag, attribute))
            if count is not None and "$" not in text and text.strip():
                yield _Numeric(element, attribute, text, count)


def _bad_word(text: str, pattern: re.Pattern[str]) -> str | None:
    return next((word for word in text.split() if pattern.fullmatch(word)), None)


def _is_locale(text: str) -> bool:
    words = text.replace(";", " ").split()
    if any(_OTHER_LOCALE.fullmatch(word.rstrip(",")) for word in words):
        return True
    return any(_WITH_UNIT.fullmatch(word) for word in words) or "," in text


@check("D114", "not-a-number", "document", "EEE")
def not_a_number(robot: Robot) -> Iterator[Hit]:
    """A numeric attribute holds something that is no number.

    Why: Parsers refuse the file, crash, or read the number up to the odd character.

    Mend: Write plain decimal numbers separated by spaces.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy stops with a ValueError.
    """
    for element, attribute, text, _ in _numeric(robot):
        try:
            parse_numbers(text)
        except NotNumbersError:
            bad = [w for w in text.split() if not _PLAIN.fullmatch(w)]
            if _is_locale(text) or all(_NOT_FINITE.fullmatch(w) for w in bad):
                continue
            yield Hit(element, f"{attribute}={text!r} is not a number", attribute)


@check("D115", "number-count", "document", "EEE")
def number_count(robot: Robot) -> Iterator[Hit]:
    """A numeric attribute holds too few or too many numbers.

    Why: Parsers refuse the file, crash, or fill up with zeros.

    Mend: Give as many numbers as the attribute has: 3 for xyz, rpy, size and scale.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy stops with a ValueError;
    PyBullet fills up with zeros.
    """
    for element, attribute, text, count in _numeric(robot):
        try:
            found = len(parse_numbers(text))
        except NotNumbersError:
            continue
        if found != count:
            message = f"{attribute}={text!r} holds {found} numbers, not {count}"
            yield Hit(element, message, attribute)


@check("D116", "not-finite", "document", "EEE")
def not_finite(robot: Robot) -> Iterator[Hit]:
    """A numeric attribute is infinite or not a number (inf, nan, 1e999).

    Why: It spreads through every placement: all verdicts become meaningless.

    Mend: Give a finite number; for an unlimited joint use type="continuous".

    Libraries: yourdfpy and MuJoCo load nan; urdfdom depends on the C library.
    """
    for element, attribute, text, _ in _numeric(robot):
        word = _bad_word(text, _NOT_FINITE)
        if word is None:
            word = next((w for w in text.split() if _overflows(w)), None)
        if word is not None:
            yield Hit(element, f"{attribute}={text!r}: {word} is not finite", attribute)


@check("D120", "number-locale", "document", "EEE")
def number_locale(robot: Robot) -> Iterator[Hit]:
    """A number is written with a decimal comma, separating commas or a unit.

    Why: Parsers stop at the comma or the unit: 0,35 becomes 0, and 35mm becomes 35 m.

    Mend: Write decimal points, spaces between numbers, and metres and radians without
    a unit.

    Libraries: what is read depends on the parser and on the process's LC_NUMERIC.
    """
    for element, attribute, text, _ in _numeric(robot):
        bad = [w for w in text.split() if not _PLAIN.fullmatch(w)]
        if bad and _is_locale(text):
            yield Hit(
                element, f"{attribute}={text!r} is not written plainly", attribute
            )


def _overflows(word: str) -> bool:
    return bool(_PLAIN.fullmatch(word)) and abs(float(word)) == float("inf")
