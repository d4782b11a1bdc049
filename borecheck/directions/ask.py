"""The map of needle directions about a target: what users call."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from borecheck.core.units import parse_angle
from borecheck.directions.chart import Chart
from borecheck.directions.direction_map import DirectionMap
from borecheck.directions.front import first_cells
from borecheck.directions.leaves import Cause, Causes, Leaves
from borecheck.directions.refine import Refinement
from borecheck.directions.settle import settled
from borecheck.directions.setup import MapSetup, Requirements
from borecheck.errors import UsageError
from borecheck.plans.needle_plan import MAX_COORDINATE
from borecheck.plans.plan_motion import STANDOFF
from borecheck.robots.given import length, refuse_others
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

# Finer maps have millions of cells, [rad].
FINEST = np.radians(0.05)


def directions(
    robot: Robot,
    scene: Scene,
    target: ArrayLike,
    *,
    resolution: float | str = "1deg",
    margin: float | str = 0.0,
    target_error: float | str = 0.0,
    standoff: float | str = STANDOFF,
    max_depth: float | str | None = None,
    max_obliquity: float | str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> DirectionMap:
    """Which needle directions to a target are clear, proven over continuous cells.

    Of every direction in a cell, and every instant of approach and insertion, the
    cell's state holds. See docs/directions.md for what is proven and how.

    Args:
        robot: From `load_robot`, with a chart of directions (zerobot).
        scene: From `load_scene`, with a patient.
        target: Where needles end, (3,), scanner's frame, [m].
        resolution: Cells are not split below it: [rad], or "0.5deg".
        margin: Required clearance to obstacles, [m], or "5mm".
        target_error: Every target so near must be reached so, [m], or "2mm".
        standoff: Length of the approach before the skin, [m].
        max_depth: Longest way in the patient; deeper is out.
        max_obliquity: Largest angle to the inward normal, [rad] or "40deg".
        progress: Called with rounds done and in all.

    Raises:
        UsageError: No patient, no such chart, or a number that makes no sense.
    """
    *_, found = maps(
        robot,
        scene,
        target,
        resolution=resolution,
        margin=margin,
        target_error=target_error,
        standoff=standoff,
        max_depth=max_depth,
        max_obliquity=max_obliquity,
        progress=progress,
        every=False,
    )
    return found


def maps(
    robot: Robot,
    scene: Scene,
    target: ArrayLike,
    *,
    resolution: float | str = "1deg",
    margin: float | str = 0.0,
    target_error: float | str = 0.0,
    standoff: float | str = STANDOFF,
    max_depth: float | str | None = None,
    max_obliquity: float | str | None = None,
    progress: Callable[[int, int], None] | None = None,
    every: bool = True,
) -> Iterator[DirectionMap]:
    """As `directions`, coarse first: every map is of the whole chart, and true.

    Args:
        robot: As there, likewise all that follow.
        scene: As there.
        target: As there.
        resolution: As there.
        margin: As there.
        target_error: As there.
        standoff: As there.
        max_depth: As there.
        max_obliquity: As there.
        progress: As there.
        every: Whether to give the map of every round, or only the last.
    """
    refuse_others(robot, scene)
    asked = _requirements(
        resolution, margin, target_error, standoff, max_depth, max_obliquity
    )
    if not any(obstacle.role == "patient" for obstacle in scene.obstacles):
        raise UsageError(
            "there is no patient: where a needle goes in is not known; add --patient"
        )
    setup = MapSetup(Chart.of(robot, target_point(target)), scene, asked)
    if setup.skin.trouble is not None:
        yield _undecided(setup, setup.skin.trouble)
        return
    refinement = Refinement(setup)
    total = _rounds(setup)
    for done, leaves in enumerate(refinement.rounds(), start=1):
        if progress is not None:
            progress(done, total)
        last = leaves
        if every:
            yield _map(setup, leaves, refinement.causes)
    if not every:
        yield _map(setup, last, refinement.causes)


def target_point(target: ArrayLike) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """The target as three numbers.

    Raises:
        UsageError: It is not, or lies metres away.
    """
    try:
        point = np.array(target, dtype=np.float64)
    except (TypeError, ValueError):
        point = np.zeros(0)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise UsageError(f"target {target!r} is not three finite numbers, [m]")
    far = float(np.abs(point).max())
    if far > MAX_COORDINATE:
        raise UsageError(
            f"the target lies {far:g} m from the isocentre: are these millimetres?"
        )
    return point


def _map(setup: MapSetup, leaves: Leaves, causes: Causes) -> DirectionMap:
    return DirectionMap(setup, settled(setup, leaves, causes), tuple(causes.listed))


def _undecided(setup: MapSetup, why: str) -> DirectionMap:
    """A map of which nothing can be said, and why."""
    leaves = Leaves.unknown(*first_cells(setup.chart.limits))
    leaves.cause[:] = 0
    return DirectionMap(setup, leaves, (Cause("skin", (), why),))


def _rounds(setup: MapSetup) -> int:
    low, high = first_cells(setup.chart.limits)
    widest = float((high - low).max())
    return 1 + max(0, int(np.ceil(np.log2(widest / setup.asked.resolution) - 1e-9)))


def _requirements(
    resolution: float | str,
    margin: float | str,
    target_error: float | str,
    standoff: float | str,
    max_depth: float | str | None,
    max_obliquity: float | str | None,
) -> Requirements:
    asked = Requirements(
        length(margin, "margin"),
        length(target_error, "target_error"),
        length(standoff, "standoff"),
        np.inf if max_depth is None else length(max_depth, "max_depth"),
        np.inf if max_obliquity is None else _angle(max_obliquity, "max_obliquity"),
        _angle(resolution, "resolution"),
    )
    for name in ("margin", "target_error", "standoff"):
        if getattr(asked, name) < 0.0:
            raise UsageError(f"{name} is {getattr(asked, name):g} m, below 0")
    if not asked.resolution >= FINEST:
        raise UsageError(
            f"resolution is {np.degrees(asked.resolution):g} deg; the finest is "
            f"{np.degrees(FINEST):g} deg"
        )
    for name in ("max_depth", "max_obliquity"):
        if not getattr(asked, name) > 0.0:
            raise UsageError(f"{name} is not above 0")
    return asked


def _angle(value: float | str, name: str) -> float:
    """An angle in [rad]: a number, or text with its unit."""
    if isinstance(value, str):
        return parse_angle(value)
    return length(value, name)
