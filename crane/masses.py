"""Masses of CRANE's parts: volume of the fine mesh times a mean density.

Neither masses nor drawings of the robot are published. The numbers in
urdf/crane/parts.xacro are this table, rounded to four digits.
"""

from collections.abc import Mapping

from borecheck_models.mass import MassProperties, mass_properties
from crane.meshes import build

# Mean densities [kg/m^3], assumed: aluminium profiles and stages are hollow; the tube
# is drawn solid: a wall of 2 mm (ID 34) of carbon at 1600 is a fifth of it, and cables;
# in-bore links of carbon and plastic with brass pulleys; the needle is steel.
DENSITY = {
    "portal": 700.0,
    "trolley": 2700.0,
    "mast": 900.0,
    "slide": 2500.0,
    "tube": 450.0,
    "back": 1500.0,
    "mid": 1500.0,
    "tip": 1300.0,
    "carriage": 1300.0,
    "needle": 7900.0,
}


def part_masses(arguments: Mapping[str, str]) -> dict[str, MassProperties]:
    """Mass properties of every part, in its link's frame.

    Args:
        arguments: The xacro arguments that shape meshes.
    """
    meshes = build("fine", arguments)
    return {name: mass_properties(meshes[name], DENSITY[name]) for name in DENSITY}
