"""Coordinates of plans that say their unit in their name: `entry_x_mm`, `entry_cm`."""

from collections.abc import Iterable

from borecheck.core.units import LENGTH_UNITS
from borecheck.plans.plan_fields import COORDINATES, PlanValueError

_POINTS = ("entry", "target")  # as lists of three, in JSON


def bare_names(names: Iterable[str]) -> tuple[dict[str, str], str | None]:
    """The names of a plan's fields without units, and the unit that they said.

    Returns:
        The bare name of each name, and the unit; None if none of them says one.

    Raises:
        PlanValueError: An ending that is no unit of length, or some coordinates say
            another unit than others or none.
    """
    bare: dict[str, str] = {}
    units: dict[str | None, str] = {}
    for name in names:
        base, _, unit = name.rpartition("_")
        if name in (*COORDINATES, *_POINTS):
            units.setdefault(None, name)
            base = name
        elif base in (*COORDINATES, *_POINTS):
            if unit not in LENGTH_UNITS:
                known = ", ".join(LENGTH_UNITS)
                raise PlanValueError(
                    f"{name}: {unit!r} is no unit of length (known: {known}; without "
                    "one a coordinate is in metres)"
                )
            units.setdefault(unit, name)
        else:
            base = name
        bare[name] = base
    if len(units) > 1:
        said = " and ".join(repr(name) for name in list(units.values())[:2])
        raise PlanValueError(f"{said} are not in the same unit: give all the same one")
    return bare, next(iter(units), None)
