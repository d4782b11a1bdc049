"""Does a needle plan begin at the patient's skin and end inside the patient?

A plan in the wrong frame, unit, position or about the wrong origin most often ends
beside the patient: the check then has nothing to object, so it is said.
"""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.triangles.solid import Side, side_of
from borecheck.plans.needle_plan import NeedlePlan

# A planned entry lies on the skin as far as the skin's mesh is right; beyond this
# something else is wrong. Assumed: a few times the error of a coarse skin, [m].
AT_SKIN = 5e-3

HINT = "wrong frame, patient position, origin or unit?"


def skin_notes(
    plan: NeedlePlan, patients: Iterable[TriangleMesh], *, begins: bool = True
) -> Iterator[str]:
    """What is odd about where a plan begins and ends, a line each.

    Args:
        plan: Entry and target in the scanner's frame, [m].
        patients: Every body of the patient, in the same frame; without any there is
            nothing to say.
        begins: Whether the entry is meant to be at the skin.
    """
    bodies = list(patients)
    if not bodies:
        return
    gaps = [distance_to(mesh, np.array(plan.entry)) for mesh in bodies]
    nearest = int(np.argmin(gaps))
    if begins and gaps[nearest] > AT_SKIN:
        side = _side(bodies, np.array(plan.entry))
        where = {Side.INSIDE: ", inside it", Side.OUTSIDE: ", outside it"}
        yield (
            f"its entry is {1e3 * gaps[nearest]:.1f} mm off the skin of "
            f"{bodies[nearest].name}{where.get(side, '')}: {HINT}"
        )
    if _side(bodies, np.array(plan.target)) is Side.OUTSIDE:
        yield f"its target is not in the patient: {HINT}"


def _side(bodies: Iterable[TriangleMesh], point: NDArray[np.float64]) -> Side:
    """Whether a point is in the patient; undecided where a body is open."""
    known = [(mesh, surface(mesh).topology) for mesh in bodies]
    if not all(topology.is_closed for _, topology in known):
        return Side.UNDECIDED
    sides = [side_of(point, *both) for both in known]
    for side in (Side.INSIDE, Side.UNDECIDED):
        if side in sides:
            return side
    return Side.OUTSIDE


def distance_to(mesh: TriangleMesh, point: NDArray[np.float64]) -> float:
    """Distance of a point from a surface, [m]."""
    there = MeshTree(np.tile(point, (3, 1)), np.array([[0, 1, 2]]))
    _, upper = surface(mesh).tree.clearance(there, np.eye(4), np.eye(4))
    return upper
