"""Number checks: every numeric attribute holds as many finite numbers as it should."""

from collections.abc import Iterator

from borecheck.robots.urdf.rules import numbers
from borecheck.validation.checks.ruled import problems
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register


@register("D114", "not-a-number", "document", "EEE")
def not_a_number(robot: CheckedUrdf) -> Iterator[Problem]:
    """A numeric attribute holds something that is no number.

    Why: Parsers refuse the file, crash, or read the number up to the odd character.

    Fix: Write plain decimal numbers separated by spaces.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy stops with a ValueError.
    """
    return problems(robot, numbers.no_numbers)


@register("D115", "number-count", "document", "EEE")
def number_count(robot: CheckedUrdf) -> Iterator[Problem]:
    """A numeric attribute holds too few or too many numbers.

    Why: Parsers refuse the file, crash, or fill up with zeros.

    Fix: Give as many numbers as the attribute has: 3 for xyz, rpy, size and scale.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy stops with a ValueError;
    PyBullet fills up with zeros.
    """
    return problems(robot, numbers.count)


@register("D116", "not-finite", "document", "EEE")
def not_finite(robot: CheckedUrdf) -> Iterator[Problem]:
    """A number is infinite or none (inf, nan, 1e999), or a length beyond every room.

    Why: It spreads through every placement: all verdicts become meaningless. So do
    lengths of more than 1e9 m, whose squares overflow.

    Fix: Give a finite number; for an unlimited joint use type="continuous".

    Libraries: yourdfpy and MuJoCo load nan; urdfdom depends on the C library.
    """
    return problems(robot, numbers.not_finite)


@register("D120", "number-locale", "document", "EEE")
def number_locale(robot: CheckedUrdf) -> Iterator[Problem]:
    """A number is written with a decimal comma, separating commas or a unit.

    Why: Parsers stop at the comma or the unit: 0,35 becomes 0, and 35mm becomes 35 m.

    Fix: Write decimal points, spaces between numbers, and metres and radians without
    a unit.

    Libraries: what is read depends on the parser and on the process's LC_NUMERIC.
    """
    return problems(robot, numbers.locale)
