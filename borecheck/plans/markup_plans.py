"""Needle plans from markups of 3D Slicer: which point is the entry, which the target.

Labels decide: a point whose label holds the word `entry` or `target`, and what is left
of the label names the plan (`T1 entry`, `T1 target`). Without such labels the order
decides, entry then target, pair by pair, and the plan says so.
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import BorecheckError, PlanError
from borecheck.exchange.markups import Markup, markups_in
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.patient_place import PatientPlace
from borecheck.plans.plan_fields import MAX_NAME

Array = NDArray[np.float64]

NO_PLACE = (
    "is a markups file of 3D Slicer, in the patient's coordinates: say where they "
    "lie in the scanner, with --isocentre X,Y,Z (the isocentre in LPS, for example "
    "12mm,-40mm,-750mm) and --position HFS, or --transform FILE.tfm"
)

# More would take longer to check than anybody waits.
MOST_PLANS = 100_000

_ROLES = {
    "entry": re.compile(r"(?<![a-z])entry(?![a-z])", re.I),
    "target": re.compile(r"(?<![a-z])target(?![a-z])", re.I),
}

# Name, entry, target, what to say of it.
Pair = tuple[str, Array, Array, tuple[str, ...]]


def plans_of_markups(
    text: str, file: str | Path, place: PatientPlace | None
) -> tuple[NeedlePlan, ...]:
    """The plans of a markups file, in the scanner's frame.

    Args:
        text: The file's.
        file: Named in errors; its stem names a plan that nothing else names.
        place: Where the patient's coordinates lie.

    Raises:
        PlanError: Nobody stated where, or which points are a plan is not said.
        InputError: It is no good markups file.
    """
    markups = markups_in(text, str(file))
    if place is None:
        raise PlanError(file, NO_PLACE)
    stem = _stem(Path(file))
    several = len(markups) > 1
    plans: list[NeedlePlan] = []
    for k, markup in enumerate(markups, 1):
        name = markup.name or (f"{stem}-{k}" if several else stem)[-MAX_NAME:]
        for pair in _pairs(markup, name, str(file), f"markup {k}"):
            plans.append(_plan(pair, markup, place, str(file), f"markup {k}"))
            if len(plans) > MOST_PLANS:
                raise PlanError(file, f"holds more than {MOST_PLANS} plans")
    return tuple(plans)


def _plan(
    pair: Pair, markup: Markup, place: PatientPlace, file: str, where: str
) -> NeedlePlan:
    name, entry, target, notes = pair
    if not name.isprintable() or len(name) > MAX_NAME:
        raise PlanError(file, f"a name has {MAX_NAME} printable characters", where)
    points = place.to_scanner(np.array([entry, target]))
    said = (*markup.notes, *notes)
    try:
        return NeedlePlan(name, points[0], points[1], notes=said)
    except BorecheckError as error:
        raise PlanError(file, str(error), where) from error


def _pairs(markup: Markup, name: str, file: str, where: str) -> Iterator[Pair]:
    roles = [_role(label) for label in markup.labels]
    if not any(roles):
        yield from _by_order(markup, name, file, where)
    elif all(roles):
        yield from _by_label(markup, name, [r for r in roles if r], file, where)
    else:
        label = markup.labels[roles.index(None)]
        raise PlanError(
            file,
            f"point {label[:40]!r} is neither entry nor target, and others are: "
            "label all of them or none",
            where,
        )


def _by_order(markup: Markup, name: str, file: str, where: str) -> Iterator[Pair]:
    points, labels = markup.points_lps, markup.labels
    count = len(points)
    if count == 0 or count % 2 or (markup.kind == "Line" and count != 2):
        raise PlanError(
            file,
            f"has {count} points, and a plan takes two: entry and target (of several "
            "plans label them, `a entry` and `a target`)",
            where,
        )
    for k in range(0, count, 2):
        note = (
            f"its points are in this order: entry {labels[k] or k + 1}, "
            f"target {labels[k + 1] or k + 2}"
        )
        own = name if count == 2 else f"{name}-{k // 2 + 1}"
        yield own, points[k], points[k + 1], (note,)


def _by_label(
    markup: Markup,
    name: str,
    roles: Sequence[tuple[str, str]],
    file: str,
    where: str,
) -> Iterator[Pair]:
    found: dict[str, dict[str, Array]] = {}
    for (role, whose), point in zip(roles, markup.points_lps, strict=True):
        ends = found.setdefault(whose, {})
        if role in ends:
            raise PlanError(
                file, f"plan {whose or name!r} has two {role} points", where
            )
        ends[role] = point
    for whose, ends in found.items():
        missing = [role for role in _ROLES if role not in ends]
        if missing:
            raise PlanError(file, f"plan {whose or name!r} has no {missing[0]}", where)
        yield whose or name, ends["entry"], ends["target"], ()


def _role(label: str) -> tuple[str, str] | None:
    """Entry or target, and the plan that the rest of the label names."""
    found = [role for role, words in _ROLES.items() if words.search(label)]
    if len(found) != 1:
        return None
    rest = _ROLES[found[0]].sub("", label)
    return found[0], rest.strip(" \t-_:.,()[]")


def _stem(file: Path) -> str:
    name = file.name
    for suffix in (".mrk.json", ".json", ".fcsv"):
        if name.lower().endswith(suffix):
            return name[: -len(suffix)] or name
    return name
