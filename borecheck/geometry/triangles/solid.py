"""Which side of a closed surface a point is on, and which solid holds another.

No triangle test sees a needle tip wholly inside a gantry's wall: their surfaces do not
meet. Here closed meshes are solids. A ray is followed along +x and its crossings are
counted with their direction; the winding number they sum to is 0 outside. All signs
are exact, and a ray through an edge or a corner is decided as if it were shifted by an
infinitely small step along y and an infinitely smaller one along z: no second try, no
tolerance. The bore of a gantry is outside: a link in it is not in the solid.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from borecheck.core import cache
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.exact import exact_pair
from borecheck.geometry.triangles.exact_sign import (
    Point,
    corners_of,
    orientation_2d,
    orientation_3d,
)
from borecheck.geometry.triangles.published import triangle_row

_ON_SURFACE = -(2**62)

# Below this, finding the topology is quicker than finding the file.
CACHED_TRIANGLES = 20_000
CACHE_KIND = "topology-1"


class Side(StrEnum):
    """Where a point is in relation to a closed surface."""

    INSIDE = "inside"
    OUTSIDE = "outside"
    ON_SURFACE = "on surface"


@dataclass(frozen=True)
class Topology:
    """What containment needs to know of a mesh, wherever it is placed.

    Found once per mesh; `place_mesh` keeps it valid.

    Attributes:
        is_closed: Whether the mesh bounds a solid: every edge is run through as often
            one way as the other, so that winding numbers are whole. Unlike
            `TriangleMesh.is_closed` this lets closed parts share edges.
        component: Number of the connected component of each triangle, (m,) int64.
    """

    is_closed: bool
    component: NDArray[np.int64]


@dataclass(frozen=True)
class Containment:
    """Whether one mesh lies inside the other one's solid.

    Attributes:
        kind: "none", "a_in_b", "b_in_a" or "unknown".
        reason: One sentence for the reader.
        point: A point of the contained (or undecided) part, (3,) [m], or None.
    """

    kind: str
    reason: str
    point: NDArray[np.float64] | None = None


def is_inside(point: ArrayLike, mesh: TriangleMesh) -> Side:
    """Which side of a closed mesh a point is on; exact for the numbers given.

    Inside is where the surface winds round the point in sum (winding number not 0).
    So overlapping closed parts are one solid, an inner surface that points inward is a
    cavity, and it does not matter which way the normals of a lone surface point.

    Args:
        point: Where, (3,) [m], in the mesh's frame.
        mesh: A closed mesh.

    Raises:
        GeometryError: The mesh is open, or the point is not three finite numbers.
    """
    if not (mesh.is_closed or topology(mesh).is_closed):
        raise GeometryError(f"mesh {mesh.name} is open: it has no inside")
    p = np.array(point, dtype=np.float64)
    if p.shape != (3,) or not np.isfinite(p).all():
        raise GeometryError(f"{point!r} is no point of three finite numbers")
    return side_of(p, mesh)


def topology(mesh: TriangleMesh) -> Topology:
    """Closedness and connected components of a mesh.

    Corners at equal coordinates count as one, so a triangle soup is judged by shape.
    """
    same = _places(mesh.vertices)
    t = same[mesh.triangles]
    n = int(same.max()) + 1
    return Topology(_edges_cancel(t, n), _components(t, n))


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
                return Topology(is_closed, component)
            cache.warn_damaged(CACHE_KIND, mesh.sha256, "not a topology of this mesh")
    found = topology(mesh)
    arrays: cache.Arrays = {
        "component": found.component.astype(np.int32),
        "is_closed": np.array(found.is_closed),
    }
    cache.store(CACHE_KIND, mesh.sha256, arrays)
    return found


@njit(cache=True, nogil=True, error_model="numpy")
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
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    there, back = edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0]
    return bool(np.array_equal(np.sort(there), np.sort(back)))


def _places(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """A number for each vertex, equal where the coordinates are equal, (n,)."""
    order = np.lexsort(vertices.T)
    steps = (np.diff(vertices[order], axis=0) != 0.0).any(axis=1)
    places = np.zeros(len(vertices), dtype=np.int64)
    places[order[1:]] = np.cumsum(steps)
    return places


def contained(
    mesh_a: TriangleMesh,
    mesh_b: TriangleMesh,
    topology_a: Topology | None = None,
    topology_b: Topology | None = None,
) -> Containment:
    """Whether a part of one mesh lies inside the other mesh's solid.

    The surfaces must be known not to touch. Then every connected component lies wholly
    on one side of the other surface, and one corner of each tells which.

    Args:
        mesh_a: Placed mesh.
        mesh_b: Placed mesh, in the same frame.
        topology_a: Its topology, if known from before (it does not change by moving).
        topology_b: The same of mesh_b.

    Returns:
        "unknown" when an open mesh is asked what it holds and the bounding boxes do
        not answer for it; containment found on the other side comes first.
    """
    topology_a = topology_a or topology(mesh_a)
    topology_b = topology_b or topology(mesh_b)
    answers = (
        _held("a_in_b", mesh_a, topology_a, mesh_b, topology_b),
        _held("b_in_a", mesh_b, topology_b, mesh_a, topology_a),
    )
    for answer in answers:
        if answer.kind not in ("none", "unknown"):
            return answer
    return answers[0] if answers[0].kind == "unknown" else answers[1]


def _held(
    kind: str,
    inner: TriangleMesh,
    inner_topology: Topology,
    outer: TriangleMesh,
    outer_topology: Topology,
) -> Containment:
    """Whether a component of inner lies inside outer."""
    for k in _inside_box(inner, inner_topology.component, outer.bounds):
        point = inner.vertices[inner.triangles[k, 0]].copy()
        if not outer_topology.is_closed:
            reason = f"{outer.name} is open: what it holds cannot be told"
            return Containment("unknown", reason, point)
        side = side_of(point, outer)
        if side is Side.ON_SURFACE:
            reason = f"{inner.name} touches {outer.name}: ask for contact first"
            return Containment("unknown", reason, point)
        if side is Side.INSIDE:
            return Containment(kind, f"{inner.name} is inside {outer.name}", point)
    return Containment("none", f"{inner.name} and {outer.name} hold nothing of another")


def _inside_box(
    mesh: TriangleMesh, component: NDArray[np.int64], box: NDArray[np.float64]
) -> NDArray[np.int64]:
    """One triangle of every component that lies wholly within a box."""
    low, high = mesh.bounds
    if (high < box[0]).any() or (low > box[1]).any():
        return np.zeros(0, dtype=np.int64)
    count = int(component.max()) + 1
    return _parts_within(mesh.vertices, mesh.triangles, component, count, box)


@njit(cache=True, nogil=True, error_model="numpy")
def _parts_within(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int64],
    component: NDArray[np.int64],
    count: int,
    box: NDArray[np.float64],
) -> NDArray[np.int64]:
    """First triangle of every component without a corner outside the box."""
    first = np.full(count, -1, dtype=np.int64)
    outside = np.zeros(count, dtype=np.bool_)
    left = count
    for t in range(len(triangles)):
        part = component[t]
        if outside[part]:
            continue
        if first[part] < 0:
            first[part] = t
        for c in range(3):
            for k in range(3):
                x = vertices[triangles[t, c], k]
                if x < box[0, k] or x > box[1, k]:
                    outside[part] = True
        if outside[part]:
            left -= 1
            if left == 0:
                break
    return first[~outside]


def side_of(point: NDArray[np.float64], mesh: TriangleMesh) -> Side:
    """As `is_inside`, of a mesh that is known to be closed."""
    if (point < mesh.bounds[0]).any() or (point > mesh.bounds[1]).any():
        return Side.OUTSIDE
    x, y, z = (float(number) for number in point)
    winding = winding_number((x, y, z), mesh.corners.reshape(-1, 9))
    if winding == _ON_SURFACE:
        return Side.ON_SURFACE
    return Side.INSIDE if winding != 0 else Side.OUTSIDE


@njit(cache=True, nogil=True, error_model="numpy")
def winding_number(p: Point, corners: NDArray[np.float64]) -> int:
    """Signed crossings of the ray from p along +x; _ON_SURFACE if p is on the mesh."""
    x, y, z = p
    winding = 0
    for k in range(len(corners)):
        y1, y2, y3 = corners[k, 1], corners[k, 4], corners[k, 7]
        if (y1 < y and y2 < y and y3 < y) or (y1 > y and y2 > y and y3 > y):
            continue
        z1, z2, z3 = corners[k, 2], corners[k, 5], corners[k, 8]
        if (z1 < z and z2 < z and z3 < z) or (z1 > z and z2 > z and z3 > z):
            continue
        if corners[k, 0] < x and corners[k, 3] < x and corners[k, 6] < x:
            continue
        triangle = triangle_row(corners, k)
        if exact_pair((x, y, z, x, y, z, x, y, z), triangle):
            return _ON_SURFACE
        t1, t2, t3 = corners_of(triangle)
        winding += _crossing(p, t1, t2, t3)
    return winding


@njit(cache=True, nogil=True, error_model="numpy")
def _turn(p: Point, u: Point, v: Point) -> int:
    """How u, v turn round p seen along -x, with p shifted by (e, e^2) along y and z.

    The area is linear in p. Where it is 0, the sign of its derivative along y decides,
    then along z; both are differences of coordinates. 0 only if u and v coincide.
    """
    sign = orientation_2d((u[1], u[2]), (v[1], v[2]), (p[1], p[2]))
    if sign != 0:
        return sign
    if u[2] != v[2]:
        return 1 if u[2] > v[2] else -1
    if u[1] != v[1]:
        return 1 if v[1] > u[1] else -1
    return 0


@njit(cache=True, nogil=True, error_model="numpy")
def _crossing(p: Point, a: Point, b: Point, c: Point) -> int:
    """+1 or -1 if the shifted ray from p along +x crosses a, b, c; p is not on it.

    The sign tells from which side: along +x out of a surface that points outward is +1.
    """
    turn = _turn(p, a, b)
    if turn == 0 or _turn(p, b, c) != turn or _turn(p, c, a) != turn:
        return 0
    # The normal has the sign of `turn` along x. The ray still has the plane before
    # it if p is behind a triangle that faces +x, or in front of one that faces -x.
    return turn if orientation_3d(a, b, c, p) == turn else 0
