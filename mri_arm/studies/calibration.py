"""The calibration study of [Heikkila2010] section 4, repeated: Monte Carlo by the axes.

Many calibrations of one arm at once: target positions by the true axes, a device's
errors, Gauss-Newton for every axis, lines to the 24 parameters. Nominal arm, joint
limits and numbers are those of `mri_arm`; the estimation is `borecheck.calibration`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines, positions, turned
from borecheck.calibration.axis_by_axis import estimate
from borecheck.calibration.axis_line import discs_at, discs_from_points, fit_axes
from borecheck.calibration.link_parameters import (
    LinkForms,
    choose_forms,
    lines_to_parameters,
    parameters_to_lines,
)
from borecheck.calibration.measurements import Measurements
from borecheck.calibration.noise import seen_noise
from borecheck.calibration.refinement import refine
from borecheck.calibration.sample_sets import angles, attitude, base_points, split
from borecheck.calibration.sensors import LaserTracker, Sensor
from borecheck.calibration.serial_arm import SerialArm
from mri_arm.calibration_setup import voxels
from mri_arm.dimensions import LIMITS
from mri_arm.parameters import ANGLES, NAMES, nominal
from mri_arm.studies.accuracy import needle_in_hand, pulses, tip_of_parameters

Array = NDArray[np.float64]

JOINTS = tuple(f"q{i}" for i in range(1, 7))

# Where the target is in frame 6 [m]: off all axes of the wrist; not published, assumed.
TARGET = (0.20, 0.25, -0.20)

# "small random variation", section 4; the paper gives no figure. 0.05 deg moves the
# target by one voxel, so that rounding stays rounding; the study varies it.
VARIATION_DEG = 0.05

THIRD = 2.0 * np.pi / 3.0


@dataclass(frozen=True)
class CalibrationCase:
    """One simulated way to calibrate.

    Attributes:
        name: For tables.
        samples: For each joint, six numbers.
        sensors: Device by joint, "" for all others.
        variation_deg: Half width of the variation about the base points, [deg].
        full_circle: Base points 120 deg apart on every joint, limits ignored.
        best_attitude: Whether the joints below stand so that the disc is large; else
            all stand at zero.
        encoder_pulses: Whether the turning joint is off by -1, 0 or +1 pulse.
    """

    name: str
    samples: tuple[int, ...]
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    variation_deg: float = VARIATION_DEG
    full_circle: bool = False
    encoder_pulses: bool = True
    best_attitude: bool = False


@dataclass(frozen=True, eq=False)
class Estimates:
    """What many calibrations of one arm found.

    Attributes:
        case: The way.
        values: Parameters in the order of `NAMES`, (r, 24), [m] and [rad].
        true: Those of the arm, (24,).
        iterations: Gauss-Newton steps, (r, 6).
    """

    case: CalibrationCase
    values: Array
    true: Array
    iterations: NDArray[np.int64]

    @property
    def errors(self) -> Array:
        """Found minus true, (r, 24)."""
        return self.values - self.true


@dataclass(frozen=True)
class ConfidenceInterval:
    """A figure with its 95 % confidence interval."""

    value: float
    lower: float
    upper: float


def camera_cases() -> tuple[CalibrationCase, ...]:
    """Section 4, Fig. 7: 21, 42, 98, 182 samples; 182 with the better camera."""
    cases = [CalibrationCase(str(n), (n,) * 6, voxels()) for n in (21, 42, 98, 182)]
    return (*cases, CalibrationCase("182/0.75", (182,) * 6, voxels(0.75)))


def laser_case(sigmas: float = 3.0) -> CalibrationCase:
    """Section 4: 42 samples for joints 1 and 2, 21 for the others, +-0.036 mm."""
    reading = "3 sigma" if sigmas else "even"
    return CalibrationCase(
        f"laser, {reading}",
        (42, 42, 21, 21, 21, 21),
        {"": LaserTracker(sigmas=sigmas)},
        variation_deg=4.0,
    )


@lru_cache(maxsize=1)
def nominal_arm() -> SerialArm:
    """The arm as drawn, from the closed form's numbers: no URDF is read."""
    points = np.zeros((6, 3))
    values = nominal()
    height = values["d1"] + values["d2"]
    points[1, 2] = values["d1"]
    points[2:, 2] = height
    points[4:, 1] = values["d4"]
    directions = np.eye(3)[[2, 0, 0, 1, 0, 1]]
    frames = np.broadcast_to(np.eye(4), (6, 4, 4)).copy()
    frames[:, :3, 3] = points
    lower, upper = np.array(list(LIMITS.values()))[:6].T
    tip = frames[5].copy()
    lines = Lines(points, directions)
    return SerialArm("mri_arm", "W", "6", JOINTS, frames, lines, lower, upper, tip, {})


@lru_cache(maxsize=1)
def forms() -> LinkForms:
    """The paper's DH and Hayati forms."""
    lines = nominal_arm().lines
    return choose_forms(lines.points, lines.directions)


def true_parameters(
    rng: np.random.Generator, length: float = 1.5e-3, angle: float = np.radians(0.25)
) -> Array:
    """An arm off its drawing: up to 1.5 mm, as the real one was (section 4), (24,)."""
    size = np.array([angle if n in ANGLES else length for n in NAMES])
    drawn = np.array([nominal()[n] for n in NAMES])
    return np.asarray(drawn + rng.uniform(-size, size))


def lines_of(values: Array) -> Lines:
    """Axes at zero of parameters in the order of `NAMES`, (24,)."""
    points, directions = parameters_to_lines(
        forms(), dict(zip(NAMES, values, strict=True))
    )
    return Lines(points, directions)


def run(
    case: CalibrationCase, true: Array, repetitions: int, rng: np.random.Generator
) -> Estimates:
    """Calibrations of one arm, each with its own variation, pulses and noise.

    Args:
        case: The way.
        true: The arm's parameters, (24,).
        repetitions: How many.
        rng: Source of everything random.
    """
    lines = lines_of(true)
    points = np.empty((repetitions, 6, 3))
    directions = np.empty((repetitions, 6, 3))
    iterations = np.empty((repetitions, 6), dtype=np.int64)
    for i, joint in enumerate(JOINTS):
        exact = _sweeps(case, lines, i, repetitions, rng)
        device = case.sensors.get(joint, case.sensors.get(""))
        seen = exact if device is None else device.measure(exact, rng)
        rough = np.broadcast_to(nominal_arm().lines.directions[i], (repetitions, 3))
        fit = fit_axes(seen, discs_from_points(seen, rough))
        points[:, i], directions[:, i] = fit.points, fit.directions
        iterations[:, i] = np.where(fit.converged, fit.iterations, -1)
    found = lines_to_parameters(forms(), points, directions)
    values = np.stack([found[name] for name in NAMES], axis=1)
    return Estimates(case, values, true, iterations)


def _sweeps(
    case: CalibrationCase,
    lines: Lines,
    i: int,
    repetitions: int,
    rng: np.random.Generator,
) -> Array:
    """True places of the target while joint i turns, (r, n, 3)."""
    arm = nominal_arm()
    target = np.add(arm.T_world_tip[:3, 3], TARGET)
    below = _attitude(case, i)
    resting = positions(lines, below, target)[0]
    bases = _bases(case, i)
    n = case.samples[i]
    width = np.radians(case.variation_deg)
    q = np.repeat(bases, split(n)) + rng.uniform(-width, width, (repetitions, n))
    if case.encoder_pulses:
        q = q + pulses()[i] * rng.integers(-1, 2, q.shape)
    flat = np.broadcast_to(resting, (q.size, 3))
    return turned(lines, i, q.ravel(), flat).reshape(repetitions, n, 3)


def _attitude(case: CalibrationCase, i: int) -> Array:
    """How the other joints stand, (6,), [rad]."""
    if not case.best_attitude:
        return np.zeros(6)
    arm = nominal_arm()
    return attitude(arm, i, np.add(arm.T_world_tip[:3, 3], TARGET))


def _bases(case: CalibrationCase, i: int) -> Array:
    if case.full_circle:
        return np.array([-THIRD, 0.0, THIRD])
    arm = nominal_arm()
    return base_points(arm.lower[i], arm.upper[i], np.radians(case.variation_deg))


def deviations(estimates: Estimates) -> dict[str, ConfidenceInterval]:
    """Standard deviation of every parameter with its interval, [m] and [rad].

    For even or rounded noise the chi-square interval of a normal one is a guide.
    """
    from scipy.stats import chi2

    r = len(estimates.values)
    s = estimates.values.std(axis=0, ddof=1)
    low = np.sqrt((r - 1) / chi2.ppf(0.975, r - 1))
    high = np.sqrt((r - 1) / chi2.ppf(0.025, r - 1))
    return {
        n: ConfidenceInterval(float(x), float(x * low), float(x * high))
        for n, x in zip(NAMES, s, strict=True)
    }


def biases(estimates: Estimates) -> dict[str, ConfidenceInterval]:
    """Mean error of every parameter with its interval, [m] and [rad]."""
    e = estimates.errors
    half = 1.96 * e.std(axis=0, ddof=1) / np.sqrt(len(e))
    return {
        n: ConfidenceInterval(float(m), float(m - h), float(m + h))
        for n, m, h in zip(NAMES, e.mean(axis=0), half, strict=True)
    }


def tip_errors(
    estimates: Estimates, rng: np.random.Generator, poses: int = 20
) -> Array:
    """Errors of the needle tip with the found parameters, (r, poses, 3), [m].

    As section 4: parameters as found, bias included, joint values off by a pulse.
    """
    arm = nominal_arm()
    tool = needle_in_hand("square")
    true = dict(zip(NAMES, estimates.true, strict=True))
    q = arm.random(rng, poses)
    exact = tip_of_parameters(q, true, tool)
    found = {n: estimates.values[:, i] for i, n in enumerate(NAMES)}
    errors = np.empty((len(estimates.values), poses, 3))
    for p in range(poses):
        off = pulses() * rng.integers(-1, 2, (len(errors), 6))
        errors[:, p] = tip_of_parameters(q[p] + off, found, tool) - exact[p]
    return errors


@dataclass(frozen=True)
class Convergence:
    """How often axes are found without noise.

    Attributes:
        arms: How many arms were tried.
        found: Share of arms of which all six axes were found.
        most: Most iterations among them.
        mean: Mean iterations among them.
        worst: Largest error of a parameter among them, [m] or [rad].
        failed: For each joint, how many were not found.
    """

    arms: int
    found: float
    most: int
    mean: float
    worst: float
    failed: tuple[int, ...]


def convergence(
    arms: int, length: float, angle: float, start: str, rng: np.random.Generator
) -> Convergence:
    """Noise-free calibrations of many arms, each off its drawing.

    Args:
        arms: How many.
        length: Largest deviation of a length from the drawing [m].
        angle: Largest deviation of an angle [rad].
        start: "nominal" as in the paper, or "points".
        rng: Source of the arms and the samples.
    """
    case = CalibrationCase("exact", (21,) * 6, variation_deg=4.0, encoder_pulses=False)
    truth = np.array([true_parameters(rng, length, angle) for _ in range(arms)])
    seen = np.empty((arms, 6, 21, 3))
    for a in range(arms):
        lines = lines_of(truth[a])
        for i in range(6):
            seen[a, i] = _sweeps(case, lines, i, 1, rng)[0]
    drawn = nominal_arm().lines
    points, directions = np.empty((arms, 6, 3)), np.empty((arms, 6, 3))
    iterations = np.empty((arms, 6), dtype=np.int64)
    for i in range(6):
        u = np.broadcast_to(drawn.directions[i], (arms, 3))
        p = np.broadcast_to(drawn.points[i], (arms, 3))
        first = discs_at(p, u, seen[:, i]) if start == "nominal" else None
        fit = fit_axes(seen[:, i], first or discs_from_points(seen[:, i], u))
        points[:, i], directions[:, i] = fit.points, fit.directions
        iterations[:, i] = np.where(fit.converged, fit.iterations, -1)
    found = lines_to_parameters(forms(), points, directions)
    errors = np.abs(np.stack([found[n] for n in NAMES], axis=1) - truth)
    right = _right(points, directions, truth) & (iterations > 0)
    whole = right.all(axis=1)
    return Convergence(
        arms,
        float(whole.mean()),
        int(iterations[whole].max(initial=0)),
        float(iterations[whole].mean()) if whole.any() else 0.0,
        float(errors[whole].max(initial=0.0)),
        tuple(int(x) for x in (~right).sum(axis=0)),
    )


def _right(points: Array, directions: Array, truth: Array) -> NDArray[np.bool_]:
    """Which axes are the true ones, (arms, 6)."""
    right = np.empty(points.shape[:2], dtype=bool)
    for a, values in enumerate(truth):
        lines = lines_of(values)
        off = np.cross(points[a] - lines.points, lines.directions)
        turn = np.cross(directions[a], lines.directions)
        far = np.maximum(np.abs(off).max(axis=1), np.abs(turn).max(axis=1))
        right[a] = far < 1e-9
    return right


def held_out_errors(
    case: CalibrationCase, rng: np.random.Generator, poses: int = 50
) -> tuple[float, float]:
    """Tip error at poses not used: axis by axis, and refined from it, rms [m].

    Both from the same data; the point is the target itself, whose place at zero each
    result has found, at poses all over the joints' ranges.
    """
    arm = nominal_arm()
    lines = lines_of(true_parameters(rng))
    target = np.add(arm.T_world_tip[:3, 3], TARGET)
    q, seen, moving = [], [], []
    for i, joint in enumerate(JOINTS):
        commanded = np.repeat(_attitude(case, i)[None], case.samples[i], axis=0)
        width = np.radians(case.variation_deg)
        commanded[:, i] = angles(rng, _bases(case, i), case.samples[i], width)
        true = commanded.copy()
        if case.encoder_pulses:
            true[:, i] += pulses()[i] * rng.integers(-1, 2, case.samples[i])
        exact = positions(lines, true, target)
        device = case.sensors.get(joint, case.sensors.get(""))
        q.append(commanded)
        seen.append(exact if device is None else device.measure(exact, rng))
        moving += [joint] * case.samples[i]
    data = Measurements(np.vstack(q), np.vstack(seen), tuple(moving))
    axes = estimate(arm, data)
    noise = seen_noise(axes.lines, data, JOINTS)
    better = refine(arm, data, axes.lines, noise=noise)
    elsewhere = arm.random(rng, poses)
    truth = positions(lines, elsewhere, target)
    errors = [
        positions(found.lines, elsewhere, found.target) - truth
        for found in (axes, better)
    ]
    first, second = (float(np.sqrt((e**2).sum(axis=1).mean())) for e in errors)
    return first, second
