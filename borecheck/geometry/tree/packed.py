"""Several mesh trees in one set of arrays: what kernels over many links take."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.tree.addresses import Book
from borecheck.geometry.tree.boxes import FRAME_COLUMNS, ROOT
from borecheck.geometry.tree.build import CHILD_ROW
from borecheck.geometry.tree.mesh_tree import MeshTree


class PackedTrees:
    """Trees one behind the other; a single tree is shared, not copied.

    Attributes:
        nodes: Nodes of all trees, (n, 7, 8), float32; references are into this array.
        corners: Triangles in the order of the leaves, (m, 9), [m].
        order: Original triangle (of its own mesh) of every leaf, (m,).
        frames: Per tree its origin (3), largest coordinate and node 0, (k, 5).
        depth: Of the deepest tree.
        book: Where these arrays lie, for kernels.
        trees: The trees as given.
    """

    def __init__(self, trees: Sequence[MeshTree]) -> None:
        self.trees = tuple(trees)
        nodes, corners, roots = [], [], []
        node_count = leaf_count = 0
        for tree in self.trees:
            nodes.append(_moved_nodes(tree, node_count, leaf_count))
            corners.append(tree.corners)
            roots.append(node_count)
            node_count += len(tree.nodes)
            leaf_count += tree.triangle_count
        single = len(self.trees) == 1
        self.nodes = nodes[0] if single else np.concatenate([_NO_NODES, *nodes])
        self.corners = corners[0] if single else np.concatenate([_NO_LEAVES, *corners])
        orders = [tree.order for tree in self.trees]
        self.order = np.concatenate([np.zeros(0, np.int64), *orders])
        self.frames = np.zeros((len(self.trees), FRAME_COLUMNS))
        for row, tree, root in zip(self.frames, self.trees, roots, strict=True):
            row[:ROOT], row[ROOT] = tree.frames[0, :ROOT], root
        self.depth = max((tree.depth for tree in self.trees), default=0)
        self.book = Book(self.nodes, self.corners, self.order, self.frames, self.depth)

    def __len__(self) -> int:
        return len(self.trees)


_NO_NODES = np.zeros((0, 7, 8), np.float32)
_NO_LEAVES = np.zeros((0, 9))


def _moved_nodes(
    tree: MeshTree, first_node: int, first_leaf: int
) -> NDArray[np.float32]:
    """The nodes of a tree with references into arrays that hold others before it."""
    if first_node == 0:
        return tree.nodes
    nodes = tree.nodes.copy()
    references = nodes.view(np.int32)[:, CHILD_ROW]
    inner = references >= 0
    references[inner] += first_node
    references[~inner] -= first_leaf
    return nodes
