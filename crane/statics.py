"""What CRANE's arm gives way, and what its idlers bear; numpy only.

[CRANE] eqs. (1) to (5), and the end-effector's stiffness at any configuration from the
tube's and the cables' through the Jacobian, of which eq. (3) is one direction. Of the
paper's numbers only the load of 5 N, the dial's 0.03 mm and its 5 trials survive; every
other stands here with the reason why it is assumed.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck_models.closed_form import number, values
from crane.dimensions import LIMITS
from crane.kinematics import forward
from crane.refusals import refuse_no_numbers, refuse_unless_positive, unit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mechanics:
    """Lengths [m], forces [N], moduli [Pa]."""

    outer: float = number(0.038, "tube, after the CAD file's name of the precursor")
    inner: float = number(0.034, "likewise, ID 34 mm")
    free_length: float = number(0.93, "assumed: slide to pitch axis, as the meshes are")
    modulus: float = number(37e9, "assumed: wound CFRP along the tube, held softly")
    shear: float = number(15e9, "assumed: plies at +-45 deg among them")
    cable_modulus: float = number(100e9, "assumed: steel rope, on its metal's area")
    cable_area: float = number(1.07e-6, "assumed: 1/16 in rope 7x19, 54 % metal")
    cable_length: float = number(1.05, "assumed: tube, slide and the drums")
    strands: float = number(2.0, "assumed: a pretensioned loop, both sides carry")
    idler_rating: float = number(180.0, "R2-5's static load from memory, unverified")
    load: float = number(5.0, "section III-A3: 5 N")
    dial: float = number(0.03e-3, "section III-A3: resolution of the dial indicator")
    trials: float = number(5.0, "section III-A3: across 5 trials")

    def __post_init__(self) -> None:
        """Refuses numbers of which no arm is made.

        Raises:
            ValueError: One is not finite or not positive, or the tube has no wall.
        """
        refuse_unless_positive(**values(self))
        if not self.inner < self.outer:
            raise ValueError(f"a tube {self.outer} m wide has no bore of {self.inner}")


# Diameter of the capstan that ends each joint's cable, [m]: a public precursor's, as
# the stand-in for C_cable (transmission.py); q8's cable runs straight.
PULLEYS: Mapping[str, float] = MappingProxyType({"q5": 0.028, "q6": 0.028, "q7": 0.016})


@dataclass(frozen=True)
class Idler:
    """A pulley that turns a cable aside by an angle that depends on one joint.

    Attributes:
        joint: Its joint.
        wrap: phi_0 of the cable at joint zero, [rad].
        sign: +1 or -1: whether the cable winds on or off as the joint moves.
        carries: The joint whose cable it turns.
    """

    joint: str
    wrap: float
    sign: float
    carries: str


# Assumed, the paper gives no phi_0: cables of later joints pass each axis in an S of
# 90 deg, the forward and the return one on either side; q7's pair is wrapped by 150
# deg to come back to the tip, and that of q8 by 60 deg.
IDLERS = (
    *(Idler("q5", np.pi / 2, s, c) for c in ("q6", "q7", "q8") for s in (1.0, -1.0)),
    *(Idler("q6", np.pi / 2, s, c) for c in ("q7", "q8") for s in (1.0, -1.0)),
    Idler("q7", np.radians(150.0), 1.0, "q8"),
    Idler("q7", np.radians(150.0), -1.0, "q8"),
)


@dataclass(frozen=True)
class Rating:
    """The highest tension that an idler allows over its joint's range, eq. (5).

    Attributes:
        idler: Which.
        tension: T_max, [N].
        at: Joint position where it is least, [rad].
        inside: Whether that is within the range and not at one of its ends.
        ends: What a look at the two ends alone would have allowed, [N].
    """

    idler: Idler
    tension: float
    at: float
    inside: bool
    ends: float


def cable_stretch(
    force: ArrayLike, length: ArrayLike, area: ArrayLike, modulus: ArrayLike
) -> Array:
    """DL = F L / (A E), [m]; eq. (1).

    Raises:
        ValueError: A number is not finite; a length, area or modulus not positive.
    """
    refuse_no_numbers(force=force)
    refuse_unless_positive(length=length, area=area, modulus=modulus)
    stiff = np.asarray(area, float) * np.asarray(modulus, float)
    return np.asarray(np.asarray(force, float) * np.asarray(length, float) / stiff)


def joint_deflection(stretch: ArrayLike, diameter: ArrayLike) -> Array:
    """Dtheta = 2 dL / D, [rad], D of the capstan that ends the cable; eq. (2).

    Raises:
        ValueError: A number is not finite, or a diameter not positive.
    """
    refuse_no_numbers(stretch=stretch)
    refuse_unless_positive(diameter=diameter)
    return np.asarray(2.0 * np.asarray(stretch, float) / np.asarray(diameter, float))


def series(*stiffness: float) -> float:
    """1/k = 1/k_1 + 1/k_2 + ...; eq. (3).

    A part may be rigid (infinite), or give way to anything (0): so does the whole then.

    Raises:
        ValueError: A stiffness is negative or no number.
    """
    if not all(k >= 0.0 for k in stiffness):
        raise ValueError(f"a stiffness of {min(stiffness)!r} is none: {stiffness}")
    if 0.0 in stiffness:
        return 0.0
    least = min(stiffness, default=float("inf"))
    if least == float("inf"):
        return least
    # in parts of the softest: no quotient overflows
    return least / sum(least / k for k in stiffness)


def idler_load(tension: ArrayLike, wrap: ArrayLike) -> Array:
    """F_n = 2 T sin(phi / 2), [N]: what presses on the bearing; eq. (4).

    Raises:
        ValueError: A number is not finite.
    """
    refuse_no_numbers(tension=tension, wrap=wrap)
    return np.asarray(
        2.0 * np.asarray(tension, float) * np.abs(np.sin(0.5 * np.asarray(wrap)))
    )


def rating(
    idler: Idler,
    bearing: float,
    limits: Mapping[str, tuple[float, float]] = LIMITS,
) -> Rating:
    """Eq. (5) of one idler over the whole range of its joint.

    Its load is greatest where the cable is turned right round, at a wrap of 180 deg:
    often inside the range, which its ends do not show.

    Args:
        idler: Which.
        bearing: Rated load F_rated, [N].
        limits: Of the joints, [rad].

    Raises:
        ValueError: The wrap would become negative: the cable leaves the pulley; or the
            bearing bears nothing, or a limit is no number.
    """
    refuse_unless_positive(bearing=bearing)
    low, high = limits[idler.joint]
    refuse_no_numbers(lower=low, upper=high, wrap=idler.wrap)
    wraps = [idler.wrap + idler.sign * q for q in (low, high)]
    if min(wraps) < 0.0:
        raise ValueError(
            f"{idler.joint}: the wrap angle falls to {np.degrees(min(wraps)):.1f} deg "
            "within its limits; below 0 the cable leaves the idler"
        )
    first = np.ceil((min(wraps) - np.pi) / (2.0 * np.pi))
    turned = np.pi + 2.0 * np.pi * first  # the next wrap at which all load is met
    inside = bool(min(wraps) < turned < max(wraps))
    loads = idler_load(1.0, wraps)
    worst = int(np.argmax(loads))
    at = idler.sign * (turned - idler.wrap) if inside else (low, high)[worst]
    with np.errstate(divide="ignore"):
        ends = float(bearing / loads.max())
        tension = float(bearing / idler_load(1.0, turned)) if inside else ends
    return Rating(idler, tension, float(at), inside, ends)


def ratings(
    mechanics: Mechanics = Mechanics(),
    idlers: tuple[Idler, ...] = IDLERS,
    limits: Mapping[str, tuple[float, float]] = LIMITS,
) -> dict[str, float]:
    """What each cable-driven joint may carry: r_i T_max [Nm], of q8 T_max [N].

    T_max is the least over all idlers of all joints, as eq. (5) takes it.
    """
    tension = min(rating(i, mechanics.idler_rating, limits).tension for i in idlers)
    carried = {joint: 0.5 * D * tension for joint, D in PULLEYS.items()}
    return carried | {"q8": tension}


def joint_stiffness(mechanics: Mechanics = Mechanics()) -> dict[str, float]:
    """Of the cable-driven joints, their motors held: [Nm/rad], of q8 [N/m].

    A torque tau pulls a cable with 2 tau / D; eqs. (1) and (2) give the rest. The base
    joints do not give way, "due to the transmission's high stiffness" (section V-D).
    """
    m = mechanics
    one_newton = float(
        cable_stretch(1.0, m.cable_length, m.cable_area, m.cable_modulus) / m.strands
    )
    found = {
        joint: 1.0 / float(joint_deflection(2.0 / D * one_newton, D))
        for joint, D in PULLEYS.items()
    }
    return found | {"q8": 1.0 / one_newton}


def tube_compliance(mechanics: Mechanics = Mechanics()) -> Array:
    """Of the tube's end, along x of the base: force and moment to shift and turn.

    Returns:
        (6, 6), x y z [m/N, m/Nm] then about x y z: Euler and Bernoulli's beam, held at
        the slide, [1/N ...].
    """
    m = mechanics
    area = 0.25 * np.pi * (m.outer**2 - m.inner**2)
    moment = np.pi / 64.0 * (m.outer**4 - m.inner**4)
    L, EI = m.free_length, m.modulus * moment
    C = np.zeros((6, 6))
    C[0, 0] = L / (m.modulus * area)
    C[1, 1] = C[2, 2] = L**3 / (3.0 * EI)
    C[3, 3] = L / (m.shear * 2.0 * moment)
    C[4, 4] = C[5, 5] = L / EI
    C[1, 5] = C[5, 1] = L**2 / (2.0 * EI)  # a force along y turns about +z
    C[2, 4] = C[4, 2] = -(L**2) / (2.0 * EI)
    return C


def compliance(
    q: ArrayLike, mechanics: Mechanics = Mechanics(), frame: str = "8"
) -> tuple[Array, Array]:
    """How the needle's frame gives way to a force and a moment on it.

    Args:
        q: Configuration (8,).
        mechanics: The numbers.
        frame: "8" or "needle_tip".

    Returns:
        (6, 6) of the tube and (6, 6) of the cables, in axes of I at the frame's origin:
        shift and turn by force [N] and moment [Nm]. Their sum is the whole.

    Raises:
        ValueError: q is not eight finite numbers.
    """
    q = np.asarray(q, float)
    if q.shape != (8,):
        raise ValueError(f"a configuration is q1..q8, (8,), not {q.shape}")
    refuse_no_numbers(q=q)
    T = forward(q)
    point = T[frame][:3, 3]
    lever = np.eye(6)
    lever[:3, 3:] = -_cross(point - T["4"][:3, 3])
    axes = np.zeros((6, 6))
    axes[:3, :3] = axes[3:, 3:] = T["W"][:3, :3]
    # a moment at the tube's end is the force at the needle times its lever
    tube = lever @ axes @ tube_compliance(mechanics) @ axes.T @ lever.T
    cables = np.zeros((6, 6))
    for joint, stiffness in joint_stiffness(mechanics).items():
        axis, at = T[joint[1]][:3, 2], T[joint[1]][:3, 3]
        twist = np.concatenate([np.cross(axis, point - at), axis])
        if joint == "q8":
            twist = np.concatenate([axis, np.zeros(3)])
        cables += np.outer(twist, twist) / stiffness
    return tube, cables


@dataclass(frozen=True)
class LoadTest:
    """A force at the needle guide, read with a dial: section III-A3's experiment.

    Attributes:
        link: Deflection by the tube alone along the force, [m]: what is left with the
            joint controller, which sees the joints' encoders.
        both: By tube and cables, [m]: without it.
        stiffness_with: Load over deflection with the controller, [N/m].
        stiffness_without: Likewise without.
        reading: Half of the dial's step, over the root of the trials: the least
            standard uncertainty of both deflections, [m].
    """

    link: float
    both: float
    stiffness_with: float
    stiffness_without: float
    reading: float


def load_test(
    q: ArrayLike, direction: ArrayLike, mechanics: Mechanics = Mechanics()
) -> LoadTest:
    """The 5 N test at a configuration.

    Args:
        q: Configuration (8,); the paper's is drawn, not told.
        direction: Of the force, in I, (3,), of any length but 0.
        mechanics: The numbers, the load among them.

    Raises:
        ValueError: The direction has no length or is not finite, or q is none.
    """
    f = unit(direction)
    tube, cables = compliance(q, mechanics)
    link, cable = float(f @ tube[:3, :3] @ f), float(f @ cables[:3, :3] @ f)
    whole = series(1.0 / link, 1.0 / cable) if cable > 0.0 else 1.0 / link
    # a reading is even within a step: its deviation is a step by the root of 12
    reading = mechanics.dial / np.sqrt(12.0 * mechanics.trials)
    load = mechanics.load
    return LoadTest(load * link, load / whole, 1.0 / link, whole, float(reading))


def _cross(v: Array) -> Array:
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
