"""Cells of directions, split until each is decided or as small as was asked.

Every round gives a whole map, which is true: later ones only decide more. A cell is

* out, if for every direction in it the robot cannot bring the needle: a joint beyond
  its limit at a station that every direction visits, too deep, or too oblique;
* contact, if a point of a part proves it (`witnesses`); of a cell of which both are
  shown, out is said;
* clear, if the skin is crossed once (`skin`), every joint keeps its limits, and every
  part is clear of every obstacle at every station (`questions`);
* undecided else.

Children look only at what their parents left open: candidates of the skin, pairs, and
ranges of stations.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from borecheck.directions.front import Front, children, first_front
from borecheck.directions.leaves import (
    IS_CLEAR,
    IS_CONTACT,
    IS_OUT,
    IS_UNDECIDED,
    Cause,
    Causes,
    Leaves,
)
from borecheck.directions.questions import (
    Cells,
    Questions,
    all_of,
    open_after,
    within,
)
from borecheck.directions.reach import Reach
from borecheck.directions.setup import MapSetup
from borecheck.directions.skin import OK, REASONS, SkinOfCells
from borecheck.directions.touching import Touching

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Bools = NDArray[np.bool_]

RIM = Cause("joint", (), "at the rim of what can be reached or is asked")


class Refinement:
    """Refines a map round by round.

    Args:
        setup: What the map is asked of.

    Attributes:
        causes: Why cells are not clear.
    """

    def __init__(self, setup: MapSetup) -> None:
        self.causes = Causes()
        self._setup = setup
        self._reach = Reach(setup, self.causes)
        self._touching = Touching(setup)

    def rounds(self) -> Iterator[Leaves]:
        """The map after every round, of the whole chart."""
        done: list[Leaves] = []
        front = first_front(self._setup)
        while True:
            front = self._examined(front)
            yield Leaves.joined([*done, front.leaves])
            sizes = (front.leaves.high - front.leaves.low).max(axis=1)
            split = front.leaves.state == IS_UNDECIDED
            split &= sizes > self._setup.asked.resolution * (1.0 + 1e-9)
            done.append(front.leaves.take(~split))
            if not split.any():
                return
            front = children(front, np.flatnonzero(split))

    def _examined(self, front: Front) -> Front:
        """The front with what can be proven of its cells."""
        leaves = front.leaves
        cells = Cells(leaves.centre, 0.5 * (leaves.high - leaves.low))
        skin, entry = self._skin(front, cells)
        known = np.isfinite(skin.depth[:, 0])
        state, cause = leaves.state.copy(), self._skin_causes(skin)
        inside, out = self._reach.judged(cells, skin)
        state[out >= 0] = IS_OUT
        cause[out >= 0] = out[out >= 0]
        left = self._left(front, cells, skin, known & (out < 0))
        witness, station = self._touching.of_cells(cells, skin, left)
        proven = witness[:, 0] >= 0
        state[proven] = IS_CONTACT
        for k in np.flatnonzero(proven):
            part, obstacle = witness[k, :2].tolist()
            cause[k] = self._pair_cause(part, obstacle, "in contact")
        left = left.take(state[left.cell] == IS_UNDECIDED)
        is_open = np.zeros(len(leaves), np.bool_)
        is_open[left.cell] = True
        clear = (state == IS_UNDECIDED) & (skin.state == OK) & inside & ~is_open
        state[clear], cause[clear] = IS_CLEAR, -1
        self._name_undecided(left, state, cause)
        found = Leaves(
            leaves.low, leaves.high, state, cause, skin.depth, skin.obliquity, entry,
            witness, station,
        )  # fmt: skip
        near = np.where(known, np.maximum(front.near, skin.depth[:, 0]), front.near)
        asked = front.was_asked | known
        return Front(found, skin.cell, skin.triangle, near, asked, left)

    def _skin(self, front: Front, cells: Cells) -> tuple[SkinOfCells, Array]:
        """What is known of the skin, and the depth along the middle of each cell."""
        chart, skin = self._setup.chart, self._setup.skin
        spread = chart.about.spread(cells.angles, cells.half)
        rays = -chart.directions(cells.angles)
        candidates = front.skin_cell, front.skin_triangle
        found = skin.over(rays, spread, front.near, *candidates)
        return found, skin.entry_depths(rays, found.cell, found.triangle)

    def _skin_causes(self, skin: SkinOfCells) -> Ids:
        cause = np.full(len(skin.state), -1)
        for state, text in REASONS.items():
            if (skin.state == state).any():
                number = self.causes.number(Cause("skin", (), text))
                cause[skin.state == state] = number
        return cause

    def _left(
        self, front: Front, cells: Cells, skin: SkinOfCells, asked: Bools
    ) -> Questions:
        """What is open of all cells; only those that are asked are looked at."""
        setup = self._setup
        old = asked[front.left.cell]
        looked_at = [within(front.left.take(old), setup, skin.depth)]
        fresh = np.flatnonzero(asked & ~front.was_asked)
        if len(fresh):
            looked_at.append(all_of(setup, fresh, skin.depth[fresh]))
        still = open_after(setup, cells, Questions.joined(looked_at))
        return Questions.joined([front.left.take(~old), still])

    def _name_undecided(self, left: Questions, state: Ids, cause: Ids) -> None:
        """Of undecided cells the nearest open pair, or that it is at a rim."""
        nearest = left.nearest_of_each()
        unnamed = cause[nearest.cell] < 0
        nearest = nearest.take(unnamed & (state[nearest.cell] == IS_UNDECIDED))
        pairs = np.stack([nearest.part, nearest.obstacle], axis=1)
        for part, obstacle in np.unique(pairs, axis=0).tolist():
            rows = (nearest.part == part) & (nearest.obstacle == obstacle)
            number = self._pair_cause(part, obstacle, "not decided")
            cause[nearest.cell[rows]] = number
        at_rim = (state == IS_UNDECIDED) & (cause < 0)
        if at_rim.any():
            cause[at_rim] = self.causes.number(RIM)

    def _pair_cause(self, part: int, obstacle: int, word: str) -> int:
        names = (
            self._setup.robot.parts[part].mesh.name,
            self._setup.scene.obstacles[obstacle].name,
        )
        text = f"{names[0]} and {names[1]}: {word}"
        return self.causes.number(Cause("pair", names, text))
