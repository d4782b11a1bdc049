"""What of a surface no motion changes: closedness, components, embedded or not."""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core import cache
from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.embedding import are_apart, is_embedded

# Below this, finding the topology is quicker than finding the file.
CACHED_TRIANGLES = 20_000
CACHE_KIND = "topology-2"

# Below this, finding out whether winding numbers tell is quicker than the file.
KEPT_TRIANGLES = 2_000
WINDING_KIND = "winding-1"

# A sheet no thicker than this share of its size has no inside.
FLAT = 1e-9

# A cavity's surface nearer than this to the one around it is taken as the other side of
# a surface drawn twice: more than the rounding of any file, less than any wall, [m].
THINNEST_WALL = 1e-5


@dataclass(frozen=True, eq=False)
class Topology:
    """What containment needs to know of a mesh, wherever it is placed.

    Found once per mesh; `place_mesh` keeps it valid.

    Attributes:
        mesh: The mesh it was found of.
        is_closed: Whether the mesh bounds a solid: every edge is run through as often
            one way as the other, so that winding numbers are whole, and no sheet that
            is drawn on both sides ends in a rim, unless it is flat. Unlike
            `TriangleMesh.is_closed` this lets closed parts share edges.
        component: Number of the connected component of each triangle, (m,) int64.
    """

    mesh: TriangleMesh
    is_closed: bool
    component: NDArray[np.int64]
    _known: dict[tuple[int, ...], bool] = field(default_factory=dict, repr=False)

    def corners_of(self, part: int) -> NDArray[np.float64]:
        """Triangles of one component, (k, 3, 3), in the mesh's own frame."""
        return self.mesh.corners[self.component == part]

    @cached_property
    def winding_tells(self) -> bool:
        """Whether no winding number of 0 hides matter, at any point.

        All components are embedded and wound the same way: what winds round a point
        cannot cancel. Found on first use and kept on disk for large meshes.
        """
        if len(self.mesh.triangles) < KEPT_TRIANGLES:
            return self._find_winding_tells()
        stored = cache.load(WINDING_KIND, self.mesh.sha256)
        if stored is not None and stored.keys() == {"tells"}:
            return bool(stored["tells"])
        found = self._find_winding_tells()
        cache.store(WINDING_KIND, self.mesh.sha256, {"tells": np.array(found)})
        return found

    def _find_winding_tells(self) -> bool:
        parts = range(int(self.component.max()) + 1)
        ways = {_way(self.corners_of(part)) for part in parts}
        return ways in ({1}, {-1}) and all(self.is_embedded(part) for part in parts)

    def is_embedded(self, part: int) -> bool:
        """Whether a component is a surface that nowhere meets or doubles itself.

        It winds round a point once (either way) or not at all. Found on first use.
        """
        if (part,) not in self._known:
            mine = self.component == part
            places = _places(self.mesh.vertices)[self.mesh.triangles[mine]]
            self._known[part,] = is_embedded(self.mesh.corners[mine], places)
        return self._known[part,]

    def are_nested(self, parts: tuple[int, ...]) -> bool:
        """Whether components with a point inside each surely lie one in another.

        They are apart by more than THINNEST_WALL. Found on first use.
        """
        for a, b in combinations(parts, 2):
            if (a, b) not in self._known:
                first, second = self.corners_of(a), self.corners_of(b)
                self._known[a, b] = are_apart(first, second, THINNEST_WALL)
            if not self._known[a, b]:
                return False
        return True


def topology(mesh: TriangleMesh) -> Topology:
    """Closedness and connected components of a mesh.

    Corners at equal coordinates count as one, so a triangle soup is judged by shape.
    """
    t, n = _by_place(mesh)
    is_closed = _edges_cancel(t, n) and not _has_rim(mesh.corners, t, n)
    return Topology(mesh, is_closed, _components(t, n))


def _by_place(mesh: TriangleMesh) -> tuple[NDArray[np.int64], int]:
    """Triangles by the number of each corner's place, (m, 3); how many places."""
    same = _places(mesh.vertices)
    return same[mesh.triangles], int(same.max()) + 1


def cached_topology(mesh: TriangleMesh) -> Topology:
    """As `topology`; that of a large mesh is kept on disk under the mesh's hash."""
    if len(mesh.triangles) < CACHED_TRIANGLES:
        return topology(mesh)
    stored = cache.load(CACHE_KIND, mesh.sha256)
    if stored is not None:
        try:
            component = stored["component"].astype(np.int64)
            is_closed = bool(stored["is_closed"])
        except (KeyError, TypeError, ValueError) as error:
            cache.warn_damaged(CACHE_KIND, mesh.sha256, repr(error))
        else:
            if component.shape == (len(mesh.triangles),) and component.min() >= 0:
                return Topology(mesh, is_closed, component)
            cache.warn_damaged(CACHE_KIND, mesh.sha256, "not a topology of this mesh")
    found = topology(mesh)
    arrays: cache.Arrays = {
        "component": found.component.astype(np.int32),
        "is_closed": np.array(found.is_closed),
    }
    cache.store(CACHE_KIND, mesh.sha256, arrays)
    return found


@kernel
def _components(triangles: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    """Number of the connected component of each triangle, in order of appearance."""
    root = np.arange(n)
    for k in range(len(triangles)):
        for corner in range(1, 3):
            a, b = triangles[k, 0], triangles[k, corner]
            while root[a] != a:
                root[a] = root[root[a]]
                a = root[a]
            while root[b] != b:
                root[b] = root[root[b]]
                b = root[b]
            root[max(a, b)] = min(a, b)
    number = np.full(n, -1)
    component = np.zeros(len(triangles), dtype=np.int64)
    count = 0
    for k in range(len(triangles)):
        a = triangles[k, 0]
        while root[a] != a:
            a = root[a]
        if number[a] < 0:
            number[a] = count
            count += 1
        component[k] = number[a]
    return component


def _edges_cancel(triangles: NDArray[np.int64], n: int) -> bool:
    """Whether every edge occurs as often in one direction as in the other."""
    a, b, c = triangles.T
    there = np.concatenate([a * n + b, b * n + c, c * n + a])
    back = np.concatenate([b * n + a, c * n + b, a * n + c])
    there.sort()
    back.sort()
    return bool(np.array_equal(there, back))


def _way(corners: NDArray[np.float64]) -> int:
    """1 where the normals of a closed surface point outward, -1 inward, 0 unsure."""
    a, b, c = (corners[:, k] - corners[0, 0] for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    sure = abs(volumes.sum()) > FLAT * np.abs(volumes).sum()
    return int(np.sign(volumes.sum())) if sure else 0


def faces_inward(corners: NDArray[np.float64]) -> bool:
    """Whether most of a closed surface's volume is enclosed by normals that point in.

    Args:
        corners: Of its triangles, (m, 3, 3).
    """
    return _way(corners) < 0


def _has_rim(
    corners: NDArray[np.float64], triangles: NDArray[np.int64], n: int
) -> bool:
    """Whether a sheet that is drawn on both sides ends in a rim and is not flat.

    A flat one, or a fin of a solid, holds nothing.
    """
    drawn = np.sort(triangles, axis=1)
    order = np.lexsort(drawn.T)
    again = np.flatnonzero(_repeats(drawn, order))
    if len(again) == 0:
        return False
    twice = order[again]
    distinct = np.delete(order, again + 1)
    edges = drawn[distinct][:, [0, 1, 1, 2, 0, 2]].reshape(-1, 2)
    keys, count = np.unique(edges[:, 0] * n + edges[:, 1], return_counts=True)
    rim = keys[count == 1]
    sides = drawn[twice][:, [0, 1, 1, 2, 0, 2]].reshape(-1, 2)
    at_rim = np.isin(sides[:, 0] * n + sides[:, 1], rim) & (sides[:, 0] != sides[:, 1])
    sheet = _components(triangles[twice], n)
    return not all(
        _is_flat(corners[twice[sheet == part]].reshape(-1, 3))
        for part in np.unique(sheet[at_rim.reshape(-1, 3).any(axis=1)])
    )


def _is_flat(points: NDArray[np.float64]) -> bool:
    """Whether points (k, 3) lie in one plane up to rounding: they hold nothing."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[2] <= FLAT * spread[0])


def _places(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """A number for each vertex, equal where the coordinates are equal, (n,)."""
    order = np.lexsort(vertices.T)
    places = np.zeros(len(vertices), dtype=np.int64)
    places[order[1:]] = np.cumsum(~_repeats(vertices, order))
    return places


def _repeats(rows: NDArray[Any], order: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether a row, in this order, is the one before it, (n - 1,).

    Column by column: a copy of all rows of a large mesh is a gigabyte.
    """
    alike = np.ones(len(order) - 1, dtype=bool)
    for column in rows.T:
        sorted_ = column[order]
        alike &= sorted_[1:] == sorted_[:-1]
    return alike
