"""What was checked, in at most six lines and its case file's: the text begins so."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from borecheck.report.case_words import case_lines

# Bodies with a line of their own; of more, the last line tells how many there are.
MOST_BODIES = 4
# Taken by default, and not said then.
USUAL = {"margin_kind": "offset", "checker": "exact", "pruning": "bvh"}
# Which come first.
ROLES = ("patient", "scanner", "couch", "other")


def lines(document: Mapping[str, Any]) -> list[str]:
    """The lines; none for a result that was stored without."""
    checked = document.get("checked")
    if checked is None:
        return []
    return [
        f"checked: {_robot(checked)}",
        *(f"  {line}" for line in case_lines(document)),
        *(f"  {body}" for body in bodies(checked["bodies"])),
        f"  {asked(document)}",
    ]


def about(document: Mapping[str, Any]) -> list[str]:
    """Robot and base, case file, and every body, as a page lists them."""
    checked = document.get("checked")
    if checked is None:
        return []
    return [_robot(checked), *case_lines(document), *bodies(checked["bodies"])]


def _robot(checked: Mapping[str, Any]) -> str:
    arguments = ", ".join(f"{k}={v}" for k, v in checked["arguments"].items())
    named = f"robot {checked['robot']}" + (f" ({arguments})" if arguments else "")
    place = f"base at {_place(checked['base_xyz_m'])}"
    turned = [math.degrees(angle) for angle in checked["base_rpy_rad"]]
    if any(abs(angle) > 1e-6 for angle in turned):
        place += f" turned by ({', '.join(_tenths(a, 0.0) for a in turned)}) deg"
    return f"{named}, {place}"


def bodies(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line for each of the bodies, patients and large ones first, or for the rest."""
    order = sorted(found, key=lambda b: (ROLES.index(b["role"]), -max(b["size_m"])))
    if len(order) <= MOST_BODIES:
        return [_body(body) for body in order]
    shown, rest = order[: MOST_BODIES - 1], order[MOST_BODIES - 1 :]
    return [*map(_body, shown), f"and {len(rest)} more, {_extent(rest)}"]


def _body(body: Mapping[str, Any]) -> str:
    role = "obstacle" if body["role"] == "other" else body["role"]
    named = role if role == body["name"] else f"{role} {body['name']}"
    return f"{named}: {_size(body['size_m'])} about {_place(body['centre_m'])}"


def _extent(found: Sequence[Mapping[str, Any]]) -> str:
    """The box around several bodies."""
    low, high = [], []
    for k in range(3):
        ends = [(b["centre_m"][k], b["size_m"][k] / 2.0) for b in found]
        low.append(min(centre - half for centre, half in ends))
        high.append(max(centre + half for centre, half in ends))
    size = [b - a for a, b in zip(low, high, strict=True)]
    middle = [(a + b) / 2.0 for a, b in zip(low, high, strict=True)]
    return f"within {_size(size)} about {_place(middle)}"


def asked(document: Mapping[str, Any]) -> str:
    """Margin, corridor, and what is not as it is by default: kind, checker, pruning."""
    margin, kind = document["margin_m"], document["margin_kind"]
    kept = f"margin {_tenths(1e3 * margin)} mm"
    if kind != USUAL["margin_kind"]:
        kept += f" ({kind})"
    words = [kept if margin else "no margin"]
    for name in ("checker", "pruning"):
        if document[name] != USUAL[name]:
            words.append(f"{name} {document[name]}")
    checked = document.get("checked", {})
    corridor, needle = checked.get("corridor_m"), checked.get("needle")
    if corridor is not None:
        which = "the needle" if needle is None else f"the needle ({needle})"
        words.append(
            f"{which} may be in the patient only within "
            f"{1e3 * corridor:.3g} mm of its line"
        )
    return ", ".join(words)


def _size(lengths: Sequence[float]) -> str:
    return " x ".join(_tenths(1e3 * v) for v in lengths) + " mm"


def _place(point: Sequence[float]) -> str:
    return f"({', '.join(_tenths(1e3 * v, 0.0) for v in point)}) mm"


def _tenths(value: float, least: float = 0.1) -> str:
    """A number with one digit behind the point, or what it has where it is small."""
    if 0.0 < abs(value) < least:
        return f"{value:.2g}"
    return f"{round(value, 1) + 0.0:.6g}"
