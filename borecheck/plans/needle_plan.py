"""Needle plans: where the needle enters, where it ends, and the poses on the way.

A plan is stated in the scanner's frame (origin at the isocentre, x along the bore, z
up), in metres. Files of plans are read by `plans.plan_file`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError

Array = NDArray[np.float64]

# A gantry is 1 m deep and a couch 2 m long: what lies farther off is no metre.
MAX_COORDINATE = 5.0

# Biopsy needles are 0.05 to 0.25 m long [m].
MIN_PATH = 1e-3
MAX_PATH = 1.0

MOUNTS = ("+90", "-90")


@dataclass(frozen=True, eq=False)
class NeedlePlan:
    """One straight needle path.

    Attributes:
        name: What the user calls it.
        entry: Where the needle enters the body, (3,), [m], scanner frame; read-only.
        target: Where its tip ends, (3,), [m], scanner frame; read-only.
        roll: Turn about the needle, [rad], or None where the plan leaves it open.
        mount: The mounting side the plan asks for, "+90" or "-90", or None.
        notes: How it was read, where the file left something to a convention.
    """

    name: str
    entry: Array
    target: Array
    roll: float | None = None
    mount: str | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for field in ("entry", "target"):
            point = np.array(getattr(self, field), dtype=np.float64)
            point.setflags(write=False)
            object.__setattr__(self, field, point)
        problem = plan_problem(self.entry, self.target)
        if problem is not None:
            raise GeometryError(f"plan {self.name!r}: {problem}")
        if self.roll is not None and not math.isfinite(self.roll):
            raise GeometryError(f"plan {self.name!r}: roll is not finite")
        if self.mount is not None and self.mount not in MOUNTS:
            raise GeometryError(
                f"plan {self.name!r}: mount {self.mount!r} is neither +90 nor -90"
            )

    def __repr__(self) -> str:
        entry, target = (
            "(" + ", ".join(f"{round(1e3 * x, 1) + 0.0:g}" for x in point) + ")"
            for point in (self.entry, self.target)
        )
        return f"<NeedlePlan {self.name}: {entry} to {target} mm>"

    @cached_property
    def length(self) -> float:
        """Distance from entry to target, [m]."""
        return math.dist(self.entry, self.target)

    @cached_property
    def direction(self) -> Array:
        """Unit vector from entry to target, (3,)."""
        return (self.target - self.entry) / self.length


@dataclass(frozen=True, eq=False)
class Waypoint:
    """One pose of the needle on its way.

    Attributes:
        tip: Needle tip in the scanner's frame, (3,), [m].
        direction: The way the needle points, unit, (3,).
        insertion: How far the needle is pushed out of its holder, [m].
        phase: "approach" (tip before the skin) or "insertion".
        along: Distance of the tip from the entry, [m]; negative before it.
    """

    tip: Array
    direction: Array
    insertion: float
    phase: str
    along: float


def plan_problem(entry: ArrayLike, target: ArrayLike) -> str | None:
    """Why entry and target make no needle path, in one line; None if they do."""
    entry, target = np.asarray(entry, dtype=float), np.asarray(target, dtype=float)
    for name, point in (("entry", entry), ("target", target)):
        if point.shape != (3,):
            return f"{name} has shape {point.shape}, not (3,)"
        if not np.isfinite(point).all():
            return f"{name} holds a number that is not finite"
        far = float(np.abs(point).max())
        if far > MAX_COORDINATE:
            return (
                f"{name} lies {far:g} m from the isocentre; plans are in metres "
                "unless they say their unit: are these millimetres?"
            )
    length = math.dist(entry, target)
    if length == 0.0:
        return "entry and target are the same point: the needle path has no length"
    if not MIN_PATH <= length <= MAX_PATH:
        return (
            f"entry and target are {length:g} m apart, and a needle path is "
            f"{MIN_PATH:g} to {MAX_PATH:g} m long: is the unit right?"
        )
    return None


def waypoints(
    plan: NeedlePlan, standoff: float, step: float, insertion: float = 0.0
) -> tuple[Waypoint, ...]:
    """Poses from a point before the skin to the target.

    The robot brings the tip to the entry with the needle drawn in, and then pushes the
    needle with its own drive ([Matsuno2020] section 3.1, steps 4 and 5). Entry and
    target are always among the poses.

    Args:
        plan: The needle plan.
        standoff: Where the approach begins, before the entry along the needle, [m].
        step: Largest distance between two poses, [m].
        insertion: Position of the needle's drive during the approach, [m].

    Raises:
        GeometryError: A standoff below 0, or a step that is not above 0.
    """
    if not (math.isfinite(standoff) and standoff >= 0.0):
        raise GeometryError(f"standoff {standoff!r} m is not 0 or more")
    if not (math.isfinite(step) and step > 0.0):
        raise GeometryError(f"step {step!r} m is not above 0")
    before = _steps(-standoff, 0.0, step)
    inside = _steps(0.0, plan.length, step)[1:]
    return (
        *(_waypoint(plan, along, insertion, "approach") for along in before),
        *(_waypoint(plan, s, insertion + s, "insertion") for s in inside),
    )


def _steps(start: float, stop: float, step: float) -> Sequence[float]:
    """Evenly spaced from start to stop, both included, at most `step` apart."""
    count = math.ceil((stop - start) / step)
    return [float(v) for v in np.linspace(start, stop, count + 1)]


def _waypoint(plan: NeedlePlan, along: float, insertion: float, phase: str) -> Waypoint:
    tip = plan.entry + along * plan.direction
    if along == plan.length:
        tip = plan.target.copy()
    tip.setflags(write=False)
    return Waypoint(tip, plan.direction, insertion, phase, along)
