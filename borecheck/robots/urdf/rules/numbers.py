"""Rules of numbers: plain, finite, and as many as there should be."""

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from borecheck.robots.urdf.attributes import NotNumbersError, parse_numbers
from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.rules.defect import Defect, matters
from borecheck.robots.urdf.schema import LENGTHS

_PLAIN = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
FARTHEST = 1e9  # [m] as for the vertices of meshes
_NOT_FINITE = re.compile(r"[-+]?(inf(inity)?|nan)", re.I)
_OTHER_LOCALE = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
_WITH_UNIT = re.compile(
    r"[-+]?(\d+\.?\d*|\.\d+)\s*(m|mm|cm|rad|deg|°|kg|g|in)[.,]?", re.I
)


class _Numeric(NamedTuple):
    element: Any
    tag: str
    attribute: str
    text: str
    size: int

    def problem(self, message: str) -> Defect:
        text = f"{self.attribute}={self.text!r}{message}"
        return Defect(self.element, text, self.attribute, matters(self.element))


def no_numbers(draft: UrdfDraft) -> Iterator[Defect]:
    """A numeric attribute holds numbers."""
    for numeric in _numeric(draft):
        try:
            parse_numbers(numeric.text)
        except NotNumbersError:
            bad = _bad_words(numeric.text)
            if _is_locale(numeric.text) or all(_NOT_FINITE.fullmatch(w) for w in bad):
                continue
            yield numeric.problem(" is not a number")


def count(draft: UrdfDraft) -> Iterator[Defect]:
    """It holds as many as it should."""
    for numeric in _numeric(draft):
        try:
            found = len(parse_numbers(numeric.text))
        except NotNumbersError:
            continue
        if found != numeric.size:
            yield numeric.problem(f" holds {found} numbers, not {numeric.size}")


def not_finite(draft: UrdfDraft) -> Iterator[Defect]:
    """None of them is infinite or no number, and no length beyond every room."""
    for numeric in _numeric(draft):
        words = numeric.text.split()
        word = next((w for w in words if _NOT_FINITE.fullmatch(w)), None)
        if word is None:
            word = next((w for w in words if _overflows(w)), None)
        if word is not None:
            yield numeric.problem(f": {word} is not finite")
        elif word := next((w for w in words if _is_far(numeric, w)), None):
            yield numeric.problem(f": {word} is beyond every room")


def locale(draft: UrdfDraft) -> Iterator[Defect]:
    """They are written with points and spaces, without a unit."""
    for numeric in _numeric(draft):
        if _bad_words(numeric.text) and _is_locale(numeric.text):
            yield numeric.problem(" is not written plainly")


def _numeric(draft: UrdfDraft) -> list[_Numeric]:
    """All numeric attributes that are there, without left-over xacro."""
    return [_Numeric(*found) for found in draft.numeric]


def _bad_words(text: str) -> list[str]:
    return [word for word in text.split() if not _PLAIN.fullmatch(word)]


def _is_locale(text: str) -> bool:
    words = text.replace(";", " ").split()
    if any(_OTHER_LOCALE.fullmatch(word.rstrip(",")) for word in words):
        return True
    return any(_WITH_UNIT.fullmatch(word) for word in words) or "," in text


def _is_far(numeric: _Numeric, word: str) -> bool:
    """Whether a length is so great that its square may overflow."""
    is_length = (numeric.tag, numeric.attribute) in LENGTHS
    return is_length and bool(_PLAIN.fullmatch(word)) and abs(float(word)) > FARTHEST


def _overflows(word: str) -> bool:
    return bool(_PLAIN.fullmatch(word)) and abs(float(word)) == float("inf")
