"""Is a part clear of an obstacle for a whole cell of directions and stations?

A question is a part, an obstacle, a cell, and a range of stations: distances from the
target back to the tip. The part is placed at the cell's centre and the range's middle.
Within the range it shifts by no more than half the range times its speed; from there to
any other direction of the cell by no more than the chart's bound, which is largest at a
corner of the part's box and an end of the range; a target that is off by e shifts all
of it by e. If the certified distance exceeds margin and all of these, the part is clear
for the whole cell and range.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.directions.setup import MapSetup

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Bools = NDArray[np.bool_]

# By how much distances must exceed what is proven to be enough: beyond rounding, [m].
RESERVE = 1e-9
# A range of stations is halved so often at most before the cell itself is.
MOST_HALVINGS = 5


@dataclass(frozen=True, eq=False)
class Questions:
    """Ranges of stations that are not proven clear, as columns of one length.

    Attributes:
        cell: Which cell.
        part: Which part of the robot.
        obstacle: Which obstacle.
        low: Where the range begins, [m].
        high: Where it ends, [m].
        near: What the distance is at most in its middle, at the cell's centre, [m].
    """

    cell: Ids
    part: Ids
    obstacle: Ids
    low: Array
    high: Array
    near: Array

    def __len__(self) -> int:
        return len(self.cell)

    def take(self, rows: Ids | Bools) -> "Questions":
        """Some of them."""
        return Questions(
            self.cell[rows],
            self.part[rows],
            self.obstacle[rows],
            self.low[rows],
            self.high[rows],
            self.near[rows],
        )

    def with_cells(self, cell: Ids) -> "Questions":
        """The same of other cells."""
        return Questions(cell, self.part, self.obstacle, self.low, self.high, self.near)

    def nearest_of_each(self) -> "Questions":
        """Of every cell the one that is nearest."""
        order = np.lexsort((self.near, self.cell))
        _, first = np.unique(self.cell[order], return_index=True)
        return self.take(order[first])

    @classmethod
    def none(cls) -> "Questions":
        """No question."""
        ids, numbers = np.zeros(0, np.int64), np.zeros(0)
        return cls(ids, ids, ids, numbers, numbers, numbers)

    @classmethod
    def joined(cls, parts: list["Questions"]) -> "Questions":
        """All of several."""
        columns = ("cell", "part", "obstacle", "low", "high", "near")
        if not parts:
            return cls.none()
        return cls(
            *(np.concatenate([getattr(p, name) for p in parts]) for name in columns)
        )


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of the chart.

    Attributes:
        angles: Centres, (k, 2), [rad].
        half: Half widths, (k, 2).
    """

    angles: Array
    half: Array

    def __len__(self) -> int:
        return len(self.angles)


def all_of(setup: MapSetup, cells: Ids, depth: Array) -> Questions:
    """Every pair of part and obstacle for some cells, over all their stations.

    Parts that are not inserted stand still while the needle is: for them stations end
    at the skin.

    Args:
        setup: The map's.
        cells: Numbers of the cells, (c,).
        depth: Bounds of the needle's depth in each, (c, 2), [m].
    """
    parts, obstacles = np.nonzero(setup.is_asked)
    pairs, count = len(parts), len(cells)
    start = np.where(setup.inserted[parts], 0.0, 1.0)
    low = np.maximum(depth[:, :1], 0.0) * start
    high = np.tile(depth[:, 1:] + setup.asked.standoff, (1, pairs))
    return Questions(
        np.repeat(cells, pairs),
        np.tile(parts, count),
        np.tile(obstacles, count),
        low.ravel(),
        high.ravel(),
        np.full(pairs * count, np.inf),
    )


def within(questions: Questions, setup: MapSetup, depth: Array) -> Questions:
    """The same, cut to the stations of their cells, whose depths are known better."""
    start = np.where(setup.inserted[questions.part], 0.0, depth[questions.cell, 0])
    low = np.maximum(questions.low, start)
    high = np.minimum(questions.high, depth[questions.cell, 1] + setup.asked.standoff)
    cut = Questions(
        questions.cell,
        questions.part,
        questions.obstacle,
        low,
        high,
        questions.near,
    )
    return cut.take(low <= high)


def open_after(setup: MapSetup, cells: Cells, asked: Questions) -> Questions:
    """What is not clear of some questions, ranges halved where that may help."""
    left: list[Questions] = []
    for _ in range(MOST_HALVINGS):
        if not len(asked):
            break
        again: list[Questions] = []
        for part in np.unique(asked.part):
            of_part = asked.take(asked.part == part)
            still, halves = _ask(setup, cells, int(part), of_part)
            left.append(still)
            again.append(halves)
        asked = Questions.joined(again)
    return Questions.joined([*left, asked])


def _ask(
    setup: MapSetup, cells: Cells, part: int, asked: Questions
) -> tuple[Questions, Questions]:
    """What is not clear of one part's questions, and what of that is halved."""
    middle, half_range = 0.5 * (asked.low + asked.high), 0.5 * (asked.high - asked.low)
    own = setup.chart.own(cells.angles[asked.cell], middle)
    T = setup.chart.place(part, setup.chart.in_urdf(own))
    turned, along = moved(setup, cells, part, asked.cell, own, T, half_range)
    lengths = np.full((len(asked), len(setup.scene.obstacles)), np.nan)
    rows = np.arange(len(asked))
    needed = (turned + along + setup.asked.margin) * (1.0 + 1e-12) + RESERVE
    lengths[rows, asked.obstacle] = needed
    bounds = setup.against[part].farther_than(
        T[:, None], lengths, setup.asked.margin + 0.5 * float(turned.min())
    )
    bounds = bounds[rows, asked.obstacle]
    clear = bounds[:, 0] > needed
    near = np.where(np.isfinite(bounds[:, 1]), bounds[:, 1], needed)
    seen = Questions(
        asked.cell, asked.part, asked.obstacle, asked.low, asked.high, near
    )
    halved = ~clear & (along > turned) & (near > setup.asked.margin + turned)
    return seen.take(~clear & ~halved), _halves(seen.take(halved))


def _halves(asked: Questions) -> Questions:
    middle = 0.5 * (asked.low + asked.high)
    lower = Questions(
        asked.cell, asked.part, asked.obstacle, asked.low, middle, asked.near
    )
    upper = Questions(
        asked.cell, asked.part, asked.obstacle, middle, asked.high, asked.near
    )
    return Questions.joined([lower, upper])


def moved(
    setup: MapSetup,
    cells: Cells,
    part: int,
    cell: Ids,
    own: Array,
    T: Array,
    half_range: Array,
) -> tuple[Array, Array]:
    """Bounds on how far a part moves: within the cells, and along their stations, [m].

    Args:
        setup: The map's.
        cells: All cells.
        part: The part.
        cell: Which cells, (k,).
        own: Configurations at their centres, (k, joints).
        T: Placements of the part there, (k, 4, 4).
        half_range: Stations before and after, (k,).
    """
    link = setup.robot.parts[part].link
    corners = setup.boxes[part] @ T[:, :3, :3].transpose(0, 2, 1) + T[:, None, :3, 3]
    speed = setup.chart.speed(link, cells.angles[cell])
    shift = (half_range[:, None] * speed)[:, None]
    ends = np.concatenate([corners - shift, corners + shift], axis=1)
    turned = setup.chart.displacements(link, ends, own, cells.half[cell]).max(axis=1)
    if not setup.chart.stands(link):
        turned = turned + setup.asked.target_error
    return turned, half_range * np.linalg.norm(speed, axis=1)
