"""Number checks: every numeric attribute holds as many finite numbers as it should."""

from collections.abc import Iterator

from borecheck.robots.urdf.rules import numbers
from borecheck.validation.checks.ruled import hits
from borecheck.validation.reading.draft import Robot
from borecheck.validation.registry import Hit, check


@check("D114", "not-a-number", "document", "EEE")
def not_a_number(robot: Robot) -> Iterator[Hit]:
    """A numeric attribute holds something that is no number.

    Why: Parsers refuse the file, crash, or read the number up to the odd character.

    Mend: Write plain decimal numbers separated by spaces.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy stops with a ValueError.
    """
    return hits(robot, numbers.no_numbers)


@check("D115", "number-count", "document", "EEE")
def number_count(robot: Robot) -> Iterator[Hit]:
    """A numeric attribute holds too few or too many numbers.

    Why: Parsers refuse the file, crash, or fill up with zeros.

    Mend: Give as many numbers as the attribute has: 3 for xyz, rpy, size and scale.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy stops with a ValueError;
    PyBullet fills up with zeros.
    """
    return hits(robot, numbers.count)


@check("D116", "not-finite", "document", "EEE")
def not_finite(robot: Robot) -> Iterator[Hit]:
    """A number is infinite or none (inf, nan, 1e999), or a length beyond every room.

    Why: It spreads through every placement: all verdicts become meaningless. So do
    lengths of more than 1e9 m, whose squares overflow.

    Mend: Give a finite number; for an unlimited joint use type="continuous".

    Libraries: yourdfpy and MuJoCo load nan; urdfdom depends on the C library.
    """
    return hits(robot, numbers.not_finite)


@check("D120", "number-locale", "document", "EEE")
def number_locale(robot: Robot) -> Iterator[Hit]:
    """A number is written with a decimal comma, separating commas or a unit.

    Why: Parsers stop at the comma or the unit: 0,35 becomes 0, and 35mm becomes 35 m.

    Mend: Write decimal points, spaces between numbers, and metres and radians without
    a unit.

    Libraries: what is read depends on the parser and on the process's LC_NUMERIC.
    """
    return hits(robot, numbers.locale)
