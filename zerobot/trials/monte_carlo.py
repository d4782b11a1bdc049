"""The experiment repeated many times with its disturbances, in the model.

Per approach (both stops) the tip is picked anew, as the papers' sequence has it (step
3); encoders and caliper err at every stop. The *real* robot is the parallelogram with
the arm bent; it is driven until the caliper shows 25 or 15 mm. The *model* is stiff,
stands where the encoders say, and is shifted so that its tip at q4 = q5 = 0 lies where
it was picked (that much of the bending the calibration takes away). What is kept is the
model's clearance; every margin can be judged from it.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.contact import clearance
from borecheck.robots.robot import Robot, load_robot
from borecheck.robots.scene import Scene, load_scene
from zerobot.trials.bench import Setup
from zerobot.trials.errors import Sources, bent, tip_sag
from zerobot.trials.published import DISTANCES_MM
from zerobot.trials.stops import STOP_TOLERANCE

Array = NDArray[np.float64]

CHUNK = 20
SLOPE_STEP = 1e-4

_JOINT = {"X": 1, "Y": 2, "Z": 0}
_WAY = {"X": -1.0, "Y": -1.0, "Z": 1.0}


@dataclass(frozen=True, eq=False)
class RealStop:
    """Where the bent robot stands when the true distance is as measured.

    Attributes:
        q: Joint positions, (6,).
        step: Change of q that brings it nearer by 1 m of travel, (6,).
        slope: Loss of true distance per travel.
    """

    q: Array
    step: Array
    slope: float


class Experiment:
    """Real robot, model and gantry.

    Args:
        sources: The disturbances.
        mount: The mounting side.
        level: Level of detail of all meshes.
    """

    def __init__(
        self, sources: Sources, mount: str = "+90", level: str = "coarse"
    ) -> None:
        self.sources = sources
        self.mount = mount
        self.sign = math.copysign(1.0, float(mount))
        self.real: Robot = load_robot("zerobot", mount=mount, level=level)
        self.model: Robot = load_robot(
            "zerobot", mount=mount, level=level, level_parts=sources.level_parts
        )
        self.scene: Scene = load_scene(
            "ct_gantry", couch="no", patient="no", level=level
        )
        self.calibrated_sag = tip_sag(sources.beam, np.zeros(6), mount)

    def true_distance(self, q: Array) -> float:
        """Distance of the bent robot to the gantry, [m]."""
        placed = bent(
            self.real.placements(q),
            self.sources.beam,
            float(q[3]),
            float(q[4]),
            self.sign,
        )
        return self._distance(self.real, placed)

    def model_distance(self, q: Array, shift: Array) -> float:
        """What the model, moved by `shift`, says at the encoders' q, [m]."""
        T = np.eye(4)
        T[:3, 3] = shift
        placed = {name: T @ P for name, P in self.model.placements(q).items()}
        return self._distance(self.model, placed)

    def _distance(self, robot: Robot, placed: dict[str, Array]) -> float:
        found, _ = clearance.to_obstacles(robot, self.scene, placed)
        assert found is not None  # there is a gantry
        return found.distance

    def real_stop(self, setup: Setup, distance_mm: int) -> RealStop:
        """The bent robot at the stop, from the stiff one's by secant steps."""
        axis = setup.approach.axis
        step = np.zeros(6)
        step[_JOINT[axis]] = setup.sign * _WAY[axis]
        q = setup.stops[distance_mm].q.copy()
        slope = self._slope(q, step)
        for _ in range(50):
            gap = self.true_distance(q) - 1e-3 * distance_mm
            if abs(gap) < STOP_TOLERANCE:
                break
            q = q + gap / slope * step
            slope = self._slope(q, step)
        return RealStop(q, step, slope)

    def _slope(self, q: Array, step: Array) -> float:
        ahead = self.true_distance(q + SLOPE_STEP * step)
        behind = self.true_distance(q - SLOPE_STEP * step)
        return max((behind - ahead) / (2.0 * SLOPE_STEP), 0.05)


def undisturbed(experiment: Experiment, stops: Sequence[Sequence[RealStop]]) -> Array:
    """Model clearance (approaches, 2) with bending and rods but nothing random, [m]."""
    return np.array(
        [
            [experiment.model_distance(s.q, experiment.calibrated_sag) for s in pair]
            for pair in stops
        ]
    )


def real_stops(
    experiment: Experiment, setups: Sequence[Setup]
) -> list[tuple[RealStop, ...]]:
    """Both stops of every approach, for the bent robot."""
    return [
        tuple(experiment.real_stop(setup, d) for d in DISTANCES_MM) for setup in setups
    ]


def draw(
    experiment: Experiment,
    stops: Sequence[Sequence[RealStop]],
    rng: np.random.Generator,
) -> Array:
    """Model clearances (approaches, 2) of one repetition of the experiment, [m]."""
    s = experiment.sources
    said = np.zeros((len(stops), len(DISTANCES_MM)))
    for i, pair in enumerate(stops):
        pick = rng.uniform(-1.0, 1.0, 3) * [s.slice, s.pick, s.pick]
        for j, (stop, distance_mm) in enumerate(zip(pair, DISTANCES_MM, strict=True)):
            oblique = math.cos(s.oblique * rng.standard_normal())
            true = 1e-3 * distance_mm * oblique + s.caliper * rng.standard_normal()
            q = stop.q + (1e-3 * distance_mm - true) / stop.slope * stop.step
            q = q + rng.standard_normal(6) * [*[s.stage] * 3, s.angle, s.angle, 0.0]
            said[i, j] = experiment.model_distance(q, experiment.calibrated_sag + pick)
    return said


def chunks(seed: int, count: int) -> Iterator[tuple[int, int, np.random.Generator]]:
    """(number, draws, generator) of each chunk; the same for any number of cores."""
    total = math.ceil(count / CHUNK)
    children = np.random.SeedSequence(seed).spawn(total)
    for i, child in enumerate(children):
        draws = min(CHUNK, count - i * CHUNK)
        yield i, draws, np.random.default_rng(child)


def run_chunk(
    experiment: Experiment,
    stops: Sequence[Sequence[RealStop]],
    draws: int,
    rng: np.random.Generator,
) -> Array:
    """Model clearances (draws, approaches, 2), [m]."""
    return np.array([draw(experiment, stops, rng) for _ in range(draws)])


def interval(successes: int, count: int, level: float = 0.95) -> tuple[float, float]:
    """Exact (Clopper-Pearson) interval of a probability."""
    from scipy.stats import beta  # 0.3 s, and only studies need it

    tail = (1.0 - level) / 2.0
    low = beta.ppf(tail, successes, count - successes + 1) if successes else 0.0
    rest = count - successes
    high = beta.ppf(1.0 - tail, successes + 1, rest) if rest else 1.0
    return float(low), float(high)
