"""Mass properties of a closed surface filled with an even density."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.plugin import TriangleMesh


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre of mass (3,) [m], inertia about it (3, 3) [kg m^2]."""

    mass: float
    com: NDArray[np.float64]
    inertia: NDArray[np.float64]


def mass_properties(mesh: TriangleMesh, density: float) -> MassProperties:
    """Mass properties of the solid inside a closed mesh.

    The solid is the signed sum of the tetrahedra between the origin and every
    triangle; their second moments are exact (no sampling).

    Args:
        mesh: Closed, outward.
        density: [kg/m^3].
    """
    volumes = _tetrahedra(mesh.corners)
    total = volumes.sum()
    centre = (volumes[:, None] * mesh.corners.sum(axis=1)).sum(axis=0) / (4.0 * total)
    corners = mesh.corners - centre
    volumes = _tetrahedra(corners)
    sums = corners.sum(axis=1)
    second = np.einsum("i,ij,ik->jk", volumes, sums, sums)
    second += np.einsum("i,icj,ick->jk", volumes, corners, corners)
    second /= 20.0
    inertia = np.trace(second) * np.eye(3) - second
    return MassProperties(density * float(total), centre, density * inertia)


def _tetrahedra(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed volumes between the origin and every triangle, (m,) [m^3]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.asarray(np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0)
