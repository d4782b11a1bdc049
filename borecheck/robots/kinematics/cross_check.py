"""Closed form, Pinocchio and yourdfpy about every frame of a robot, compared."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError
from borecheck.robots.description import hook, plugin_hook
from borecheck.robots.kinematics import sources
from borecheck.robots.kinematics.agreement import Disagreement, Tolerances, differences
from borecheck.robots.kinematics.sources import Placements, RobotLike

Array = NDArray[np.float64]


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
        parameters=parameters(robot),
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


def parameters(robot: RobotLike) -> dict[str, float]:
    """The closed form's dimensions by name; none of a robot without the hook."""
    description = robot.description
    if description is None or description.dimensions is None:
        return {}
    dimensions = plugin_hook(description, "dimensions", hook, sources.not_dimensions)
    named: dict[str, float] = dimensions(**sources.closed_form_arguments(robot))
    return named


def _moved(placements: list[dict[str, Array]], count: int) -> float:
    """Largest extent of the box that one frame's origin moved in, [m]."""
    origins = np.array([[T[:3, 3] for T in said.values()] for said in placements])
    moved = float(np.linalg.norm(np.ptp(origins, axis=0), axis=-1).max())
    turned = np.array([[T[:3, :3] for T in said.values()] for said in placements])
    if count > 1 and moved == 0.0 and np.ptp(turned, axis=0).max() == 0.0:
        raise GeometryError("no frame moved over the sample: nothing was checked")
    return moved


def _largest(sizes: list[float]) -> float:
    return float(np.max(sizes))  # unlike with max(), NaN wins
