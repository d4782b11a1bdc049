"""Is a mesh in metres or in millimetres? Told from its size, never in silence.

STL, OBJ and PLY files do not say their unit. The size of the scene around a mesh
(the gantry, the robot) tells metres from millimetres, and nothing finer: centimetres
and inches look like small metres or large millimetres and must be said. A guess is
good enough to show a scene and to find contact, never to call anything clear.
"""

import numpy as np

from borecheck.errors import MeshError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

# A part of a scanner room is between 1/20 and 5 times the size of the scene. Both
# readings cannot fit at once (a factor of 1000 apart, 100 wide); between them lies a
# band, 5 to 50, where neither fits and the user is asked.
_SMALLEST_SHARE = 0.05
_LARGEST_SHARE = 5.0
# A guess is made only where no other unit fits: a gantry in cm, taken as mm, is a
# tenth of its size, and an arm inside its wall would be called clear.
_ALSO_POSSIBLE = {"cm": 1e-2, "in": 0.0254}
_OTHERS_LARGEST = 3.0
# Nothing that stands in a scanner room is larger; 17 m are a gantry in a wrong unit.
_LARGEST_OBSTACLE = 3.0


def largest_extent(mesh: TriangleMesh) -> float:
    """Longest edge of the mesh's axis-aligned box, in the mesh's unit."""
    return float((mesh.bounds[1] - mesh.bounds[0]).max())


def guess_unit(mesh: TriangleMesh, reference_size_m: float) -> tuple[str, str | None]:
    """The unit of a mesh that was read with scale 1, "m" or "mm", and a warning.

    Args:
        mesh: The numbers of the file, taken as metres.
        reference_size_m: Size of the scene that the mesh belongs to, [m].

    Returns:
        The unit, and a line for the user that says what was assumed; None when the
        numbers are plausible as metres, the unit of everything here, and as nothing
        else.

    Raises:
        MeshError: Neither metres nor millimetres give a plausible size, or not metres
            but another unit besides millimetres.
    """
    size = largest_extent(mesh)
    others = [
        unit
        for unit, length in _ALSO_POSSIBLE.items()
        if _SMALLEST_SHARE <= size * length / reference_size_m <= _OTHERS_LARGEST
    ]
    if _is_plausible(size, reference_size_m):
        return "m", _also_possible(mesh, others)
    if others:
        raise MeshError(
            mesh.name,
            f"{_dimensions(mesh)} is no plausible size in m, but one in "
            f"{' or '.join(others)}: say the unit (FILE:mm, FILE:cm, FILE:in)",
        )
    if _is_plausible(size * 1e-3, reference_size_m):
        return "mm", (
            f"mesh {mesh.name}: taken as millimetres, because {_dimensions(mesh)} m "
            f"does not fit a scene of {reference_size_m:g} m; "
            "nothing is called clear until the unit is stated (FILE:mm, FILE:cm ...)"
        )
    raise MeshError(
        mesh.name,
        f"{_dimensions(mesh)} is no plausible size in m or mm beside a scene of "
        f"{reference_size_m:g} m: say the unit (FILE:mm, FILE:m, FILE:cm, FILE:in)",
    )


def unit_mistake(mesh: TriangleMesh, reference_size_m: float) -> str | None:
    """One line if a mesh, in metres as stated, looks 1000 times too large or small.

    Args:
        mesh: The mesh in its stated unit, [m].
        reference_size_m: Size of the scene that the mesh belongs to, [m].
    """
    size = largest_extent(mesh)
    too_large = size >= 1e3 * _SMALLEST_SHARE * reference_size_m
    too_small = size <= 1e-3 * _LARGEST_SHARE * reference_size_m
    if not (too_large or too_small):
        return None
    guess = "large: is the file in mm?" if too_large else "small: is the file in m?"
    return (
        f"mesh {mesh.name}: {_dimensions(mesh)} m beside a scene of "
        f"{reference_size_m:g} m looks 1000 times too {guess}"
    )


def large_obstacle(mesh: TriangleMesh) -> str | None:
    """One line about a mesh, in metres, that is larger than what stands in a room."""
    if largest_extent(mesh) <= _LARGEST_OBSTACLE:
        return None
    return f"{_dimensions(mesh)} m, more than 3 m across: is its unit right?"


def _also_possible(mesh: TriangleMesh, others: list[str]) -> str | None:
    """A line if metres are plausible but not alone: a 3 may be 3 m or 3 inches."""
    if not others:
        return None
    words = ", ".join(f"FILE:{unit}" for unit in ("m", *others))
    return (
        f"mesh {mesh.name}: taken as metres, but {_dimensions(mesh)} is a plausible "
        f"size in {' and '.join(others)}, too; nothing is called clear until the unit "
        f"is stated ({words})"
    )


def _is_plausible(size: float, reference: float) -> bool:
    return _SMALLEST_SHARE * reference <= size <= _LARGEST_SHARE * reference


def _dimensions(mesh: TriangleMesh) -> str:
    return " x ".join(f"{v:.4g}" for v in np.ptp(mesh.bounds, axis=0))
