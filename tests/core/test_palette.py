"""Colours can be read: contrast as WCAG 2.2 defines it."""

import re

import pytest

from borecheck.core.palette import DARK, LIGHT, PLAN, ROLES, TOUCHING, rgb, style_sheet

# WCAG 2.2, success criterion 1.4.3, for text of usual size.
READABLE = 4.5
PAPER, NIGHT = "#ffffff", "#14181d"


def luminance(colour):
    shares = [value / 255.0 for value in rgb(colour)]
    linear = [
        s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_contrast_of_known_colours():
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize(("table", "page"), [(LIGHT, PAPER), (DARK, NIGHT)])
def test_verdicts_can_be_read_on_their_ground_and_on_the_page(table, page):
    assert set(table) == {"clear", "contact", "unknown"}
    for shade in table.values():
        assert contrast(shade.ink, shade.ground) >= READABLE
        assert contrast(shade.ink, page) >= READABLE


def test_labels_are_white_on_the_ink_of_the_day():
    assert all(contrast(shade.ink, PAPER) >= READABLE for shade in LIGHT.values())


def test_the_style_sheet_holds_the_whole_table():
    text = style_sheet()
    shades = [*LIGHT.values(), *DARK.values()]
    for colour in (*ROLES.values(), *TOUCHING, PLAN, *(s.ink for s in shades)):
        assert colour in text
    assert len(set(re.findall(r"--(role-[a-z]+):", text))) == len(ROLES)
