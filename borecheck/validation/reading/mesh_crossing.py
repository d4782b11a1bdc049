"""Triangles of one mesh that cross each other."""

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.validation.reading.mesh_facts import weld

MAX_TRIANGLES = 200_000


def crossing_pairs(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Pairs of triangles that meet although they share no corner, (k, 2).

    Decided exactly. Neighbours always meet at their shared corner or edge, so only
    triangles without a common corner count. Nothing for meshes over MAX_TRIANGLES.
    """
    from borecheck.geometry.tree.mesh_tree import MeshTree

    if len(mesh.triangles) > MAX_TRIANGLES:
        return np.zeros((0, 2), dtype=np.int64)
    tree = MeshTree.of(mesh, cached=False)
    pairs = tree.contacts(tree, np.eye(4), np.eye(4))
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    corners = weld(mesh.vertices)[mesh.triangles]
    a, b = corners[pairs[:, 0]], corners[pairs[:, 1]]
    shared = (a[:, :, None] == b[:, None, :]).any(axis=(1, 2))
    return pairs[~shared]
