"""One way to place a vertex, so that every checker sees the same float64 numbers.

Two programs that form T * v in different orders differ in the last bit, and a
contact test can hang on that bit. All prunings and all narrowphases therefore go
through `place_point`: multiply and add from left to right, no fused operations
(numba contracts nothing without fastmath).
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

Triangle = tuple[float, float, float, float, float, float, float, float, float]


@kernel(inline="always")
def place_point(
    T: NDArray[np.float64], x: float, y: float, z: float
) -> tuple[float, float, float]:
    """T * (x, y, z) for a (4, 4) or (3, 4) transform."""
    return (
        T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3],
        T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3],
        T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3],
    )


@kernel(inline="always")
def place_triangle(
    T: NDArray[np.float64], corners: NDArray[np.float64], k: int
) -> Triangle:
    """Triangle k of corners (m, 9), placed, as a tuple of nine numbers."""
    ax, ay, az = place_point(T, corners[k, 0], corners[k, 1], corners[k, 2])
    bx, by, bz = place_point(T, corners[k, 3], corners[k, 4], corners[k, 5])
    cx, cy, cz = place_point(T, corners[k, 6], corners[k, 7], corners[k, 8])
    return (ax, ay, az, bx, by, bz, cx, cy, cz)


@kernel
def place_vertices(
    T: NDArray[np.float64], vertices: NDArray[np.float64]
) -> NDArray[np.float64]:
    """T * v for vertices (n, 3); bit for bit what `place_point` gives."""
    placed = np.zeros_like(vertices)
    for i in range(len(vertices)):
        x, y, z = place_point(T, vertices[i, 0], vertices[i, 1], vertices[i, 2])
        placed[i, 0], placed[i, 1], placed[i, 2] = x, y, z
    return placed


def place_mesh(T_world_mesh: NDArray[np.float64], mesh: TriangleMesh) -> TriangleMesh:
    """The mesh with its vertices in the world, as every checker sees them."""
    T = np.ascontiguousarray(T_world_mesh, dtype=np.float64)
    inner = mesh.inner_vertices
    return TriangleMesh(
        mesh.name,
        place_vertices(T, mesh.vertices),
        mesh.triangles,
        None if inner is None else place_vertices(T, inner),
    )


def placed_bounds(
    T_world_mesh: NDArray[np.float64], bounds: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest corner of a box around the placed box of a mesh.

    It holds every placed vertex: 1e-9 m pays for the rounding of these few products
    in a room of metres.

    Args:
        T_world_mesh: Placement, (4, 4).
        bounds: `TriangleMesh.bounds`, (2, 3).
    """
    R = T_world_mesh[:3, :3]
    middle = R @ ((bounds[0] + bounds[1]) / 2) + T_world_mesh[:3, 3]
    reach = np.abs(R) @ ((bounds[1] - bounds[0]) / 2) + 1e-9
    return middle - reach, middle + reach
