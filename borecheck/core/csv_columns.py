"""Columns of CSV files that say their unit in their name: `elbow_deg`, `slide_mm`.

A bare name is SI. A column whose name is a joint's own name is that joint, whatever it
ends in.
"""

from collections.abc import Sequence

from borecheck.core.units import ANGLE_UNITS, LENGTH_UNITS
from borecheck.errors import BorecheckError, UnknownNameError


class ColumnError(BorecheckError):
    """A header that cannot be read; the reader adds the file."""


def separator_problem(cells: Sequence[str]) -> str | None:
    """One line if the columns of a header are separated by something else than commas.

    Args:
        cells: The header, as cut at commas.
    """
    for sign, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(cells) == 1 and sign in cells[0]:
            return (
                f"columns must be separated by commas, not {name} "
                "(and decimals written with a point)"
            )
    return None


def unit_columns(
    columns: Sequence[str],
    angles: Sequence[str],
    lengths: Sequence[str],
    kind: str = "column",
) -> dict[str, tuple[int, float]]:
    """Where each quantity stands, and the factor that makes it SI.

    Args:
        columns: The header.
        angles: Names of quantities in [rad], also as NAME_rad or NAME_deg.
        lengths: Names of quantities in [m], also as NAME_m, NAME_mm ...
        kind: What a column is called in errors.

    Returns:
        Index and factor by quantity, only those that are there.

    Raises:
        UnknownNameError: A column that is none of these.
        ColumnError: An unknown unit, or a quantity that is there twice.
    """
    units = {name: ANGLE_UNITS for name in angles}
    units |= {name: LENGTH_UNITS for name in lengths}
    found: dict[str, tuple[int, float]] = {}
    for index, column in enumerate(columns):
        name, factor = _quantity(column, units, kind)
        if name in found:
            first = columns[found[name][0]]
            also = f" (as {first} and {column})" if first != column else ""
            raise ColumnError(f"column {name!r} is there twice{also}")
        found[name] = (index, factor)
    return found


def refuse_mixed(columns: Sequence[str], names: Sequence[str]) -> None:
    """Refuses a header in which some columns of one kind say their unit and some not.

    Args:
        columns: The header.
        names: All quantities of one kind.

    Raises:
        ColumnError: Which ones do and which do not.
    """
    with_unit = [c for c in columns if c not in names and c.rpartition("_")[0] in names]
    bare = [c for c in columns if c in names]
    if with_unit and bare:
        raise ColumnError(
            f"{with_unit[0]} says its unit and {bare[0]} does not: "
            "give all joints of a kind their unit, or none (then rad, m)"
        )


def _quantity(
    column: str, units: dict[str, dict[str, float]], kind: str
) -> tuple[str, float]:
    """The quantity that a column holds, and its factor to SI."""
    if column in units:
        return column, 1.0
    name, _, unit = column.rpartition("_")
    if name not in units:
        raise UnknownNameError(kind, column, list(units))
    if unit not in units[name]:
        what = "an angle" if units[name] is ANGLE_UNITS else "a length"
        known = ", ".join([name, *(f"{name}_{u}" for u in units[name])])
        raise ColumnError(
            f"column {column!r}: {unit!r} is no unit of {name}, which is {what} "
            f"(known: {known})"
        )
    return name, units[name][unit]
