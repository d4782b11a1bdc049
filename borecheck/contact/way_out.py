"""How to part two surfaces that touch: a short straight way, tried and then verified.

Directions are tried, not proven to hold the shortest of all: the scanner's axes, the
line between the middles of both, and the normals of triangles in contact. Along each
the length is narrowed to a tenth of a millimetre. What is given was placed there and
asked as any pair is: the surfaces are apart, and neither solid holds the other.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.geometry.triangles.solid import contained

Array = NDArray[np.float64]

# Ways are multiples of this, and none is longer, [m].
STEP, LONGEST = 1e-4, 0.05
# Normals that are tried, each both ways, of as many triangles in contact.
MOST_NORMALS = 8


@dataclass(frozen=True, eq=False)
class Placed:
    """A surface where it stands.

    Attributes:
        mesh: The surface in its own frame.
        T: T_scene_mesh, (4, 4).
    """

    mesh: TriangleMesh
    T: Array

    def moved(self, shift: Array) -> "Placed":
        """The same, shifted in the scanner's frame."""
        T = self.T.copy()
        T[:3, 3] += shift
        return Placed(self.mesh, T)

    @property
    def middle(self) -> Array:
        """Of its box, (3,)."""
        return np.asarray(
            self.T[:3, :3] @ self.mesh.bounds.mean(axis=0) + self.T[:3, 3]
        )


def way_out(
    first: Placed, second: Placed, corners: Array, margin: float = 0.0
) -> Array | None:
    """A shift of the first surface that parts it from the second, (3,), [m].

    Args:
        first: What is moved.
        second: What stands.
        corners: Pairs of triangles in contact, placed, (n, 2, 3, 3), [m].
        margin: How far apart both must be then, [m].

    Returns:
        The shortest that was found, in tenths of a millimetre along each axis; None if
        none of LONGEST or less was. Other parts and obstacles are not looked at.
    """
    directions = _directions(first, second, corners)
    most = round(LONGEST / STEP)
    steps = [2**k for k in range(most.bit_length()) if 2**k < most] + [most]
    for before, count in zip([0, *steps], steps, strict=False):
        found = [
            _narrowed(first, second, direction, before, count, margin)
            for direction in directions
            if _are_apart(first, second, _shift(direction, count), margin)
        ]
        if found:
            return min(found, key=lambda shift: float(np.linalg.norm(shift)))
    return None


def _directions(first: Placed, second: Placed, corners: Array) -> Array:
    """Unit vectors (n, 3)."""
    some = corners[:: -(-len(corners) // MOST_NORMALS)].reshape(-1, 3, 3)
    normals = np.cross(some[:, 1] - some[:, 0], some[:, 2] - some[:, 0])
    between = (first.middle - second.middle)[None]
    found = np.concatenate([np.eye(3), between, normals])
    found = found[np.linalg.norm(found, axis=1) > 0.0]
    found /= np.linalg.norm(found, axis=1)[:, None]
    both = np.concatenate([found, -found])
    _, kept = np.unique(both.round(3), axis=0, return_index=True)
    return np.asarray(both[np.sort(kept)])


def _shift(direction: Array, count: int) -> Array:
    """So many steps in a direction, to whole steps along each axis, (3,)."""
    return np.asarray((direction * count).round() * STEP)


def _narrowed(
    first: Placed,
    second: Placed,
    direction: Array,
    touching: int,
    apart: int,
    margin: float,
) -> Array:
    """The shortest shift found between one that touches and one that does not."""
    while apart - touching > 1:
        middle = (touching + apart) // 2
        if _are_apart(first, second, _shift(direction, middle), margin):
            apart = middle
        else:
            touching = middle
    return _shift(direction, apart)


def _are_apart(first: Placed, second: Placed, shift: Array, margin: float) -> bool:
    moved = first.moved(shift)
    a, b = surface(first.mesh), surface(second.mesh)
    if a.tree.within(b.tree, moved.T, second.T, margin).verdict != "clear":
        return False
    meshes = place_mesh(moved.T, first.mesh), place_mesh(second.T, second.mesh)
    # of open surfaces it cannot be told, and they are apart
    return contained(*meshes, a.topology, b.topology).kind in ("none", "unknown")
