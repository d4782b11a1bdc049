"""Masses of Zerobot's parts: volume of the fine mesh times a mean density.

Neither masses nor drawings of the robot are published. The numbers in
urdf/zerobot/parts.xacro are this table, rounded to four digits.
"""

from borecheck_models.mass import MassProperties, mass_properties
from zerobot.meshes import build

# Mean densities [kg/m^3], assumed: steel and aluminium parts are hollow, the base
# is a welded frame with a control cabinet; tubes and rods are carbon.
DENSITY = {
    "base": 1300.0,
    "lift": 2000.0,
    "slide": 2000.0,
    "cross": 2700.0,
    "arm": 750.0,
    "crank": 2700.0,
    "rod_a": 1600.0,
    "rod_b": 1600.0,
    "holder": 1400.0,
    "carriage": 1400.0,
    "needle": 7900.0,
}


def part_masses(needle_length: float = 0.12) -> dict[str, MassProperties]:
    """Mass properties of every part, in its link's frame."""
    meshes = build("fine", {"needle_length": repr(needle_length)})
    return {name: mass_properties(meshes[name], DENSITY[name]) for name in DENSITY}
