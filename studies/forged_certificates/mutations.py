"""Every field of a certificate, changed in every way: value, type, missing, swapped."""

import copy
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from borecheck.motion.certificate import digest

Document = dict[str, Any]
Place = tuple[str | int, ...]

# Values that fit nowhere, or almost.
STRANGE: tuple[Any, ...] = (
    None, True, False, "", "1", [], {}, [[]], [1], {"x": 1}, -1, 0, 1, 2, 7, 10**30,
    -(10**30), 10**400, 1e17, -1e17, 1e308, -1e308, 5e-324, math.nan, math.inf,
    -math.inf, 0.5, -0.5, 1e-9, "robot", "patient", "fixed", "\x1b[2K", "x" * 100_000,
)  # fmt: skip
NUDGES = (1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.1)


def renewed(document: Document) -> Document:
    """With a fresh hash over whatever it holds now."""
    content = {name: value for name, value in document.items() if name != "sha256"}
    return {**content, "sha256": digest(content)}


def places(value: Any, at: Place = ()) -> Iterator[Place]:
    """Where the values of a document are: records, lists, and what is in them."""
    if at:
        yield at
    if isinstance(value, dict):
        for name, item in value.items():
            yield from places(item, (*at, name))
    elif isinstance(value, list):
        for k, item in enumerate(value):
            yield from places(item, (*at, k))


def mutated(
    rng: np.random.Generator, document: Document, other: Document
) -> tuple[str, Document]:
    """A certificate with one place changed, and which kind of place and change."""
    found = copy.deepcopy(document)
    every = [at for at in places(document) if at != ("sha256",)]
    groups = sorted({_kind_of(at) for at in every})
    group = groups[int(rng.integers(len(groups)))]  # rare fields as often as intervals
    some = [at for at in every if _kind_of(at) == group]
    at = some[int(rng.integers(len(some)))]
    holder = _at(found, at[:-1])
    change = str(rng.choice(["strange", "nudge", "missing", "twice", "swap", "other"]))
    value = holder[at[-1]]
    if change == "missing":
        del holder[at[-1]]
    elif change == "twice" and isinstance(holder, list):
        holder.insert(int(at[-1]), copy.deepcopy(value))
    elif change == "swap" and isinstance(holder, list) and len(holder) > 1:
        k = int(rng.integers(len(holder)))
        holder[at[-1]], holder[k] = holder[k], holder[at[-1]]
    elif change == "other":
        holder[at[-1]] = copy.deepcopy(_of_other(rng, other, group))
    elif change == "nudge" and type(value) in (int, float):
        size = float(rng.choice(NUDGES)) * float(rng.choice([-1.0, 1.0]))
        holder[at[-1]] = (
            value + size * max(1.0, abs(value)) if size > 0 else value + size
        )
    else:
        change = "strange"
        holder[at[-1]] = STRANGE[int(rng.integers(len(STRANGE)))]
    return f"{group}: {change}", renewed(found)


def _of_other(rng: np.random.Generator, other: Document, group: str) -> Any:
    """A value of the same kind of place in another certificate."""
    some = [at for at in places(other) if _kind_of(at) == group]
    return _at(other, some[int(rng.integers(len(some)))]) if some else None


def _kind_of(at: Place) -> str:
    return ".".join("n" if isinstance(step, int) else step for step in at)


def _at(value: Any, at: Place) -> Any:
    for step in at:
        value = value[step]
    return value
