"""How far plans may be off, and how those that are not clear can be, in words."""

from collections.abc import Iterator, Mapping
from typing import Any


def tolerance_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """A line for every plan of which something is known."""
    for plan in document["plans"]:
        if "tolerance" in plan:
            yield f"{plan['name']}: {_tolerance(plan['tolerance'])}"
        if "repair" in plan:
            yield f"{plan['name']}: {_repair(plan['repair'])}"


def _tolerance(found: Mapping[str, Any]) -> str:
    if found["angle_deg"] is None:
        return "not shown to stay clear for any direction beside its own"
    angle, error = f"{found['angle_deg']:.3g}", f"{1e3 * found['target_error_m']:.3g}"
    near = f"for every target within {error} mm and every direction within {angle} deg"
    if found.get("met") is False:
        return f"NOT SHOWN to stay clear {near}: {found['reason']}"
    return f"stays clear {near}, proven"


def _repair(found: Mapping[str, Any]) -> str:
    bound = found["none_nearer_than_deg"]
    proven = (
        ""
        if bound is None
        else f"no clear direction nearer than {bound:.1f} deg, proven"
    )
    if found["entry"] is None:
        return (
            f"no clear direction found; {proven}"
            if proven
            else "no direction is clear, proven"
        )
    entry = ", ".join(f"{1e3 * x:.1f}" for x in found["entry"])
    return (
        f"nearest clear plan: entry ({entry}) mm, {found['angle_deg']:.1f} deg away; "
        f"{proven}"
    )
