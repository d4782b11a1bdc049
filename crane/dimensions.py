"""CRANE's numbers for the closed form, each with the place it is read from.

Typed from [CRANE] (or assumed, with the reason) and NOT from the xacro file, which
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
    """Lengths [m] and the place of the base, in the scanner's frame I (isocentre).

    Table IV's plain numbers survived the extraction, its angles did not: the twists and
    offsets are a reading (docs/crane.md), and say so.
    """

    base_x: float = number(-0.45, "assumed: at q3 = 0 the pitch axis is in the mouth")
    base_y: float = number(0.0, "assumed: over the middle of the couch")
    base_z: float = number(0.0, "assumed: at q2 = 0 the tube is at its height")
    base_yaw: float = number(0.0, "assumed: the arm reaches into the bore along +x")
    a6: float = number(0.07, "Table IV row 6: a = 7e-2")
    a7: float = number(0.07, "Table IV row 7: a = 7e-2")
    d7: float = number(0.03, "Table IV row 7: d = 3e-2")
    a8: float = number(0.01, "Table IV row 8: a = 1e-2")
    d8: float = number(0.02, "Table IV row 8: d = 2e-2, the guide; q8 is added to it")
    ahead: float = number(0.05, "assumed: the needle's length ahead of frame 8")


# None is printed. q4 to q7: a public controller of this line of robots; q8: the rail of
# its precursor; q1 to q3 assumed, "X-Y-Z cartesian motion with a large workspace".
LIMITS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "q1": (-0.35, 0.35),
        "q2": (-0.35, 0.35),
        "q3": (0.0, 0.60),
        "q4": (-math.radians(90.0), math.radians(90.0)),
        "q5": (-math.radians(40.0), math.radians(70.0)),
        "q6": (-math.radians(70.0), math.radians(70.0)),
        "q7": (-math.radians(60.0), math.radians(120.0)),
        "q8": (0.0, 0.0475),
    }
)

ANGLES = ("q4", "q5", "q6", "q7")

# The longest needle, 250 mm, less 90 mm for the two clutches; assumed.
MOST_AHEAD = 0.16

_PLACE = ("base_x", "base_y", "base_z", "base_yaw")
ARGUMENTS = (*_PLACE, "needle_ahead")


def from_arguments(
    arguments: Mapping[str, str | float] = MappingProxyType({}),
    perturbed: Mapping[str, float] = MappingProxyType({}),
) -> Dimensions:
    """The dimensions that the robot's arguments ask for.

    Args:
        arguments: `base_x`, `base_y`, `base_z`, `needle_ahead` [m] and `base_yaw`
            [rad]; numbers or their texts.
        perturbed: Added to single dimensions by name, to show that each is seen.

    Raises:
        ValueError: An argument that does not exist or holds no finite number, or a
            needle that no guide holds.
    """
    closed_form.refuse_unknown(arguments, ARGUMENTS)
    values = {
        name: finite(name, arguments[name]) for name in _PLACE if name in arguments
    }
    if "needle_ahead" in arguments:
        ahead = values["ahead"] = finite("needle_ahead", arguments["needle_ahead"])
        if not 0.0 <= ahead <= MOST_AHEAD:
            raise ValueError(f"needle_ahead = {ahead!r} is not 0 to {MOST_AHEAD} m")
    return closed_form.moved(Dimensions(**values), perturbed)


def dimensions(**arguments: str | float) -> dict[str, float]:
    """Every number of the closed form by its name, [m] and [rad]."""
    return closed_form.values(from_arguments(arguments))


def sources() -> dict[str, str]:
    """Where every number of the closed form comes from, by name."""
    return closed_form.sources(Dimensions)
