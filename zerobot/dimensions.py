"""Zerobot's numbers for the closed form, each with the place it is read from.

Typed from the papers (or assumed, with the reason) and NOT from the xacro file, which
types them a second time: that two hands wrote the same number is what the cross-check
of `borecheck fk` checks. Never generate one from the other.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from borecheck_models import closed_form
from borecheck_models.closed_form import finite, number


@dataclass(frozen=True)
class Dimensions:
    """Lengths [m] and joint offsets ([m] or [rad]) of [Matsuno2020] Fig. 4, Table 1.

    l8 occurs in no equation and no table of the papers and is left out. None of the
    lengths is published; `source` in the metadata of each field says why it is assumed.
    """

    mount_sign: float = number(
        1.0, "sin(alpha_3), Table 1: alpha_3 is 90 or -90 deg by the mounting side"
    )
    l1: float = number(
        0.90, "assumed: the end-effector is 'approximately 900mm' long, section 4.3"
    )
    l2: float = number(0.06, "assumed: drop of the needle pivot below the arm axis")
    l3: float = number(0.10, "assumed: cancels against l5 at the tip")
    l4: float = number(
        0.95, "assumed: mount_sign (l1 + l7), the tip at the isocentre at q = 0"
    )
    l5: float = number(0.10, "assumed: l3, the tip at the isocentre at q = 0")
    l6: float = number(
        0.26, "assumed: l2 + l9 + 0.12, the tip at the isocentre at q = 0"
    )
    l7: float = number(0.05, "assumed: distance of the needle from the pivot")
    l9: float = number(0.08, "assumed: height of the needle holder")
    lE: float = number(  # noqa: N815 - the paper's name
        0.12, "assumed: free needle, argument needle_length; needles are 10 to 15 cm"
    )
    rod_length: float = number(
        0.84, "assumed, agreed with urdf/zerobot: crank axis to holder axis"
    )
    rod_lever: float = number(
        0.05, "assumed, agreed with urdf/zerobot: axis to rod, up and down"
    )
    rod_side: float = number(
        0.047, "assumed, agreed with urdf/zerobot: rods beside the mid-plane"
    )
    tip_offset_x: float = number(0.0, "calibration: tip off its place, along x_6")
    tip_offset_y: float = number(0.0, "calibration: tip off its place, along y_6")
    tip_offset_z: float = number(0.0, "calibration: tip off its place, along z_6")
    q1_offset: float = number(0.0, "calibration: added to q1 [m]")
    q2_offset: float = number(0.0, "calibration: added to q2 [m]")
    q3_offset: float = number(0.0, "calibration: added to q3 [m]")
    q4_offset: float = number(0.0, "calibration: added to q4 [rad]")
    q5_offset: float = number(0.0, "calibration: added to q5 [rad]")
    q6_offset: float = number(0.0, "calibration: added to q6 [m]")

    @property
    def offsets(self) -> tuple[float, ...]:
        """What is added to q1..q6, [m] or [rad]."""
        return tuple(getattr(self, f"q{i}_offset") for i in range(1, 7))


# assumed; q4 and q5 must contain the postures of Tables 2 to 4 (+-30 and +-15 deg)
LIMITS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "q1": (-0.25, 0.25),
        "q2": (-0.25, 0.25),
        "q3": (-0.25, 0.25),
        "q4": (-math.radians(45.0), math.radians(45.0)),
        "q5": (-math.radians(30.0), math.radians(30.0)),
        "q6": (0.0, 0.15),
    }
)

_CALIBRATION = tuple(
    [f"tip_offset_{axis}" for axis in "xyz"] + [f"q{i}_offset" for i in range(1, 7)]
)

ARGUMENTS = ("mount", "needle_length", "level_parts", *_CALIBRATION)


def from_arguments(
    arguments: Mapping[str, str | float] = MappingProxyType({}),
    perturbed: Mapping[str, float] = MappingProxyType({}),
) -> Dimensions:
    """The dimensions that the robot's arguments ask for.

    Args:
        arguments: `mount` (+90 or -90, [deg]), `needle_length` [m], `tip_offset_x/y/z`
            [m], `q1_offset` .. `q6_offset` ([m] or [rad]); numbers or their texts.
            `level_parts` is left to `bodies`.
        perturbed: Added to single dimensions by name, to show that each is seen.

    Raises:
        ValueError: An argument that does not exist or holds no finite number.
    """
    closed_form.refuse_unknown(arguments, ARGUMENTS)
    sign = _mount_sign(arguments.get("mount", "+90"))
    values = {name: finite(name, arguments.get(name, 0.0)) for name in _CALIBRATION}
    values["lE"] = finite("needle_length", arguments.get("needle_length", 0.12))
    nominal = Dimensions(mount_sign=sign, l4=sign * 0.95, **values)
    return closed_form.moved(nominal, perturbed)


def dimensions(**arguments: str | float) -> dict[str, float]:
    """Every number of the closed form by its name in the paper, [m] and [rad]."""
    return closed_form.values(from_arguments(arguments))


def sources() -> dict[str, str]:
    """Where every number of the closed form comes from, by name."""
    return closed_form.sources(Dimensions)


def _mount_sign(mount: str | float) -> float:
    angle = finite("mount", mount)
    if abs(angle) != 90.0:
        raise ValueError(f"mount {mount!r} is neither +90 nor -90 (degrees)")
    return math.copysign(1.0, angle)
