"""The calibration study of [Heikkila2010] section 4, repeated: Monte Carlo by the axes.

Many calibrations of one arm at once: target positions by the true axes, a device's
errors, Gauss-Newton for every axis, lines to the 24 parameters. Nominal arm, joint
limits and numbers are those of `mri_arm`; the estimation is `borecheck.calibration`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines, positions, turned
from borecheck.calibration.axis_by_axis import estimate
from borecheck.calibration.axis_line import discs_from_points, fit_axes
from borecheck.calibration.link_parameters import (
    lines_to_parameters,
)
from borecheck.calibration.measurements import Measurements
from borecheck.calibration.noise import seen_noise
from borecheck.calibration.refinement import refine
from borecheck.calibration.sample_sets import angles, attitude, base_points, split
from borecheck.calibration.sensors import LaserTracker, Sensor
from mri_arm.calibration_setup import voxels
from mri_arm.parameters import NAMES
from mri_arm.studies.accuracy import needle_in_hand, pulses, tip_of_parameters
from mri_arm.studies.simulated_arms import (
    JOINTS,
    TARGET,
    forms,
    lines_of,
    nominal_arm,
    true_parameters,
)

Array = NDArray[np.float64]

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
        exact = sweeps(case, lines, i, repetitions, rng)
        device = case.sensors.get(joint, case.sensors.get(""))
        seen = exact if device is None else device.measure(exact, rng)
        rough = np.broadcast_to(nominal_arm().lines.directions[i], (repetitions, 3))
        fit = fit_axes(seen, discs_from_points(seen, rough))
        points[:, i], directions[:, i] = fit.points, fit.directions
        iterations[:, i] = np.where(fit.converged, fit.iterations, -1)
    found = lines_to_parameters(forms(), points, directions)
    values = np.stack([found[name] for name in NAMES], axis=1)
    return Estimates(case, values, true, iterations)


def sweeps(
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
