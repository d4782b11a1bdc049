"""What a map consists of: cells of directions, each with what is proven of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

CLEAR, CONTACT, OUT, UNDECIDED = "clear", "contact", "out", "undecided"
STATES = (CLEAR, CONTACT, OUT, UNDECIDED)
IS_CLEAR, IS_CONTACT, IS_OUT, IS_UNDECIDED = range(4)


@dataclass(frozen=True)
class Cause:
    """Why cells are not clear.

    Attributes:
        kind: "pair", "joint", "depth", "obliquity", "skin" or "scene".
        names: Part and obstacle, or the joint; may be empty.
        text: In words.
    """

    kind: str
    names: tuple[str, ...]
    text: str


@dataclass(frozen=True, eq=False)
class Leaves:
    """Cells that tile the chart, as columns of one length.

    Attributes:
        low: Lower ends of the coordinates, (k, 2), [rad].
        high: Upper ends, (k, 2).
        state: Place in STATES, (k,).
        cause: Place in the map's causes, or -1.
        depth: Bounds of the needle's depth, (k, 2), [m]; NaN where not known.
        obliquity: Bounds of the angle to the inward normal, (k, 2), [rad].
        entry: Depth along the centre's direction, (k,), [m]; NaN where not known.
        witness: Of proven contact: part, obstacle, its point; else -1, (k, 3).
        station: Where that point proves it, (k,), [m].
    """

    low: Array
    high: Array
    state: Ids
    cause: Ids
    depth: Array
    obliquity: Array
    entry: Array
    witness: Ids
    station: Array

    def __len__(self) -> int:
        return len(self.low)

    @property
    def centre(self) -> Array:
        """Coordinates in the middle, (k, 2)."""
        return np.asarray(0.5 * (self.low + self.high))

    @classmethod
    def unknown(cls, low: Array, high: Array) -> "Leaves":
        """Cells of which nothing is known yet."""
        count = len(low)
        return cls(
            low,
            high,
            np.full(count, IS_UNDECIDED),
            np.full(count, -1),
            np.full((count, 2), np.nan),
            np.full((count, 2), np.nan),
            np.full(count, np.nan),
            np.full((count, 3), -1),
            np.full(count, np.nan),
        )

    def take(self, rows: Ids | NDArray[np.bool_]) -> "Leaves":
        """Some of them."""
        return Leaves(*(column[rows] for column in vars(self).values()))

    @classmethod
    def joined(cls, parts: Sequence["Leaves"]) -> "Leaves":
        """All of several."""
        columns = zip(*(vars(part).values() for part in parts), strict=True)
        return cls(*(np.concatenate(column) for column in columns))


class Causes:
    """Causes by number; the same cause has one number."""

    def __init__(self) -> None:
        self.listed: list[Cause] = []
        self._numbers: dict[Cause, int] = {}

    def number(self, cause: Cause) -> int:
        """The number of a cause, given when it is first met."""
        if cause not in self._numbers:
            self._numbers[cause] = len(self.listed)
            self.listed.append(cause)
        return self._numbers[cause]
