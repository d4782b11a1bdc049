"""Clear directions in the order of what users weigh: room, depth, obliquity."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.queries import queries
from borecheck.directions.direction_map import DirectionMap
from borecheck.directions.leaves import IS_CLEAR
from borecheck.plans.needle_plan import NeedlePlan

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# Of so many clear cells the clearance is looked at.
LOOKED_AT = 160
# Shares of approach and of insertion at which it is looked at.
STATIONS = (0.0, 0.5, 1.0)
# Ranked directions are at least so far from each other, [rad].
APART = np.radians(5.0)


@dataclass(frozen=True)
class Weights:
    """What a direction costs; the least cost ranks first.

    Attributes:
        depth: Of a millimetre in the patient.
        obliquity: Of a degree from the inward normal.
        clearance: Of a millimetre of clearance that is missing to `enough`.
        enough: Clearance beyond which more is not worth anything, [m].
    """

    depth: float = 1.0
    obliquity: float = 1.0
    clearance: float = 5.0
    enough: float = 0.02


WEIGHTS = Weights()


@dataclass(frozen=True, eq=False)
class Ranked:
    """A clear direction with what it is ranked by.

    Attributes:
        cell: Number of its cell.
        plan: The plan along the middle of the cell.
        cost: The sum it is ranked by.
        depth: Of the needle, [m].
        obliquity: Largest in the cell, [rad].
        clearance: Least at the instants looked at, [m]; more is not proven of it.
    """

    cell: int
    plan: NeedlePlan
    cost: float
    depth: float
    obliquity: float
    clearance: float


def ranked(
    found: DirectionMap, count: int = 3, weights: Weights = WEIGHTS
) -> tuple[Ranked, ...]:
    """The clear directions that cost least, each some degrees from the others.

    Args:
        found: The map.
        count: How many at most.
        weights: What costs how much.
    """
    leaves = found.leaves
    rows = np.flatnonzero((leaves.state == IS_CLEAR) & np.isfinite(leaves.entry))
    if not len(rows):
        return ()
    cost = weights.depth * 1e3 * leaves.entry[rows]
    cost += weights.obliquity * np.degrees(leaves.obliquity[rows, 1])
    rows, cost = _spread(rows, cost)
    room = clearances(found, rows)
    missing = np.maximum(weights.enough - room, 0.0)
    cost = cost + weights.clearance * 1e3 * missing
    chosen: list[Ranked] = []
    directions = found.setup.chart.directions(leaves.centre[rows])
    for k in np.argsort(cost, kind="stable"):
        others = [int(np.flatnonzero(rows == c.cell)[0]) for c in chosen]
        if (directions[others] @ directions[k] > np.cos(APART)).any():
            continue
        cell = int(rows[k])
        chosen.append(
            Ranked(
                cell,
                found.plan(cell, f"rank_{len(chosen) + 1}"),
                float(cost[k]),
                float(leaves.entry[cell]),
                float(leaves.obliquity[cell, 1]),
                float(room[k]),
            )
        )
        if len(chosen) == count:
            break
    return tuple(chosen)


def _spread(rows: Ids, cost: Array) -> tuple[Ids, Array]:
    """Half of those looked at cost least so far, the others lie between the rest."""
    order = np.argsort(cost, kind="stable")
    if len(order) > LOOKED_AT:
        first = order[: LOOKED_AT // 2]
        rest = order[LOOKED_AT // 2 :]
        step = np.linspace(0, len(rest) - 1, LOOKED_AT // 2).astype(int)
        order = np.concatenate([first, rest[step]])
    return rows[order], cost[order]


def clearances(found: DirectionMap, cells: Ids) -> Array:
    """Least clearance seen along the middle of clear cells, (c,), [m]."""
    chart, setup = found.setup.chart, found.setup
    needle = setup.robot.needle_with_tip().link
    skin = [(needle, o.name) for o in setup.scene.obstacles if o.role == "patient"]
    asked = queries(setup.robot, setup.scene, skip=skin)
    angles, depth = found.leaves.centre[cells], found.leaves.entry[cells]
    column = setup.robot.model.joint_names.index(chart.insertion)
    poses = []
    for share in STATIONS:
        poses.append(
            chart.in_urdf(chart.own(angles, depth + share * setup.asked.standoff))
        )
        inserted = chart.in_urdf(chart.own(angles, depth))
        inserted[:, column] += share * depth
        poses.append(inserted)
    every = np.concatenate(poses)
    every = np.clip(every, setup.robot.model.lower, setup.robot.model.upper)
    room = asked.clearance(every, within=0.1)[:, 0]
    return np.asarray(room.reshape(len(poses), -1).min(axis=0))
