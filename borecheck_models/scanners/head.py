"""What is operated on: a head phantom, the melon of the trials, and their entry points.

[Heikkila2010] calls the volume of the head the region of surgical interest. No patient
data are in it: the head is an ellipsoid with the size of an adult's.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.plugin import TriangleMesh
from borecheck_models.shapes import Detail, lofted

Array = NDArray[np.float64]

# Half axes [m]: crown to chin, ear to ear, forehead to back of the head. Assumed from
# textbook means of adults: 225 mm high, 153 mm wide, 195 mm long.
HEAD = (0.1125, 0.0765, 0.0975)

# [Heikkila2010] section 5, "a melon (cucumis melo)": size not published, assumed.
MELON = (0.085, 0.075, 0.075)

# Cranial vault: normals within 90 deg of halfway between crown (-x) and forehead (+z).
VAULT = (-np.sqrt(0.5), 0.0, np.sqrt(0.5))


@dataclass(frozen=True, eq=False)
class EntryPoints:
    """Points on the head and the outward normals there.

    Attributes:
        points: (n, 3), in the head's frame [m]: x towards the feet, z to the ceiling.
        normals: Outward, (n, 3).
    """

    points: Array
    normals: Array


def ellipsoid(half_axes: tuple[float, float, float], detail: Detail) -> TriangleMesh:
    """An ellipsoid about the origin, drawn around the true one."""
    n = detail.segments
    polar = np.linspace(0.0, np.pi, max(n // 2, 4) + 1)
    around = np.arange(n) * (2.0 * np.pi / n)
    ring = np.column_stack([np.zeros(n), np.cos(around), np.sin(around)])
    rings = [np.sin(p) * ring + np.cos(p) * np.array([1.0, 0, 0]) for p in polar[1:-1]]
    # flat triangles lie inside their corners' sphere by 1 - cos of half a step each way
    grown = 1.0 / (np.cos(np.pi / n) * np.cos(0.5 * polar[1]))
    axes = grown * np.array(half_axes)
    ends = (axes * (1.0, 0.0, 0.0), axes * (-1.0, 0.0, 0.0))
    return lofted(np.array(rings) * axes, ends)


def entry_points(
    count: int, half_axes: tuple[float, float, float] = HEAD
) -> EntryPoints:
    """Points spread evenly over the cranial vault.

    A spiral over the sphere of directions, taken as normals: dense where the head is
    round, as the choice of an entry is.

    Args:
        count: How many on the vault.
        half_axes: Of the ellipsoid, [m].
    """
    k = np.arange(2 * count) + 0.5
    polar = np.arccos(1.0 - k / count)
    turn = np.pi * (1.0 + np.sqrt(5.0)) * k
    sphere = np.column_stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)]
    )
    normals = sphere[sphere @ np.array(VAULT) > 0.0][:count]
    axes = np.array(half_axes)
    points = normals * axes**2 / np.linalg.norm(normals * axes, axis=1)[:, None]
    return EntryPoints(points, normals)
