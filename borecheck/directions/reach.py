"""Can the robot bring the needle there: joints, depth and obliquity over cells.

A joint's position is bounded about the cell's centre by the chart. Between two stations
positions are straight and their bounds convex, so limits that hold at the first and the
last station hold at all; a limit that is broken at one station which every direction
visits puts all of them out of reach.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.directions.leaves import Cause, Causes
from borecheck.directions.questions import RESERVE, Cells
from borecheck.directions.setup import MapSetup
from borecheck.directions.skin import SkinOfCells

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Bools = NDArray[np.bool_]


def visited(setup: MapSetup, skin: SkinOfCells) -> tuple[Array, Array, Bools]:
    """First and last station that all directions of a cell visit, and if there are."""
    low = skin.depth[:, 1]
    high = skin.depth[:, 0] + setup.asked.standoff
    with np.errstate(invalid="ignore"):
        return low, high, low <= high


class Reach:
    """Judges cells by what the robot can reach and what was asked of the needle.

    Args:
        setup: The map's.
        causes: Where causes get their numbers.
    """

    def __init__(self, setup: MapSetup, causes: Causes) -> None:
        self._setup, self._causes = setup, causes
        self._model = setup.robot.model

    def judged(self, cells: Cells, skin: SkinOfCells) -> tuple[Bools, Ids]:
        """Which cells are all within reach; why others are all out of it, or -1."""
        asked, drive = self._setup.asked, self._setup.chart.insertion
        travel = self._setup.chart.travel[1]
        depth, oblique = skin.depth, skin.obliquity
        out = np.full(len(cells), -1)
        with np.errstate(invalid="ignore"):
            inside = (depth[:, 1] <= min(travel, asked.max_depth)) & (
                oblique[:, 1] <= asked.max_obliquity
            )
            steep = oblique[:, 0] > asked.max_obliquity
            self._name(out, steep, "obliquity", "more oblique than asked")
            self._name(out, depth[:, 0] > asked.max_depth, "depth", "deeper than asked")
            deep = f"deeper than {drive} drives the needle"
            self._name(out, depth[:, 0] > travel, "depth", deep)
        beyond, within = self._joints(cells, skin)
        for k, name in enumerate(self._model.joint_names):
            for side, word in enumerate(("below", "above")):
                text = f"{name} {word} its limit"
                self._name(out, beyond[:, k, side], "joint", text, (name,))
        return inside & within, out

    def _name(
        self, out: Ids, rows: Bools, kind: str, text: str, names: tuple[str, ...] = ()
    ) -> None:
        if rows.any():
            out[rows] = self._causes.number(Cause(kind, names, text))

    def _joints(self, cells: Cells, skin: SkinOfCells) -> tuple[Bools, Bools]:
        """Joints surely beyond their limits, (k, joints, 2); cells surely within."""
        lower, upper = self._model.lower, self._model.upper
        beyond = np.zeros((len(cells), len(lower), 2), np.bool_)
        inside = np.isfinite(skin.depth[:, 0])
        low, high, all_visit = visited(self._setup, skin)
        ends = (skin.depth[:, 0], skin.depth[:, 1] + self._setup.asked.standoff)
        rows = np.flatnonzero(inside)
        some = Cells(cells.angles[rows], cells.half[rows])
        for station in ends:
            q, b = self._around(some, station[rows])
            within_limits = (q - b >= lower - RESERVE) & (q + b <= upper + RESERVE)
            inside[rows] &= within_limits.all(axis=1)
        rows = np.flatnonzero(all_visit)
        some = Cells(cells.angles[rows], cells.half[rows])
        for station in (low, 0.5 * (low + high), high):
            q, b = self._around(some, station[rows])
            beyond[rows, :, 0] |= q + b < lower - RESERVE
            beyond[rows, :, 1] |= q - b > upper + RESERVE
        return beyond, inside

    def _around(self, cells: Cells, station: Array) -> tuple[Array, Array]:
        """Configurations at centres, and by how much joints differ in the cells."""
        chart = self._setup.chart
        own = chart.own(cells.angles, station)
        change = chart.joint_changes(own, cells.half)
        error = self._setup.asked.target_error
        at = [self._model.joint_names.index(name) for name in chart.about.axes]
        change[:, [k for k in range(change.shape[1]) if k not in at]] += error
        change[:, self._model.joint_names.index(chart.insertion)] = 0.0
        # the chart ends at the limits of its own joints
        change[:, at] = 0.0
        return chart.in_urdf(own), change
