"""A triangle mesh as a value: read-only arrays in metres."""

from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import frozen
from borecheck.errors import GeometryError


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Vertices and triangles of one surface; the arrays are copied and frozen.

    Attributes:
        name: What the user calls it (a link, a file).
        vertices: Points, (n, 3), float64, [m].
        triangles: Vertex indices, (m, 3), int64, outward by the right-hand rule.
        inner_vertices: Of a polyhedron round a round shape: the same vertices, (n, 3),
            of one within it, [m]; the shape is between the two. Else None.
    """

    name: str
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    inner_vertices: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64, order="C")
        triangles = np.array(self.triangles, dtype=np.int64, order="C")
        _check_arrays(self.name, vertices, triangles)
        vertices.setflags(write=False)
        triangles.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)
        if self.inner_vertices is not None:
            inner = np.array(self.inner_vertices, dtype=np.float64, order="C")
            _check_arrays(self.name, inner, triangles)
            inner.setflags(write=False)
            object.__setattr__(self, "inner_vertices", inner)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Corner points of every triangle, (m, 3, 3), [m]."""
        if self._is_soup:
            return self.vertices.reshape(-1, 3, 3)
        return frozen(self.vertices[self.triangles])

    @cached_property
    def _is_soup(self) -> bool:
        """Whether triangle k has the vertices 3k to 3k + 2, as read from STL."""
        ids = self.triangles.reshape(-1)
        return len(ids) == len(self.vertices) and bool(
            np.array_equal(ids, np.arange(len(ids)))
        )

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """Smallest and largest coordinates of the used vertices, (2, 3), [m]."""
        # Column by column: ten times as fast as along the rows.
        x, y, z = self.corners.reshape(-1, 3).T
        lower, upper = (x.min(), y.min(), z.min()), (x.max(), y.max(), z.max())
        return frozen(np.array([lower, upper]))

    @cached_property
    def sha256(self) -> str:
        """Hash of the arrays (not of the name): the identity in reports and caches.

        Over type, shape and data of both: the bytes alone would be the same if numbers
        moved from one array to the other.
        """
        digest = sha256(b"borecheck mesh 2\n")
        for values, kind in ((self.vertices, "<f8"), (self.triangles, "<i8")):
            rows, columns = values.shape
            digest.update(f"{kind} {rows} {columns}\n".encode())
            digest.update(values.astype(kind, copy=False).data)
        return digest.hexdigest()

    @cached_property
    def is_closed(self) -> bool:
        """Whether every edge is shared by exactly two triangles, once each way.

        Vertices at equal coordinates count as one, so a triangle soup as read from
        STL is judged by its shape. Only of a closed mesh can one say what is inside.
        """
        _, same = np.unique(self.vertices, axis=0, return_inverse=True)
        t = same.reshape(-1)[self.triangles]
        edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
        edges = edges[edges[:, 0] != edges[:, 1]]
        key = edges[:, 0] * np.int64(len(same)) + edges[:, 1]
        back = edges[:, 1] * np.int64(len(same)) + edges[:, 0]
        keys, counts = np.unique(key, return_counts=True)
        return bool((counts == 1).all() and np.array_equal(keys, np.unique(back)))

    @property
    def inner(self) -> "TriangleMesh":
        """The polyhedron within a round shape; of any other the mesh itself."""
        # A mesh that remembered itself would wait for the garbage collector.
        return self if self.inner_vertices is None else self._within

    @cached_property
    def _within(self) -> "TriangleMesh":
        assert self.inner_vertices is not None
        return TriangleMesh(self.name, self.inner_vertices, self.triangles)

    @cached_property
    def excess(self) -> float:
        """How far a round shape's surface lies at most outside the true one, [m].

        Points of the two polyhedra that correspond are no farther apart than vertices.
        """
        if self.inner_vertices is None:
            return 0.0
        apart = self.vertices - self.inner_vertices
        return float(np.linalg.norm(apart, axis=1).max())

    def moved(self, T_new_old: NDArray[np.float64]) -> "TriangleMesh":
        """The same mesh with its vertices expressed in another frame."""
        R, shift = T_new_old[:3, :3], T_new_old[:3, 3]
        inner = self.inner_vertices
        return TriangleMesh(
            self.name,
            self.vertices @ R.T + shift,
            self.triangles,
            None if inner is None else inner @ R.T + shift,
        )


def _check_arrays(
    name: str, vertices: NDArray[np.float64], triangles: NDArray[np.int64]
) -> None:
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise GeometryError(f"mesh {name}: vertices have shape {vertices.shape}")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
        raise GeometryError(f"mesh {name}: triangles have shape {triangles.shape}")
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(bad):
        raise GeometryError(f"mesh {name}: vertex {bad[0]} is not finite")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise GeometryError(
            f"mesh {name}: a triangle names vertex "
            f"{int(triangles.max())}, but there are {len(vertices)}"
        )
