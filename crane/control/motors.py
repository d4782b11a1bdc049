"""The loop with its motors: PD at 1 kHz under the local controller, eqs. (27) to (31).

Motors bear their load without giving way: the weight is balanced by springs (section
III-A), and what a PD leaves of the rest is what the local controller takes out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crane.control.controller import Gains, updated
from crane.control.filter import PERIOD, WEIGHT, ComplementaryFilter
from crane.control.loop import Run, as_run, begun_at, poses
from crane.control.plant import Plant, followed
from crane.encoders import CAPSTAN, JOINT_STEP, rounded
from crane.refusals import refuse_unless_positive
from crane.transmission import transmission

Array = NDArray[np.float64]

STEPS_OF_ENCODERS = JOINT_STEP * np.array([1.0, 1.0, 1.0, 0.5 * CAPSTAN])


@dataclass(frozen=True)
class Motors:
    """PD of eq. (31), per unit of a motor's inertia; all assumed.

    Attributes:
        bandwidth: Root of K_p / J, [rad/s]; the printed gains are in counts, and lost.
        damping: Of the PD's pair of poles; 1 does not overshoot.
        ticks: Motor periods in one of the controller: 50 ms, as trackers allow.
    """

    bandwidth: float = 2.0 * float(np.pi) * 30.0
    damping: float = 1.0
    ticks: int = 50

    def __post_init__(self) -> None:
        """Refuses what is no PD.

        Raises:
            ValueError: A number is not positive or not finite.
        """
        refuse_unless_positive(
            bandwidth=self.bandwidth, damping=self.damping, ticks=self.ticks
        )


def sampled_loop(
    plant: Plant,
    targets: Array,
    q0: ArrayLike,
    gains: Gains,
    motors: Motors = Motors(),
    *,
    rounding: bool = True,
    rng: np.random.Generator | None = None,
) -> Run:
    """The closed loop, motor by motor.

    Args:
        plant: The arm.
        targets: (steps + 1, 4, 4), one a period of the controller.
        q0: Where it begins at rest, (8,).
        gains: Of the local controller.
        motors: The PD.
        rounding: Whether joint encoders have 14 bits.
        rng: Of the tracker's noise.

    Raises:
        ValueError: Poses or a configuration that are none, or gains of several loops.
    """
    targets, q0 = poses(targets), begun_at(q0)
    if np.size(gains.K_ee) != 1:
        raise ValueError(f"K_ee {np.shape(gains.K_ee)}: motors are those of one loop")
    drive = _Drive.at_rest(plant, q0, motors, rounding)
    q_sp = q0[None]
    preferred = q_sp[0].copy()
    placed, qs = [], []
    for k in range(len(targets) - 1):
        T = plant.placement(drive.joints[None])
        placed.append(T)
        qs.append(drive.joints[None].copy())
        T_hat, now, then = (
            plant.seen(T, rng),
            targets[k : k + 1],
            targets[k + 1 : k + 2],
        )
        q_hat = drive.estimate[None]
        q_sp = updated(q_sp, q_hat, T_hat, now, gains, preferred, then)
        drive.run(q_sp[0])
    return as_run(np.array(placed), np.array(qs), targets)


@dataclass
class _Drive:
    """Motors, joints and their estimate, as they go on."""

    believed: Array
    true: Array
    plant: Plant
    motors: Motors
    filter: ComplementaryFilter
    rounding: bool
    m: Array
    speed: Array
    joints: Array
    zero: Array
    stretch: Array

    @classmethod
    def at_rest(
        cls, plant: Plant, q: Array, motors: Motors, rounding: bool
    ) -> "_Drive":
        believed = np.array(transmission().matrix)
        stretch = plant.stretched(q[None])[0] - q
        filter_ = ComplementaryFilter(believed[4:, 4:], q[4:].copy(), WEIGHT, PERIOD)
        zero = np.zeros(8)
        true = np.array(plant.true_coupling().matrix)
        # the load hangs on from the start: encoders were zeroed with it
        return cls(
            believed, true, plant, motors, filter_, rounding, zero, zero, q, q, stretch
        )

    @property
    def estimate(self) -> Array:
        """q^ of eq. (30): stages by their gear ratios, cables by the filter."""
        base = self.zero[:4] + (self.believed @ self.m)[:4]
        return np.concatenate([base, self.filter.estimate])

    def run(self, q_sp: Array) -> None:
        """One period of the local controller."""
        w, z = self.motors.bandwidth, self.motors.damping
        back = np.linalg.inv(self.believed)
        # joints hang from where their cables pull; how much is that of this period
        now = self.plant.stretched(self.joints[None])[0] - self.joints
        more = now - self.stretch
        for _ in range(self.motors.ticks):
            pull = w * w * back @ (q_sp - self.estimate) - 2.0 * z * w * self.speed
            self.speed = self.speed + PERIOD * pull
            self.m = self.m + PERIOD * self.speed
            hanging = self.true @ self.m + self.zero + more
            self.joints = followed(self.joints, hanging, self.plant.play)
            read = self.joints[4:]
            if self.rounding:
                read = rounded(read, STEPS_OF_ENCODERS)
            self.filter.step(self.speed[4:], read)
