"""No character of a file moves the cursor."""

import sys
import unicodedata

import pytest

from borecheck.core.text import printable


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("arm\x1b[1A\x1b[2K\nACCEPTED", "arm\\x1b[1A\\x1b[2K\\nACCEPTED"),
        ("a\r\tb\x07\x7f\x9b", "a\\r\\tb\\x07\\x7f\\x9b"),
        ("\u202egnp\u2028\ufeff", "\\u202egnp\\u2028\\ufeff"),
        ("\ud800", "\\ud800"),
        ("Längsachse 手臂 of arm-1", "Längsachse 手臂 of arm-1"),
        (3.5, "3.5"),
    ],
)
def test_what_does_not_show_is_escaped(text: object, shown: str) -> None:
    assert printable(text) == shown


def test_every_character_shows() -> None:
    """Nothing of the Unicode categories of controls, formats and breaks is left."""
    told = printable("".join(map(chr, range(sys.maxunicode + 1))))
    kinds = {unicodedata.category(c) for c in told}
    assert not kinds & {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}


def test_line_breaks_of_our_own_stay() -> None:
    assert printable("one\ntwo\x1b", keep="\n") == "one\ntwo\\x1b"
