"""What is proven of a motion, and what was only seen of it, in words.

Rounded lengths are bounds still: a proven least one is rounded down, one that the
motion reaches is rounded up.
"""

from collections.abc import Mapping
from math import ceil, floor
from typing import Any

# What no least clearance counts where a needle may be in its patient.
NEEDLE_APART = "; the needle to its patient does not count"


def motion_lines(block: Mapping[str, Any]) -> list[str]:
    """What is proven of a motion and what the samples add; a line each."""
    path, closest = block["path"], block["closest"]
    samples = f"{path['sampled_clear']} of {path['samples']} samples clear"
    lines = [
        f"{samples}; certified between them"
        if path["certified"]
        else f"{samples}; not certified between"
    ]
    lines += contact_lines(path)
    worst = path["worst"]
    if path.get("least") is not None:
        line = least_line(path["least"], closest)
        inside = block.get("corridor") is not None
        lines.append(f"{line}{NEEDLE_APART if inside else ''}")
    elif worst["closest"] is not None and worst.get("sampled_clearance_m"):
        nearest = worst["closest"]
        lines.append(
            "nearest of the poses sampled: "
            f"{nearest['link']} to {nearest['obstacle']}, "
            f"{1e3 * worst['sampled_clearance_m']:.3f} mm at {worst['fraction']:.1%}"
        )
    return lines


def least_line(least: Mapping[str, Any], closest: Mapping[str, Any] | None) -> str:
    """The certified least clearance, where it is, and whether it is sharp."""
    lower, upper = at_least(least["clearance_m"]), at_most(least["clearance_upper_m"])
    where = f"{upper} at {least['fraction']:.1%}"
    if closest is not None:
        where = f"{closest['link']} to {closest['obstacle']}, {where}"
    line = f"least clearance {lower}, proven at every instant ({where})"
    if not least["within_tolerance"]:
        line += "; sharper than that it could not be shown"
    return line


def contact_lines(path: Mapping[str, Any]) -> list[str]:
    """Where contact begins: proven, or only seen."""
    begins = path.get("contact_begins")
    if begins is not None:
        span = f"{begins['from']:.2%} and {begins['to']:.2%}"
        return [f"contact begins between {span} of the motion"]
    if path["first_contact"] is None:
        return []
    return [
        f"contact at {path['first_contact']:.1%} of the motion, the first of the poses "
        "sampled"
    ]


def at_least(length: float | None) -> str:
    """A lower bound in millimetres, or a dash."""
    return "-" if length is None else f"{floor(1e6 * length) / 1e3:.3f} mm"


def at_most(length: float | None) -> str:
    """An upper bound in millimetres, or a dash."""
    return "-" if length is None else f"{ceil(1e6 * length) / 1e3:.3f} mm"
