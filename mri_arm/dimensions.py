"""The MRI arm's numbers for the closed form, each with the place it is read from.

Typed from [Heikkila2010] (or assumed, with the reason) and NOT from the xacro file,
which types them a second time: that two hands wrote the same number is what the
cross-check of `borecheck fk` checks. Never generate one from the other.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from borecheck_models import closed_form
from borecheck_models.closed_form import finite, number


@dataclass(frozen=True)
class Dimensions:
    """Lengths [m] and the place of the base, in the scanner's frame I (image centre).

    Only the forearm and the needle are published; the others are assumed, so that the
    published encoder resolutions give the published repeatability in one stated pose
    (docs/mri_arm.md), and say so in the metadata of their field.
    """

    base_x: float = number(0.0, "assumed: axis 1 beside the patient, > 1 m (2 mT)")
    base_y: float = number(-1.30, "assumed: axis 1 beside the patient, > 1 m (2 mT)")
    base_z: float = number(-1.0, "assumed: the floor, image centre 1 m above it")
    base_yaw: float = number(0.0, "assumed: the forearm points across the patient")
    shoulder: float = number(0.60, "assumed: height of axis 2 above the floor")
    upper_arm: float = number(0.45, "assumed: axis 2 to axis 3; 0.25 to 0.7 fit too")
    forearm: float = number(1.0, "section 2: '4th link ... 1000 mm length'")
    flange: float = number(0.10, "assumed: as the 10 cm extension of section 5")
    needle: float = number(0.15, "section 4: 'biopsy needle (150 mm)'")
    tool_square: float = number(0.0, "1: needle at right angles to axis 6; 0: along")


# J2, J3: section 2; J6: section 2; J1, J4, J5: assumed, "+/- 75 degrees ... or more";
# insertion: assumed, the optional "redundant axis coincident with the needle axis".
LIMITS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "q1": (-math.radians(100.0), math.radians(100.0)),
        "q2": (-math.radians(20.0), math.radians(20.0)),
        "q3": (-math.radians(42.0), math.radians(42.0)),
        "q4": (-math.radians(100.0), math.radians(100.0)),
        "q5": (-math.radians(90.0), math.radians(90.0)),
        "q6": (-math.radians(75.0), math.radians(75.0)),
        "insertion": (0.0, 0.10),
    }
)

# Section 2, [deg] per pulse: a turn over 64000, 4000, 4000, 57600, 6000, 28800.
ENCODER_DEG = (0.005625, 0.09, 0.09, 0.00625, 0.06, 0.0125)

ARGUMENTS = ("base_x", "base_y", "base_yaw", "needle_mount", "needle_length")


def from_arguments(
    arguments: Mapping[str, str | float] = MappingProxyType({}),
    perturbed: Mapping[str, float] = MappingProxyType({}),
) -> Dimensions:
    """The dimensions that the robot's arguments ask for.

    Args:
        arguments: `base_x`, `base_y` [m], `base_yaw` [rad], `needle_mount` (along,
            square), `needle_length` [m]; numbers or their texts.
        perturbed: Added to single dimensions by name, to show that each is seen.

    Raises:
        ValueError: An argument that does not exist or holds no finite number.
    """
    closed_form.refuse_unknown(arguments, ARGUMENTS)
    names = {"base_x", "base_y", "base_yaw"} & set(arguments)
    values = {name: finite(name, arguments[name]) for name in names}
    if "needle_length" in arguments:
        values["needle"] = finite("needle_length", arguments["needle_length"])
    values["tool_square"] = _square(arguments.get("needle_mount", "along"))
    nominal = Dimensions(**values)
    return closed_form.moved(nominal, perturbed)


def dimensions(**arguments: str | float) -> dict[str, float]:
    """Every number of the closed form by its name, [m] and [rad]."""
    return closed_form.values(from_arguments(arguments))


def sources() -> dict[str, str]:
    """Where every number of the closed form comes from, by name."""
    return closed_form.sources(Dimensions)


def _square(mount: str | float) -> float:
    if mount not in ("along", "square"):
        raise ValueError(f"needle_mount {mount!r} is neither along nor square")
    return 1.0 if mount == "square" else 0.0
