"""Trees of large meshes, kept on disk under the hash of the mesh's numbers."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core import cache
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree.boxes import LARGEST_COORDINATE
from borecheck.geometry.tree.build import TreeArrays, build
from borecheck.geometry.tree.soundness import is_sound

# Below this, building is quicker than finding the file.
CACHED_TRIANGLES = 20_000
CACHE_KIND = "tree-1"


def checked_mesh(vertices: ArrayLike, triangles: ArrayLike) -> TriangleMesh:
    """Numbers of which a tree can be made.

    Raises:
        GeometryError: They are no mesh, or too large for boxes of float32.
    """
    try:
        ids, points = np.asarray(triangles), np.asarray(vertices, np.float64)
    except (TypeError, ValueError):
        raise GeometryError(
            "mesh of the tree: vertices are no numbers (n, 3)"
        ) from None
    if ids.size == 0:
        raise GeometryError("mesh of the tree has no triangles: give indices (m, 3)")
    if ids.dtype.kind not in "iu":
        raise GeometryError(f"triangles are {ids.dtype}, not vertex indices")
    mesh = TriangleMesh("of the tree", points, ids)
    reject_far(mesh)
    return mesh


def reject_far(mesh: TriangleMesh) -> None:
    """Refuses a mesh too large for boxes of float32.

    Raises:
        GeometryError: A coordinate beyond LARGEST_COORDINATE, of any vertex.
    """
    farthest = max(mesh.vertices.max(), -mesh.vertices.min())
    if farthest > LARGEST_COORDINATE:
        raise GeometryError(
            f"mesh {mesh.name}: a coordinate exceeds {LARGEST_COORDINATE:g} m"
        )


def tree_of(
    mesh: TriangleMesh, corners: NDArray[np.float64], cached: bool
) -> TreeArrays:
    """The tree of a mesh with these triangles, (m, 9), built or found on disk."""
    if not cached or len(corners) < CACHED_TRIANGLES:
        return build(corners)
    stored = _read_tree(mesh.sha256, corners)
    if stored is not None:
        return stored
    tree = build(corners)
    arrays: cache.Arrays = {
        "nodes": tree.nodes,
        "order": tree.order.astype(np.int32),
        "frame": tree.frame,
        "depth": np.array(tree.depth),
    }
    cache.store(CACHE_KIND, mesh.sha256, arrays)
    return tree


def _read_tree(key: str, corners: NDArray[np.float64]) -> TreeArrays | None:
    """The cached tree of a mesh with these triangles, if it is there and sound."""
    arrays = cache.load(CACHE_KIND, key)
    if arrays is None:
        return None
    try:
        tree = TreeArrays(
            np.ascontiguousarray(arrays["nodes"], np.float32),
            arrays["order"].astype(np.int64),
            np.ascontiguousarray(arrays["frame"], np.float64),
            int(arrays["depth"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        cache.warn_damaged(CACHE_KIND, key, repr(error))
        return None
    if not is_sound(tree, corners):
        cache.warn_damaged(CACHE_KIND, key, "not a tree of this mesh")
        return None
    return tree
