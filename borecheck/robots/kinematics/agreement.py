"""Do independent kinematics put every frame in the same place, and where not?

The comparator is blind: it takes functions q -> {frame: T} and knows no robot and no
engine. `cross_check` hands it the closed form, Pinocchio and yourdfpy.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations, islice, product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import rotation_angle
from borecheck.errors import (
    GeometryError,
    JointLimitError,
    UnknownNameError,
    UsageError,
)
from borecheck.robots.description import hook
from borecheck.robots.kinematics import sources
from borecheck.robots.kinematics.sources import Placements, RobotLike
from borecheck.robots.model import RobotModel

Array = NDArray[np.float64]

MAX_CORNERS = 64  # all corners of six joints; more joints get that many drawn ones


@dataclass(frozen=True)
class Tolerances:
    """How far two placements may differ and still count as the same.

    Two roads of about 30 operations on numbers of about 1 m differ by 1e-14; a
    dimension wrong by one micrometre differs by 1e-6.
    """

    position_m: float = 1e-9
    rotation_rad: float = 1e-9


@dataclass(frozen=True)
class Disagreement:
    """The largest difference of two sources about one frame.

    Attributes:
        frame: The frame.
        position_m: Largest distance of the two origins, [m].
        rotation_rad: Largest angle between the two orientations, [rad].
        q_position: Where the origins differ most, (n,).
        q_rotation: Where the orientations differ most, (n,).
    """

    frame: str
    position_m: float
    rotation_rad: float
    q_position: tuple[float, ...]
    q_rotation: tuple[float, ...]

    def exceeds(self, tolerances: Tolerances) -> bool:
        """Whether it is more than the tolerances allow (NaN is)."""
        within = (
            self.position_m <= tolerances.position_m
            and self.rotation_rad <= tolerances.rotation_rad
        )
        return not within


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """What the sources say, and how far apart they are.

    Attributes:
        robot: The robot's name.
        arguments: Its xacro arguments.
        joint_names: The joints in the order of q.
        q: The configuration that `frames` is for, (n,).
        configurations: How many configurations were compared.
        moved_m: How far the farthest-moving frame moved over them, [m].
        parameters: The closed form's dimensions by their names in the paper.
        frames: {frame: {source: T_base_frame (4, 4)}} at q.
        worst: {(source, source): {frame: largest difference}}.
        tolerances: What counted as the same.
        silent: Sources that the robot has not, with the reason.
    """

    robot: str
    arguments: Mapping[str, str]
    joint_names: tuple[str, ...]
    q: tuple[float, ...]
    configurations: int
    moved_m: float
    parameters: Mapping[str, float]
    frames: Mapping[str, Mapping[str, Array]]
    worst: Mapping[tuple[str, str], Mapping[str, Disagreement]]
    tolerances: Tolerances
    silent: Mapping[str, str]

    @property
    def disagreements(self) -> tuple[Disagreement, ...]:
        """All differences beyond the tolerances; empty when the sources agree."""
        found = (d for pair in self.worst.values() for d in pair.values())
        return tuple(d for d in found if d.exceeds(self.tolerances))

    @property
    def position_m(self) -> float:
        """Largest distance between any two sources about any frame, [m]."""
        return _largest([d.position_m for p in self.worst.values() for d in p.values()])

    @property
    def rotation_rad(self) -> float:
        """Largest angle between any two sources about any frame, [rad]."""
        return _largest(
            [d.rotation_rad for p in self.worst.values() for d in p.values()]
        )


def differences(
    first: Placements, second: Placements, configurations: Iterable[ArrayLike]
) -> dict[str, Disagreement]:
    """Largest difference of two sources about each frame, over all configurations.

    Args:
        first: Function q -> {frame: T_base_frame}.
        second: Another one; both must know the same frames.
        configurations: Joint positions, (k, n).

    Raises:
        UnknownNameError: One knows a frame that the other does not.
        UsageError: No configuration, or no frame, to compare.
    """
    worst: dict[str, Disagreement] = {}
    for row in configurations:
        q = np.array(row, dtype=np.float64)
        one, other = first(q), second(q)
        _same_frames(one, other)
        for frame, T in one.items():
            found = _difference(frame, q, T, other[frame])
            worst[frame] = _larger(worst[frame], found) if frame in worst else found
    if not worst:
        raise UsageError("no configuration or no frame to compare: nothing was checked")
    return worst


def disagreements(
    first: Placements,
    second: Placements,
    configurations: Iterable[ArrayLike],
    tolerances: Tolerances | None = None,
) -> list[Disagreement]:
    """The frames about which two sources differ beyond the tolerances."""
    allowed = Tolerances() if tolerances is None else tolerances
    worst = differences(first, second, configurations)
    return [found for found in worst.values() if found.exceeds(allowed)]


def sample_configurations(
    model: RobotModel, rng: np.random.Generator, count: int
) -> Array:
    """Zero, corners of the limits, then random ones: (count, n).

    Zero and corners are left out where a mimic joint would break its own limit.

    Raises:
        UsageError: No configuration is asked for, or a joint does not vary over the
            sample (a premise of the check).
    """
    if count < 1:
        raise UsageError(f"{count} configurations: at least 1 is needed")
    fixed = list(islice(_special(model, rng), count))
    drawn = model.random_configurations(rng, count - len(fixed))
    sample = np.array([*fixed, *drawn])
    still = np.flatnonzero(np.ptp(sample, axis=0) == 0.0)
    if count > 1 and len(still):
        names = [model.joint_names[i] for i in still]
        raise UsageError(f"joints that do not vary in the sample: {', '.join(names)}")
    return sample


def cross_check(
    robot: RobotLike,
    configurations: ArrayLike,
    tolerances: Tolerances | None = None,
) -> CrossCheck:
    """Closed form, Pinocchio and yourdfpy about every frame of the paper.

    Args:
        robot: The loaded robot; without a closed form two sources remain.
        configurations: Joint positions in the order of the model, (k, n) or (n,).
        tolerances: What counts as the same.

    Raises:
        GeometryError: More than one configuration, and no frame moved.
    """
    allowed = Tolerances() if tolerances is None else tolerances
    qs = np.atleast_2d(np.array(configurations, dtype=np.float64))
    available, silent = _available(robot)
    remembered = {name: _Remembered(source, qs) for name, source in available.items()}
    worst = {
        (a, b): differences(remembered[a], remembered[b], qs)
        for a, b in combinations(available, 2)
    }
    at_first = {name: remembered[name](qs[0]) for name in available}
    frames = sources.compared_frames(robot)
    return CrossCheck(
        robot=robot.model.name,
        arguments=dict(robot.arguments),
        joint_names=robot.model.joint_names,
        q=tuple(float(v) for v in qs[0]),
        configurations=len(qs),
        moved_m=_moved(remembered["pinocchio"].all(), len(qs)),
        parameters=_parameters(robot),
        frames={f: {name: at_first[name][f] for name in available} for f in frames},
        worst=worst,
        tolerances=allowed,
        silent=silent,
    )


def to_json(result: CrossCheck) -> dict[str, Any]:
    """The result as JSON-ready values, as docs of `borecheck fk` describe."""
    return {
        "robot": result.robot,
        "arguments": dict(result.arguments),
        "q": dict(zip(result.joint_names, result.q, strict=True)),
        "configurations": result.configurations,
        "moved_m": result.moved_m,
        "parameters": dict(result.parameters),
        "frames": {
            frame: {
                source: said[source].tolist() if source in said else None
                for source in sources.SOURCES
            }
            for frame, said in result.frames.items()
        },
        "worst": {
            "position_m": result.position_m,
            "rotation_rad": result.rotation_rad,
        },
        "worst_by_frame": {
            f"{a} - {b}": {
                frame: {"position_m": d.position_m, "rotation_rad": d.rotation_rad}
                for frame, d in found.items()
            }
            for (a, b), found in result.worst.items()
        },
        "tolerances": {
            "position_m": result.tolerances.position_m,
            "rotation_rad": result.tolerances.rotation_rad,
        },
        "agree": not result.disagreements,
        "silent": dict(result.silent),
    }


class _Remembered:
    """A source asked once per configuration; the comparisons then read its answers."""

    def __init__(self, source: Placements, qs: Array) -> None:
        self._answers = {q.tobytes(): dict(source(q)) for q in qs}

    def __call__(self, q: Array) -> Mapping[str, Array]:
        return self._answers[q.tobytes()]

    def all(self) -> list[dict[str, Array]]:
        return list(self._answers.values())


def _available(robot: RobotLike) -> tuple[dict[str, Placements], dict[str, str]]:
    found: dict[str, Placements] = {}
    silent = {}
    closed = sources.analytic(robot)
    if closed is None:
        silent["analytic"] = "this robot has no closed form"
    else:
        found["analytic"] = closed
    found["pinocchio"] = sources.pinocchio(robot)
    found["yourdfpy"] = sources.yourdfpy(robot)
    return found, silent


def _parameters(robot: RobotLike) -> dict[str, float]:
    description = robot.description
    if description is None or description.dimensions is None:
        return {}
    named: Callable[..., dict[str, float]] = hook(description.dimensions)
    return named(**sources.closed_form_arguments(robot))


def _moved(placements: list[dict[str, Array]], count: int) -> float:
    """Largest extent of the box that one frame's origin moved in, [m]."""
    origins = np.array([[T[:3, 3] for T in said.values()] for said in placements])
    moved = float(np.linalg.norm(np.ptp(origins, axis=0), axis=-1).max())
    turned = np.array([[T[:3, :3] for T in said.values()] for said in placements])
    if count > 1 and moved == 0.0 and np.ptp(turned, axis=0).max() == 0.0:
        raise GeometryError("no frame moved over the sample: nothing was checked")
    return moved


def _special(model: RobotModel, rng: np.random.Generator) -> Iterable[Array]:
    """Zero and corners, as far as every joint is then within its limits."""
    lower = np.where(np.isfinite(model.lower), model.lower, -np.pi)
    upper = np.where(np.isfinite(model.upper), model.upper, np.pi)
    n = len(lower)
    if 2**n <= MAX_CORNERS:
        picks = np.array(list(product([False, True], repeat=n)))
    else:
        picks = rng.integers(0, 2, (MAX_CORNERS, n)).astype(bool)
    for q in [np.zeros(n), *np.where(picks, upper, lower)]:
        try:
            yield model.check_limits(q)
        except JointLimitError:
            continue


def _same_frames(one: Mapping[str, Array], other: Mapping[str, Array]) -> None:
    for extra in sorted(set(one) ^ set(other)):
        knows = one if extra not in one else other
        raise UnknownNameError("frame", extra, sorted(knows))


def _difference(frame: str, q: Array, T: Array, T_other: Array) -> Disagreement:
    at = tuple(float(v) for v in q)
    distance = float(np.linalg.norm(T[:3, 3] - T_other[:3, 3]))
    return Disagreement(
        frame, distance, rotation_angle(T[:3, :3], T_other[:3, :3]), at, at
    )


def _larger(one: Disagreement, other: Disagreement) -> Disagreement:
    """The larger of each kind; NaN counts as larger than anything."""
    p = max(one, other, key=lambda d: _size(d.position_m))
    r = max(one, other, key=lambda d: _size(d.rotation_rad))
    return Disagreement(
        one.frame, p.position_m, r.rotation_rad, p.q_position, r.q_rotation
    )


def _size(value: float) -> float:
    return np.inf if np.isnan(value) else value


def _largest(sizes: list[float]) -> float:
    return float(np.max(sizes))  # unlike with max(), NaN wins
