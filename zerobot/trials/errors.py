"""What was wrong in the experiment, as numbers fixed before anything is computed.

[Matsuno2020] section 4.3 names two causes of the misses: the needle tip is picked in a
CT image in which the needle looks 5 mm wide, and the 900 mm long end-effector bends
under its weight. Encoders, caliper and the placing of the level rods are ours.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import axis_rotation
from zerobot.kinematics import forward

Array = NDArray[np.float64]

GRAVITY = 9.81

AT_THE_END = ("holder", "carriage", "needle")
ALONG_THE_BEAM = ("arm", "rod_a", "rod_b", "crank")


@dataclass(frozen=True)
class Beam:
    """The arm as equal parallel tubes, clamped at the drives, loaded at the end.

    None of it is published: assumed, as a light carbon arm of the papers' length would
    be built. `ALUMINIUM` is the other usual choice.

    Attributes:
        count: Tubes side by side, each bending by itself.
        outer: Outer diameter, [m].
        inner: Inner diameter, [m].
        young: Young's modulus, [Pa].
        shear: Shear modulus, [Pa].
        density: [kg/m^3].
        length: [m]; section 4.3: approximately 900 mm.
        load: Mass at the end: holder, needle and its drive, [kg].
        load_forward: Its centre of mass before the pivot, along the tilted x, [m].
        load_up: And above it, along the tilted z, [m].
    """

    count: int = 2
    outer: float = 0.025
    inner: float = 0.021
    young: float = 70e9
    shear: float = 5e9
    density: float = 1600.0
    length: float = 0.9
    load: float = 0.5
    load_forward: float = 0.04
    load_up: float = -0.02

    @property
    def bending(self) -> float:
        """E I of all tubes, [N m^2]."""
        area_moment = math.pi / 64.0 * (self.outer**4 - self.inner**4)
        return self.count * self.young * area_moment

    @property
    def torsion(self) -> float:
        """G J of all tubes, [N m^2]."""
        polar = math.pi / 32.0 * (self.outer**4 - self.inner**4)
        return self.count * self.shear * polar

    @property
    def weight(self) -> float:
        """Of all tubes by length, [N/m]."""
        area = math.pi / 4.0 * (self.outer**2 - self.inner**2)
        return self.count * self.density * area * GRAVITY


CARBON = Beam()
ALUMINIUM = Beam(young=70e9, shear=26e9, density=2700.0)


@dataclass(frozen=True)
class Sources:
    """Sizes of the disturbances, and where each is read from.

    Attributes:
        pick: Half width of the even distribution of the picked tip in the image plane
            (y, z), [m]; half of the 5 mm that the needle looks wide, section 4.3.
        slice: The same along the bore (x), [m]; assumed: half a slice of 5 mm.
        stage: Standard deviation of q1, q2, q3, [m]; assumed: ball screws.
        angle: Standard deviation of q4, q5, [rad]; assumed: 0.05 deg.
        caliper: Standard deviation of the caliper, [m]; assumed: its resolution.
        oblique: Standard deviation of its angle to the shortest line, [rad]; assumed.
            The true distance is then shorter than what it shows.
        beam: The arm.
        level_parts: How the *model* places the level rods: "parallelogram" or "frame4".
    """

    pick: float = 0.0025
    slice: float = 0.0025
    stage: float = 0.05e-3
    angle: float = math.radians(0.05)
    caliper: float = 0.05e-3
    oblique: float = math.radians(3.0)
    beam: Beam = CARBON
    level_parts: str = "parallelogram"


@dataclass(frozen=True, eq=False)
class Sag:
    """How the end of the beam moves, in W: displacement [m], rotation vector [rad]."""

    displacement: Array
    rotation: Array


def sag(beam: Beam, q4: float, q5: float, mount_sign: float = 1.0) -> Sag:
    """Bending and twist of the arm in a posture, by beam theory.

    End load m g at the length L with its centre of mass x before the end, weight w by
    length: drop = m g L^3/(3 EI) + m g x L^2/(2 EI) + w L^4/(8 EI), slope = m g L^2/
    (2 EI) + m g x L/(EI) + w L^3/(6 EI), twist = m g y L/(GJ) with the lever y beside
    the arm's axis. Round tubes bend alike in every direction; nothing moves along x.

    Args:
        beam: The arm.
        q4: Turn about the arm, [rad].
        q5: Turn of the holder, [rad].
        mount_sign: sin(alpha_3).
    """
    S4, S5, C5 = math.sin(q4), math.sin(q5), math.cos(q5)
    f, u, L, EI = beam.load_forward, beam.load_up, beam.length, beam.bending
    ahead = f * C5 + u * S5
    above = -0.06 - f * S5 + u * C5  # l2 = 0.06 m: the pivot hangs below the arm's axis
    beside = -mount_sign * S4 * above
    force = beam.load * GRAVITY
    drop = (
        force * (L**3 / 3.0 + ahead * L**2 / 2.0) / EI + beam.weight * L**4 / 8.0 / EI
    )
    slope = force * (L**2 / 2.0 + ahead * L) / EI + beam.weight * L**3 / 6.0 / EI
    twist = -force * beside * L / beam.torsion
    return Sag(np.array([0.0, 0.0, -drop]), np.array([twist, mount_sign * slope, 0.0]))


def bent(
    placements: Mapping[str, Array], beam: Beam, q4: float, q5: float, mount_sign: float
) -> dict[str, Array]:
    """The placements with the arm bent: what the real robot looks like.

    The holder moves with the beam's end; arm and rods turn about their root as the
    chord of the bent beam does.
    """
    moved = sag(beam, q4, q5, mount_sign)
    end = placements["4"][:3, 3]
    root = end - mount_sign * beam.length * np.array([1.0, 0.0, 0.0])
    chord = np.array(
        [
            0.5 * moved.rotation[0],
            -mount_sign * moved.displacement[2] / beam.length,
            0.0,
        ]
    )
    at_end = _about(end, moved.rotation, moved.displacement)
    along = _about(root, chord, np.zeros(3))
    result = dict(placements)
    for link in AT_THE_END:
        result[link] = at_end @ placements[link]
    for link in ALONG_THE_BEAM:
        result[link] = along @ placements[link]
    return result


def tip_sag(beam: Beam, q: Array, mount: str) -> Array:
    """How far the needle tip is from where the stiff robot has it, (3,), [m]."""
    sign = math.copysign(1.0, float(mount))
    frames = forward(q, mount=mount)
    moved = sag(beam, float(q[3]), float(q[4]), sign)
    T = _about(frames["4"][:3, 3], moved.rotation, moved.displacement)
    tip = frames["E"][:3, 3]
    return T[:3, :3] @ tip + T[:3, 3] - tip


def _about(point: Array, rotation: Array, displacement: Array) -> Array:
    """The rigid motion that turns about a point and then moves, (4, 4)."""
    angle = float(np.linalg.norm(rotation))
    R = axis_rotation(rotation / angle, angle) if angle > 0.0 else np.eye(3)
    T = np.eye(4)
    T[:3, :3] = R
    T[:3, 3] = point - R @ point + displacement
    return T
