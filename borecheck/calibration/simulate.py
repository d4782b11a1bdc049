"""Calibration data of an arm that is not quite as drawn, and its true parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines, positions
from borecheck.calibration.link_parameters import parameters_to_lines
from borecheck.calibration.measurements import Measurements
from borecheck.calibration.sample_sets import VARIATION, Sweep, sweeps
from borecheck.calibration.sensors import Exact, Sensor
from borecheck.calibration.serial_arm import SerialArm
from borecheck.calibration.setup import CalibrationSetup, sensors_of, target_at_zero
from borecheck.errors import UnknownNameError

Array = NDArray[np.float64]

# How far a true arm is from its drawing, [Heikkila2010] section 4: "max deviations from
# nominal parameter values were less than 1.5 mm"; twice that, and half a degree.
LENGTH_DEVIATION = 3e-3
ANGLE_DEVIATION = np.radians(0.5)


@dataclass(frozen=True, eq=False)
class TrueArm:
    """An arm as built: what a calibration should find.

    Attributes:
        parameters: By name, [m] and [rad].
        lines: Its axes at zero.
        target: Where the target is at zero, in the world frame, (3,), [m].
    """

    parameters: Mapping[str, float]
    lines: Lines
    target: Array


def true_arm(
    arm: SerialArm,
    target: Sequence[float],
    rng: np.random.Generator,
    length: float = LENGTH_DEVIATION,
    angle: float = ANGLE_DEVIATION,
) -> TrueArm:
    """An arm whose parameters are off by up to so much each.

    Args:
        arm: The arm as drawn.
        target: The target in the frame of the tip link, (3,), [m].
        rng: Source of the deviations.
        length: Largest deviation of a length [m].
        angle: Largest deviation of an angle [rad].
    """
    values = dict(arm.nominal)
    for name in arm.forms.names:
        size = angle if name in arm.forms.angles else length
        values[name] += float(rng.uniform(-size, size))
    points, directions = parameters_to_lines(arm.forms, values)
    return TrueArm(values, Lines(points, directions), target_at_zero(arm, target))


def measure(
    arm: SerialArm,
    true: TrueArm,
    plan: Sequence[Sweep],
    rng: np.random.Generator,
    sensor: Mapping[str, Sensor],
    pulses: Mapping[str, float],
) -> Measurements:
    """What the devices would have recorded.

    The joint that turns is off by -1, 0 or +1 pulse ([Heikkila2010] section 4); a joint
    that stands still keeps the same pulse throughout, which its axis absorbs.

    Args:
        arm: The arm as drawn: names and order.
        true: The arm as built.
        plan: Commanded joint values.
        rng: Source of the noise.
        sensor: Device by joint; "" for all others.
        pulses: Encoder resolution by joint, [rad]; 0 for those not named.
    """
    q, points, moving = [], [], []
    for part in plan:
        pulse = pulses.get(part.joint, 0.0)
        off = np.zeros_like(part.q)
        if part.joint:
            joint = arm.joint_names.index(part.joint)
            off[:, joint] = pulse * rng.integers(-1, 2, len(part.q))
        exact = positions(true.lines, part.q + off, true.target)
        device = sensor.get(part.joint, sensor.get("", Exact()))
        q.append(part.q)
        points.append(device.measure(exact, rng))
        moving += [part.joint] * len(part.q)
    return Measurements(np.vstack(q), np.vstack(points), tuple(moving), "simulated")


def simulate(
    arm: SerialArm,
    setup: CalibrationSetup,
    samples: int,
    noise: str,
    rng: np.random.Generator,
    variation: float = VARIATION,
) -> tuple[Measurements, TrueArm]:
    """Data of a random arm and the arm itself.

    Args:
        arm: The arm as drawn.
        setup: How it is measured.
        samples: For each joint.
        noise: "none" or the name of a device (`sensors_of`).
        rng: Source of everything random.
        variation: Half width of the variation about the base points, [rad].
    """
    true = true_arm(arm, setup.target, rng)
    target = target_at_zero(arm, setup.target)
    plan = sweeps(arm, samples, rng, target, variation, setup.visible)
    available = {"none": {}, **sensors_of(arm, setup)}
    if noise not in available:
        raise UnknownNameError("noise", noise, available)
    pulses = {} if noise == "none" else setup.pulses
    sensor = available[noise]
    return measure(arm, true, plan, rng, sensor, pulses), true
